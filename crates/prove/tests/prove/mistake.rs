//! Mistakes of `rungd mutate` that are shown to change nothing, and mistakes that are not.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rungd_lab::testing::{JudgedLadder, MutantKind, MutateOptions, mutate, read_text};
use rungd_language::source::span::SourceFile;
use rungd_prove::mistake::changes_nothing;
use rungd_test_support::folder::TestFolder;

/// Two latches, of which the second comes only while the first is ON.
const LATCHES: &str = r#"
[tags]
start  = { at = "X0" }
step   = { at = "X1" }
stop   = { at = "X2" }
lamp   = { at = "Y0" }
first  = { at = "C0" }
second = { at = "C1" }
count  = { type = "int" }

[[program]]
name = "Main"
[[program.rung]]
when = ["start", "!stop"]
do   = ["SET first"]
[[program.rung]]
when = ["first", "step"]
do   = ["SET second"]
[[program.rung]]
when = ["stop"]
do   = ["RST first", "RST second"]
"#;

/// A test that notices nothing.
const BLIND: &str = r#"[[scenario]]
name = "nothing"
steps = ["run 20ms", "expect: !lamp"]
"#;

/// Judges what is left out of the contacts of one more rung: `what` of each change that counts,
/// and of each that is proved to change nothing.
fn judged(name: &str, rung: &str, test: &str) -> [Vec<String>; 2] {
    let folder = TestFolder::new(&format!("mistake-{name}"));
    let ladder = format!("{LATCHES}[[program.rung]]\nname = \"last\"\n{rung}\n");
    std::fs::write(folder.path().join("l.toml"), ladder).expect("a file");
    let text = format!("ladder = [\"l.toml\"]\nperiod = \"10ms\"\n{test}");
    let file = SourceFile { name: "x.test.toml".to_owned(), text };
    let read = read_text(&folder.path().join("x.test.toml"), file, None);
    let found: Vec<&str> = read.findings.iter().map(|one| one.message.as_str()).collect();
    let suite = read.suite.unwrap_or_else(|| panic!("no suite: {found:?}"));
    let given_up = Arc::new(AtomicBool::new(false));
    let options = MutateOptions {
        jobs: 1,
        kinds: &[MutantKind::ContactOut],
        progress: &|_| {},
        proves: Some(&|mutant| changes_nothing(mutant, &given_up)),
        given_up: &given_up,
    };
    let JudgedLadder { judged, proved, .. } = mutate(&[&suite], &options);
    [judged, proved].map(|all| {
        let of_rung = all.into_iter().filter(|mutant| mutant.rung.starts_with("Main, rung last"));
        of_rung.map(|mutant| mutant.what).collect()
    })
}

/// Says which contacts of a rung change nothing if they are left out.
#[track_caller]
fn check(name: &str, rung: &str, test: &str, expected: &[&str]) {
    let [_, proved] = judged(name, rung, test);
    let texts: Vec<String> =
        expected.iter().map(|contact| format!("contact `{contact}` left out")).collect();
    assert_eq!(proved, texts, "{rung} {test}");
}

const LAMP: &str = "when = [\"first\", \"second\"]\ndo = [\"OUT lamp\"]";

#[test]
fn a_contact_that_a_latch_implies_changes_nothing() {
    let [counted, proved] = judged("latches", LAMP, BLIND);
    assert_eq!(proved, ["contact `first` left out"]);
    assert_eq!(counted, ["contact `second` left out"]);
}

#[test]
fn a_contact_in_a_branch_and_one_in_an_edge_are_compared_too() {
    let branches = r#"when = ["!stop"]
branch = [{ when = ["second", "first"], do = ["OUT lamp"] }]"#;
    check("branch", branches, BLIND, &["first"]);
    let edge = "when = [\"rise(first & second)\"]\ndo = [\"SET lamp\"]";
    check("edge", edge, BLIND, &["first"]);
}

#[test]
fn legs_of_a_counter_are_compared_too() {
    let legs = r#"leg.up = ["second", "first"]
leg.rst = ["stop"]
do = ["CNT CT0 preset=3"]"#;
    check("legs", legs, BLIND, &["first"]);
}

#[test]
fn what_an_operator_writes_and_what_is_retained_has_any_value() {
    let step = |step: &str| {
        format!(
            "[[scenario]]\nname = \"a\"\nsteps = [\"{step}\", \"run 20ms\", \"expect: !stop\"]\n"
        )
    };
    check("written", LAMP, &step("set second true"), &[]);
    check("pulse", LAMP, &step("pulse second 50ms"), &[]);
    check("retained", LAMP, &format!("[retain]\ntags = [\"second\"]\n{BLIND}"), &[]);
    let first = format!("[retain]\ntags = [\"first\"]\n{BLIND}");
    check("retained-first", LAMP, &first, &["first"]);
    let random = "[[random]]\nname = \"r\"\nruns = 1\nscans = 10\nchange.second = \"1%\"\n";
    check("random", LAMP, random, &[]);
}

#[test]
fn nothing_is_shown_where_a_test_forces_or_stops() {
    for (name, step) in [("force", "force second false"), ("stop", "stop")] {
        let test = format!(
            "[[scenario]]\nname = \"a\"\nsteps = [\"run 20ms\", \"{step}\", \"run 20ms\"]\n"
        );
        check(name, LAMP, &test, &[]);
    }
}

#[test]
fn what_no_model_computes_has_any_value() {
    for (at, contact) in ["!$LastScan", "!$ForcesActive", "$DownSeconds == 0", "$MaxScanTime < 5"]
        .into_iter()
        .enumerate()
    {
        let rung = format!("when = [\"second\", \"{contact}\"]\ndo = [\"OUT lamp\"]");
        check(&format!("status-{at}"), &rung, BLIND, &[]);
    }
}

#[test]
fn a_scan_that_may_come_late_is_one_of_those_that_are_looked_at() {
    let rung = r#"when = ["second", "wait.Acc != 50"]
do = ["OUT lamp"]"#;
    let timer = r#"[[program.rung]]
when = ["$On"]
do = ["TMR wait preset=1s"]
[tags.wait]
type = "timer"
"#;
    let rung = format!("{rung}\n{timer}");
    let late =
        "[[scenario]]\nname = \"a\"\nsteps = [\"late 1\", \"run 20ms\", \"expect: !lamp\"]\n";
    check("late", &rung, late, &[]);
    let odd = rung.replace("!= 50", "!= 55");
    check("late-odd", &odd, late, &["wait.Acc != 55"]);
}

#[test]
fn a_contact_that_also_notes_a_mishap_is_not_shown() {
    let rung = "when = [\"second\", \"first\", \"100 / count >= 0\"]\ndo = [\"OUT lamp\"]";
    check("mishap", rung, BLIND, &[]);
}

#[test]
fn what_the_effort_does_not_decide_counts() {
    let rung = r#"when = ["second", "count != 30000"]
do = ["OUT lamp"]
[[program.rung]]
when = ["step"]
do = ["ADD count 1 to=count"]"#;
    let [counted, proved] = judged("effort", rung, BLIND);
    assert_eq!(proved, Vec::<String>::new());
    assert_eq!(counted, ["contact `second` left out", "contact `count != 30000` left out"]);
}
