//! The interface to the live power: the state of the contacts in one scan.
//!
//! `asker` sends an implementation to the state with each look; `paint` reads the contacts that it
//! draws.

use std::fmt::Debug;

use rungd_client::live::LiveView;
use rungd_config::controller::OutputState;
use rungd_lab::draw::circuit::ContactSymbol;

/// The contacts of one scan.
pub(super) trait PowerOf: Debug + Send + Sync {
    /// The number of the scan.
    fn scan(&self) -> u64;

    /// The value of an operand at the end of the scan, as text; `None`: there is no such operand.
    fn value(&self, operand: &str) -> Option<String>;

    /// Whether a contact, in the form that is drawn, conducts; `None`: its rung was not executed.
    /// `element`: the full name of a block or Stage; `rung`: from 1.
    fn conducts(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<bool>;

    /// The values of the sides of a compare as its rung read them, `40 >= 50`; `None`: the contact
    /// is no compare, or its rung was not executed.
    fn compared(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<String>;
}

impl PowerOf for LiveView {
    fn scan(&self) -> u64 {
        self.power.scan
    }

    fn value(&self, operand: &str) -> Option<String> {
        let cell = self.program.subject.cell(operand).ok()?;
        let value = self.say_value(cell, self.power.value(cell));
        let output = self.output(&self.power, cell).unwrap_or(OutputState::AsMemory);
        Some(value + &output.long_text(", "))
    }

    fn conducts(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<bool> {
        let executes = self.executes(&self.power);
        executes.then(|| LiveView::conducts(self, &self.power, element, rung, contact)).flatten()
    }

    fn compared(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<String> {
        let executes = self.executes(&self.power);
        executes.then(|| LiveView::compared(self, &self.power, element, rung, contact)).flatten()
    }
}
