//! What `[prove]` says of the environment, with known answers.

use rungd_lab::testing::read_suite;
use rungd_prove::answer::{Answer, AnswerVerdict};
use rungd_prove::decide::{DecideLimits, decide, decide_can};
use rungd_prove::kept::KeptAnswers;
use rungd_prove::question::Questions;
use rungd_test_support::folder::TestFolder;
use std::fs;
use std::time::Duration;

/// The answers about the lines of a test file over a ladder, `always` before `can`.
pub fn answers(ladder: &str, test: &str) -> Vec<Answer> {
    answers_of(&[("ladder.toml", ladder)], &format!("ladder = [\"ladder.toml\"]\n{test}"))
}

/// The same about a test file beside other files, each with its name.
pub fn answers_of(files: &[(&str, &str)], test: &str) -> Vec<Answer> {
    let folder = TestFolder::new("prove-environment");
    let path = folder.path().join("a.test.toml");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    fs::write(&path, test).expect("a test file");
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
pub fn words(ladder: &str, test: &str) -> Vec<&'static str> {
    words_of(&answers(ladder, test))
}

/// The words of answers.
pub fn words_of(found: &[Answer]) -> Vec<&'static str> {
    found.iter().map(Answer::word).collect()
}

/// The scenario of a line that is violated.
pub fn scenario(answer: &Answer) -> &str {
    violated(answer).1
}

/// What stands in the way of an answer.
pub fn cause(answer: &Answer) -> &str {
    let AnswerVerdict::NotDecided { cause, .. } = &answer.verdict else { panic!("{answer:#?}") };
    cause
}

/// The number of scans of a line that is violated, and its scenario.
pub fn violated(answer: &Answer) -> (u64, &str) {
    let AnswerVerdict::Violated { scan, scenario, .. } = &answer.verdict else {
        panic!("{answer:#?}")
    };
    (*scan, scenario)
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
    let cause = cause(found);
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

/// A timer that begins anew when it is done, and a Task that recurs.
const TIMED: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["!T0.Done"], do = ["TMR T0 preset=30ms"] },
  { when = ["X0"], do = ["TMR T1 preset=50ms"] },
  { when = ["X0"], do = ["TMR T2 preset=20ms"] },
  { when = ["$On"], do = ["ENTASK Often every=30ms"] },
  { when = ["T1.Done"], do = ["OUT Y0"] },
]
[[task]]
name = "Often"
rung = [{ when = ["!C0"], do = ["SET C0", "MOVE 0 to=D0"] }]
[[program]]
name = "Behind"
rung = [
  { when = ["X1"], do = ["RST C0"] },
  { when = ["!C0"], do = ["TMR T3 preset=1s"] },
]
"#;

#[test]
fn a_time_of_scans_has_any_value() {
    let ladder = r#"
[tags]
slow = { at = "Y0" }
fast = { at = "Y1" }
[[program]]
name = "Main"
rung = [
  { when = ["$MaxScanTime > 500"], do = ["OUT slow"] },
  { when = ["$MaxScanTime < -1"], do = ["OUT fast"] },
]
"#;
    let found = answers(ladder, "always = [\"!slow\", \"!fast\"]\n");
    let cause = cause(&found[0]);
    assert!(cause.ends_with("of $MaxScanTime: a time of scans"), "{cause}");
    let cuts = ["$MaxScanTime: a time of scans".to_owned()];
    assert_eq!((found[1].word(), found[1].cuts.as_slice()), ("proved", &cuts[..]));
    // Also if other inputs are listed.
    let listed = "always = [\"!slow\"]\n[prove]\ninputs = [\"X0\"]\n";
    assert_eq!(words(ladder, listed), ["not decided"]);
}

#[test]
fn a_scan_that_comes_late_is_seen_by_timers_and_tasks() {
    let nominal = "always = [\"T0.Acc <= 30\", \"!T1.Done | T2.Done\"]\n";
    assert_eq!(words(TIMED, nominal), ["proved", "proved"]);
    let late = format!("{nominal}[prove]\nstep = \"1..3\"\n");
    let found = answers(TIMED, &late);
    assert_eq!(found.iter().map(Answer::word).collect::<Vec<_>>(), ["violated", "proved"]);
    let (scan, scenario) = violated(&found[0]);
    // 0 ms, 10 ms or 20 ms, and then at least 40 ms.
    assert_eq!(scan, 3);
    assert!(scenario.contains("\"late "), "{scenario}");
    let told = "  a scan comes 1 to 3 periods of 10 ms after the last one\n";
    assert!(found[1].text().contains(told), "{}", found[1].text());
}

