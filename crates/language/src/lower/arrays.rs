//! COPY, FILL and SR as operations.

use super::assembler::Assembler;
use super::legs::Legs;
use crate::resolve::array::{Array, ShiftBits};
use crate::resolve::instruction::{Filling, Instruction, Value};
use rungd_engine::isa::status::st;
pub use rungd_engine::isa::{Bit, BitSpace, LegName};
pub use rungd_engine::ops::{
    BitRead, BitsRead, BitsWritten, CopyBits, CopyWords, FillBits, FillWords, LegPowers, Op,
    ShiftState, Sr, WordForm, WordsRead, WordsWritten,
};

impl Assembler<'_> {
    /// COPY.
    pub fn copy(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        if instruction.is_record_copy() {
            return self.copy_record(instruction, leg);
        }
        let [from, to]: [Array; 2] = ["from", "to"].map(|name| instruction.operands.required(name));
        let (read, written) = (self.cells(from), self.cells(to));
        if to.is_bits() {
            let (from, to) = (BitsRead(read), BitsWritten(written));
            return Op::CopyBits(CopyBits { leg, from, to });
        }
        let form = self.word_form(from.is_real(), to);
        let (from, to) = (WordsRead(read), WordsWritten(written));
        Op::CopyWords(CopyWords { leg, from, to, form })
    }

    /// FILL.
    pub fn fill(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        let (value, to): (Filling, Array) =
            (instruction.operands.required("value"), instruction.operands.required("to"));
        let cells = self.cells(to);
        let status = |assembler: &Self, n| assembler.layout.bit(Bit::Space(BitSpace::St, n)).0;
        let bit = match value {
            Filling::Bit(bit) => self.layout.bit(bit).0,
            Filling::Element(element) => self.bit_while(element, leg),
            Filling::Value(Value::Const(0, _)) if to.is_bits() => status(self, st::OFF),
            Filling::Value(Value::Const(..)) if to.is_bits() => status(self, st::ON),
            Filling::Value(value) => {
                let form = self.word_form(value.is_real(), to);
                let word = self.value_while(value, leg);
                return Op::FillWords(FillWords { leg, word, to: WordsWritten(cells), form });
            }
        };
        Op::FillBits(FillBits { leg, bit: BitRead(bit), to: BitsWritten(cells) })
    }

    fn word_form(&mut self, from_real: bool, to: Array) -> WordForm {
        WordForm { from_real, to_real: to.is_real(), limits: self.array_limits(to) }
    }

    /// SR.
    pub fn shift(&mut self, instruction: &Instruction, legs: Legs) -> Op {
        let run: ShiftBits = instruction.operands.required("bits");
        let text = self.identity.edge_instruction(instruction);
        let history = self.shift_history(run, text);
        let [data, clk, rst] =
            [LegName::Data, LegName::Clk, LegName::Rst].map(|name| legs.leg(name));
        let bits = BitsWritten(self.cells(run.array));
        Op::Sr(Sr { data, clk, rst, bits, shift: ShiftState { history, down: run.down } })
    }
}
