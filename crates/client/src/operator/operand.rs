//! One bit or word that an operator has named: its values, and whether it may be written or forced.
//!
//! Made by [`super::names::OperandNames`]. This module decides whether an operand may be written
//! and forced (`docs/operator.md`), but not which users may do this.

use std::fmt;
use std::sync::Arc;

use super::protocol::{BitOrNumber, GivenValue, RefusalKind, RequestRefusal, ShownValue};
use super::value::write_name;
use rungd_engine::Cell;
use rungd_engine::isa::decimal_comma::corrected;
use rungd_engine::isa::{Address, Bit, BitSpace, NearestReal, Real, Word, WordSpace};
use rungd_language::resolve::value_texts::{ValueTexts, with_text};
use rungd_language::source::atom::{Atom, AtomKind};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::span::Span;
use rungd_runtime::exchange::{Mode, Snapshot};

/// A bit or word with its names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// The text of the request.
    pub operand: String,
    /// The operand's tag.
    pub tag: Option<String>,
    /// The operand's address, or the name of the Stage or block.
    pub address: String,
    /// The unit of the tag.
    pub unit: Option<String>,
    /// The texts of its values.
    pub texts: Option<Arc<ValueTexts>>,
    /// The parsed address.
    pub what: Address,
    /// The operand's cell in memory.
    pub cell: Cell,
}

impl fmt::Display for Variable {
    /// The form `parts.Acc (CT0.Acc)`, or only the address.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_name(f, self.tag.as_deref(), &self.address)
    }
}

impl Variable {
    /// Whether the operand may be written.
    ///
    /// # Errors
    /// It may not; the refusal contains the reason.
    pub fn may_write(&self) -> Result<(), RequestRefusal> {
        let writable = match self.what {
            Address::Bit(Bit::Space(BitSpace::X, _)) => true,
            Address::Bit(bit) => bit.writable_from_outside(),
            Address::Word(word) => word.writable(),
            Address::Structure(_) => false,
        };
        if writable { Ok(()) } else { Err(read_only(self, "written")) }
    }

    /// Whether the operand may be forced. Flags of structures may be forced too.
    ///
    /// # Errors
    /// It may not; the refusal contains the reason.
    pub fn may_force(&self) -> Result<(), RequestRefusal> {
        let forcible = match self.what {
            Address::Bit(bit) => bit.forcible(),
            Address::Structure(_) => false,
            Address::Word(word) => word.writable(),
        };
        if forcible { Ok(()) } else { Err(read_only(self, "forced")) }
    }

    /// Converts a given value to the operand's number: 0 or 1 for a bit, a number within `limits`
    /// for a word.
    ///
    /// # Errors
    /// The value does not fit.
    pub fn number(
        &self,
        given: &GivenValue,
        limits: impl Fn(Word) -> (i32, i32),
    ) -> Result<i32, RequestRefusal> {
        match self.what {
            Address::Bit(_) => bit_value(given).ok_or_else(|| {
                let message = format!("`{}` is a bit: it takes ON or OFF", self.operand);
                RequestRefusal::new(RefusalKind::BadValue, message)
            }),
            Address::Word(word) => {
                let (min, max) = limits(word);
                match word.is_real() {
                    true => self.real(given, min, max),
                    false => self.word(given, min, max),
                }
            }
            Address::Structure(_) => Err(read_only(self, "written")),
        }
    }

    /// Converts a given value to the content of an integer's cell.
    fn word(&self, given: &GivenValue, min: i32, max: i32) -> Result<i32, RequestRefusal> {
        let bad = |message: String| RequestRefusal::new(RefusalKind::BadValue, message);
        let beyond =
            |given: &str| bad(format!("`{}` takes {min} to {max}, not {given}", self.operand));
        let number = match given {
            GivenValue::Bit(_) | GivenValue::Real(_) => None,
            GivenValue::Number(number) => Some(*number),
            GivenValue::Text(text) => {
                match Atom::parse(text.trim(), Span::default()).map(|a| a.kind) {
                    Ok(AtomKind::Integer(n) | AtomKind::Duration(n)) => Some(i64::from(n)),
                    Ok(AtomKind::Name(_) | AtomKind::Real(_)) => None,
                    // An out-of-range text gets this operand's limits below, not the limits of its
                    // own notation.
                    Err(_) if corrected(text.trim()).is_some_and(|right| is_real(&right)) => None,
                    Err(finding) if finding.code != Code::OutOfRange => {
                        return Err(bad(with_correction(&finding)));
                    }
                    Err(_) if is_real(text.trim()) => None,
                    Err(_) => return Err(beyond(text.trim())),
                }
            }
        };
        let Some(number) = number else {
            let message = "takes a whole number, as 12, 0x1F or 1m30s";
            return Err(bad(format!("`{}` is a word: it {message}", self.operand)));
        };
        let fits = i32::try_from(number).ok().filter(|n| (min..=max).contains(n));
        fits.ok_or_else(|| beyond(&number.to_string()))
    }

