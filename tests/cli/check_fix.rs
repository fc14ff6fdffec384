//! `rungd check --fix`: what it writes, what it leaves, and that no file gets worse.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::fmt::{folder, rungd};

const SLIPS: &str = r#"# The first line stays.
[tags]
go = { at = "X0" }   # START
lamp = { at = "Y0", }
[[program]]
name = "Main"
[[program.rung]]
when = "go"      # one contact
do = ["out lamp"]
[[program.rung]]
when = ["go", "lamp AND x3"]
do = ["OUT Y1", "OUT lampe"]
"#;

const CORRECTED: &str = r#"# The first line stays.
[tags]
go = { at = "X0" }   # START
lamp = { at = "Y0" }
[[program]]
name = "Main"
[[program.rung]]
when = ["go"]      # one contact
do = ["OUT lamp"]
[[program.rung]]
when = ["go", "lamp AND x3"]
do = ["OUT Y1", "OUT lampe"]
"#;

struct Checked {
    code: Option<i32>,
    out: String,
    errors: String,
}

impl Checked {
    /// The number of errors that it counts.
    fn error_count(&self) -> u32 {
        let last = self.errors.lines().last().unwrap_or_default();
        last.split_once(" error").and_then(|(count, _)| count.parse().ok()).unwrap_or(0)
    }
}

fn check(folder: &Path, arguments: &[&str]) -> Checked {
    let output = rungd(&[&["check"], arguments].concat(), folder);
    let [out, errors] = [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap());
    Checked { code: output.status.code(), out, errors }
}

#[test]
fn only_certain_corrections_are_written() {
    let folder = folder("check-fix-certain");
    let ladder = folder.join("a.toml");
    fs::write(&ladder, SLIPS).unwrap();
    let first = check(&folder, &["--fix", "a.toml"]);
    assert_eq!(fs::read_to_string(&ladder).unwrap(), CORRECTED);
    let told = "a.toml:4: Take `,` away\na.toml:8: Write `when = [\"go\"]`\n\
                a.toml:9: Write `OUT`\n";
    assert_eq!((first.out.as_str(), first.code), (told, Some(78)), "{}", first.errors);
    assert!(first.errors.contains("did you mean `lamp`?"), "{}", first.errors);
    assert_eq!(first.error_count(), 2, "no guess, no other sign: {}", first.errors);
    let second = check(&folder, &["--fix", "a.toml"]);
    assert_eq!((second.out.as_str(), second.errors), ("", first.errors));
    assert_eq!(fs::read_to_string(&ladder).unwrap(), CORRECTED);
}

#[test]
fn a_controller_file_is_corrected_together_with_its_ladders() {
    let folder = folder("check-fix-controller");
    let ladder =
        "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = \"X0\"\ndo = [\"OUT Y0\"]\n";
    fs::write(folder.join("ladder.toml"), ladder).unwrap();
    fs::write(folder.join("c.toml"), "ladder = \"ladder.toml\"\nscan.period = \"10ms\"\n").unwrap();
    let checked = check(&folder, &["--fix", "--deny", "warnings", "c.toml"]);
    let told =
        "c.toml:1: Write `ladder = [\"ladder.toml\"]`\nladder.toml:4: Write `when = [\"X0\"]`\n";
    assert_eq!((checked.out.as_str(), checked.code), (told, Some(0)), "{}", checked.errors);
    // The tag of the second file makes the first one right, apart from its slip.
    let uses = "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = \"go\"\ndo = [\"OUT Y1\"]\n";
    fs::write(folder.join("uses.toml"), uses).unwrap();
    fs::write(folder.join("tags.toml"), "[tags]\ngo = { at = \"X1\" }\n").unwrap();
    let checked = check(&folder, &["--fix", "uses.toml", "tags.toml"]);
    assert_eq!(
        (checked.out.as_str(), checked.code),
        ("uses.toml:4: Write `when = [\"go\"]`\n", Some(0))
    );
}

