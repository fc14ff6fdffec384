//! One door for the tests of all rules: ladder text in, one line a finding out.

use expect_test::Expect;

use crate::resolve::{LoadOptions, load_ladders};
use crate::source::finding::Finding;
use crate::source::span::SourceFile;

/// Loads the ladder, checks it and silences what it allows. Indentation and blank lines around it
/// do not count.
pub fn check(ladder: &str, expected: Expect) {
    let lines: Vec<&str> = ladder.trim().lines().map(str::trim_start).collect();
    let ladder = lines.join("\n");
    expected.assert_eq(&print(&ladder, &findings(&ladder)));
}

/// [`check`] of rungs of `Main`, one inline table a line: rung k stands in line k + 3.
pub fn check_main(rungs: &str, expected: Expect) {
    check(&format!("[[program]]\nname = \"Main\"\nrung = [\n{}\n]", rungs.trim()), expected);
}

/// The findings of a ladder.
pub fn findings(ladder: &str) -> Vec<Finding> {
    let file = SourceFile { name: "test.toml".to_owned(), text: ladder.to_owned() };
    let (program, mut findings) = load_ladders(&[file], &LoadOptions::default());
    let Some(program) = program else { return findings };
    findings.extend(super::check(&program, &[]));
    super::silence(&program, findings)
}

/// `line:col name message`, and the help below it.
fn print(ladder: &str, findings: &[Finding]) -> String {
    let file = SourceFile { name: String::new(), text: ladder.to_owned() };
    let mut text = String::new();
    for finding in findings {
        let (line, column) = file.line_column(finding.span.start);
        let help = finding.help.as_deref().unwrap_or("none");
        text.push_str(&format!("{line}:{column} {} {}\n", finding.code.name(), finding.message));
        help.lines().for_each(|line| text.push_str(&format!("    {line}\n")));
    }
    text
}
