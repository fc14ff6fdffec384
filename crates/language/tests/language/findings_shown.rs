//! Many findings, and findings in generated files: the number of printed findings, and their
//! lengths.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::{FileId, SourceFile, Span};

fn place(start: usize, end: usize) -> Span {
    Span { file: FileId(0), start: start as u32, end: end as u32 }
}

fn file(text: String) -> Vec<SourceFile> {
    vec![SourceFile { name: "ladder.toml".to_owned(), text }]
}

/// The printed form of a finding about the part `here` of a line.
#[track_caller]
fn shown(before: &str, here: &str, behind: &str) -> String {
    let span = place(before.len(), before.len() + here.len());
    let finding = Finding::new(Code::UnknownName, span, "no such name").label("this");
    render(&[finding], &file(format!("{before}{here}{behind}")), Style::default())
}

/// The part of the source line that a caret line points at.
fn pointed_at(said: &str) -> String {
    let lines: Vec<&str> = said.lines().collect();
    let at = lines.iter().position(|line| line.contains('^')).unwrap();
    let caret = lines[at].find('^').unwrap();
    let count = lines[at].matches('^').count();
    lines[at - 1].chars().skip(caret).take(count).collect()
}

#[test]
fn a_long_line_is_cut_around_the_span_and_the_caret_is_aligned() {
    let long = "\"abcdefgh\", ".repeat(50_000);
    for (before, behind) in [
        (long.clone(), long.clone()),
        (long.clone(), String::new()),
        (String::new(), long.clone()),
        (format!("# one\n{long}"), format!("{long}\n# three\n")),
        (format!("# one\n{}", "\"tägé\", ".repeat(9_000)), long.clone()),
    ] {
        let said = shown(&before, "jam", &behind);
        assert!(said.len() < 2_000, "{} bytes", said.len());
        assert_eq!(pointed_at(&said), "jam", "{said}");
        let line = before.matches('\n').count() + 1;
        let column = before[before.rfind('\n').map_or(0, |at| at + 1)..].chars().count() + 1;
        let head = format!("ladder.toml:{line}:{column}\n");
        assert!(said.contains(&head), "{head}{said}");
        assert_eq!(said.contains(" ..."), column > 1, "{said}");
    }
}

#[test]
fn a_long_span_is_cut() {
    let long = "x".repeat(300_000);
    let said = shown("when = [\"", &long, "\"]");
    assert!(said.len() < 4_000, "{} bytes", said.len());
    assert!(said.contains("ladder.toml:1:10\n"), "{said}");
}

#[test]
fn a_distant_related_span_on_the_same_line_has_its_own_excerpt() {
    let long = "\"abcdefgh\", ".repeat(50_000);
    let text = format!("jam{long}jam{long}");
    let second = place(3 + long.len(), 6 + long.len());
    let finding = Finding::new(Code::DuplicateName, second, "two things bear one name")
        .label("the second")
        .related(place(0, 3), "the first");
    let said = render(&[finding], &file(text), Style::default());
    assert!(said.len() < 4_000, "{} bytes", said.len());
    let column = 4 + long.len();
    assert!(said.contains(&format!("--> ladder.toml:1:{column}\n")), "{said}");
    assert!(said.contains("::: ladder.toml:1:1\n"), "{said}");
}

fn many(errors: usize, warnings: usize) -> Vec<Finding> {
    let new = |n: usize| {
        let code = if n < warnings { Code::UnusedTag } else { Code::UnknownName };
        Finding::new(code, place(12 * n + 1, 12 * n + 9), format!("number {n}"))
    };
    (0..warnings + errors).map(new).collect()
}

#[test]
fn at_most_100_findings_are_shown_errors_first_and_all_are_counted() {
    let text = "\"abcdefgh\", ".repeat(20_000);
    let shown = |findings: &[Finding]| render(findings, &file(text.clone()), Style::default());
    let said = shown(&many(10_000, 0));
    assert_eq!(said.matches("error[").count(), 100);
    assert!(said.ends_with("and 9900 more errors\n\n10000 errors, 0 warnings\n"), "{said}");
    let said = shown(&many(30, 5_000));
    assert_eq!((said.matches("error[").count(), said.matches("warning[").count()), (30, 70));
    assert!(said.ends_with("and 4930 more warnings\n\n30 errors, 5000 warnings\n"), "{said}");
    let said = shown(&many(101, 1));
    assert!(said.ends_with("and 1 more error, 1 more warning\n\n101 errors, 1 warning\n"));
    let said = shown(&many(50, 50));
    assert_eq!(said.matches("number ").count(), 100);
    assert!(!said.contains("more"), "{said}");
}

#[test]
fn colored_output_shows_the_same_place() {
    let text = "\"abcdefgh\", ".repeat(20_000);
    let style = Style { color: true, deny_warnings: true };
    let said = render(&many(0, 150)[149..], &file(text), style);
    assert!(said.contains("ladder.toml:1:1790"), "{said:?}");
    assert!(!said.contains('\u{1}') && said.ends_with("1 error, 0 warnings\n"), "{said:?}");
}

#[test]
fn windows_line_endings_and_control_characters_in_file_names_are_not_drawn() {
    let text = "[tags]\r\nrung = [\r\n  \"jam\",\r\n]\r\n".to_owned();
    let at = text.find("jam").unwrap();
    let finding = Finding::new(Code::UnknownName, place(at, at + 3), "`b\r\n c` is nothing")
        .related(place(0, 6), "the first");
    let files = vec![SourceFile { name: "ev\u{1b}[31mil\n.toml".to_owned(), text }];
    let said = render(&[finding], &files, Style::default());
    assert!(said.contains("--> ev\\u{1b}[31mil\\n.toml:3:4\n"), "{said}");
    assert!(said.contains("`b\\r\\n c` is nothing"), "{said}");
    assert!(!said.contains(['\u{1b}', '\r', '\u{240d}']), "{said}");
    assert_eq!(said.lines().filter(|line| line.ends_with("^^^")).count(), 1, "{said}");
}

/// C1 controls and signs that turn the direction of writing, in an excerpt and before its place.
#[test]
fn no_character_of_a_file_moves_the_cursor_or_changes_the_text_direction() {
    let obeyed: String = ('\u{1}'..='\u{9f}')
        .filter(|c| c.is_control() && !matches!(c, '\t' | '\n' | '\r'))
        .chain(['\u{200e}', '\u{200f}', '\u{61c}'])
        .chain('\u{202a}'..='\u{202e}')
        .chain('\u{2066}'..='\u{2069}')
        .collect();
    let text = format!("# {obeyed}\nat = \"{obeyed}X9\" # {obeyed}\n");
    let at = text.find("X9").unwrap();
    let finding = Finding::new(Code::UnknownName, place(at, at + 2), "there is no such place")
        .related(place(0, 1), "the first");
    let said = render(&[finding], &file(text), Style::default());
    assert!(!said.contains(|c| c != '\n' && obeyed.contains(c)), "{said:?}");
    let marked = said.lines().find(|line| line.contains("at = ")).unwrap();
    let marks = said.lines().find(|line| line.ends_with("^^")).unwrap();
    let column = |line: &str, of: &str| line.split(of).next().unwrap().chars().count();
    assert_eq!(column(marked, "X9"), column(marks, "^^"), "{said}");
}
