//! Verdicts in formats for programs: JUnit XML, which every CI reads, and JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::failure::{Failure, SeenOperand};
use super::runner::TestVerdict;
use super::unmoved::UnmovedNames;
use crate::svg::escaped;

/// The verdicts of one test file.
#[derive(Clone, Debug)]
pub struct FileVerdicts {
    /// The displayed name of the file.
    pub file: String,
    /// The verdicts, in file order.
    pub verdicts: Vec<TestVerdict>,
}

/// The verdicts as JUnit XML. Its times are virtual, so that the same tests give the same bytes.
pub fn junit(files: &[FileVerdicts]) -> String {
    let count =
        |count_in: &dyn Fn(&FileVerdicts) -> usize| files.iter().map(count_in).sum::<usize>();
    let (tests, failed) = (count(&|file| file.verdicts.len()), count(&FileVerdicts::failed));
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(text, "<testsuites tests=\"{tests}\" failures=\"{failed}\">");
    for file in files {
        let (name, count, failed) = (escaped(&file.file), file.verdicts.len(), file.failed());
        let _ = writeln!(
            text,
            "  <testsuite name=\"{name}\" tests=\"{count}\" failures=\"{failed}\" errors=\"0\" \
             skipped=\"0\">"
        );
        file.verdicts.iter().for_each(|verdict| text += &case(&file.file, verdict));
        text += "  </testsuite>\n";
    }
    text + "</testsuites>\n"
}

fn case(file: &str, verdict: &TestVerdict) -> String {
    let (class, name, line) = (escaped(file), escaped(&verdict.name), verdict.line);
    let seconds = verdict.virtual_ns as f64 / 1e9;
    let head = format!(
        "    <testcase classname=\"{class}\" name=\"{name}\" file=\"{class}\" line=\"{line}\" \
         time=\"{seconds:.3}\""
    );
    let Some(failure) = &verdict.failure else { return format!("{head}/>\n") };
    let message = escaped(&format!("{}: {}", failure.text, failure.what));
    let text = escaped(&failure.text(file));
    format!("{head}>\n      <failure message=\"{message}\">{text}</failure>\n    </testcase>\n")
}

/// The verdicts as JSON: one object for all files.
pub fn json(files: &[FileVerdicts]) -> Value {
    let of_file = |verdicts: &FileVerdicts| {
        let tests: Vec<Value> = verdicts.verdicts.iter().map(of_verdict).collect();
        json!({ "file": verdicts.file, "failed": verdicts.failed(), "tests": tests })
    };
    let failed: usize = files.iter().map(FileVerdicts::failed).sum();
    json!({ "failed": failed, "files": files.iter().map(of_file).collect::<Vec<_>>() })
}

fn of_verdict(verdict: &TestVerdict) -> Value {
    json!({
        "name": verdict.name,
        "line": verdict.line,
        "passed": verdict.failure.is_none(),
        "runs": verdict.runs,
        "scans": verdict.scans,
        "virtual_ms": verdict.virtual_ns / 1_000_000,
        "unmoved": of_unmoved(&verdict.unmoved),
        "failure": verdict.failure.as_deref().map(of_failure),
    })
}

fn of_unmoved(unmoved: &UnmovedNames) -> Value {
    json!({
        "never_on": unmoved.never_on,
        "never_off": unmoved.never_off,
        "never_moved": unmoved.never_moved,
        "never_changed": unmoved.never_changed,
    })
}

fn of_failure(failure: &Failure) -> Value {
    let operand = |operand: &SeenOperand| {
        let changes: Vec<Value> = operand
            .changes
            .iter()
            .map(|at| json!({ "scan": at.scan, "ms": at.now_ns / 1_000_000, "value": at.value }))
            .collect();
        let mut json = json!({ "name": operand.name, "value": operand.value, "changes": changes });
        if let Some(scan) = operand.on_within {
            json["on_within_scan"] = scan.into();
        }
        json
    };
    json!({
        "step": failure.step.map(|(step, _)| step),
        "line": failure.place.0,
        "column": failure.place.1,
        "text": failure.text,
        "what": failure.what,
        "scan": failure.scan,
        "ms": failure.now_ns / 1_000_000,
        "operands": failure.operands.iter().map(operand).collect::<Vec<_>>(),
        "devices": failure.troubles,
        "why": failure.why,
        "scenario": failure.scenario,
        "findings": failure.findings,
    })
}

impl FileVerdicts {
    /// The number of failed tests.
    pub fn failed(&self) -> usize {
        self.verdicts.iter().filter(|verdict| verdict.failure.is_some()).count()
    }
}
