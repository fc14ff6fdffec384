//! Conditions with `was(x)`, played.
//!
//! Each test is a test file over the ladder of `tests/suites`, and what becomes of its scenarios.

use std::path::Path;

use super::reading::read_text;
use super::runner::{RunOptions, programs, run};
use super::suite::Suite;
use rungd_language::source::span::SourceFile;

/// A test file over `crates.toml`, behind its first line.
pub(super) fn suite(text: &str) -> Suite {
    let read = reading(text);
    let findings: Vec<_> = read.findings.iter().map(|finding| &finding.message).collect();
    read.suite.unwrap_or_else(|| panic!("{findings:?}"))
}

pub(super) fn reading(text: &str) -> super::reading::ReadSuite {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suites/x.test.toml");
    let text = format!("ladder = [\"crates.toml\"]\n{text}");
    read_text(&path, SourceFile { name: "x.test.toml".to_owned(), text }, None)
}

/// The failures of all tests of a suite: the text of the step, and the scan.
pub(super) fn failures(suite: &Suite) -> Vec<String> {
    let options = RunOptions { jobs: 1, filter: None, progress: &|_, _| {}, given_up: None };
    let verdicts = run(suite, &programs(suite), &options).into_iter();
    let failed = verdicts.filter_map(|verdict| Some((verdict.name, verdict.failure?)));
    failed.map(|(name, failure)| format!("{name}: {} @{}", failure.text, failure.scan)).collect()
}

/// The steps of one scenario; each line is a step.
pub(super) fn scenario(steps: &str) -> String {
    let steps: Vec<String> = steps.lines().map(|step| format!("{:?},", step.trim())).collect();
    format!("[[scenario]]\nname = \"a\"\nsteps = [{}]\n", steps.concat())
}

/// Checks that all steps of a scenario pass.
fn passes(steps: &str) {
    assert_eq!(failures(&suite(&scenario(steps))), Vec::<String>::new(), "{steps}");
}

/// The messages of the findings about a condition.
fn findings(condition: &str) -> Vec<String> {
    let text = scenario(&format!("expect: {condition}"));
    reading(&text).findings.into_iter().map(|finding| finding.message).collect()
}

#[test]
fn was_is_the_value_at_the_end_of_the_scan_before() {
    passes(
        "run 1 scans
        set start 1
        run 1 scans
        expect: start & !was(start)
        run 1 scans
        expect: start & was(start)
        set start 0
        run 1 scans
        expect: !start & was(start)",
    );
}

#[test]
fn was_of_a_word_is_compared_and_computed_with() {
    passes(
        "set weight 10
        run 1 scans
        expect: weight == 10 & was(weight) == 0
        set weight 14
        run 1 scans
        expect: weight - was(weight) == 4 & was(weight) * 2 + 1 == 21
        expect: (was(weight) & 0x0A) == 0x0A & abs(was(weight) - weight) < 5
        set level 2.5
        run 1 scans
        expect: level - was(level) >= 2.5 & was(level) < 0.1",
    );
}

#[test]
fn was_takes_a_member_an_element_and_a_bit_of_a_word() {
    passes(
        "run 1 scans
        set recipe[2] 7
        set gate[1] 1
        set weight 8
        pulse bottle 10ms
        expect: bottles.Acc == 1 & was(bottles.Acc) == 0 & was(weight.3) == $Off
        expect: was(recipe[2]) == 0 & !was(gate[1]) & !was( weight.3 )
        run 1 scans
        expect: was(recipe[2]) == 7 & was(gate[1]) & was(weight.3) & was(recipe[2]) + 1 == 8
        expect: was(bottles.Acc) == 1 & was(Main.Running) & was(X0) & !X0 & was(D7) == 8",
    );
}

#[test]
fn after_every_start_was_is_memory_as_started() {
    let set = "[[scenario]]\nname = \"a\"\nset = { weight = 5, bottle = true }\nsteps = [\n";
    let steps = "\"expect: was(weight) == 5 & !was(bottle)\", \"set weight 6\", \"run 1 scans\",
        \"expect: was(weight) == 5 & weight == 6\", \"set start 1\", \"run 2 scans\", \"stop\",
        \"set weight 7\"]\n";
    assert_eq!(
        failures(&suite(&format!("{set}{steps}"))),
        ["a: set weight 7 @4"],
        "a queued write in STOP fails"
    );
    passes(
        "set weight 6
        run 2 scans
        stop
        expect: was(weight) == 6
        start
        expect: was(weight) == 6 & was(size) == 3
        run 1 scans
        expect: was(weight) == 6
        set weight 9
        run 1 scans
        power-cut
        expect: was(weight) == 0 & was(size) == 3
        run 1 scans
        expect: was(weight) == 0",
    );
}

