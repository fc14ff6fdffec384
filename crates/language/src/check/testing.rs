//! Helpers for the tests of all rules: they print the findings of a ladder text.

use expect_test::Expect;

use super::{CheckInputs, OutsideOperands, OutsideRead};
use crate::resolve::operands::{numbers, resolve_operands};
use crate::resolve::program::Program;
use crate::resolve::range::{Range, resolve_range};
use crate::resolve::{LoadOptions, load_ladders};
use crate::source::finding::{Code, Finding};
use crate::source::reader::Text;
use crate::source::span::{SourceFile, Span};
use rungd_engine::isa::NumberRanges;

/// Loads the ladder, checks it, silences allowed warnings and compares the findings. Indentation
/// and blank lines around the text do not count. `never-written` is left out, because the ladders
/// of tests read addresses that nothing writes.
pub fn check(ladder: &str, expected: Expect) {
    compare(ladder, |code| code != Code::NeverWritten, expected);
}

/// As [`check`], for the findings of one code.
pub fn check_only(code: Code, ladder: &str, expected: Expect) {
    compare(ladder, |found| found == code, expected);
}

/// As [`check_only`], without the helps.
pub fn check_heads(code: Code, ladder: &str, expected: Expect) {
    let lines: Vec<&str> = ladder.trim().lines().map(str::trim_start).collect();
    let ladder = lines.join("\n");
    let mut findings = findings(&ladder);
    findings.retain(|finding| finding.code == code);
    let file = SourceFile { name: String::new(), text: ladder };
    let head = |finding: &Finding| {
        let (line, column) = file.line_column(finding.span.start);
        format!("{line}:{column} {}\n", finding.message)
    };
    expected.assert_eq(&findings.iter().map(head).collect::<String>());
}

fn compare(ladder: &str, shows: impl Fn(Code) -> bool, expected: Expect) {
    let lines: Vec<&str> = ladder.trim().lines().map(str::trim_start).collect();
    let ladder = lines.join("\n");
    let mut findings = findings(&ladder);
    findings.retain(|finding| shows(finding.code));
    expected.assert_eq(&print(&ladder, &findings));
}

/// As [`check`], for rungs of `Main`, one inline table on each line: rung k is in line k + 3.
pub fn check_main(rungs: &str, expected: Expect) {
    check(&main(rungs), expected);
}

/// A ladder of these rungs.
pub fn main(rungs: &str) -> String {
    let rungs: Vec<&str> = rungs.trim().lines().map(str::trim_start).collect();
    format!("[[program]]\nname = \"Main\"\nrung = [\n{}\n]", rungs.join("\n"))
}

/// As [`check_main`], with a controller file that retains these ranges.
pub fn check_retained(ranges: &[&str], rungs: &str, expected: Expect) {
    compare_retained(ranges, false, rungs, &expected);
}

/// As [`check_retained`], for what `[retain] tags` names.
pub fn check_retained_tags(tags: &[&str], rungs: &str, expected: Expect) {
    compare_retained(tags, true, rungs, &expected);
}

fn compare_retained(ranges: &[&str], of_tag: bool, rungs: &str, expected: &Expect) {
    let ladder = main(rungs);
    let (program, _) = load(&ladder);
    let program = program.expect("the ladder has no errors");
    let scope = program.scope();
    let range = |text: &&str| {
        let text = Text { text: (*text).to_owned(), span: Span::default(), exact: true };
        Range { of_tag, ..resolve_range(scope, &text).expect("a range") }
    };
    let retained: Vec<_> = ranges.iter().map(range).collect();
    expected.assert_eq(&print(&ladder, &super::check(&program, CheckInputs::of(&retained))));
}

