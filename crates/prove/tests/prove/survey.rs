//! Surveys of small ladders, each with one fault, and of shipped ladders.
//!
//! The expected surveys of shipped ladders lie in `surveys/`; `UPDATE_EXPECT=1 cargo test -p
//! rungd-prove survey` writes them anew.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use expect_test::expect_file;
use rungd_lab::testing::read_text;
use rungd_language::source::span::SourceFile;
use rungd_prove::decide::DecideLimits;
use rungd_prove::survey::{Survey, survey};
use rungd_test_support::folder::TestFolder;

/// The survey of a test file in a folder.
fn survey_in(folder: &Path, test: &str) -> Survey {
    let file = SourceFile { name: "x.test.toml".to_owned(), text: test.to_owned() };
    let read = read_text(&folder.join("x.test.toml"), file, None);
    let found: Vec<&str> = read.findings.iter().map(|one| one.message.as_str()).collect();
    let suite = read.suite.unwrap_or_else(|| panic!("no suite: {found:?}"));
    let given_up = Arc::new(AtomicBool::new(false));
    let limits = DecideLimits { time: Duration::from_secs(3_600), memory: 1 << 30, given_up };
    survey(suite, &limits, &|_| {})
}

/// The survey of a ladder, and what a test file says beside it.
fn surveyed(name: &str, ladder: &str, test: &str) -> Survey {
    let folder = TestFolder::new(&format!("survey-{name}"));
    std::fs::write(folder.path().join("l.toml"), ladder).expect("a file");
    survey_in(folder.path(), &format!("ladder = [\"l.toml\"]\nalways = []\n{test}"))
}

/// The tags of the small ladders.
const TAGS: &str = r#"
[tags]
a     = { at = "X0" }
b     = { at = "X1" }
y     = { at = "Y0" }
z     = { at = "Y1" }
level = { type = "int", min = 0, max = 3 }
small = { at = "V0" }
list  = { type = "int", count = 3 }
bits  = { at = "C10", count = 3 }
wait  = { type = "timer" }
parts = { type = "counter" }
"#;

/// Surveys a ladder with these rungs of Main: its lines.
fn lines(name: &str, rungs: &str) -> String {
    let ladder = format!("{TAGS}\n[[program]]\nname = \"Main\"\nrung = [\n{rungs}\n]\n");
    surveyed(name, &ladder, "").text()
}

#[track_caller]
fn says(text: &str, line: &str) {
    assert!(text.lines().any(|other| other == line), "no line `{line}` in\n{text}");
}

#[test]
fn an_output_that_never_comes_or_never_goes_is_said() {
    let text = lines(
        "outputs",
        r#"{ when = ["a", "!a"], do = ["OUT y"] }, { when = ["b"], do = ["SET z"] },"#,
    );
    says(&text, "output y: never ON");
    says(&text, "output z: comes ON, and never goes OFF again");
    says(&text, "Main, rung 1: never ON");
    assert_eq!(text.lines().count(), 3, "{text}");
}

#[test]
fn an_output_that_changes_in_every_scan_with_still_inputs_is_said() {
    let text = lines(
        "flaps",
        r#"{ when = ["a", "!y"], do = ["OUT y"] }, { when = ["b", "!a"], do = ["OUT z"] },"#,
    );
    let flaps = "can change in every scan for ever, with inputs that stand still";
    assert_eq!(
        text,
        format!(
            "output y: comes ON, goes OFF\noutput y, every scan: {flaps}\noutput z: comes ON, goes OFF\n"
        )
    );
}

#[test]
fn contacts_that_never_matter_are_said() {
    let text = lines(
        "contacts",
        r#"{ when = ["a", "a | b"], do = ["OUT y"] },
           { when = ["y"], do = ["OUT z"] },
           { when = ["z", "!(y & !a)"], do = ["OUT C0"] },"#,
    );
    let never = "never matters: the rung does the same without it";
    says(&text, &format!("Main, rung 1, contact `a | b`: {never}"));
    says(&text, &format!("Main, rung 3, contact `!(y & !a)`: {never}"));
    assert!(!text.contains("contact `a`:"), "{text}");
}

#[test]
fn a_structure_that_is_never_done_is_said() {
    let text = lines(
        "done",
        r#"{ when = ["a", "!y"], do = ["TMR wait preset=1s"] },
           { when = ["wait.Done | wait.Acc > 500ms"], do = ["RSTT wait"] },
           { when = ["b"], do = ["OUT y"] },
           { leg.up = ["a"], leg.rst = ["b"], do = ["CNT parts preset=2"] },"#,
    );
    says(&text, "wait.Done: never reached");
    says(&text, "parts.Done: is reached");
}