#[test]
fn a_force_between_two_scans_does_not_change_what_was() {
    passes(
        "run 1 scans
        force pusher 1
        expect: pusher & !was(pusher)
        run 1 scans
        expect: pusher & !was(pusher)
        run 1 scans
        expect: was(pusher)",
    );
}

#[test]
fn always_within_and_hold_have_was() {
    let steps = scenario("set weight 3\nrun 1 scans\nset weight 9\nrun 3 scans");
    let always = format!("always = [\"weight - was(weight) < 5\"]\n{steps}");
    assert_eq!(failures(&suite(&always)), ["a: always: weight - was(weight) < 5 @2"]);
    passes(
        "beat bottle 10ms every 20ms
        within 1s: was(bottles.Acc) == 2
        set in_front 1
        hold 100ms: was(bottles.Acc) >= bottles.Acc",
    );
}

#[test]
fn an_edge_may_be_of_a_value_that_was() {
    passes(
        "run 1 scans
        set start 1
        run 1 scans
        expect: rise(start) & !rise(was(start))
        run 1 scans
        expect: rise(was(start))
        run 1 scans
        expect: !rise(was(start))",
    );
}

#[test]
fn a_reload_keeps_what_was() {
    passes(
        "set shift 4
        run 1 scans
        set shift 6
        run 1 scans
        reload crates2.toml
        expect: was(shift) == 4 & shift == 6
        run 1 scans
        expect: was(shift) == 6",
    );
}

#[test]
fn a_failure_shows_the_value_that_was_and_its_changes() {
    let suite = suite(&scenario("set weight 3\nrun 1 scans\nrun 2 scans\nexpect: was(weight) < 3"));
    let options = RunOptions { jobs: 1, filter: None, progress: &|_, _| {}, given_up: None };
    let verdicts = run(&suite, &programs(&suite), &options);
    let failure = verdicts[0].failure.as_ref().expect("it fails");
    let [operand] = &failure.operands[..] else { panic!("{:?}", failure.operands) };
    assert_eq!((operand.name.as_str(), operand.value.as_str()), ("was(weight)", "3"));
    let changes = operand.changes.iter().map(|change| (change.scan, change.value.as_str()));
    assert_eq!(changes.collect::<Vec<_>>(), [(1, "0"), (2, "3")]);
}

#[test]
fn was_takes_one_place() {
    for (condition, message) in [
        ("was()", "`was` takes one place"),
        ("was(start & bottle)", "`was` takes one place"),
        ("was(weight + 1) > 3", "`was` takes one place"),
        ("was(rise(start))", "`was` takes one place"),
        ("was(was(start))", "`was` takes one place"),
        ("was(3) > 2", "`was` takes one place"),
        ("was(start", "`was` takes one place"),
        ("was(strat)", "nothing is called `strat`"),
        ("was(late)", "`late` is a structure"),
        ("was(recipe[step]) > 1", "the index of `recipe[step]` is a word"),
        ("was(recipe) > 1", "`recipe` is an array: name an element, `recipe[0]` to `recipe[3]`"),
        ("was(patience) > 1", "`patience` is a constant, 2500: it has no address"),
        ("was(Drain)", "`Drain` is a block: `Drain.Running` is its bit"),
        ("was(weight)", "`was(weight)` is a word, not a bit"),
        ("was(start) > 2", "`was(start)` is a bit, not a number"),
    ] {
        assert_eq!(findings(condition), [message], "{condition}");
    }
}

#[test]
fn a_tag_of_the_ladder_may_be_called_was() {
    assert_eq!(findings("was"), ["nothing is called `was`"]);
    assert_eq!(findings("was > 3"), ["nothing is called `was`"]);
}

#[test]
fn conditions_take_bits_of_words_and_hexadecimal_numbers() {
    passes(
        "set weight 0x0A
        run 1 scans
        expect: weight.1 & weight.3 & !weight.0 & D7.3 & rise(weight.3)
        expect: weight == 0x0A & (weight & 0x0F) == 0x0A & (weight & 0x04) == 0
        expect: 0x0A == weight & weight - 0x02 == 8 & (weight.1 & weight.0) == 0
        set recipe[1] 0x80
        run 1 scans
        expect: recipe[1].7 & recipe[step + 1].7 & was(weight.1)",
    );
}
