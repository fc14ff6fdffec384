//! COPY, FILL and SR as operations.

use super::assembler::Assembler;
use super::legs::Legs;
use crate::engine::ops::{
    BitOwn, BitRead, BitsRead, BitsWritten, CopyBits, CopyWords, FillBits, FillWords, LegPowers,
    Op, Shift, Sr, WordForm, WordsRead, WordsWritten,
};
use crate::isa::status::st;
use crate::isa::{Bit, BitSpace, LegName};
use crate::resolve::array::{Array, ShiftBits};
use crate::resolve::instruction::{Action, Filling, Instruction, Value};

impl Assembler<'_> {
    /// SET and RST of an element, COPY, FILL and SR.
    pub fn array_action(&mut self, instruction: &Instruction, legs: Legs) -> Op {
        let action = &instruction.action;
        if let Action::SetElement { on, bit } = action {
            return self.set_element(*on, bit.value, legs.when());
        }
        if let Action::Copy { from, to } = action {
            return self.copy(from.value, to.value, legs.when());
        }
        if let Action::Fill { value, to } = action {
            return self.fill(value.value, to.value, legs.when());
        }
        let Action::Shift { bits } = action else { unreachable!("the caller asks for arrays") };
        let text = self.identity.edge_instruction(instruction);
        let history = self.shift_history(bits.value, text);
        let legs = [LegName::Data, LegName::Clk, LegName::Rst].map(|name| legs.leg(name));
        self.shift(bits.value, legs, history)
    }

    /// COPY.
    fn copy(&mut self, from: Array, to: Array, leg: LegPowers) -> Op {
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
    fn fill(&mut self, value: Filling, to: Array, leg: LegPowers) -> Op {
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

    /// SR, with its legs `data`, `clk`, `rst`.
    fn shift(&mut self, run: ShiftBits, [data, clk, rst]: [LegPowers; 3], history: BitOwn) -> Op {
        let bits = BitsWritten(self.cells(run.array));
        Op::Sr(Sr { data, clk, rst, bits, shift: Shift { history, down: run.down } })
    }
}
