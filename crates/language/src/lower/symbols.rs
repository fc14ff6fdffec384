//! The book of names, alarm texts and limits: everything that the engine does not need.
//!
//! Made by `lower`; read by the log writer, the drivers and the simulator.

use std::sync::Arc;

use super::identity::Identity;
use super::word_limits::WordLimits;
use crate::resolve::alarm_terms::AlarmTerms;
use crate::resolve::name_book::NameBook;
use crate::resolve::program::{Program, TagMeaning};
use rungd_engine::isa::{Address, Bit, NumberMap, Structure, Word};
use rungd_engine::{Cell, Layout};

/// A tag with an `alarm`.
#[derive(Clone, Debug)]
pub struct Alarm {
    /// The bit.
    pub bit: Cell,
    /// The tag's name.
    pub tag: String,
    /// The text.
    pub text: String,
    /// Its priority, delays and group.
    pub terms: AlarmTerms,
}

/// A tag with `log = "change"`.
#[derive(Clone, Debug)]
pub struct LoggedTag {
    /// The bit or word.
    pub cell: Cell,
    /// The tag's name; for a structure's member, `tag.Member`.
    pub tag: String,
}

/// Names, texts and limits, by number and cell.
#[derive(Clone, Debug)]
pub struct Symbols {
    /// The cells of all addresses.
    pub layout: Layout,
    /// The names of blocks, Stages, devices, tags and addresses.
    pub names: Arc<NameBook>,
    /// Tags with an alarm, in the order of a scan: causes before consequences.
    pub alarms: Vec<Alarm>,
    /// Tags whose changes are logged, in file order.
    pub logged: Vec<LoggedTag>,
    /// The rung of each MATH, by its number: `Main, rung 3`.
    pub maths: Vec<String>,
    /// The names of parts with a state.
    pub identity: Arc<Identity>,
    limits: WordLimits,
}

impl Symbols {
    /// `places`: the places of bits with an alarm in the order of a scan.
    pub(super) fn new(
        program: &Program,
        layout: Layout,
        identity: Identity,
        places: &NumberMap<Bit, usize>,
    ) -> Symbols {
        let mut symbols = Symbols {
            layout,
            names: Arc::clone(&program.names),
            alarms: Vec::new(),
            logged: Vec::new(),
            maths: Vec::new(),
            identity: Arc::new(identity),
            limits: WordLimits::of(program),
        };
        let mut alarms = Vec::new();
        for tag in &program.tags {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            if let (Address::Bit(bit), Some(text)) = (address, &tag.alarm) {
                let alarm = Alarm {
                    bit: symbols.layout.bit_in(bit),
                    tag: tag.name.clone(),
                    text: text.clone(),
                    terms: tag.terms.clone(),
                };
                alarms.push((places.get(&bit).copied().unwrap_or(0), alarm));
            }
            if tag.log_changes {
                symbols.log(address, &tag.name);
            }
        }
        alarms.sort_by_key(|(place, _)| *place);
        symbols.alarms = alarms.into_iter().map(|(_, alarm)| alarm).collect();
        symbols
    }

    /// Adds a logged tag: its bit or word. A structure adds its `.Done` or `DN`, but not `.Acc`,
    /// which would log every count and every millisecond.
    fn log(&mut self, address: Address, tag: &str) {
        let (address, name) = match address {
            Address::Structure(structure) => {
                let member = structure.done_name();
                (structure.member(member).unwrap_or(address), format!("{tag}.{member}"))
            }
            Address::Bit(_) | Address::Word(_) => (address, tag.to_owned()),
        };
        if let Some(cell) = self.layout.cell(address) {
            self.logged.push(LoggedTag { cell, tag: name });
        }
    }

    /// The cell of an operand that a text names.
    ///
    /// # Errors
    /// A sentence for people: the text names a whole structure.
    pub fn cell(&self, address: Address, text: &str) -> Result<Cell, String> {
        let member = address.structure().map_or("Acc", Structure::acc_name);
        let message = || format!("`{text}` is a structure: name a member, as `{text}.{member}`");
        self.layout.cell(address).ok_or_else(message)
    }

    /// The name of the word of a bit that nothing may write, because a tag of the word has `min` or
    /// `max`: a bit alone cannot be limited.
    pub fn limited_word(&self, address: Address) -> Option<String> {
        let Address::Bit(Bit::InWord(bit)) = address else { return None };
        self.limits.has(bit.word).then(|| self.names.name(Address::Word(bit.word)))
    }

    /// The value of a cell with its text, for people: `1 (dosing)`, `ON (open)`, `12`. `content`:
    /// the content of the cell.
    pub fn say_value(&self, cell: Cell, content: i32) -> String {
        match (self.layout.address(cell), cell) {
            (Some(address), _) => self.names.say_value(address, content),
            (None, Cell::Bit(_) | Cell::WordBit(_)) => {
                if content != 0 { "ON" } else { "OFF" }.to_owned()
            }
            (None, Cell::Word(_)) => self.layout.text(cell, content),
        }
    }

    /// The limits of a write from outside to a word: its range, narrowed by `min` and `max` of its
    /// tags. A write beyond them is refused.
    pub fn limits(&self, word: Word) -> (i32, i32) {
        self.limits.get(word)
    }
}