    /// Converts a given value to the content of an R word's cell; the limits are contents, too.
    fn real(&self, given: &GivenValue, min: i32, max: i32) -> Result<i32, RequestRefusal> {
        let bad = |message: String| RequestRefusal::new(RefusalKind::BadValue, message);
        let beyond = |given: &str| {
            let [min, max] = [min, max].map(Real::of_cell);
            bad(format!("`{}` takes {min} to {max}, not {given}", self.operand))
        };
        let number = match given {
            GivenValue::Bit(_) => None,
            GivenValue::Number(number) => Some(*number as f64),
            GivenValue::Real(number) => Some(*number),
            GivenValue::Text(text) => {
                match Atom::parse(text.trim(), Span::default()).map(|a| a.kind) {
                    Ok(AtomKind::Integer(n) | AtomKind::Duration(n)) => Some(n.into()),
                    Ok(AtomKind::Real(real)) => Some(real.into()),
                    Ok(AtomKind::Name(_)) => None,
                    Err(finding) if finding.code == Code::OutOfRange => {
                        return Err(beyond(text.trim()));
                    }
                    Err(finding) => return Err(bad(with_correction(&finding))),
                }
            }
        };
        let Some(number) = number else {
            let message = "it takes a number, as 12.5, 12 or 2e-3";
            return Err(bad(format!("`{}` is a real: {message}", self.operand)));
        };
        let NearestReal { real, is_beyond } = Real::stored(number);
        if is_beyond {
            return Err(beyond(&format!("{number:?}")));
        }
        match (min..=max).contains(&real.cell()) {
            true => Ok(real.cell()),
            false => Err(beyond(&real.to_string())),
        }
    }

    /// Converts a number to this operand's value: ON or OFF for a bit.
    pub fn held(&self, value: i32) -> BitOrNumber {
        match self.cell {
            Cell::Bit(_) | Cell::WordBit(_) => BitOrNumber::Bit(value != 0),
            Cell::Word(_) if matches!(self.what, Address::Word(word) if word.is_real()) => {
                BitOrNumber::Real(Real::of_cell(value))
            }
            Cell::Word(_) => BitOrNumber::Word(value),
        }
    }

    /// The text of a value, if its tag gives one.
    pub fn value_text(&self, value: BitOrNumber) -> Option<&str> {
        let content = match value {
            BitOrNumber::Bit(on) => i32::from(on),
            BitOrNumber::Word(number) => number,
            BitOrNumber::Real(_) => return None,
        };
        self.texts.as_ref()?.text(content)
    }

    /// A value with its text: `1 (dosing)`.
    pub fn say_value(&self, value: BitOrNumber) -> String {
        with_text(value, self.value_text(value))
    }

    /// The operand with its value in an image.
    pub fn seen(&self, image: &Snapshot) -> ShownValue {
        let value = self.held(image.value(self.cell));
        ShownValue {
            operand: self.operand.clone(),
            tag: self.tag.clone(),
            address: self.address.clone(),
            value,
            unit: self.unit.clone(),
            text: self.value_text(value).map(str::to_owned),
            forced: image.forces.has(self.cell),
            driven: self.driven(image),
            unknown: None,
        }
    }

    /// The state of the output, for a Y outside RUN.
    pub(super) fn driven(&self, image: &Snapshot) -> Option<bool> {
        let driven = image.outputs.get(self.output()? as usize)?;
        (image.mode != Mode::Run).then_some(*driven != 0)
    }

    /// The number of a Y.
    pub fn output(&self) -> Option<u32> {
        match self.what {
            Address::Bit(Bit::Space(BitSpace::Y, n)) => Some(n),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        }
    }

    /// The number of an X.
    pub fn input(&self) -> Option<u32> {
        match self.what {
            Address::Bit(Bit::Space(BitSpace::X, n)) => Some(n),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        }
    }
}

/// The message of a finding about a value, with the text to write if its help has one.
fn with_correction(finding: &Finding) -> String {
    let help = finding.help_text().filter(|help| help.starts_with("write `"));
    help.map_or(finding.message.clone(), |help| format!("{}: {help}", finding.message))
}

/// Whether a number has a point or an exponent.
fn is_real(text: &str) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    !digits.starts_with("0x") && digits.contains(['.', 'e', 'E'])
}

fn bit_value(given: &GivenValue) -> Option<i32> {
    match given {
        GivenValue::Bit(on) => Some(i32::from(*on)),
        GivenValue::Number(n @ (0 | 1)) => Some(*n as i32),
        GivenValue::Number(_) | GivenValue::Real(_) => None,
        GivenValue::Text(text) => match text.trim().to_ascii_lowercase().as_str() {
            "on" | "true" | "1" => Some(1),
            "off" | "false" | "0" => Some(0),
            _ => None,
        },
    }
}

fn read_only(operand: &Variable, done: &str) -> RequestRefusal {
    let name = &operand.operand;
    let why = match operand.what {
        Address::Bit(Bit::Space(BitSpace::St, _))
        | Address::Word(Word::Space(WordSpace::Dst, _)) => "it shows the state of the controller",
        Address::Bit(Bit::Stage(_)) => "a Stage is switched by the ladder",
        Address::Bit(Bit::Running(_) | Bit::Done(_)) => {
            "a block is started and stopped by the ladder"
        }
        Address::Bit(Bit::Device(..)) => "it shows the state of the device; it can be forced",
        Address::Bit(Bit::InWord(bit)) if bit.word.writable() => {
            "a bit of a word is forced with its word"
        }
        Address::Bit(Bit::InWord(_)) => "it shows the state of the controller",
        Address::Bit(Bit::Flag(..)) => {
            "its instruction writes it at every execution; it can be forced"
        }
        Address::Bit(Bit::Space(..)) | Address::Word(_) | Address::Structure(_) => {
            "name a member of it"
        }
    };
    RequestRefusal::new(RefusalKind::BadOperand, format!("`{name}` cannot be {done}: {why}"))
}