#[test]
fn the_shortest_run_takes_the_latest_scans() {
    let test = "always = [\"!Y0\"]\n[prove]\nstep = \"1..3\"\n";
    let found = &answers(TIMED, test)[0];
    let (scan, scenario) = violated(found);
    assert_eq!(scan, 3, "{scenario}");
    let steps = r#"
    "set X0 1",
    "run 1 scans",
    "late "#;
    assert!(scenario.contains(steps), "{scenario}");
}

/// A machine whose shift and operation are retained; only a press of the button is no reason to run.
const RETAINED: &str = r#"
[tags]
button  = { at = "X0" }
running = { at = "C0" }
pressed = { at = "C1" }
valve   = { at = "Y0" }
held    = { at = "C2" }
shift   = { at = "D0", min = 1, max = 3, initial = 1 }
speed   = { at = "R0", min = 0.0, max = 10.0 }
[[program]]
name = "Main"
rung = [
  { when = ["button"], do = ["SET running", "SET pressed"] },
  { when = ["running"], do = ["OUT valve"] },
  { when = ["button"], do = ["OUT held"] },
  { when = ["button", "shift == 3"], do = ["MOVE 1 to=shift"] },
  { when = ["button", "speed > 20.0"], do = ["RST running"] },
]
"#;

const KEPT: &str = "[retain]\ntags = [\"running\", \"held\", \"shift\", \"speed\"]\n";

#[test]
fn retained_memory_has_any_value_within_its_limits_before_the_first_scan() {
    let lines = "always = [\"!valve | pressed\", \"shift != 2\", \"shift <= 3\", \"!held | button\", \
                 \"speed <= 10.0\"]\n";
    let cold = format!("{lines}{KEPT}");
    assert_eq!(words(RETAINED, &cold), ["proved"; 5]);
    let test = format!("{cold}[prove]\nfrom = \"retained\"\n");
    let found = answers(RETAINED, &test);
    let expected = ["violated", "violated", "proved", "proved", "proved"];
    assert_eq!(found.iter().map(Answer::word).collect::<Vec<_>>(), expected, "{found:#?}");
    for (answer, set) in found.iter().zip(["{ \"running\" = 1 }", "{ \"shift\" = 2 }"]) {
        let (scan, scenario) = violated(answer);
        assert_eq!(scan, 1);
        assert!(scenario.contains(&format!("set   = {set}\n")), "{scenario}");
    }
    assert!(found[0].text().contains("from any retained values"), "{}", found[0].text());
}

#[test]
fn a_retained_counter_or_timer_has_any_value_before_the_first_scan() {
    let ladder = r#"
[[program]]
name = "Main"
rung = [
  { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT0 up-preset=3 dn-preset=0"] },
  { when = ["X2"], do = ["TMRAG T0 preset=30ms"] },
  { when = ["CT0.Acc > 6"], do = ["OUT Y0"] },
]
"#;
    let test = "always = [\"CT0.Acc != 5\", \"T0.Acc < 20 | X2\", \"Y0 | CT0.Acc < 7\", \
                \"!CT0.Done | CT0.Acc >= 3\", \"!T0.Done | T0.Acc >= 30\"]\n\
                [retain]\nranges = [\"CT0\", \"T0\"]\n[prove]\nfrom = \"retained\"\n";
    let found = answers(ladder, test);
    let expected = ["violated", "violated", "proved", "proved", "proved"];
    assert_eq!(words_of(&found), expected, "{found:#?}");
    let (scan, first) = violated(&found[0]);
    assert_eq!(scan, 1, "{first}");
    assert!(first.contains("set   = { \"CT0.Acc\" = "), "{first}");
    assert!(scenario(&found[1]).contains("\"T0.Acc\" ="), "{}", scenario(&found[1]));
    let told = "any value: CT0: retained flags, and what its instruction keeps\n";
    assert!(found[2].text().contains(told), "{}", found[2].text());
}

#[test]
fn what_the_pass_behind_a_crash_leaves_is_a_start_too() {
    let ladder = r#"
[tags]
lamp = { at = "C0", initial = true }
[[program]]
name = "Main"
rung = [
  { when = ["T0.Reset"], do = ["OUT Y0"] },
  { when = ["!lamp"], do = ["OUT Y1"] },
  { when = ["X0"], do = ["TMR T0 preset=30ms"] },
  { when = ["X0"], do = ["OUT lamp"] },
  { leg.data = ["$On"], leg.clk = ["X1"], leg.rst = ["$Off"], do = ["SR C8..C9"] },
]
"#;
    let lines = "always = [\"!Y0 | !$FirstScan\", \"!Y1 | !$FirstScan\", \
                 \"!$FirstScan | C8 | !X1\"]\n";
    let test = |retain: &str| format!("{lines}{retain}[prove]\nfrom = \"retained\"\n");
    let retain = "[retain]\nranges = [\"C8..C9\"]\n";
    assert_eq!(words(ladder, &format!("{lines}{retain}")), ["proved"; 3]);
    assert_eq!(words(ladder, &test("")), ["proved"; 3]);
    // A test sets neither the flag of a timer nor the history of an SR.
    let expected = ["not decided", "violated", "not decided"];
    assert_eq!(words(ladder, &test(retain)), expected);
}

/// A batch, and a rinse that begins by itself.
const STAGED: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["RUN Batch"] },
  { when = ["Batch.Mix", "Batch.Fill"], do = ["OUT Y3"] },
]
[[program]]
name = "Batch"
[[program.stage]]
name = "Fill"
rung = [{ when = ["$On"], do = ["OUT Y0"] }, { when = ["X1"], do = ["JMP Mix"] }]
[[program.stage]]
name = "Mix"
rung = [{ when = ["$On"], do = ["OUT Y1"] }, { when = ["!X1"], do = ["JMP Fill"] }]
[[program]]
name = "Rinse"
autostart = true
[[program.stage]]
name = "Wait"
rung = [{ when = ["$On"], do = ["OUT Y2"] }]
"#;

