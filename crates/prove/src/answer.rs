//! The answer about a line: proved, violated or not decided, and what stands behind it.
//!
//! `decide` makes it; `rungd prove` prints its text or its JSON.

use rungd_base::scan_period::ScanPeriod;
use rungd_lab::testing::time_text;
use rungd_language::source::wording::counted;
use serde_json::{Value, json};

use crate::cone::Share;
use rungd_lab::testing::Failure;

/// The answer about a line.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The line.
    pub line: String,
    /// Whether it is a line of `can`, and not of `always`.
    pub is_can: bool,
    /// What was found.
    pub verdict: AnswerVerdict,
    /// How much of the program the line depends on; `None` if that was not looked at.
    pub depends_on: Option<DependsOn>,
    /// What was assumed: the texts of `assume`.
    pub assumptions: Vec<String>,
    /// The results that had any value, because gates do not compute them.
    pub cuts: Vec<String>,
    /// Why the answer says nothing, if it does not.
    pub vacuous: Option<String>,
    /// Whether it is kept from an earlier proof of the same question.
    pub is_kept: bool,
    /// The hash of the question.
    pub hash: String,
    /// The time that it took, ms.
    pub ms: u128,
    /// The scan period.
    pub period: ScanPeriod,
    /// The maximum number of periods from one scan to the next.
    pub late_max: u32,
    /// Whether retained memory has any values before the first scan.
    pub is_from_retained: bool,
    /// What may happen to the controller.
    pub events: EventsTold,
}

/// What may happen to the controller, in words.
#[derive(Clone, Debug, Default)]
pub struct EventsTold {
    /// The words of `events`.
    pub words: Vec<&'static str>,
    /// What they mean where that is not the same for every file.
    pub sentences: Vec<String>,
}

/// How much of a program a line depends on.
#[derive(Clone, Copy, Debug)]
pub struct DependsOn {
    /// Operations.
    pub operations: Share,
    /// Inputs.
    pub inputs: Share,
}

/// What was found about a line.
#[derive(Clone, Debug)]
pub enum AnswerVerdict {
    /// No sequence of inputs, however long, breaks it.
    Proved {
        /// How.
        way: Way,
        /// What shows that each side can be.
        witnesses: Vec<SideWitness>,
    },
    /// A sequence of inputs breaks it; it was executed.
    Violated {
        /// The way that has found it.
        way: &'static str,
        /// The scan, from 1.
        scan: u64,
        /// The scenario, to paste into a test file.
        scenario: String,
        /// How the test fails.
        failure: Option<Box<Failure>>,
    },
    /// Neither.
    NotDecided {
        /// What was looked at.
        covered: Vec<String>,
        /// What stood in the way.
        cause: String,
    },
}

/// How a line was proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Every state that can be reached was visited.
    Exploring {
        /// The number of states.
        states: u64,
    },
    /// It follows from the scans before.
    Induction {
        /// The number of scans.
        k: usize,
    },
    /// An invariant excludes the opposite.
    Reachability {
        /// The number of its clauses.
        clauses: usize,
    },
}

impl Way {
    /// Its word, and the number of states, scans or clauses.
    pub(crate) fn word_and_number(self) -> (&'static str, u64) {
        match self {
            Way::Exploring { states } => (EXPLORING, states),
            Way::Induction { k } => (INDUCTION, k as u64),
            Way::Reachability { clauses } => (REACHABILITY, clauses as u64),
        }
    }

    /// The way with a word.
    pub(crate) fn of_word(word: &str, number: u64) -> Option<Way> {
        let count = number as usize;
        match word {
            EXPLORING => Some(Way::Exploring { states: number }),
            INDUCTION => Some(Way::Induction { k: count }),
            REACHABILITY => Some(Way::Reachability { clauses: count }),
            _ => None,
        }
    }

    /// Adds its word and its number.
    pub fn add_json(self, all: &mut Value) {
        all["way"] = json!(self.word_and_number().0);
        match self {
            Way::Exploring { states } => all["states"] = json!(states),
            Way::Induction { k } => all["k"] = json!(k),
            Way::Reachability { clauses } => all["clauses"] = json!(clauses),
        }
    }

    /// As a sentence.
    pub fn text(self) -> String {
        match self {
            Way::Exploring { states } => {
                format!("by exploring: all {} that can be reached", counted(states, "state"))
            }
            Way::Induction { k: 0 } => "by deducing: no scan breaks it, whatever memory is".into(),
            Way::Induction { k } => {
                format!("by deducing: it follows from the last {}", counted(k as u64, "scan"))
            }
            Way::Reachability { clauses } => {
                let clauses = counted(clauses as u64, "clause");
                format!("by deducing: an invariant of {clauses}, which every scan keeps")
            }
        }
    }
}

/// The words of the ways.
pub(crate) const EXPLORING: &str = "exploring";
pub(crate) const DEDUCING: &str = "deducing";
const INDUCTION: &str = "induction";
const REACHABILITY: &str = "reachability";

/// What shows that a side of a line can be.
#[derive(Clone, Debug)]
pub struct SideWitness {
    /// The side.
    pub side: String,
    /// What was found.
    pub shown: Shown,
}

/// Whether a side can be.
#[derive(Clone, Debug)]
pub enum Shown {
    /// It is so at the end of a scan, from 1; the scenario.
    At(u64, String),
    /// It can never be.
    Never,
    /// Neither.
    Open,
}

