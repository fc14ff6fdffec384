//! The dialogs with the user: for an operand to watch, a new value, and the confirmation of a
//! change.
//!
//! `update` opens and answers them, `paint` draws them. Nothing is changed in a controller before
//! the last dialog has shown the operand, its present value and the new value.

use super::message::KeyPress;
use rungd_client::operator::protocol::{GivenValue, OfferedName, Request, SHELF_MS_MAX};
use rungd_engine::isa::duration;

/// The longest text that can be typed.
const TEXT_CHARS_MAX: usize = 120;

/// The most names that are offered.
const NAMES_MAX: usize = 8;

/// The change to make to an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WantedChange {
    Force,
    Write,
    Release,
    Acknowledge,
    /// Brings a shelved alarm back.
    Unshelve,
}

/// A dialog.
#[derive(Clone, Debug)]
pub(super) enum Dialog {
    /// Requests an operand to watch.
    Add(TypedName),
    /// Requests the new value. `is_typed`: the user has changed the text, so no value is proposed
    /// any more.
    NewValue { wanted: WantedChange, operand: String, text: String, is_typed: bool },
    /// Requests for how long an alarm is shelved, and why.
    Shelve(TypedShelf),
    /// Requests the confirmation of a change.
    Confirm { wanted: WantedChange, operand: String, text: String },
}

/// The typed beginning of a name, with the names that begin with it.
#[derive(Clone, Debug, Default)]
pub(super) struct TypedName {
    pub text: String,
    pub names: Vec<OfferedName>,
    /// The chosen name, which replaces the typed text.
    pub chosen: Option<usize>,
}

/// A shelf as it is typed.
#[derive(Clone, Debug)]
pub(super) struct TypedShelf {
    /// The alarm.
    pub alarm: String,
    /// For how long: `8h`; empty: out of service.
    pub time: String,
    /// The reason; `None`: the time is typed yet.
    pub why: Option<String>,
}

impl TypedShelf {
    /// A shelf of an alarm for a shift.
    pub fn new(alarm: String) -> TypedShelf {
        TypedShelf { alarm, time: "8h".to_owned(), why: None }
    }

    /// Handles a key. Returns the request once the reason is given.
    ///
    /// # Errors
    /// What is wrong with the typed time.
    pub fn press(&mut self, press: KeyPress) -> Result<Option<Request>, String> {
        if press != KeyPress::Enter {
            edit(self.why.as_mut().unwrap_or(&mut self.time), press);
            return Ok(None);
        }
        let for_ms = self.for_ms()?;
        let Some(why) = &self.why else {
            self.why = Some(String::new());
            return Ok(None);
        };
        let (why, alarms) = (why.trim().to_owned(), vec![self.alarm.clone()]);
        let request = Request::Shelve { alarms, for_ms, why: why.clone(), for_user: None };
        Ok((!why.is_empty()).then_some(request))
    }

    /// The typed time, ms; `None`: out of service.
    fn for_ms(&self) -> Result<Option<u64>, String> {
        let time = self.time.trim();
        if time.is_empty() {
            return Ok(None);
        }
        match duration::parse(time).map(|ms| u64::from(ms.unsigned_abs())) {
            Ok(ms @ 1..=SHELF_MS_MAX) => Ok(Some(ms)),
            Ok(_) | Err(_) => Err(duration::not_a_duration(time, "30m, 8h, 168h")),
        }
    }
}

impl WantedChange {
    /// The heading of the dialog.
    pub fn heading(self) -> &'static str {
        match self {
            WantedChange::Force => "Force",
            WantedChange::Write => "Write",
            WantedChange::Release => "Release the force of",
            WantedChange::Acknowledge => "Acknowledge",
            WantedChange::Unshelve => "Bring back",
        }
    }

    /// The request to the controller.
    pub fn request(self, operand: String, text: String) -> Request {
        match self {
            WantedChange::Force => Request::Force { operand, value: GivenValue::Text(text) },
            WantedChange::Write => {
                let value = GivenValue::Text(text);
                Request::Write { operand, value, for_user: None, from_page: false, reason: None }
            }
            WantedChange::Release => Request::Unforce { operand },
            WantedChange::Acknowledge => Request::Ack { alarms: vec![operand], for_user: None },
            WantedChange::Unshelve => Request::Unshelve { alarms: vec![operand], for_user: None },
        }
    }
}

impl Dialog {
    /// The operand that the dialog is about. Its present value is shown.
    pub fn operand(&self) -> Option<&str> {
        match self {
            Dialog::Add(_) => None,
            Dialog::Shelve(TypedShelf { alarm: operand, .. })
            | Dialog::NewValue { operand, .. }
            | Dialog::Confirm { operand, .. } => Some(operand),
        }
    }
}

impl TypedName {
    /// The text in the line: the chosen name, or else the typed text.
    pub fn shown(&self) -> &str {
        let chosen = self.chosen.and_then(|at| self.names.get(at));
        chosen.map_or(&self.text, |name| &name.name)
    }

    /// Takes the names that begin with a text, if the typed text is still the same.
    pub fn take(&mut self, prefix: &str, names: Vec<OfferedName>) {
        if prefix == self.text {
            (self.names, self.chosen) = (names, None);
            self.names.truncate(NAMES_MAX);
        }
    }

    /// Handles a key. Returns whether the text has changed, so that new names must be requested.
    pub fn press(&mut self, press: KeyPress) -> bool {
        let last = self.names.len().checked_sub(1);
        if matches!(press, KeyPress::Down | KeyPress::Tab) {
            self.chosen = last.map(|last| self.chosen.map_or(0, |at| (at + 1).min(last)));
        } else if matches!(press, KeyPress::Up | KeyPress::BackTab) {
            self.chosen = self.chosen.and_then(|at| at.checked_sub(1));
        } else {
            let mut text = self.shown().to_owned();
            if edit(&mut text, press) {
                (self.text, self.chosen) = (text, None);
                self.names.clear();
                return true;
            }
        }
        false
    }
}

/// Handles a key in a text. Returns whether the text has changed.
pub(super) fn edit(text: &mut String, press: KeyPress) -> bool {
    if press == KeyPress::Backspace {
        return text.pop().is_some();
    }
    let KeyPress::Char(c) = press else { return false };
    let has_room = text.chars().count() < TEXT_CHARS_MAX && !c.is_control();
    if has_room {
        text.push(c);
    }
    has_room
}