#[test]
fn retained_stages_are_on_or_off_before_the_first_scan() {
    let lines = "always = [\"!Y3\", \"!Y1 | !$FirstScan | X1\", \"Rinse.Running\", \"Y2\", \
                 \"!Batch.Fill | Batch.Running\", \"!$FirstScan | X0 | !Batch.Running\"]\n";
    assert_eq!(words(STAGED, lines), ["proved"; 6]);
    let kept = "[retain]\nstages = [\"*\"]\n[prove]\nfrom = \"retained\"\n";
    let found = answers(STAGED, &format!("{lines}{kept}"));
    let expected = ["violated", "violated", "violated", "violated", "proved", "violated"];
    assert_eq!(words_of(&found), expected, "{found:#?}");
    let sets = [
        Some("{ \"Batch.Fill\" = 1, \"Batch.Mix\" = 1 }"),
        Some("{ \"Batch.Mix\" = 1 }"),
        Some("{ \"Rinse.Running\" = 0 }"),
        None,
        None,
        None,
    ];
    for (answer, set) in found.iter().zip(sets) {
        let Some(set) = set else { continue };
        let (scan, scenario) = violated(answer);
        assert_eq!(scan, 1, "{scenario}");
        assert!(scenario.contains(&format!("set   = {set}\n")), "{scenario}");
    }
    // Others are not retained, and begin as at a cold start.
    let rinse = format!("{lines}{}", kept.replace('*', "Rinse"));
    let expected = ["proved", "proved", "violated", "violated", "proved", "proved"];
    assert_eq!(words(STAGED, &rinse), expected);
}

#[test]
fn a_program_that_begins_at_its_initial_stage_is_a_start_too() {
    // Before its turn no Stage of it is ON.
    let line = "always = [\"!$FirstScan | X0 | !Batch.Running | Y0 | Y1\"]\n";
    let kept = "[retain]\nstages = [\"Batch\"]\n[prove]\nfrom = \"retained\"\n";
    let ladder = STAGED.replace("\"RUN Batch\"", "\"SET C0\"");
    // With no Stage ON it runs so.
    let found = &answers(&ladder, &format!("{line}{kept}"))[0];
    assert!(scenario(found).contains("set   = { \"Batch.Fill\" = 0 }\n"), "{found:#?}");
    let seen = "[[program]]\nname = \"Main\"\nrung = [\n  { when = [\"Batch.Running\", \"!Batch.Fill\"], do = [\"OUT Y4\"] },";
    let ladder = ladder.replacen("[[program]]\nname = \"Main\"\nrung = [", seen, 1);
    let line = "always = [\"!(Y4 & Y0)\"]\n";
    let found = &answers(&ladder, &format!("{line}{kept}"))[0];
    assert!(scenario(found).contains("set   = { \"Batch.Running\" = 1 }\n"), "{found:#?}");
}

#[test]
fn a_retained_stage_of_the_scan_before_is_not_known_in_the_first_scan() {
    let kept = "[retain]\nstages = [\"*\"]\n[prove]\nfrom = \"retained\"\n";
    let found = answers(STAGED, &format!("always = [\"!was(Batch.Fill) | Y0 | Y1 | X0\"]\n{kept}"));
    assert_eq!(cause(&found[0]), "`from`: `was(Batch.Fill)` of a retained Stage");
}