#[test]
fn mishaps_of_instructions_are_said() {
    let text = lines(
        "mishaps",
        r#"{ when = ["rise(a)"], do = ["ADD level 1 to=level"] },
           { when = ["b"], do = ["MATH small = 100 / level"] },
           { when = ["b"], do = ["MATH D7 = if(level == 0, 0, 100 / level)"] },
           { when = ["b"], do = ["MATH small = (level - 1) * 40000"] },
           { when = ["b"], do = ["MOVE list[level] to=D8", "SET bits[level]"] },
           { when = ["bits[level]"], do = ["OUT y"] },"#,
    );
    says(&text, "Main, rung 1, `ADD level 1 to=level`, min and max: the result can be beyond them");
    says(&text, "Main, rung 2, `MATH small = 100 / level`, divisor: can be 0");
    assert!(!text.contains("rung 3"), "{text}");
    says(
        &text,
        "Main, rung 4, `MATH small = (level - 1) * 40000`, range of the word: the result can be beyond it",
    );
    says(&text, "Main, rung 5, `MOVE list[level] to=D8`, index: can be outside");
    says(&text, "Main, rung 5, `SET bits[level]`, index: can be outside");
    says(&text, "Main, rung 6, its contacts, index: can be outside");
}

#[test]
fn a_stage_from_which_nothing_leads_is_said() {
    let ladder = format!(
        r#"{TAGS}
[[program]]
name = "Main"
rung = [{{ when = ["rise(a)"], do = ["RUN Job"] }}]

[[program]]
name = "Job"

[[program.stage]]
name = "Begin"
rung = [
  {{ when = ["b"], do = ["JMP End"] }},
  {{ when = ["y", "a"], do = ["JMP Other"] }},
]

[[program.stage]]
name = "End"
rung = [{{ when = ["a", "y"], do = ["JMP Begin"] }}]

[[program.stage]]
name = "Other"
rung = [{{ when = ["$On"], do = ["EXIT"] }}]
"#
    );
    let text = surveyed("stages", &ladder, "").text();
    says(&text, "Stage Job.Begin: is entered, is left");
    says(&text, "Stage Job.End: is entered, and never left: nothing leads on");
    says(&text, "Stage Job.Other: never entered");
}

#[test]
fn an_interlock_holds_or_is_broken() {
    let ladder = format!(
        "{TAGS}\n[[program]]\nname = \"Main\"\nrung = [\n{}\n]\n",
        r#"{ when = ["a"], do = ["OUT y"] }, { when = ["b", "!y"], do = ["OUT z"] },
           { when = ["b"], do = ["OUT C0"] },"#
    );
    let locks = "[[interlock]]\noutputs = [\"y\", \"z\", \"C0\"]\n";
    let survey = surveyed("interlock", &ladder, locks);
    let text = survey.text();
    says(&text, "interlock !(y & z): holds");
    says(&text, "interlock !(y & C0): BROKEN: both can be ON together");
    says(&text, "interlock !(z & C0): BROKEN: both can be ON together");
    let broken = survey.facts.iter().find(|fact| fact.is_broken()).expect("a broken one");
    let scenario = survey.scenario(broken, 0).expect("a scenario");
    assert!(scenario.contains("set a 1") && scenario.contains("set b 1"), "{scenario}");
}

#[test]
fn a_change_is_told_with_a_scenario_or_as_excluded() {
    let ladder = |rung: &str| {
        format!(
            "{TAGS}\n[[program]]\nname = \"Main\"\nrung = [{{ when = [{rung}], do = [\"OUT y\"] }}]\n"
        )
    };
    let old = surveyed("change-a", &ladder("\"a\", \"!a\""), "");
    let new = surveyed("change-b", &ladder("\"a\", \"!b\""), "");
    assert!(new.changes(&new.text()).is_empty());
    let changes = new.changes(&old.text());
    let texts: Vec<String> = changes.iter().map(|change| change.text()).collect();
    let first =
        "changed: output y\n  was: never ON\n  is:  comes ON, goes OFF\n\n    [[scenario]]\n";
    assert!(texts[0].starts_with(first), "{texts:?}");
    assert!(texts[0].contains("expect: !y"), "{texts:?}");
    let back = old.changes(&new.text());
    assert!(back[0].is_excluded && back[0].scenario.is_none(), "{back:?}");
}

#[test]
fn shipped_ladders_have_the_surveys_that_lie_beside_the_tests() {
    for (name, expected) in [
        ("lubrication", expect_file!["surveys/lubrication.txt"]),
        ("bin-emptying", expect_file!["surveys/bin-emptying.txt"]),
    ] {
        let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/programs");
        let test = format!("ladder = [\"{name}.toml\"]\nalways = []\n");
        expected.assert_eq(&survey_in(&programs, &test).text());
    }
}
