//! The ladder on the screen: the shown block or Stage, the chosen rung and symbol, and the power.
//!
//! `state` keeps it, `update` moves in it, `paint` draws it. `asker` makes the picture; it belongs
//! to the program whose hash is kept beside it.

use std::sync::Arc;

use super::power_of::PowerOf;
use rungd_client::live::LiveProgram;
use rungd_lab::draw::circuit::ContactSymbol;
use rungd_lab::draw::ladder::{Picture, RungPicture};
use rungd_lab::draw::power::{FlowOfPower, flow_of_power};
use rungd_lab::draw::text::{PoweredRung, powered};

/// The ladder, and a position in it.
#[derive(Clone, Debug, Default)]
pub(super) struct LadderView {
    /// The program with its ladder, if it could be loaded.
    pub program: Option<Arc<LiveProgram>>,
    /// The hash of the program; "" as long as there is none.
    pub sha256: String,
    /// Why there is no picture.
    pub trouble: Option<String>,
    /// The power of a scan.
    pub power: Option<Arc<dyn PowerOf>>,
    /// Why there is no power.
    pub no_power: Option<String>,
    /// The block or Stage, among those that have rungs.
    pub element: usize,
    /// The chosen rung, from 0.
    pub rung: usize,
    /// The chosen contact or instruction of that rung, in the order of the rung's text.
    pub symbol: usize,
}

/// A rung as text, with its state.
pub(super) struct RungView {
    pub text: PoweredRung,
    /// Whether the rung is executed; `None`: no power is known.
    pub executes: Option<bool>,
    /// The flow of power in the rung.
    pub flow: Option<FlowOfPower>,
}

/// The name, the heading and the rungs of a block or Stage.
pub(super) type ElementRungs<'p> = (String, String, &'p [RungPicture]);

impl LadderView {
    /// Takes the picture of a new program. Keeps the shown block or Stage if the new program has it
    /// too.
    pub fn take(&mut self, sha256: String, found: Result<Arc<LiveProgram>, String>) {
        let before = self.name();
        (self.program, self.trouble) = match found {
            Ok(program) => (Some(program), None),
            Err(trouble) => (None, Some(trouble)),
        };
        (self.sha256, self.power) = (sha256, None);
        match self.elements().iter().position(|(name, ..)| *name == before) {
            Some(at) => self.element = at,
            None => (self.element, self.rung) = (0, 0),
        }
        self.rung = self.rung.min(self.rung_count().saturating_sub(1));
        self.symbol = 0;
    }

    /// The blocks and Stages that have rungs.
    pub fn elements(&self) -> Vec<ElementRungs<'_>> {
        self.picture().map(Picture::elements).unwrap_or_default()
    }

    /// The ladder, if it is loaded.
    pub fn picture(&self) -> Option<&Picture> {
        self.program.as_ref().map(|program| &program.picture)
    }

    /// The shown block or Stage.
    pub fn shown(&self) -> Option<ElementRungs<'_>> {
        self.elements().into_iter().nth(self.element)
    }

    fn name(&self) -> String {
        self.shown().map(|(name, ..)| name).unwrap_or_default()
    }

    fn rung_count(&self) -> usize {
        self.shown().map_or(0, |(_, _, rungs)| rungs.len())
    }

    /// Shows a block or Stage. For a block without rungs of its own, shows its first Stage.
    pub fn open(&mut self, wanted: &str) {
        let elements = self.elements();
        let whole = elements.iter().position(|(name, ..)| name == wanted);
        let of_block = || {
            let prefix = format!("{wanted}.");
            elements.iter().position(|(name, ..)| name.starts_with(&prefix))
        };
        let Some(at) = whole.or_else(of_block) else { return };
        if at != self.element {
            (self.element, self.rung, self.symbol) = (at, 0, 0);
        }
    }

    /// Goes to the next or the previous block or Stage, and wraps around at the ends.
    pub fn turn(&mut self, forward: bool) {
        let count = self.elements().len().max(1);
        let step = if forward { 1 } else { count - 1 };
        (self.element, self.rung, self.symbol) = ((self.element + step) % count, 0, 0);
    }

    /// Goes down by a number of rungs; a negative number goes up.
    pub fn go_down(&mut self, rungs: isize) {
        let last = self.rung_count().saturating_sub(1);
        let rung = self.rung.saturating_add_signed(rungs).min(last);
        if rung != self.rung {
            (self.rung, self.symbol) = (rung, 0);
        }
    }

    /// Goes right by a number of symbols of the rung; a negative number goes left.
    pub fn go_right(&mut self, symbols: isize) {
        let last = self.place().map_or(0, |text| text.symbols.len().saturating_sub(1));
        self.symbol = self.symbol.saturating_add_signed(symbols).min(last);
    }

    fn place(&self) -> Option<PoweredRung> {
        let (_, _, rungs) = self.shown()?;
        rungs.get(self.rung).map(|rung| powered(&rung.grid, None, 0))
    }

    /// The operand of the chosen symbol.
    pub fn operand(&self) -> Option<String> {
        let operand = self.place()?.symbols.get(self.symbol)?.operand.clone();
        (!operand.is_empty()).then_some(operand)
    }

    /// The chosen symbol, if it is a compare: its text, and the values of its sides as its rung
    /// read them.
    pub fn compared(&self, element: &str, rung: &RungPicture) -> Option<String> {
        let contact = &rung.grid.contacts.get(self.symbol)?.symbol;
        let number = u32::try_from(rung.number).unwrap_or(u32::MAX);
        let values = self.power.as_ref()?.compared(element, number, contact)?;
        Some(format!("{}: {values}", contact.label.name))
    }

    /// A rung with its power. `room`: the columns of the page.
    pub fn rung_view(&self, element: &str, rung: &RungPicture, room: usize) -> RungView {
        let number = u32::try_from(rung.number).unwrap_or(u32::MAX);
        let conducts =
            |power: &dyn PowerOf, contact: &ContactSymbol| power.conducts(element, number, contact);
        let executes = self.power.as_ref().map(|power| {
            let mut own =
                rung.grid.contacts.iter().filter(|contact| contact.symbol.branch.is_none());
            own.all(|contact| conducts(&**power, &contact.symbol).is_some())
        });
        let flow = self.power.as_ref().filter(|_| executes == Some(true)).map(|power| {
            flow_of_power(&rung.grid, &|contact| conducts(&**power, contact).unwrap_or(false))
        });
        RungView { text: powered(&rung.grid, flow.as_ref(), room), executes, flow }
    }
}