impl Answer {
    /// Its word.
    pub fn word(&self) -> &'static str {
        match self.verdict {
            AnswerVerdict::Proved { .. } => "proved",
            AnswerVerdict::Violated { .. } => "violated",
            AnswerVerdict::NotDecided { .. } => "not decided",
        }
    }

    /// A scan, from 1, with its time, if no scan comes late: `scan 2,204 (22.03 s)`.
    pub fn when(&self, scan: u64) -> String {
        let after_ns = scan.saturating_sub(1) * self.period.ns();
        match self.late_max {
            ..=1 => format!("scan {} ({})", grouped(scan), time_text(after_ns)),
            _ => format!("scan {}", grouped(scan)),
        }
    }

    /// Its text: a line, and indented lines below it.
    pub fn text(&self) -> String {
        let mut text = format!("{}: {}\n", self.word(), self.line);
        let mut add = |line: &str| text += &format!("  {line}\n");
        if let Some(vacuous) = &self.vacuous {
            add(&format!("vacuous: {vacuous}"));
        }
        let (mut below, mut reasons) = (String::new(), String::new());
        match &self.verdict {
            AnswerVerdict::Proved { way, witnesses } => {
                let kept = "; unchanged since it was proved (`--again` proves it again)";
                add(&format!("{}{}", way.text(), if self.is_kept { kept } else { "" }));
                if self.is_can {
                    add("from each of them some inputs lead there");
                }
                for SideWitness { side, shown } in witnesses {
                    match shown {
                        Shown::At(scan, scenario) => {
                            add(&format!("`{side}` can be ON: scan {}", grouped(*scan)));
                            below += &format!("\n{scenario}");
                        }
                        Shown::Never => add(&format!("`{side}` can never be ON")),
                        Shown::Open => add(&format!("`{side}`: not shown that it can be ON")),
                    }
                }
            }
            AnswerVerdict::Violated { scan, scenario, failure, .. } => {
                let when = self.when(*scan);
                add(&match (self.is_can, scan) {
                    (true, 0) => "from the start no inputs lead there".to_owned(),
                    (true, _) => format!("after {when} no inputs lead there any more"),
                    (false, _) => format!("at {when}, by the shortest inputs that were found"),
                });
                below += &format!("\n{scenario}");
                if let Some(failure) = failure {
                    below += "\n";
                    reasons = failure.reasons_text();
                }
            }
            AnswerVerdict::NotDecided { covered, cause } => {
                add(&format!("stood in the way: {cause}"));
                covered.iter().for_each(|covered| add(covered));
            }
        }
        if let Some(DependsOn { operations, inputs }) = self.depends_on {
            add(&format!(
                "depends on {} of {} operations and {} of {} inputs",
                operations.kept, operations.all, inputs.kept, inputs.all
            ));
        }
        add(&match self.late_max {
            ..=1 => format!("every scan comes exactly {} after the last one", self.period.words()),
            most => format!(
                "a scan comes 1 to {most} periods of {} after the last one",
                self.period.words()
            ),
        });
        if self.is_from_retained {
            add("from any retained values within their limits");
        }
        if !self.events.words.is_empty() {
            add(&format!("may happen: {}", self.events.words.join(", ")));
        }
        self.events.sentences.iter().for_each(|sentence| add(sentence));
        self.assumptions.iter().for_each(|assumed| add(&format!("assumed: {assumed}")));
        self.cuts.iter().for_each(|cut| add(&format!("any value: {cut}")));
        text + &indented(below.trim_end()) + if reasons.is_empty() { "" } else { "\n" } + &reasons
    }

    /// It as JSON.
    pub fn json(&self, file: &str) -> Value {
        let mut all = json!({
            "file": file,
            "line": self.line,
            "answer": self.word(),
            "can": self.is_can,
            "vacuous": self.vacuous,
            "assumptions": self.assumptions,
            "cuts": self.cuts,
            "late_max": self.late_max,
            "from_retained": self.is_from_retained,
            "events": self.events.words,
            "kept": self.is_kept,
            "ms": self.ms as u64,
        });
        match &self.verdict {
            AnswerVerdict::Proved { way, witnesses } => {
                way.add_json(&mut all);
                all["witnesses"] = witnesses.iter().map(SideWitness::json).collect();
            }
            AnswerVerdict::Violated { way, scan, scenario, failure } => {
                all["way"] = json!(way);
                all["scan"] = json!(scan);
                all["scenario"] = json!(scenario);
                all["why"] = json!(failure.as_ref().map(|failure| &failure.why));
            }
            AnswerVerdict::NotDecided { covered, cause } => {
                all["cause"] = json!(cause);
                all["covered"] = json!(covered);
            }
        }
        all
    }
}

impl SideWitness {
    fn json(&self) -> Value {
        match &self.shown {
            Shown::At(scan, scenario) => {
                json!({ "side": self.side, "can": true, "scan": scan, "scenario": scenario })
            }
            Shown::Never => json!({ "side": self.side, "can": false }),
            Shown::Open => json!({ "side": self.side, "can": null }),
        }
    }
}

fn indented(text: &str) -> String {
    let line = |line: &str| match line.is_empty() {
        true => "\n".to_owned(),
        false => format!("    {line}\n"),
    };
    text.lines().map(line).collect()
}

/// A number with its thousands apart: `2,204`.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let first = digits.len() % 3;
    let (head, rest) = digits.split_at(first);
    let groups = rest.as_bytes().chunks(3).map(|group| String::from_utf8_lossy(group).into_owned());
    let head = (!head.is_empty()).then(|| head.to_owned());
    head.into_iter().chain(groups).collect::<Vec<_>>().join(",")
}
