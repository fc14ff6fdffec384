//! Reads the values in a test: a word of a step, or a value of TOML.
//!
//! Called by `steps` and `random`. A value must have the form of its operand: ON or OFF for a bit,
//! a whole number or a duration for a word, any number for a real. It must be within the limits of
//! the operand.

use super::names::TestTarget;
use super::step_words::StepWord;
use crate::traces::stimulus::StimulusTarget;
use rungd_engine::isa::Real;
use rungd_engine::isa::duration;
use rungd_language::source::atom::{Atom, AtomKind};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, possible};
use rungd_language::source::reader::Constant;
use rungd_language::source::span::{Located, Span};

/// The content of the cell for a value of TOML.
pub(super) fn constant(target: &TestTarget, given: &Located<Constant>) -> Result<i32, Finding> {
    content(target, given.value, given.span)
}

/// The content of the cell for a word of a step.
pub(super) fn word(target: &TestTarget, word: &StepWord) -> Result<i32, Finding> {
    let text = word.value.as_str();
    let given = match text.to_ascii_lowercase().as_str() {
        "on" | "true" => Constant::Bit(true),
        "off" | "false" => Constant::Bit(false),
        _ => match Atom::parse(text, word.span) {
            Ok(Atom { kind: AtomKind::Integer(number), .. }) => Constant::Integer(number),
            Ok(Atom { kind: AtomKind::Duration(ms), .. }) => Constant::Duration(ms),
            Ok(Atom { kind: AtomKind::Real(real), .. }) => Constant::Real(real),
            Ok(Atom { kind: AtomKind::Name(_), .. }) => {
                return Err(wrong(target, text, word.span));
            }
            Err(mut finding) => {
                if finding.code == Code::InstructionSyntax {
                    finding.code = Code::TestStep;
                }
                return Err(finding);
            }
        },
    };
    content(target, given, word.span)
}

fn content(target: &TestTarget, given: Constant, span: Span) -> Result<i32, Finding> {
    let name = &target.operand.name;
    let beyond = |min: String, max: String, value: String| {
        let message = format!("`{name}` takes {min} to {max}, not {value}");
        let finding = Finding::new(Code::OutOfRange, span, message);
        finding.help(advise("write `{}`, `{}`, or what lies between", [min, max].map(possible)))
    };
    match (target.takes, given) {
        (StimulusTarget::Input(_) | StimulusTarget::Bit(_), Constant::Bit(on)) => Ok(on.into()),
        (
            StimulusTarget::Input(_) | StimulusTarget::Bit(_),
            Constant::Integer(number @ (0 | 1)),
        ) => Ok(number),
        (
            StimulusTarget::Word(_, (min, max)),
            Constant::Integer(number) | Constant::Duration(number),
        ) => match (min..=max).contains(&number) {
            true => Ok(number),
            false => Err(beyond(min.to_string(), max.to_string(), number.to_string())),
        },
        (StimulusTarget::Real(_, (min, max)), Constant::Integer(n) | Constant::Duration(n)) => {
            within(min, max, Real::nearest(n)).map_err(|[min, max, real]| beyond(min, max, real))
        }
        (StimulusTarget::Real(_, (min, max)), Constant::Real(real)) => {
            within(min, max, real).map_err(|[min, max, real]| beyond(min, max, real))
        }
        (
            StimulusTarget::Input(_) | StimulusTarget::Bit(_),
            Constant::Integer(_) | Constant::Duration(_) | Constant::Real(_),
        )
        | (StimulusTarget::Word(..), Constant::Bit(_) | Constant::Real(_))
        | (StimulusTarget::Real(..), Constant::Bit(_)) => Err(wrong(target, &shown(given), span)),
    }
}

fn within(min: Real, max: Real, real: Real) -> Result<i32, [String; 3]> {
    match (min..=max).contains(&real) {
        true => Ok(real.cell()),
        false => Err([min, max, real].map(|real| real.to_string())),
    }
}

fn shown(given: Constant) -> String {
    match given {
        Constant::Bit(on) => on.to_string(),
        Constant::Integer(number) => number.to_string(),
        Constant::Duration(ms) => duration::print(ms),
        Constant::Real(real) => real.to_string(),
    }
}

/// The finding for a value of the wrong form.
fn wrong(target: &TestTarget, given: &str, span: Span) -> Finding {
    let name = &target.operand.name;
    let (kind, takes, help) = match target.takes {
        StimulusTarget::Input(_) | StimulusTarget::Bit(_) => {
            ("a bit", "0 or 1", advise("write `{}`, or `{}`", ["1", "0"].map(possible)))
        }
        StimulusTarget::Word(..) => {
            let whole = given.parse::<f64>().ok().map(|real| possible(format!("{real:.0}")));
            let help = Help::from("write it as `12`, `-3`, `1m30s`").with_all(whole);
            ("a word", "a whole number or a duration", help)
        }
        StimulusTarget::Real(..) => {
            ("a real", "a number", "write it as `12.5`, `-3`, `2e-3`".into())
        }
    };
    let message = format!("`{name}` is {kind}: it takes {takes}, not `{given}`");
    Finding::new(Code::TestStep, span, message).help(help)
}
