//! The answer of `how`: as text and as JSON.
//!
//! `how` makes it; `rungd how`, `rungd web` and `rungd lsp` show it.

use crate::answer::Way;
use rungd_base::scan_period::ScanPeriod;
use rungd_lab::testing::time_text;
use rungd_language::source::wording::{counted, thousands};
use serde_json::{Value, json};

use super::sentence::{InputChange, said};

/// The answer.
#[derive(Clone, Debug)]
pub struct HowAnswer {
    /// The condition.
    pub condition: String,
    /// The state that it is about; `None`: a cold start.
    pub begin: Option<HowBegin>,
    /// The scan period.
    pub period: ScanPeriod,
    /// What an operator may write.
    pub writes: Vec<String>,
    /// What was found.
    pub verdict: HowVerdict,
    /// The time that it took, ms.
    pub ms: u128,
}

/// The state of a recorded controller, for people.
#[derive(Clone, Debug)]
pub struct HowBegin {
    /// The number of its last scan; the first of a process is 1.
    pub scan: Option<u64>,
    /// The time of that scan, ns since 1970 (UTC).
    pub unix_ns: Option<i64>,
    /// The names of what is forced, and stays so.
    pub forced: Vec<String>,
    /// The names of the field devices that are lost, and stay so.
    pub lost: Vec<String>,
}

/// What was found.
#[derive(Clone, Debug)]
pub enum HowVerdict {
    /// It is true in the state that it is about.
    Holds,
    /// It is true behind some inputs, which were tried.
    Found {
        /// The way that has found them.
        way: &'static str,
        /// The number of scans, the last of which it is true behind.
        scan: u64,
        /// What to do, as a sentence.
        sentence: String,
        /// The same, change by change.
        changes: Vec<InputChange>,
        /// The same as a scenario.
        scenario: String,
    },
    /// No inputs lead there, however long.
    Never {
        /// How that was proved.
        way: Way,
        /// The results that had any value.
        any: Vec<String>,
    },
    /// Neither.
    Open {
        /// What was looked at.
        covered: Vec<String>,
        /// What stood in the way.
        cause: String,
    },
}

impl HowAnswer {
    /// Its word.
    pub fn word(&self) -> &'static str {
        match self.verdict {
            HowVerdict::Holds => "holds",
            HowVerdict::Found { .. } => "found",
            HowVerdict::Never { .. } => "cannot be",
            HowVerdict::Open { .. } => "not decided",
        }
    }

    /// Its text, but for the time of the state: a line, and indented lines below it.
    pub fn text(&self) -> String {
        let fact = said(&self.condition);
        let mut text = match &self.verdict {
            HowVerdict::Holds => format!("{fact} now\n"),
            HowVerdict::Found { sentence, .. } => format!("{sentence}\n"),
            HowVerdict::Never { .. } => format!("{} cannot be: proved\n", self.condition),
            HowVerdict::Open { .. } => {
                format!("{}: not found within {}\n", self.condition, seconds(self.ms))
            }
        };
        let mut add = |line: &str| text += &format!("  {line}\n");
        match &self.verdict {
            HowVerdict::Holds => {}
            HowVerdict::Found { scan, .. } => {
                add(&format!("{}, by the shortest inputs that were found", self.when(*scan)));
            }
            HowVerdict::Never { way, any } => {
                add(&way.text());
                any.iter().for_each(|any| add(&format!("any value: {any}")));
                match self.writes.is_empty() {
                    true => add("by inputs alone: nobody writes anything"),
                    false => add(&format!("whatever is written into {}", self.writes.join(", "))),
                }
            }
            HowVerdict::Open { covered, cause } => {
                add(&format!("stood in the way: {cause}"));
                covered.iter().for_each(|covered| add(covered));
            }
        }
        if let Some(HowBegin { forced, lost, .. }) = &self.begin {
            if !forced.is_empty() {
                add(&format!("forced, and stays so: {}", forced.join(", ")));
            }
            if !lost.is_empty() {
                add(&format!("lost, and stays so: {}", lost.join(", ")));
            }
        }
        if let HowVerdict::Found { scenario, .. } = &self.verdict {
            text += "\n";
            scenario.lines().for_each(|line| text += &format!("    {line}\n"));
        }
        text
    }

    /// The scan behind which it is true, with its time.
    fn when(&self, scan: u64) -> String {
        let time = |scans: u64| time_text(scans * self.period.ns());
        match &self.begin {
            None => format!("at scan {} ({})", thousands(scan), time(scan.saturating_sub(1))),
            Some(HowBegin { scan: Some(last), .. }) => {
                let (scans, last) = (counted(scan, "scan"), thousands(*last));
                format!("{scans} ({}) behind scan {last}", time(scan))
            }
            Some(_) => format!("{} ({}) later", counted(scan, "scan"), time(scan)),
        }
    }

    /// It as JSON.
    pub fn json(&self) -> Value {
        let mut all = json!({
            "condition": self.condition,
            "answer": self.word(),
            "ms": self.ms as u64,
            "writes": self.writes,
            "from": self.begin.as_ref().map(HowBegin::json),
        });
        match &self.verdict {
            HowVerdict::Holds => {}
            HowVerdict::Found { way, scan, sentence, changes, scenario } => {
                all["way"] = json!(way);
                all["scan"] = json!(scan);
                all["text"] = json!(sentence);
                all["changes"] = changes.iter().map(InputChange::json).collect();
                all["scenario"] = json!(scenario);
            }
            HowVerdict::Never { way, any } => {
                way.add_json(&mut all);
                all["cuts"] = json!(any);
            }
            HowVerdict::Open { covered, cause } => {
                all["cause"] = json!(cause);
                all["covered"] = json!(covered);
            }
        }
        all
    }
}

impl HowBegin {
    fn json(&self) -> Value {
        json!({
            "scan": self.scan,
            "unix_ns": self.unix_ns,
            "forced": self.forced,
            "lost": self.lost,
        })
    }
}

fn seconds(ms: u128) -> String {
    time_text(u64::try_from(ms).unwrap_or(u64::MAX / 1_000_000).max(1) * 1_000_000)
}
