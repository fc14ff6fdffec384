//! The operands of PACK and UNPACK: an array of bits, and a word of whole numbers with as many.
//!
//! Called by `operand`.

use super::Resolver;
use super::array::{Array, ShiftBits};
use super::instruction::{OperandList, OperandValue, Value, WordPlace};
use crate::source::atom::Atom;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, possible};
use crate::source::span::{Located, Span};
pub use rungd_engine::isa::Spec;

/// A word, with its place in the text.
struct WrittenWord {
    /// The number of its bits; `None` for a real.
    bit_count: Option<u32>,
    span: Span,
}

impl Resolver<'_> {
    /// The array, if it is of bits; otherwise adds a finding.
    pub(super) fn packed_bits(
        &mut self,
        run: ShiftBits,
        atom: &Atom,
        spec: &Spec,
    ) -> Option<OperandValue> {
        if run.array.is_bits() {
            return Some(OperandValue::Array(run.array));
        }
        let message = format!("`{atom}` is of words: `{}` works on bits", spec.name);
        let finding = Finding::new(Code::OperandType, atom.span, message);
        let help = "name an array of bits, or a range: `{}`";
        self.find(finding.help(advise(help, [possible("C0..C7")])));
        None
    }

    /// Whether the word of PACK or UNPACK has a bit for each element; if not, adds a finding.
    pub(super) fn packing_fits(&mut self, operands: &OperandList, spec: &Spec) -> bool {
        let (bits, word) = match operands.get::<Array>("bits") {
            Some(bits) => (Some(bits), written_word(operands)),
            None => (operands.get::<Array>("to"), read_word(operands)),
        };
        let (Some(bits), Some(word)) = (bits, word) else { return true };
        let (name, text) = (spec.name, self.text(word.span).to_owned());
        let Some(bit_count) = word.bit_count else {
            let message = format!("`{text}` is a real: `{name}` writes a word of whole numbers");
            let finding = Finding::new(Code::OperandType, word.span, message);
            let help = advise("write to a D word, as `{}`", [possible("D0")]);
            self.find(finding.help(help));
            return false;
        };
        let count = bits.value.count;
        if count <= bit_count {
            return true;
        }
        let message = format!("`{name}` of {count} bits, and `{text}` has {bit_count}");
        let finding = Finding::new(Code::OperandType, bits.span, message);
        let words = "one element for each bit of the word, at most";
        let help = self.first_of(bits, bit_count, words);
        self.find(finding.related(word.span, format!("{bit_count} bits")).help(help));
        false
    }
}

/// The word that PACK writes.
fn written_word(operands: &OperandList) -> Option<WrittenWord> {
    let Located { value, span } = operands.get::<WordPlace>("to")?;
    let word = match value {
        WordPlace::Word(word) => word,
        WordPlace::Element(element) => element.array.first_word()?,
    };
    let bit_count = Some(u32::from(word.bit_count())).filter(|count| *count > 0);
    Some(WrittenWord { bit_count, span })
}

/// The word that UNPACK reads. A constant has 32 bits.
fn read_word(operands: &OperandList) -> Option<WrittenWord> {
    let Located { value, span } = operands.get::<Value>("word")?;
    let bit_count = match value {
        Value::Const(..) | Value::Real(_) => 32,
        Value::Word(word) => word.bit_count().into(),
        Value::Element(element) => element.array.first_word()?.bit_count().into(),
    };
    Some(WrittenWord { bit_count: Some(bit_count), span })
}
