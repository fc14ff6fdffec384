//! The mistakes of a change with several writes, and the refusal that names them.
//!
//! Used by `write`. One mistake refuses the whole change, so all of them are named at once, each
//! with its operand and its remedy.

use std::collections::HashMap;

use rungd_client::operator::protocol::{RefusalKind, RefusedOperand, RequestRefusal, WRITES_MAX};
use rungd_engine::{Cell, WordCell};
use rungd_language::source::wording::escaped;

/// The most mistakes that one refusal names.
const MISTAKES_MAX: usize = 100;

/// The refused writes of a change.
#[derive(Default)]
pub(super) struct SetMistakes {
    mistakes: Vec<RefusedOperand>,
}

impl SetMistakes {
    pub fn is_empty(&self) -> bool {
        self.mistakes.is_empty()
    }

    pub fn is_full(&self) -> bool {
        self.mistakes.len() >= MISTAKES_MAX
    }

    pub fn add(&mut self, operand: &str, refusal: RequestRefusal) {
        self.mistakes.push(RefusedOperand { operand: operand.to_owned(), refusal });
    }

    /// The refusal of the change. Its kind is that of the first mistake in the request itself; if
    /// there is none, only the present state of the controller refuses it. `are_more`: there are
    /// mistakes that it does not name.
    pub fn refusal(self, are_more: bool) -> RequestRefusal {
        let kinds = self.mistakes.iter().map(|mistake| mistake.refusal.kind);
        let kind =
            kinds.clone().find(|kind| *kind != RefusalKind::Refused).or(kinds.clone().next());
        let mut message = "nothing is written:".to_owned();
        for mistake in &self.mistakes {
            message.push_str(&format!("\n  {}", escaped(&mistake.refusal.message)));
        }
        if are_more {
            message.push_str(&format!("\n  and more than these {MISTAKES_MAX}"));
        }
        let refusal = RequestRefusal::new(kind.unwrap_or(RefusalKind::Refused), message);
        RequestRefusal { mistakes: self.mistakes, ..refusal }
    }
}

/// A change has no write, or too many.
pub(super) fn wrong_count(count: usize) -> RequestRefusal {
    let message = match count {
        0 => format!("a change names 1 to {WRITES_MAX} operands, and this one names none"),
        _ => format!(
            "one change has at most {WRITES_MAX} values, and this one has {count}: nothing is \
             written"
        ),
    };
    RequestRefusal::new(RefusalKind::BadRequest, message)
}

/// The places of the writes of a change so far.
#[derive(Default)]
pub(super) struct NamedPlaces<'w> {
    cells: HashMap<Cell, &'w str>,
    /// For each word of which a bit is written, the first such bit.
    bits: HashMap<WordCell, &'w str>,
}

impl<'w> NamedPlaces<'w> {
    /// Adds the place of a write.
    ///
    /// # Errors
    /// An earlier write is for the same place, for a bit of the same word, or for its whole word.
    pub fn add(&mut self, cell: Cell, operand: &'w str) -> Result<(), RequestRefusal> {
        if let Some(other) = self.cells.insert(cell, operand) {
            return Err(same_place(other, operand));
        }
        let beside = match cell {
            Cell::Bit(_) => None,
            Cell::Word(word) => self.bits.get(&word).map(|bit| (operand, *bit)),
            Cell::WordBit(bit) => {
                self.bits.entry(bit.word).or_insert(operand);
                self.cells.get(&Cell::Word(bit.word)).map(|word| (*word, operand))
            }
        };
        beside.map_or(Ok(()), |(word, bit)| Err(bit_of_word(word, bit)))
    }
}

/// A change writes a word and a bit of it.
fn bit_of_word(word: &str, bit: &str) -> RequestRefusal {
    let message = format!("`{bit}` is a bit of `{word}`: write the word, or only bits of it");
    RequestRefusal::new(RefusalKind::BadOperand, message)
}

/// Two writes of a change are for the same place.
fn same_place(one: &str, other: &str) -> RequestRefusal {
    let message = match one == other {
        true => format!("`{one}` is named twice: name it once"),
        false => format!("`{one}` and `{other}` are the same place: name one of them"),
    };
    RequestRefusal::new(RefusalKind::BadOperand, message)
}
