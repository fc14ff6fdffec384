//! The answers that are kept beside a test file, so that what has not changed is not proved again.
//!
//! `rungd prove` reads and writes `NAME.proof.toml`; `decide` asks for the answer with the hash of
//! a question. Only proofs are kept: a violation is executed each time. A file that is no such file
//! keeps nothing.

use std::fmt::Write as _;

use crate::answer::{Answer, AnswerVerdict, Way};
use crate::cone::Cone;
use crate::model::Target;
use rungd_language::source::key::key;
use rungd_language::source::reader::{self, Table};
use rungd_language::source::span::FileId;

/// The answers about the lines of a test file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeptAnswers {
    /// In the order of the file.
    pub proved: Vec<KeptAnswer>,
}

/// A line that was proved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptAnswer {
    /// The line.
    pub line: String,
    /// The hash of its question.
    pub hash: String,
    /// How it was proved.
    pub way: Way,
    /// The results that had any value.
    pub cuts: Vec<String>,
    /// Why the proof says nothing.
    pub vacuous: Option<String>,
}

impl KeptAnswer {
    /// What is kept of an answer, if it is a proof of a line of `always`.
    pub fn of(answer: &Answer) -> Option<KeptAnswer> {
        let AnswerVerdict::Proved { way, .. } = answer.verdict else { return None };
        if answer.is_can {
            return None;
        }
        Some(KeptAnswer {
            line: answer.line.clone(),
            hash: answer.hash.clone(),
            way,
            cuts: answer.cuts.clone(),
            vacuous: answer.vacuous.clone(),
        })
    }
}

impl KeptAnswers {
    /// Reads a file.
    pub fn read(text: &str) -> KeptAnswers {
        let (answers, findings) = reader::document(text, FileId(0), |mut root| {
            let proved = root.tables(key("proved", "A line that was proved."), "a proof");
            let proved = proved.into_iter().filter_map(read_answer).collect();
            root.finish();
            proved
        });
        let proved = answers.filter(|_| findings.is_empty()).unwrap_or_default();
        KeptAnswers { proved }
    }

    /// The file.
    pub fn text(&self) -> String {
        let mut text =
            "# Made by `rungd prove`. An answer holds as long as the hash of its question \
                        is the same.\n"
                .to_owned();
        for KeptAnswer { line, hash, way, cuts, vacuous } in &self.proved {
            let quoted = |text: &str| serde_json::Value::from(text).to_string();
            let (name, number) = way.word_and_number();
            let _ = write!(
                text,
                "\n[[proved]]\nline   = {}\nhash   = \"{hash}\"\nway    = \"{name}\"\n\
                 number = {number}\n",
                quoted(line)
            );
            if !cuts.is_empty() {
                let cuts: Vec<String> = cuts.iter().map(|cut| quoted(cut)).collect();
                let _ = writeln!(text, "cuts   = [{}]", cuts.join(", "));
            }
            if let Some(vacuous) = vacuous {
                let _ = writeln!(text, "says-nothing = {}", quoted(vacuous));
            }
        }
        text
    }

    /// The answer with the hash of a question.
    pub fn find(&self, line: &str, hash: &str) -> Option<&KeptAnswer> {
        self.proved.iter().find(|kept| kept.line == line && kept.hash == hash)
    }
}

fn read_answer(mut table: Table<'_>) -> Option<KeptAnswer> {
    let text = |table: &mut Table<'_>, name| table.string(key(name, "As it was proved."));
    let line = text(&mut table, "line");
    let hash = text(&mut table, "hash");
    let way = text(&mut table, "way");
    let number = table.integer(key("number", "The size of the proof."), 0..=i64::MAX);
    let cuts = table.strings(key("cuts", "What had any value."));
    let vacuous = text(&mut table, "says-nothing").map(|text| text.text);
    table.finish();
    Some(KeptAnswer {
        line: line?.text,
        hash: hash?.text,
        way: Way::of_word(&way?.text, number?.value.unsigned_abs())?,
        cuts: cuts.map_or(Vec::new(), |cuts| cuts.value.into_iter().map(|cut| cut.text).collect()),
        vacuous,
    })
}

/// The hash of a question: of the gates of its cone, of what it asks, and of this version of rungd.
/// Gates have no cell numbers, so an edit elsewhere does not change them. Where something has no
/// gates, the operations count too.
pub(crate) fn hash(cone: &Cone, target: Target, settings: &str) -> String {
    let model = &cone.model;
    let gates = cone.gates();
    let mut hashed = QuestionHash(hmac_sha256::Hash::new());
    let version = env!("CARGO_PKG_VERSION");
    // Writing to a hash does not fail.
    let _ = write!(
        hashed,
        "{version} {settings} {} {} {}",
        target.value,
        model.period_ms(),
        model.late_max
    );
    let free: Vec<(i32, i32)> = model.inputs.iter().map(|free| (free.low, free.high)).collect();
    let _ = write!(hashed, "{free:?} {:?} {:?}", gates.graph.nodes(), gates.constraints);
    let _ = write!(hashed, "{:?} {:?}", gates.judged, gates.free);
    for latch in &gates.latches {
        let _ = write!(hashed, "{:?} {:?} {:?} ", latch.literal, latch.next, latch.initial);
    }
    if !gates.cuts.is_empty() {
        let _ = write!(hashed, "{:?} {:?}", model.start, model.code);
    }
    hashed.0.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

/// Hashes a text that is written in parts, without keeping it.
struct QuestionHash(hmac_sha256::Hash);

impl std::fmt::Write for QuestionHash {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}
