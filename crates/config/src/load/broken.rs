//! Tests of files that are not TOML as a whole: the findings in the rest of the file, for every
//! kind of file, and that such a file gives no program. `crates/language/tests/language/broken.rs`
//! breaks the shipped files.

use crate::load::{InputFile, Loaded, ladder_inputs, recorded_files};
use rungd_base::random::SplitMix64;
use rungd_language::source::finding::Code;
use rungd_language::source::span::SourceFile;

fn load(text: &str) -> Loaded {
    ladder_inputs(&[InputFile { path: "ladder.toml".into(), bytes: text.into() }]).unwrap()
}

/// The line and the name of each finding.
fn finding_lines(loaded: &Loaded) -> Vec<String> {
    assert!(loaded.program.is_none() && loaded.controller.is_none());
    let line = |place: rungd_language::source::span::Span| {
        loaded.files[place.file.0 as usize].line_column(place.start).0
    };
    loaded
        .findings
        .iter()
        .map(|finding| format!("{} {}", line(finding.span), finding.code.name()))
        .collect()
}

const MAIN: &str = "[[program]]\nname = \"Main\"\n";

#[test]
fn the_rest_of_a_broken_ladder_is_checked() {
    let rungs = "[[program.rung]]\nwhen = [\"X0\"\ndo = [\"OUT Y0\"]\n\
                 [[program.rung]]\nwhen = [\"D0\", \"nope\"]\ndo = [\"OUTT Y1\", \"OUT Y0\"]\n";
    let expected = [
        "5 toml-syntax",
        "7 operand-type",
        "7 unknown-name",
        "8 unknown-instruction",
        "8 duplicate-out",
    ];
    assert_eq!(finding_lines(&load(&format!("{MAIN}{rungs}"))), expected);
}

#[test]
fn a_name_possibly_declared_in_a_broken_part_is_not_reported() {
    let rung = "[[program.rung]]\nwhen = [\"lamp\", \"lmap\"]\ndo = [\"OUT Y0\"]\n";
    let findings_of = |tags: &str| finding_lines(&load(&format!("[tags]\n{tags}\n{MAIN}{rung}")));
    assert_eq!(findings_of("lamp = { at = \"Y1\""), ["3 toml-syntax", "6 unknown-name"]);
    assert_eq!(findings_of("la\"mp = { at = \"Y1\" }"), ["2 toml-syntax"]);
    assert_eq!(findings_of("lamp { at = \"Y1\" }"), ["2 toml-syntax"]);
}

#[test]
fn a_missing_part_of_a_broken_file_is_not_reported() {
    let lone = "[ladder]\norder = [\"Main\"]\n[tags]\n\
                lamp = { at = \"Y0\" }\n[[program]\nname = \"Main\"\n";
    assert_eq!(finding_lines(&load(lone)), ["5 toml-syntax"]);
    let rung = format!(
        "{MAIN}[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"RUN Drain\n\
         [[program]]\nname = \"Drain\"\n"
    );
    assert_eq!(finding_lines(&load(&rung)), ["5 toml-syntax"]);
    let silenced = "[ladder]\nallow = [\"bare-timer-value\"\n[[program]]\nname = \"Main\"\n\
                    rung = [{ when = [\"X0\"], do = [\"TMR T0 preset=5\"] }]\n";
    assert_eq!(finding_lines(&load(silenced)), ["3 toml-syntax"]);
}

/// The findings of a controller file that contains `line`, and of its ladder.
fn controlled(line: &str, ladder: &str) -> Vec<String> {
    let text = format!("ladder = [\"ladder.toml\"]\n{line}\n");
    let file = |name: &str, text: String| SourceFile { name: name.to_owned(), text };
    let files = [file("controller.toml", text), file("ladder.toml", ladder.to_owned())];
    finding_lines(&recorded_files(&files))
}

#[test]
fn a_broken_controller_file_and_its_ladders_are_checked() {
    let ladder =
        format!("{MAIN}rung = [{{ when = [\"X5000\", \"rio.Ok\"], do = [\"OUTT Y0\"] }}]\n");
    let found =
        controlled("[scan]\nperiod = \"0ms\"\n[outputs]\non = [\"D0\"]\nhold = [\"Y1]", &ladder);
    assert_eq!(
        found,
        ["3 out-of-range", "6 toml-syntax", "3 unknown-name", "3 unknown-instruction"]
    );
    let found = controlled("[memory]\nX = 6000 0\n[[device]\nname = \"rio\"", &ladder);
    assert_eq!(found, ["3 toml-syntax", "4 toml-syntax", "3 unknown-instruction"]);
}

#[test]
fn a_broken_ladder_file_does_not_prevent_checks_of_the_others() {
    let file = |path: &str, text: &str| InputFile { path: path.into(), bytes: text.into() };
    let other = format!("{MAIN}rung = [{{ when = [\"lamp\", \"nope\"], do = [\"OUT Y0\"] }}]\n");
    let files = [
        file("tags.toml", "[tags]\nlamp = { at = \"C0\"\nbell = { at = \"Q0\" }\n"),
        file("main.toml", &other),
    ];
    assert_eq!(
        finding_lines(&ladder_inputs(&files).unwrap()),
        ["3 toml-syntax", "3 unknown-name", "3 unknown-name"]
    );
}

#[test]
fn the_spans_of_findings_lie_within_any_broken_file() {
    let pid = include_str!("../../../../config/lib/pid.toml");
    let plant = include_str!("../../../../config/programs/pump-station.toml");
    let mut random = SplitMix64(7);
    for _ in 0..400 {
        for text in [pid, plant] {
            let mut chars: Vec<char> = text.chars().collect();
            for _ in 0..=random.next() % 3 {
                let at = (random.next() % chars.len() as u64) as usize;
                let new = ['"', '[', ']', '\n', '=', 'ä', '{', '\''][(random.next() % 8) as usize];
                match random.next() % 3 {
                    0 => drop(chars.remove(at)),
                    1 => chars.insert(at, new),
                    _ => drop(chars.drain(at..(at + 30).min(chars.len()))),
                }
            }
            let loaded = load(&chars.into_iter().collect::<String>());
            let text = &loaded.files[0].text;
            for finding in &loaded.findings {
                let places = finding.related.iter().map(|(place, _)| *place).chain([finding.span]);
                for place in places {
                    let range = place.start as usize..place.end as usize;
                    assert!(text.get(range).is_some(), "{finding:?} in\n{text}");
                }
            }
            let is_broken = loaded.findings.iter().any(|finding| finding.code == Code::TomlSyntax);
            assert!(!is_broken || loaded.program.is_none());
        }
    }
}

/// If the number of steps grew with the square of the number of lines, this test would not end.
#[test]
fn many_broken_lines_are_checked_in_linear_time() {
    const MANY: usize = 20_000;
    let rung = "{ when = [\"X0], do = [\"OUT Y0\"] },\n";
    for text in [
        format!("{MAIN}rung = [\n{}]\n", rung.repeat(MANY)),
        format!("{MAIN}{}", "[[program.rung]]\nwhen = [\"X0\"\n".repeat(MANY)),
        format!("[tags]\n{}", "a = { at = \"C0\" }\n".repeat(MANY)),
        format!("{MAIN}{}", "[[program.rung]\n".repeat(MANY)),
        "a = \"\"\"x\n".repeat(MANY),
    ] {
        let loaded = load(&text);
        assert!(loaded.program.is_none() && !loaded.findings.is_empty());
    }
}
