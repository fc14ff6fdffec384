//! The operands whose values can be read into a set, and written back by it.
//!
//! Part of [`super::names`]; the controller answers a `read-set` with it. Members of structures are
//! left out unless they are named themselves: an instruction owns them. So are read-only places,
//! and inputs that a device moves.

use std::collections::HashSet;

use super::names::OperandNames;
use super::operand::Variable;
use super::protocol::{RefusalKind, RequestRefusal, WRITES_MAX};
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Structure};

/// The operands of a set, each place once.
#[derive(Debug, Default)]
pub struct WritableOperands {
    /// In the order of the request; their names are the names to write.
    pub operands: Vec<Variable>,
    /// The structures whose members are left out.
    pub structures: HashSet<Structure>,
    /// The number of other bits and words that are left out.
    pub read_only: usize,
    /// The tags of records to which operands belong.
    pub records: Vec<String>,
    seen: HashSet<Cell>,
}

/// What decides whether an operand is in a set.
pub struct WritableFilter<'a> {
    /// The present content of a cell.
    pub content: &'a dyn Fn(Cell) -> i32,
    /// Whether a device moves an operand.
    pub is_moved: &'a dyn Fn(Address) -> bool,
}

impl OperandNames {
    /// The operands that these texts name and a set can write; without texts, all tags.
    ///
    /// # Errors
    /// A text names nothing, or there are more operands than one change may write.
    pub fn writable(
        &self,
        texts: &[String],
        filter: &WritableFilter<'_>,
    ) -> Result<WritableOperands, RequestRefusal> {
        let mut set = WritableOperands::default();
        if texts.is_empty() {
            for what in self.tagged() {
                set.structures.extend(what.structure());
                if let Some(operand) = self.called(*what) {
                    set.take(self, filter, operand, false)?;
                }
            }
        }
        for text in texts {
            let found = self.find_at_most(WRITES_MAX, text)?;
            let is_named = matches!(&*found, [one] if one.operand == text.trim());
            for operand in found.iter().filter_map(|operand| self.called(operand.what)) {
                set.take(self, filter, operand, is_named)?;
            }
        }
        set.leave_out_bits_of_words();
        set.records = self.records_of(&set.operands);
        Ok(set)
    }
}

impl WritableOperands {
    /// Leaves out the bits of words that are in the set themselves.
    fn leave_out_bits_of_words(&mut self) {
        let words: HashSet<Cell> = self.operands.iter().map(|operand| operand.cell).collect();
        let is_in_word = |cell: Cell| match cell {
            Cell::WordBit(bit) => words.contains(&Cell::Word(bit.word)),
            Cell::Bit(_) | Cell::Word(_) => false,
        };
        self.operands.retain(|operand| !is_in_word(operand.cell));
    }

    /// Takes an operand into the set, or counts it as left out. `is_named`: the request names this
    /// operand itself.
    fn take(
        &mut self,
        names: &OperandNames,
        filter: &WritableFilter<'_>,
        operand: Variable,
        is_named: bool,
    ) -> Result<(), RequestRefusal> {
        if !self.seen.insert(operand.cell) {
            return Ok(());
        }
        let content = (filter.content)(operand.cell);
        let is_open = operand.may_write().is_ok() && names.is_within_limits(&operand, content);
        let structure = operand.what.structure().filter(|_| !is_named);
        if let Some(structure) = structure {
            self.structures.insert(structure);
        } else if !is_open || !is_named && (filter.is_moved)(operand.what) {
            self.read_only += 1;
        } else if self.operands.len() == WRITES_MAX {
            let message = format!(
                "these are more than {WRITES_MAX} values, and one change writes at most \
                 {WRITES_MAX}: name fewer operands"
            );
            return Err(RequestRefusal::new(RefusalKind::BadRequest, message));
        } else {
            self.operands.push(operand);
        }
        Ok(())
    }
}
