//! What `[prove]` says of the environment, with known answers: `any`.

use rungd_lab::testing::read_suite;
use rungd_prove::answer::{Answer, AnswerVerdict};
use rungd_prove::decide::{DecideLimits, decide, decide_can};
use rungd_prove::kept::KeptAnswers;
use rungd_prove::question::Questions;
use rungd_test_support::folder::TestFolder;
use std::fs;
use std::time::Duration;

/// The answers about the lines of a test file over a ladder, `always` before `can`.
fn answers(ladder: &str, test: &str) -> Vec<Answer> {
    let folder = TestFolder::new("prove-environment");
    let path = folder.path().join("a.test.toml");
    fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
    fs::write(&path, format!("ladder = [\"ladder.toml\"]\n{test}")).expect("a test file");
    let read = read_suite(&path).expect("a file");
    let found: Vec<&String> = read.findings.iter().map(|finding| &finding.message).collect();
    let questions = Questions::new(read.suite.unwrap_or_else(|| panic!("{found:?}")));
    let limits = DecideLimits {
        time: Duration::from_secs(20),
        memory: 100_000_000,
        given_up: Default::default(),
    };
    let kept = KeptAnswers::default();
    let always = questions.lines.iter().map(|line| decide(&questions, line, &limits, &kept));
    let can = questions.can.iter().map(|line| decide_can(&questions, line, &limits));
    always.chain(can).collect()
}

/// The words of the answers.
fn words(ladder: &str, test: &str) -> Vec<&'static str> {
    answers(ladder, test).iter().map(Answer::word).collect()
}

/// A latch whose lamp follows in the same scan, and a computed real.
const COMPUTED: &str = r#"
[tags]
start  = { at = "X0" }
latch  = { at = "C0" }
lamp   = { at = "Y0" }
behind = { at = "Y1" }
level  = { at = "R0" }
high   = { at = "Y2" }
[[program]]
name = "Main"
rung = [
  { when = ["latch"], do = ["OUT lamp"] },
  { when = ["start"], do = ["SET latch"] },
  { when = ["latch"], do = ["OUT behind"] },
  { when = ["start"], do = ["MATH level = level * 0.5 + 3.0"] },
  { when = ["level > 50.0", "start"], do = ["OUT high"] },
]
"#;

#[test]
fn what_has_any_value_may_change_between_two_rungs() {
    // The ladder never resets the latch, so a lamp that is ON stays ON with `behind`.
    let line = "always = [\"!lamp | behind\"]\n";
    assert_eq!(words(COMPUTED, line), ["proved"]);
    let cut = format!("{line}[prove]\nany = [\"latch\"]\n");
    let found = &answers(COMPUTED, &cut)[0];
    let AnswerVerdict::NotDecided { cause, .. } = &found.verdict else { panic!("{found:?}") };
    assert!(cause.contains("of latch: by `any`"), "{cause}");
}

#[test]
fn what_has_any_value_is_named_and_is_not_computed() {
    let found = &answers(COMPUTED, "always = [\"!high | start\"]\n[prove]\nany = [\"level\"]\n")[0];
    assert_eq!((found.word(), found.cuts.as_slice()), ("proved", &["level: by `any`".into()][..]));
    // The MATH is not among them.
    let operations = found.depends_on.expect("a cone").operations;
    assert!(operations.kept <= operations.all - 3, "{operations:?}");
    // The level never gets there, which only the real arithmetic knows.
    let open = "always = [\"!high\"]\n[prove]\nany = [\"level\"]\n";
    assert_eq!(words(COMPUTED, open), ["not decided"]);
    // A run that needs no such value holds in a test.
    let found = "always = [\"!(lamp & start)\"]\n[prove]\nany = [\"level\"]\n";
    assert_eq!(words(COMPUTED, found), ["violated"]);
    let can = "[prove]\nany = [\"latch\"]\ncan = [\"!latch\"]\n";
    assert_eq!(words(COMPUTED, can), ["not decided"]);
}
