//! The seam to the live power: what the contacts of one scan did.
//!
//! `asker` hands an implementation to the state with each look; `paint` asks it for the contacts
//! that it draws.

use std::fmt::Debug;

/// The contacts of one scan.
pub(super) trait PowerOf: Debug + Send + Sync {
    /// The number of the scan.
    fn scan(&self) -> u64;

    /// Whether a contact conducts, as it is drawn; `None`: its block does not execute. `element`:
    /// a block or Stage by its whole name; `rung`: from 1; `contact`: its branch and its number, as
    /// `observe` counts.
    fn conducts(&self, element: &str, rung: u32, contact: (Option<u32>, usize)) -> Option<bool>;
}
