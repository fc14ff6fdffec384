//! Observers of test files, played.
//!
//! Each test is a test file over the ladder of `tests/suites`, and what becomes of its scenarios.

use std::path::Path;

use super::reading::read_text;
use super::runner::{RunOptions, programs, run};
use super::suite::Suite;
use super::was_tests::{failures, reading, scenario, suite};
use rungd_language::source::span::SourceFile;

/// An observer with these tags and rungs.
fn observer(tags: &str, rungs: &str) -> String {
    let rungs = rungs.trim().replace("rung ", "[[observer.rung]]\n");
    format!("[observer.tags]\n{tags}\n{rungs}\n")
}

/// Checks that all steps of a scenario pass with an observer.
fn observes(observer: &str, steps: &str) {
    let text = format!("{observer}{}", scenario(steps));
    assert_eq!(failures(&suite(&text)), Vec::<String>::new(), "{text}");
}

/// The messages of the findings of a test file with an observer.
fn findings_about(observer: &str) -> Vec<String> {
    let text = format!("{observer}{}", scenario("run 1 scans"));
    reading(&text).findings.into_iter().map(|finding| finding.message).collect()
}

#[test]
fn the_observer_is_executed_behind_each_scan_before_conditions_are_judged() {
    let lamp = observer(
        "seen = { type = \"bit\" }\nscans = { type = \"int\" }",
        "rung when = [\"full_lamp\"]\ndo = [\"OUT seen\"]
        rung when = [\"$On\"]\ndo = [\"ADD scans 1 to=scans\"]",
    );
    observes(
        &lamp,
        "expect: !seen & scans == 0
        run 1 scans
        expect: scans == 1
        pulse bottle 10ms every 30ms times 3
        expect: bottles.Done & seen & full_lamp & scans == 10
        set in_front 1
        within 10ms: !seen
        hold 50ms: !seen & scans - was(scans) == 1",
    );
    let always = format!("always = [\"seen == full_lamp\", \"scans < 4\"]\n{lamp}");
    let text = format!("{always}{}", scenario("run 9 scans"));
    assert_eq!(failures(&suite(&text)), ["a: always: scans < 4 @4"]);
}

#[test]
fn the_observer_measures_the_time_of_the_controllers_scans() {
    let waited = observer(
        "waited = { type = \"timer\" }\nrises = { type = \"counter\" }",
        "rung when = [\"start\", \"!pusher\"]\ndo = [\"TMR waited preset=100ms\"]
        rung leg.up = [\"rise(start)\"]\nleg.rst = [\"$Off\"]\ndo = [\"CNT rises preset=2\"]",
    );
    observes(
        &waited,
        "run 3 scans
        set start 1
        run 10 scans
        expect: !waited.Done & waited.Acc == 90
        run 1 scans
        expect: waited.Done & rises.Acc == 1
        set start 0
        run 1 scans
        expect: waited.Acc == 0
        pulse start 10ms
        expect: rises.Done",
    );
}

#[test]
fn the_observer_sees_a_last_scan_before_its_passes() {
    let pushed = observer(
        "pushed = { type = \"bit\" }\nlast = { type = \"bit\" }",
        "rung when = [\"pusher\"]\ndo = [\"OUT pushed\"]
        rung when = [\"$LastScan\"]\ndo = [\"SET last\"]",
    );
    observes(
        &pushed,
        "run 1 scans
        pulse bottle 10ms every 20ms times 3
        expect: pusher & pushed & !last
        stop
        expect: !pusher & pushed & last
        start
        run 1 scans
        expect: pushed == pusher & last",
    );
}

#[test]
fn the_observer_reads_all_memory_of_the_controller() {
    let all = observer(
        "open = { type = \"bit\" }\nsum = { type = \"int\" }\nat = { type = \"int\" }
        half = { type = \"real\" }\nlimit = { value = 7 }\nall = { type = \"int\", count = 4 }",
        "rung when = [\"Drain.Running\", \"Drain.Open\"]\ndo = [\"OUT open\"]
        rung when = [\"recipe[step] > limit\", \"weight.0\", \"D7.1\", \"size == 3\"]\ndo = [
            \"MATH sum = recipe[step] + recipe[2] * 2 + bottles.Acc\", \"MATH half = level / 2\",
            \"COPY recipe to=all\", \"MOVE recipe[step] to=at\"]",
    );
    observes(
        &all,
        "set start 1
        set recipe[1] 8
        set recipe[2] 5
        set step 1
        set level 3
        set weight 3
        run 2 scans
        expect: open & sum == 18 & half == 1.5 & at == 8 & all[2] == 5
        expect: all[step] == 8 & sum(all) == 13 & was(all[1]) == 8",
    );
}

#[test]
fn the_observer_goes_on_over_a_new_process_and_a_reload() {
    let counts = observer(
        "scans = { type = \"int\", initial = 100 }\nlong = { type = \"timer\" }",
        "rung when = [\"$On\"]\ndo = [\"ADD scans 1 to=scans\", \"TMR long preset=10s\"]",
    );
    observes(
        &counts,
        "run 2 scans
        expect: scans == 102 & long.Acc == 10
        restart for 1s
        expect: scans == 103
        run 1 scans
        expect: scans == 104 & long.Acc > 1s & $FirstScan
        power-cut
        run 1 scans
        expect: scans == 105
        reload crates2.toml
        expect: scans == 105 & was(scans) == 104
        run 1 scans
        expect: scans == 106 & was(scans) == 105 & long.Acc > 1s30ms",
    );
}

#[test]
fn the_observer_may_use_templates_of_the_ladder() {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suites/x.test.toml");
    let text = "ladder = [\"crates.toml\", \"lib:pulse\"]
        [observer.tags]\nlong = { type = \"bit\" }
        [[observer.rung]]\nuse = \"Pulse\"\nname = \"p\"
        with = { trigger = \"start\", length = \"50ms\" }
        [[observer.rung]]\nwhen = [\"p.on\"]\ndo = [\"OUT long\"]\n";
    let steps = scenario("run 1 scans\npulse start 10ms\nexpect: long\nrun 9 scans\nexpect: !long");
    let file = SourceFile { name: "x.test.toml".to_owned(), text: format!("{text}{steps}") };
    let read = read_text(&path, file, None);
    let found: Vec<_> = read.findings.iter().map(|finding| &finding.message).collect();
    let suite = read.suite.unwrap_or_else(|| panic!("{found:?}"));
    assert_eq!(failures(&suite), Vec::<String>::new());
}

#[test]
fn the_observer_writes_its_own_tags_alone() {
    for (instruction, message) in [
        ("OUT pusher", "`pusher` belongs to the ladder: an observer only reads it"),
        ("SET C5", "`C5` belongs to the ladder: an observer only reads it"),
        ("MOVE 1 to=recipe[step]", "`recipe[0]` belongs to the ladder: an observer only reads it"),
        ("OUT weight.3", "`weight.3` belongs to the ladder: an observer only reads it"),
        ("SET alias", "`alias` belongs to the ladder: an observer only reads it"),
        ("TMR late preset=1s", "`late` belongs to the ladder: an observer only reads it"),
        ("RSTT late", "`late` belongs to the ladder: an observer only reads it"),
        ("RUN Drain", "an observer starts, stops and calls nothing"),
        ("EXIT", "an observer starts, stops and calls nothing"),
    ] {
        let own = "own = { type = \"bit\" }\nalias = { at = \"D7.1\" }";
        let text = observer(own, &format!("rung when = [\"start\"]\ndo = [\"{instruction}\"]"));
        assert_eq!(findings_about(&text), [message], "{instruction}");
    }
}

#[test]
fn the_names_of_the_observer_are_none_of_the_ladders() {
    let rung = "rung when = [\"start\"]\ndo = [\"OUT own\"]";
    let named = |name: &str| {
        let tags = format!("own = {{ type = \"bit\" }}\n{name} = {{ type = \"bit\" }}");
        findings_about(&observer(&tags, rung))
    };
    assert_eq!(named("pusher"), ["the name `pusher` is taken"]);
    assert_eq!(named("recipe"), ["the name `recipe` is taken"]);
    assert_eq!(named("Drain"), ["the name `Drain` is taken"]);
    assert_eq!(named("D7"), ["`D7` reads as an address"]);
    assert_eq!(named("other"), Vec::<String>::new());
    let n = observer("n = { type = \"sensaphone\" }", "");
    assert_eq!(findings_about(&n), ["an observer has no Sensaphone counters"]);
}

#[test]
fn the_help_for_an_unknown_type_lists_those_of_observers() {
    let text = observer("n = { type = \"xyz\" }", "");
    let text = format!("{text}{}", scenario("run 1 scans"));
    let finding = reading(&text).findings.remove(0);
    assert_eq!(finding.message, "a tag has no type `xyz`");
    let help = finding.help_text().unwrap_or_default();
    assert_eq!(help, "the types are bit, int, word, real, timer, counter");
}

#[test]
fn a_test_does_not_write_what_the_observer_has() {
    let own = observer("own = { type = \"bit\" }", "rung when = [\"start\"]\ndo = [\"OUT own\"]");
    let message = ["`own` belongs to the observer: its rungs alone write it"];
    for step in ["set own 1", "force own 1", "pulse own 10ms"] {
        let read = reading(&format!("{own}{}", scenario(step)));
        let found: Vec<_> = read.findings.into_iter().map(|finding| finding.message).collect();
        assert_eq!(found, message, "{step}");
    }
}

#[test]
fn a_failure_shows_the_tags_of_the_observer() {
    let count = observer(
        "pushed = { type = \"int\" }",
        "rung when = [\"rise(pusher)\"]\ndo = [\"ADD pushed 1 to=pushed\"]",
    );
    let steps = "run 1 scans\npulse bottle 10ms every 20ms times 3\nexpect: pushed == 0 & start";
    let suite = suite(&format!("{count}{}", scenario(steps)));
    let options = RunOptions { jobs: 1, filter: None, progress: &|_, _| {}, given_up: None };
    let verdicts = run(&suite, &programs(&suite), &options);
    let failure = verdicts[0].failure.as_ref().expect("it fails");
    let [pushed, start] = &failure.operands[..] else { panic!("{:?}", failure.operands) };
    assert_eq!((pushed.name.as_str(), pushed.value.as_str()), ("pushed", "1"));
    let changes = pushed.changes.iter().map(|change| (change.scan, change.value.as_str()));
    assert_eq!(changes.collect::<Vec<_>>(), [(1, "0"), (6, "1")]);
    assert_eq!(start.name, "start");
    assert!(failure.why.iter().any(|why| why.contains("start")), "{:?}", failure.why);
}

/// The images of all scans of the first scenario of a suite.
fn images(suite: &Suite) -> Vec<(Vec<u8>, Vec<i32>)> {
    let mut all = Vec::new();
    let mut row = |scan: super::TracedScan<'_>| {
        all.push((scan.image.bits().to_vec(), scan.image.words().to_vec()));
        Ok(())
    };
    super::trace(suite, &programs(suite), 0, &mut row).expect("no file is written");
    all
}

#[test]
fn the_controller_does_the_same_with_an_observer() {
    let steps = scenario(
        "set start 1\nbeat bottle 10ms every 30ms\nset recipe[0] 9\nset swapped 1\nset gate[0] 1
        set level 50\nrun 1s\nstop\nstart\nrun 1s\npower-cut\nrun 500ms
        reload crates2.toml\nrun 1s",
    );
    let busy = observer(
        "a = { type = \"timer\" }\nb = { type = \"counter\" }\nc = { type = \"int\", count = 50 }",
        "rung when = [\"rise(bottle)\"]\ndo = [\"ADD c[0] 1 to=c[0]\", \"MATH c[1] = shift / c[2]\"]
        rung when = [\"late.Done\"]\ndo = [\"TMR a preset=1s\"]
        rung leg.up = [\"pusher\"]\nleg.rst = [\"$LastScan\"]\ndo = [\"CNT b preset=3\"]",
    );
    let always = "always = [\"was(shift) <= shift | a.Acc >= 0\"]\n";
    let (alone, observed) = (suite(&steps), suite(&format!("{always}{busy}{steps}")));
    assert!(images(&alone) == images(&observed));
}

#[test]
fn a_condition_over_a_rung_that_copies_x_judges_as_was_x_does() {
    let copies = "[observer.tags]\nnow_level = { type = \"real\" }\nbefore = { type = \"real\" }
        now_start = { type = \"bit\" }\nstart_before = { type = \"bit\" }
        now_acc = { type = \"int\" }\nacc_before = { type = \"int\" }
        [[observer.rung]]\nwhen = [\"$On\"]\ndo = [
            \"MOVE now_level to=before\", \"MOVE level to=now_level\",
            \"MOVE now_acc to=acc_before\", \"MOVE bottles.Acc to=now_acc\"]
        [[observer.rung]]\nwhen = [\"now_start\"]\ndo = [\"OUT start_before\"]
        [[observer.rung]]\nwhen = [\"start\"]\ndo = [\"OUT now_start\"]\n";
    let random = |seed: u32| {
        let change = "change = { start = \"9%\", bottle = \"40%\", in_front = \"1%\", \
                      level = { walk = \"0..100\", step = 3, chance = \"30%\" } }";
        format!("[[random]]\nname = \"a\"\nruns = 2\nscans = 60\nseed = {seed}\n{change}\n")
    };
    let lines = [
        ("level - was(level) < 3 | bottle", "level - before < 3 | bottle"),
        ("!was(start) | start | pusher", "!start_before | start | pusher"),
        ("was(bottles.Acc) < 9 | was(level) < 6", "acc_before < 9 | before < 6"),
        ("was(bottles.Acc) < 3 | was(level) < 9", "acc_before < 3 | before < 9"),
    ];
    let mut failed = 0;
    for seed in 0..50 {
        for (was, copied) in lines {
            let of = |line: &str| {
                let text = format!("always = [\"{line}\"]\n{copies}{}", random(seed));
                let failures = failures(&suite(&text));
                failures
                    .iter()
                    .map(|told| told.rsplit('@').next().unwrap().to_owned())
                    .collect::<Vec<_>>()
            };
            let (was, copied) = (of(was), of(copied));
            assert_eq!(was, copied, "seed {seed}");
            failed += was.len();
        }
    }
    assert!((50..180).contains(&failed), "{failed}");
}
