//! The questions that the monitor asks its user: an operand to watch, a new value, and whether a
//! change is really wanted.
//!
//! `update` opens and answers them, `paint` draws them. Nothing is changed in a controller before
//! the last question has named the operand, its present value and the new one.

use super::message::Press;
use crate::operator::protocol::{GivenValue, Name, Request};

/// The longest text that can be typed.
const TEXT_CHARS_MAX: usize = 120;

/// The most names that are offered.
const NAMES_MAX: usize = 8;

/// What is to be done to an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangeWanted {
    Force,
    Write,
    Release,
}

/// A question.
#[derive(Clone, Debug)]
pub(super) enum Dialog {
    /// Which operand to watch?
    Add(Typed),
    /// To which value?
    NewValue { wanted: ChangeWanted, operand: String, text: String },
    /// Really?
    Confirm { wanted: ChangeWanted, operand: String, text: String },
}

/// The beginning of a name, with the names that begin so.
#[derive(Clone, Debug, Default)]
pub(super) struct Typed {
    pub text: String,
    pub names: Vec<Name>,
    /// The name that is taken over.
    pub chosen: Option<usize>,
}

impl ChangeWanted {
    /// As a heading.
    pub fn heading(self) -> &'static str {
        match self {
            ChangeWanted::Force => "Force",
            ChangeWanted::Write => "Write",
            ChangeWanted::Release => "Release the force of",
        }
    }

    /// The request to the controller.
    pub fn request(self, operand: String, text: String) -> Request {
        match self {
            ChangeWanted::Force => Request::Force { operand, value: GivenValue::Text(text) },
            ChangeWanted::Write => {
                let value = GivenValue::Text(text);
                Request::Write { operand, value, for_user: None }
            }
            ChangeWanted::Release => Request::Unforce { operand },
        }
    }
}

impl Dialog {
    /// The operand that the question is about: its present value is shown.
    pub fn operand(&self) -> Option<&str> {
        match self {
            Dialog::Add(_) => None,
            Dialog::NewValue { operand, .. } | Dialog::Confirm { operand, .. } => Some(operand),
        }
    }
}

impl Typed {
    /// What stands in the line: the chosen name, else what was typed.
    pub fn shown(&self) -> &str {
        let chosen = self.chosen.and_then(|at| self.names.get(at));
        chosen.map_or(&self.text, |name| &name.name)
    }

    /// Takes the names that begin with a text, if that still stands there.
    pub fn take(&mut self, prefix: &str, names: Vec<Name>) {
        if prefix == self.text {
            (self.names, self.chosen) = (names, None);
            self.names.truncate(NAMES_MAX);
        }
    }

    /// Whether the text has changed, so that other names begin with it.
    pub fn press(&mut self, press: Press) -> bool {
        let last = self.names.len().checked_sub(1);
        if matches!(press, Press::Down | Press::Tab) {
            self.chosen = last.map(|last| self.chosen.map_or(0, |at| (at + 1).min(last)));
        } else if matches!(press, Press::Up | Press::BackTab) {
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

/// Types into a text; whether that changed it.
pub(super) fn edit(text: &mut String, press: Press) -> bool {
    if press == Press::Backspace {
        return text.pop().is_some();
    }
    let Press::Char(c) = press else { return false };
    let has_room = text.chars().count() < TEXT_CHARS_MAX && !c.is_control();
    if has_room {
        text.push(c);
    }
    has_room
}
