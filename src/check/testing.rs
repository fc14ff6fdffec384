//! Helpers for the tests of all rules: from a ladder text to its findings, printed.

use expect_test::Expect;

use super::Around;
use crate::resolve::program::Program;
use crate::resolve::range::resolve_range;
use crate::resolve::scope::Scope;
use crate::resolve::{LoadOptions, load_ladders};
use crate::source::finding::Finding;
use crate::source::reader::Text;
use crate::source::span::{SourceFile, Span};

/// Loads the ladder, checks it, silences allowed warnings and compares the findings. Indentation
/// and blank lines around the text do not count.
pub fn check(ladder: &str, expected: Expect) {
    let lines: Vec<&str> = ladder.trim().lines().map(str::trim_start).collect();
    let ladder = lines.join("\n");
    expected.assert_eq(&print(&ladder, &findings(&ladder)));
}

/// As [`check`], for rungs of `Main`, one inline table on each line: rung k is in line k + 3.
pub fn check_main(rungs: &str, expected: Expect) {
    check(&format!("[[program]]\nname = \"Main\"\nrung = [\n{}\n]", rungs.trim()), expected);
}

/// As [`check_main`], with a controller file that retains these ranges.
pub fn check_retained(ranges: &[&str], rungs: &str, expected: Expect) {
    let rungs: Vec<&str> = rungs.trim().lines().map(str::trim_start).collect();
    let ladder = format!("[[program]]\nname = \"Main\"\nrung = [\n{}\n]", rungs.join("\n"));
    let (program, _) = load(&ladder);
    let program = program.expect("the ladder has no errors");
    let scope = Scope::of(&program);
    let range = |text: &&str| {
        let text = Text { text: (*text).to_owned(), span: Span::default(), exact: true };
        resolve_range(&scope, &text).expect("a range")
    };
    let retained: Vec<_> = ranges.iter().map(range).collect();
    expected.assert_eq(&print(&ladder, &super::check(&program, Around::of(&retained))));
}

/// The findings of a ladder.
fn findings(ladder: &str) -> Vec<Finding> {
    let (program, mut findings) = load(ladder);
    let Some(program) = program else { return findings };
    findings.extend(super::check(&program, Around::of(&[])));
    super::silence(&program, findings)
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