/// As [`check_main`], with a controller file and all findings. A device moves X0, C1, D1 and R1;
/// Modbus clients write MC1, MHR1 and the accumulator of CT1, and MC5, which X5 follows.
pub fn check_outside(rungs: &str, expected: Expect) {
    let ladder = main(rungs);
    let program = load(&ladder).0.expect("the ladder has no errors");
    let scope = program.scope();
    let text = |source: &str| Text { text: source.to_owned(), span: Span::default(), exact: true };
    let address = |name: &str| scope.address(name).expect("an address");
    let range = |name: &str| resolve_range(scope, &text(name)).expect("a range");
    let mut listed = NumberRanges::default();
    for name in ["MC1", "MHR1", "CT1.Acc"] {
        listed.add(numbers(address(name), 1), 0);
    }
    let outside = OutsideOperands {
        moved: ["X0", "C1", "D1", "R1"].map(address).into_iter().collect(),
        listed,
        image: ["MC5", "X5"].map(range).into(),
        wired: Some(Span::default()),
        reads: Vec::new(),
    };
    let around = CheckInputs { outside: Some(&outside), ..CheckInputs::of(&[]) };
    expected.assert_eq(&print(&ladder, &super::check(&program, around)));
}

/// As [`check_outside`], with parts of a controller file that read: each has its operands, with
/// spaces between those of several parts, and the text of its action. Compares only the findings of
/// these parts.
pub fn check_read_outside(rungs: &str, reads: &[(&str, &str)], expected: Expect) {
    let ladder = main(rungs);
    let program = load(&ladder).0.expect("the ladder has no errors");
    let scope = program.scope();
    let address = |name: &str| scope.address(name).expect("an address");
    let read = |name: &str, reader: &str| {
        let text = Text { text: name.to_owned(), span: Span::default(), exact: true };
        let operands = resolve_operands(scope, &text).expect("operands");
        OutsideRead::new(operands.first, operands.count, Span::default(), reader.to_owned())
    };
    let reads = reads.iter().flat_map(|&(names, reader)| {
        names.split(' ').map(|name| read(name, reader)).collect::<Vec<_>>()
    });
    let outside = OutsideOperands {
        moved: ["D1", "R1", "MC1"].map(address).into_iter().collect(),
        reads: reads.collect(),
        ..OutsideOperands::default()
    };
    let around = CheckInputs { outside: Some(&outside), ..CheckInputs::of(&[]) };
    let mut findings = super::check(&program, around);
    findings.retain(|finding| finding.span == Span::default());
    expected.assert_eq(&print(&ladder, &findings));
}

/// The findings of a ladder.
fn findings(ladder: &str) -> Vec<Finding> {
    let (program, mut findings) = load(ladder);
    let Some(program) = program else { return findings };
    findings.extend(super::check(&program, CheckInputs::of(&[])));
    super::silence(&program, findings, None)
}

/// The resolved program of a ladder, and the findings of reading and resolving it.
pub fn load(ladder: &str) -> (Option<Program>, Vec<Finding>) {
    let file = SourceFile { name: "test.toml".to_owned(), text: ladder.to_owned() };
    load_ladders(&[file], &LoadOptions::default())
}

/// Each finding as `line:col name`, the message and, indented, the help; long lines are folded.
fn print(ladder: &str, findings: &[Finding]) -> String {
    let file = SourceFile { name: String::new(), text: ladder.to_owned() };
    let mut text = String::new();
    for finding in findings {
        let (line, column) = file.line_column(finding.span.start);
        text.push_str(&format!("{line}:{column} {}\n", finding.code.name()));
        fold(&finding.message, "  ", &mut text);
        finding.help_text().iter().flat_map(|help| help.lines()).for_each(|line| {
            fold(line, "    ", &mut text);
        });
    }
    text
}

fn fold(line: &str, indent: &str, text: &mut String) {
    let mut width = 0;
    for word in line.split_whitespace() {
        let fits = width > 0 && width + 1 + word.len() <= 72;
        if width > 0 && !fits {
            text.push('\n');
        }
        text.push_str(if fits { " " } else { indent });
        text.push_str(word);
        width = word.len() + if fits { width + 1 } else { 0 };
    }
    text.push('\n');
}
