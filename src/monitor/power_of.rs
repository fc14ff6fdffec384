//! The seam to the live power: what the contacts of one scan did.
//!
//! `asker` hands an implementation to the state with each look; `paint` asks it for the contacts
//! that it draws.

use std::fmt::Debug;

use crate::draw::circuit::ContactSymbol;
use crate::live::LiveView;

/// The contacts of one scan.
pub(super) trait PowerOf: Debug + Send + Sync {
    /// The number of the scan.
    fn scan(&self) -> u64;

    /// Whether a contact conducts, as it is drawn; `None`: its rung was not executed. `element`:
    /// a block or Stage by its whole name; `rung`: from 1.
    fn conducts(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<bool>;
}

impl PowerOf for LiveView {
    fn scan(&self) -> u64 {
        self.power.scan
    }

    fn conducts(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<bool> {
        LiveView::conducts(self, &self.power, (element, rung), contact)
    }
}