/// Texts whose corrections in an editor are a choice, with two slips in one text, or not closed:
/// what stands around a slip must never go.
#[test]
fn ambiguous_mistakes_are_not_corrected() {
    let folder = folder("check-fix-otherwise");
    let rungs = [
        r#"{ when = ["%X0 & !Y1 | %X2"], do = ["OUT Y9"] }"#,
        r#"{ when = ["'go' & Y1 & 'go'"], do = ["OUT Y9"] }"#,
        r#"{ when = ["level > 3,5 | level < 1,5"], do = ["OUT Y9"] }"#,
        r#"{ when = ["LD go AND (Y1 OR Y2)"], do = ["OUT Y9"] }"#,
        r#"{ when = ["level > 1,500"], do = ["OUT Y9"] }"#,
        r#"{ when = ["never", "X010"], do = ["OUT Y9"] }"#,
        r#"{ when = ["go"], do = ["OUT(Y8,Y9)", "MOVE(5,D2,D3)"] }"#,
        r#"{ when = ["go"], do = ["MATH D1 -= level - 1", "MATH D2 = level AND 0x0F"] }"#,
        r#"{ when = ["go"], do = ["TMR T0 preset=1,500ms", "RST Y7 = 1"] }"#,
        r#"{ when = ["go], do = [OUT Y9] }, # why"#,
    ];
    for rung in rungs {
        let tags = "[tags]\ngo = { at = \"X5\" }\nlevel = { at = \"D0\" }\n";
        let text = format!("{tags}[[program]]\nname = \"Main\"\nrung = [\n  {rung}\n]\n");
        fs::write(folder.join("a.toml"), &text).unwrap();
        let checked = check(&folder, &["--fix", "a.toml"]);
        assert_eq!(fs::read_to_string(folder.join("a.toml")).unwrap(), text, "{}", checked.out);
        assert_eq!(checked.code, Some(78), "{rung}");
    }
}

#[test]
fn two_names_of_the_same_file_are_refused_before_anything_is_written() {
    let folder = folder("check-fix-links");
    fs::write(folder.join("h1.toml"), SLIPS).unwrap();
    fs::hard_link(folder.join("h1.toml"), folder.join("h2.toml")).unwrap();
    let checked = check(&folder, &["--fix", "h1.toml", "h2.toml"]);
    assert_eq!((checked.out.as_str(), checked.code), ("", Some(2)), "{}", checked.errors);
    assert!(checked.errors.contains("h1.toml and h2.toml are one file: name one of them"));
    assert_eq!(fs::read_to_string(folder.join("h1.toml")).unwrap(), SLIPS);
}

#[test]
fn a_pipe_is_refused_and_a_library_file_is_not_changed() {
    let folder = folder("check-fix-pipe");
    assert!(Command::new("mkfifo").arg(folder.join("p")).status().unwrap().success());
    let checked = check(&folder, &["--fix", "p"]);
    assert_eq!((checked.out.as_str(), checked.code), ("", Some(2)), "{}", checked.errors);
    assert!(checked.errors.contains("--fix corrects regular files only"), "{}", checked.errors);
    let checked = check(&folder, &["--fix", "lib:pid"]);
    assert_eq!(checked.out, "", "{}", checked.errors);
}

/// Every file with findings of every kind: no file has more errors afterwards, a second turn finds
/// nothing to correct, and what is not TOML is not cut.
#[test]
fn no_correction_adds_errors_and_a_second_run_corrects_nothing() {
    let folder = folder("check-fix-all");
    let shown = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ui");
    let mut corrected = 0;
    for entry in fs::read_dir(shown).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".toml") {
            continue;
        }
        fs::copy(&path, folder.join(&name)).unwrap();
        let before = check(&folder, &[&name]);
        let after = check(&folder, &["--fix", &name]);
        assert!(after.error_count() <= before.error_count(), "{name}: {}", after.errors);
        let is_same = fs::read(&path).unwrap() == fs::read(folder.join(&name)).unwrap();
        assert_eq!(is_same, after.out.is_empty(), "{name}: what is written is told");
        corrected += after.out.lines().count();
        if !is_same {
            let again = check(&folder, &["--fix", &name]);
            assert_eq!(again.out, "", "{name}: {}", after.out);
        }
    }
    assert!(corrected > 10, "only {corrected}");
    println!("{corrected} corrections");
}
