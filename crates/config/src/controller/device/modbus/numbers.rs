//! The keys of a row that say how its registers are read as numbers: `type`, `word-order`,
//! `byte-order`, `split`, and the scaling.

use super::super::driver::ResolvedRow;
use super::ModbusReader;
use super::keys::ModbusRowKeys;
use rungd_io::modbus::number::{ByteOrder, NumberOrder, RegisterNumberType, WordOrder};
use rungd_io::modbus_client::settings::{NumberPart, RegisterNumber};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Fix, FixEdit, pair, text};
use rungd_language::source::span::Span;

/// The numbers of a row.
#[derive(Clone, Copy)]
pub(super) struct RowNumber {
    pub kind: RegisterNumberType,
    whole: RegisterNumber,
    is_split: bool,
}

impl RowNumber {
    /// The parts of a number, one for each word of memory.
    pub fn parts(self) -> &'static [NumberPart] {
        match self.is_split {
            true => &[NumberPart::High, NumberPart::Low],
            false => &[NumberPart::Whole],
        }
    }

    /// A part of a number.
    pub fn part(self, part: NumberPart) -> RegisterNumber {
        RegisterNumber { part, ..self.whole }
    }
}

impl ModbusReader<'_> {
    /// The numbers in a row's registers, according to the row's keys.
    pub(super) fn number(
        &mut self,
        keys: &ModbusRowKeys,
        row: &ResolvedRow<'_>,
        is_bits: bool,
    ) -> Option<RowNumber> {
        let before = self.findings.len();
        if is_bits {
            self.refuse_of_bits(keys);
        }
        let kind = keys.kind.as_ref().map_or(RegisterNumberType::U16, |kind| kind.value);
        let is_single = kind.registers() == 1 && !keys.has_wrong_type;
        if let (Some(order), true, false) = (&keys.word_order, is_single, is_bits) {
            let message = "a single register has no word order";
            let help = "`word-order` is for types of 32 and 64 bits; for bytes that are swapped in \
                        a register, write `byte-order`";
            let finding = Finding::new(Code::Controller, order.span, message).help(help);
            self.findings.push(finding.or_omit());
        }
        let scaling = keys.scaling.resolve(row.is_real(), self.findings);
        let is_split = keys.split.as_ref().is_some_and(|split| split.value);
        if let (Some(split), true, false) = (&keys.split, is_split && !keys.has_wrong_type, is_bits)
        {
            self.refuse_split(keys, kind, row, split.span);
        }
        if keys.has_wrong_type || keys.has_wrong_order || self.findings.len() > before {
            return None;
        }
        let order = NumberOrder {
            words: keys.word_order.as_ref().map_or_else(WordOrder::default, |order| order.value),
            bytes: keys.byte_order.as_ref().map_or_else(ByteOrder::default, |order| order.value),
        };
        let whole = RegisterNumber { kind, order, part: NumberPart::Whole, scaling };
        Some(RowNumber { kind, whole, is_split })
    }

    /// Findings for keys of numbers in a row of bits.
    fn refuse_of_bits(&mut self, keys: &ModbusRowKeys) {
        let given = [
            ("type", keys.kind.as_ref().map(|kind| kind.span)),
            ("word-order", keys.word_order.as_ref().map(|order| order.span)),
            ("byte-order", keys.byte_order.as_ref().map(|order| order.span)),
            ("split", keys.split.as_ref().map(|split| split.span)),
        ];
        for (name, place) in given {
            let Some(span) = place else { continue };
            let message = format!("a bit has no `{name}`");
            let help = format!("take `{name}` out of this row");
            let finding = Finding::new(Code::Controller, span, message).help(help);
            self.findings.push(finding.fix(FixEdit::Delete));
        }
        keys.scaling.refuse(self.findings);
    }

    /// Findings for a `split` that has no two halves, or whose halves would be changed.
    fn refuse_split(
        &mut self,
        keys: &ModbusRowKeys,
        kind: RegisterNumberType,
        row: &ResolvedRow<'_>,
        span: Span,
    ) {
        let mut refuse = |message: &str, help: &str, fix: Fix| {
            let finding = Finding::new(Code::Controller, span, message).help(help);
            self.findings.push(finding.fix(fix.possible()).or_omit());
        };
        match kind {
            RegisterNumberType::U64 | RegisterNumberType::I64 => {}
            RegisterNumberType::U16
            | RegisterNumberType::I16
            | RegisterNumberType::U32
            | RegisterNumberType::I32
            | RegisterNumberType::F32
            | RegisterNumberType::F64 => {
                return refuse(
                    "only a whole number of 64 bits is split",
                    "`split` goes with `type = \"u64\"` or `\"i64\"`; a `f64` goes into an R",
                    pair("type = \"u64\""),
                );
            }
        }
        if !row.has_words_of_32_bits() {
            return refuse(
                "the halves of a number are bits, which only a D holds",
                "write `to = \"D0..D1\"`: the higher 32 bits, then the lower",
                text(row.text.text.replace(char::is_alphabetic, "D")).at(row.text.span),
            );
        }
        if keys.scaling.is_given() {
            refuse(
                "half a number is not scaled",
                "take `multiply`, `divide` and `offset` out, or take `split` out",
                FixEdit::Remove("divide").into(),
            );
        }
    }
}
