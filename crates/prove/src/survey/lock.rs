//! What has changed since a survey was written: line by line, each with a scenario.
//!
//! Called by `rungd prove --survey --check`. The file has the lines of a survey, and a line begins
//! with what it is about. What a ladder can do now is shown by a scenario; of what it can do no
//! more there is none, because no sequence of inputs leads there.

use std::collections::HashMap;

use serde_json::{Value, json};

use super::facts::{Fact, Possibility};
use super::surveyed::Survey;

/// A line that has changed.
#[derive(Clone, Debug)]
pub struct SurveyChange {
    /// What it is about.
    pub subject: String,
    /// What was said of it; `None`: nothing.
    pub was: Option<String>,
    /// What is said of it now; `None`: nothing.
    pub is: Option<String>,
    /// What shows that something can be now; executed.
    pub scenario: Option<String>,
    /// Whether something that could be is now proved to be never so.
    pub is_excluded: bool,
}

impl Survey {
    /// The differences from a survey that was written.
    pub fn changes(&self, written: &str) -> Vec<SurveyChange> {
        let lines: Vec<(&str, &str)> =
            written.lines().filter_map(|line| line.split_once(": ")).collect();
        let old: HashMap<&str, &str> = lines.iter().copied().collect();
        let mut all = Vec::new();
        for fact in &self.facts {
            let was = old.get(fact.subject.as_str()).copied();
            if was != fact.verdict() {
                all.push(self.change(fact, was));
            }
        }
        let known: HashMap<&str, &Fact> =
            self.facts.iter().map(|fact| (fact.subject.as_str(), fact)).collect();
        for (subject, was) in lines {
            if !known.contains_key(subject) {
                all.push(SurveyChange {
                    subject: subject.to_owned(),
                    was: Some(was.to_owned()),
                    is: None,
                    scenario: None,
                    is_excluded: false,
                });
            }
        }
        all
    }

    fn change(&self, fact: &Fact, was: Option<&str>) -> SurveyChange {
        let could = fact.kind.answers_of(was);
        let could = |at: usize| could.get(at).copied().flatten();
        let new = (0..fact.answers.len()).rev().find(|at| {
            matches!(fact.answers[*at], Possibility::Can(_)) && could(*at) != Some(true)
        });
        let lost = (0..fact.answers.len())
            .any(|at| fact.answers[at] == Possibility::Never && could(at) == Some(true));
        SurveyChange {
            subject: fact.subject.clone(),
            was: was.map(str::to_owned),
            is: fact.verdict().map(str::to_owned),
            scenario: new.and_then(|at| self.scenario(fact, at)),
            is_excluded: lost,
        }
    }
}

impl SurveyChange {
    /// Its text: a line, and indented lines below it.
    pub fn text(&self) -> String {
        let said = |said: &Option<String>| said.clone().unwrap_or("nothing to say".to_owned());
        let mut text = format!("changed: {}\n", self.subject);
        text += &format!("  was: {}\n  is:  {}\n", said(&self.was), said(&self.is));
        if self.is_excluded {
            text += "  no sequence of inputs leads there any more: proved\n";
        }
        if let Some(scenario) = &self.scenario {
            text += "\n";
            scenario.lines().for_each(|line| text += &format!("    {line}\n"));
            text += "\n";
        }
        text
    }

    /// It as JSON.
    pub fn json(&self) -> Value {
        json!({
            "subject": self.subject,
            "was": self.was,
            "is": self.is,
            "scenario": self.scenario,
            "excluded": self.is_excluded,
        })
    }
}
