//! A fact of a survey, as text and as JSON.
//!
//! `survey` makes facts; `rungd prove --survey` prints them, and `lock` compares their lines. A
//! line has no times and no counts, so the survey of a ladder is the same on every machine.

use rungd_engine::isa::Bit;
use serde_json::{Value, json};

use super::mishaps::RungMishap;
use crate::model::Path;

/// What a fact says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactKind {
    /// Whether an output comes ON and goes OFF.
    Output,
    /// Whether an alarm is raised and cleared.
    Alarm,
    /// Whether a Stage is entered and left.
    Stage,
    /// Whether a structure is ever Done.
    Done,
    /// Whether two outputs can be ON together.
    Interlock,
    /// Whether a rung, a leg or a branch is ever ON.
    Power,
    /// Whether a contact ever matters.
    Part,
    /// Whether a mishap can be.
    Mishap(RungMishap),
    /// Whether an output flaps every scan for ever with still inputs.
    Flap,
}

/// Whether a condition can be ON.
#[derive(Clone, Debug, PartialEq)]
pub enum Possibility {
    /// After this path, which was executed.
    Can(Path),
    /// For no sequence of inputs.
    Never,
    /// Neither.
    Open,
}

impl Possibility {
    fn word(&self) -> &'static str {
        match self {
            Possibility::Can(_) => "can",
            Possibility::Never => "never",
            Possibility::Open => "not decided",
        }
    }
}

/// A fact.
#[derive(Clone, Debug)]
pub struct Fact {
    /// What it says.
    pub kind: FactKind,
    /// What it is about: `output pump`.
    pub subject: String,
    /// Where that stands in the files of the program: `pump.toml:12`; empty without a place.
    pub place: String,
    /// The answers to its conditions.
    pub answers: Vec<Possibility>,
    /// The number of its first condition in the model; `None`: it has a model of its own.
    pub(super) first: Option<usize>,
    /// The bit that it is about, for outputs and alarms.
    pub(super) bit: Option<Bit>,
    /// Whether the rung around it is never ON: then it says nothing.
    pub is_hidden: bool,
}

impl Fact {
    /// What is said of its subject; `None`: it is as everyone expects.
    pub fn verdict(&self) -> Option<&'static str> {
        if self.is_hidden {
            return None;
        }
        let first = self.answers.first()?;
        let words = self.kind.words();
        match (first, self.answers.get(1)) {
            (Possibility::Open, _) => Some(words.open),
            (Possibility::Never, _) => words.never,
            (Possibility::Can(_), None) => words.can,
            (Possibility::Can(_), Some(Possibility::Can(_))) => Some(words.goes),
            (Possibility::Can(_), Some(Possibility::Never)) => Some(words.stays),
            (Possibility::Can(_), Some(Possibility::Open)) => Some(words.stays_open),
        }
    }

    /// Its line; `None`: it has none.
    pub fn line(&self) -> Option<String> {
        self.verdict().map(|verdict| format!("{}: {verdict}", self.subject))
    }

    /// Whether it is as everyone expects.
    pub fn is_ordinary(&self) -> bool {
        let all = |wanted: fn(&Possibility) -> bool| self.answers.iter().all(wanted);
        self.verdict().is_none()
            || match self.kind {
                FactKind::Output | FactKind::Alarm | FactKind::Stage | FactKind::Done => {
                    all(|answer| matches!(answer, Possibility::Can(_)))
                }
                FactKind::Interlock => all(|answer| matches!(answer, Possibility::Never)),
                FactKind::Power | FactKind::Part | FactKind::Mishap(_) | FactKind::Flap => false,
            }
    }

    /// Whether something is not decided.
    pub fn is_open(&self) -> bool {
        !self.is_hidden && self.answers.contains(&Possibility::Open)
    }

    /// Whether it is a broken interlock.
    pub fn is_broken(&self) -> bool {
        self.kind == FactKind::Interlock && matches!(self.answers[..], [Possibility::Can(_)])
    }

    /// It as JSON.
    pub fn json(&self) -> Value {
        json!({
            "subject": self.subject,
            "place": self.place,
            "verdict": self.verdict(),
            "answers": self.answers.iter().map(Possibility::word).collect::<Vec<_>>(),
        })
    }
}

/// The words for the answers of a kind. `None`: that is not worth a line.
struct FactWords {
    can: Option<&'static str>,
    goes: &'static str,
    stays: &'static str,
    stays_open: &'static str,
    never: Option<&'static str>,
    open: &'static str,
}

const PLAIN: FactWords =
    FactWords { can: None, goes: "", stays: "", stays_open: "", never: None, open: "not decided" };

/// The words of a kind that is worth a line only if it can be.
const fn bad(can: &'static str, open: &'static str) -> FactWords {
    FactWords { can: Some(can), open, ..PLAIN }
}

impl FactKind {
    /// The answers that a verdict was made of: whether each condition can be. `None`: not decided.
    pub(super) fn answers_of(self, verdict: Option<&str>) -> Vec<Option<bool>> {
        let words = self.words();
        let Some(text) = verdict else {
            // Nothing is said of what is as everyone expects.
            return vec![Some(words.can.is_none())];
        };
        match () {
            () if Some(text) == words.never => vec![Some(false), Some(false)],
            () if text == words.goes || Some(text) == words.can => vec![Some(true), Some(true)],
            () if text == words.stays => vec![Some(true), Some(false)],
            () if text == words.stays_open => vec![Some(true), None],
            () => vec![None, None],
        }
    }

    fn words(self) -> FactWords {
        match self {
            FactKind::Output => FactWords {
                goes: "comes ON, goes OFF",
                stays: "comes ON, and never goes OFF again",
                stays_open: "comes ON; not decided: whether it goes OFF",
                never: Some("never ON"),
                ..PLAIN
            },
            FactKind::Alarm => FactWords {
                goes: "is raised, is cleared",
                stays: "is raised, and never cleared again",
                stays_open: "is raised; not decided: whether it is cleared",
                never: Some("never raised"),
                ..PLAIN
            },
            FactKind::Stage => FactWords {
                goes: "is entered, is left",
                stays: "is entered, and never left: nothing leads on",
                stays_open: "is entered; not decided: whether it is left",
                never: Some("never entered"),
                ..PLAIN
            },
            FactKind::Done => {
                FactWords { can: Some("is reached"), never: Some("never reached"), ..PLAIN }
            }
            FactKind::Interlock => FactWords {
                can: Some("BROKEN: both can be ON together"),
                never: Some("holds"),
                ..PLAIN
            },
            FactKind::Power => FactWords { never: Some("never ON"), ..PLAIN },
            FactKind::Part => FactWords {
                never: Some("never matters: the rung does the same without it"),
                open: "not decided: whether it matters",
                ..PLAIN
            },
            FactKind::Mishap(RungMishap::DividesByZero) => bad("can be 0", "not decided"),
            FactKind::Mishap(RungMishap::Saturates) => {
                bad("the result can be beyond it", "not decided")
            }
            FactKind::Mishap(RungMishap::LeavesLimits) => {
                bad("the result can be beyond them", "not decided")
            }
            FactKind::Mishap(RungMishap::IndexOutside) => bad("can be outside", "not decided"),
            FactKind::Flap => bad(
                "can change in every scan for ever, with inputs that stand still",
                "not decided",
            ),
        }
    }
}
