//! Reads test files and checks the result: the resolved tests, or the findings.

use std::path::Path;

use expect_test::{Expect, expect};

use super::reading::read_text;
use super::suite::{RandomChange, RandomTest, Reload, TestOperand, TestStep};
use rungd_language::source::finding::Severity;
use rungd_language::source::span::SourceFile;

/// Checks a whole test file of `tests/suites`.
fn check_file(text: &str, expected: Expect) {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suites/x.test.toml");
    let file = SourceFile { name: "x.test.toml".to_owned(), text: text.to_owned() };
    let read = read_text(&path, file, None);
    let mut told = String::new();
    for finding in &read.findings {
        let file = &read.files[finding.span.file.0 as usize];
        let (line, column) = file.line_column(finding.span.start);
        let mark = if finding.severity() == Severity::Warning { "warning " } else { "" };
        let name = file.name.rsplit('/').next().unwrap_or_default();
        let name = if name == "x.test.toml" { "" } else { name };
        told += &format!(
            "{name}{line}:{column} {mark}{}\n  {}\n",
            finding.code.name(),
            finding.message
        );
        let help = finding.help_text().map(|help| help.chars().take(80).collect::<String>());
        told += &help.map_or(String::new(), |help| format!("    {help}\n"));
    }
    if let Some(suite) = &read.suite {
        for (id, always) in suite.always.iter().enumerate() {
            always.iter().for_each(|of| told += &format!("always {id}: {}\n", of.text));
        }
        for scenario in &suite.scenarios {
            told += &format!("{}:{}\n", scenario.name, shown_set(&scenario.set));
            scenario.steps.iter().for_each(|step| told += &format!("  {}\n", shown(&step.value)));
        }
        for random in &suite.randoms {
            let RandomTest { name, runs, scans, seed, set, changes, .. } = random;
            told += &format!("{name}: {runs} runs of {scans}, seed {seed}:{}\n", shown_set(set));
            for RandomChange { operand, chance, motion } in changes {
                told += &format!("  {} {chance:?} {motion:?}\n", operand.name);
            }
        }
    }
    expected.assert_eq(&told.replace(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."), "…"));
}

fn shown_set(set: &[(TestOperand, i32)]) -> String {
    set.iter().map(|(of, value)| format!(" {}={value}", shown_operand(of))).collect()
}

/// An input with its number.
fn shown_operand(operand: &TestOperand) -> String {
    operand.input.map_or(operand.name.clone(), |n| format!("{}(X{n})", operand.name))
}

fn shown(step: &TestStep) -> String {
    match step {
        TestStep::Set(of, value) => format!("set {}={value}", shown_operand(of)),
        TestStep::Force(of, value) => format!("force {}={value}", shown_operand(of)),
        TestStep::Unforce(of) => format!("unforce {}", shown_operand(of)),
        TestStep::Pulse { operand, on, every, times } => {
            format!("pulse {} {on:?} {every:?} {times}", shown_operand(operand))
        }
        TestStep::Beat { operand, on, every } => {
            format!("beat {} {on:?} {every:?}", shown_operand(operand))
        }
        TestStep::Expect(condition) => format!("expect [{}]", condition.text),
        TestStep::Within(time, condition) => format!("within {time:?} [{}]", condition.text),
        TestStep::Hold(time, condition) => format!("hold {time:?} [{}]", condition.text),
        TestStep::Reload(Reload::Refused(text)) => {
            let line = text.lines().next().unwrap_or_default();
            let line = line.rsplit('/').next().unwrap_or_default();
            format!("refused: {}", line.chars().take(70).collect::<String>())
        }
        TestStep::Run(_)
        | TestStep::Late(_)
        | TestStep::Stop
        | TestStep::Start
        | TestStep::Restart { .. }
        | TestStep::PowerCut(_)
        | TestStep::Reload(Reload::To(_))
        | TestStep::Lose(_)
        | TestStep::Restore(_)
        | TestStep::Clock(_) => format!("{step:?}"),
    }
}

/// Checks the steps of a scenario; each line is a step.
fn check(steps: &str, expected: Expect) {
    let steps: Vec<String> =
        steps.lines().map(|step| format!("    {:?},\n", step.trim())).collect();
    let steps = steps.concat();
    let text =
        format!("ladder = [\"crates.toml\"]\n[[scenario]]\nname = \"a\"\nsteps = [\n{steps}]\n");
    check_file(&text, expected);
}

#[test]
fn every_kind_of_step_is_read() {
    check(
        "pulse bottle 100ms every 400ms times 3
        pulse bottle 50ms
        beat start 100ms every 1s
        set in_front 1
        set size 12
        set weight 3s
        set level 12.5
        set level 3
        set gate[2] ON
        set recipe[1] -4
        force pusher 1
        force late.Done 1
        unforce pusher
        run 2s
        run 2 scans
        late 3
        stop
        start
        restart
        power-cut
        power-cut lose 2s
        restart for 8h
        power-cut for 1m
        power-cut for 1m lose 2s
        clock 2026-11-22T06:00:00
        within 2s: pusher
        within 00:00:02:500: pusher
        hold 300ms : full_lamp & bottles.Acc == 3
        expect: !pusher",
        expect![[r#"
            a:
              pulse bottle(X0) Ms(100) Ms(400) 3
              pulse bottle(X0) Ms(50) Ms(50) 1
              beat start(X2) Ms(100) Ms(1000)
              set in_front(X1)=1
              set size=12
              set weight=3000
              set level=1095237632
              set level=1077936128
              set gate[2]=1
              set recipe[1]=-4
              force pusher=1
              force late.Done=1
              unforce pusher
              Run(Ms(2000))
              Run(Scans(2))
              Late(3)
              Stop
              Start
              Restart { down_ms: 0 }
              PowerCut(PowerOff { down_ms: 0, lose_ms: 0 })
              PowerCut(PowerOff { down_ms: 0, lose_ms: 2000 })
              Restart { down_ms: 28800000 }
              PowerCut(PowerOff { down_ms: 60000, lose_ms: 0 })
              PowerCut(PowerOff { down_ms: 60000, lose_ms: 2000 })
              Clock(1795327200)
              within Ms(2000) [pusher]
              within Ms(2500) [pusher]
              hold Ms(300) [full_lamp & bottles.Acc == 3]
              expect [!pusher]
        "#]],
    );
}

#[test]
fn a_complete_test_file_is_read() {
    check_file(
        r#"
ladder = ["crates.toml"]
period = "20ms"
always = ["!(pusher & !full_lamp)", "level <= 95 | !start", "gate[0] + gate[1] <= 1"]

[retain]
tags = ["shift"]

[[scenario]]
name  = "a full crate is pushed out"
set   = { swapped = true, size = 4, "recipe[2]" = -1, weight = "2s", bottle = 1 }
steps = [
    "expect: bottles.Acc == 0 & shift == 0",
    "within 2s: (size + 1) * 2 - recipe[step] % 3 >= -3 & rise(pusher | gate[step])",
    "power-cut",
]

[[random]]
name   = "nobody can open both valves"
runs   = 200
scans  = 5000
seed   = 7
[random.change]
start  = "0.1%"
level  = { walk = "0..50.5", step = 0.5, chance = "10%" }
weight = { jump = "-9..9", chance = "100%" }
"#,
        expect![[r#"
            always 0: !(pusher & !full_lamp)
            always 0: level <= 95 | !start
            always 0: gate[0] + gate[1] <= 1
            a full crate is pushed out: swapped=1 size=4 recipe[2]=-1 weight=2000 bottle(X0)=1
              expect [bottles.Acc == 0 & shift == 0]
              within Ms(2000) [(size + 1) * 2 - recipe[step] % 3 >= -3 & rise(pusher | gate[step])]
              PowerCut(PowerOff { down_ms: 0, lose_ms: 0 })
            nobody can open both valves: 200 runs of 5000, seed 7:
              start Chance(1000) Toggle
              level Chance(100000) Walk { low: 0.0, high: 50.5, step: 0.5 }
              weight Chance(1000000) Jump { low: -9.0, high: 9.0 }
        "#]],
    );
}

#[test]
fn steps_after_a_reload_refer_to_the_reloaded_program() {
    check_file(
        r#"
controller = "rungd.toml"
always = ["!(pusher & !full_lamp)"]

[[scenario]]
name  = "a reload"
steps = [
    "expect: bottles.Acc == 0",
    "reload crates2.toml",
    "expect: crates_out.Acc == 0",
    "set bottle 1",
    "reload crates2.toml",
    "lose plant",
    "reload rungd.toml",
    "expect: bottles.Acc == 0",
    "reload crates.toml",
    "restore plant",
]

[[scenario]]
name  = "refused"
steps = ["reload rungd2.toml", "expect: left_out"]

[[scenario]]
name  = "refused too"
steps = ["reload wrong.toml", "expect: nothing"]
"#,
        expect![[r#"
            always 0: !(pusher & !full_lamp)
            always 1: !(pusher & !full_lamp)
            always 2: !(pusher & !full_lamp)
            a reload:
              expect [bottles.Acc == 0]
              Reload(To(ProgramId(1)))
              expect [crates_out.Acc == 0]
              set bottle(X0)=1
              Reload(To(ProgramId(1)))
              Lose(DeviceId(0))
              Reload(To(ProgramId(0)))
              expect [bottles.Acc == 0]
              Reload(To(ProgramId(2)))
              Restore(DeviceId(0))
            refused:
              refused: rungd2.toml: the sizes in `[memory]` differ from the running program's
            refused too:
              refused: error[unknown-name]: nothing is called `missing`
        "#]],
    );
}

#[test]
fn names_after_a_reload_are_checked_against_the_new_program() {
    check(
        "reload crates2.toml
        expect: bottles.Acc == 0
        reload rungd.toml crates.toml
        reload crates.toml crates.toml",
        expect![[r#"
            6:14 unknown-name
              nothing is called `bottles`
                did you mean `bottle.Acc`?
            7:13 test-step
              `rungd.toml` is a controller file, given with other files
                name it alone, `reload rungd.toml`, or name ladders alone
            8:25 test-step
              `crates.toml` is named twice
                remove one of the two
        "#]],
    );
}

#[test]
fn an_always_line_invalid_in_the_new_program_is_reported_at_the_reload() {
    check_file(
        r#"
ladder = ["crates.toml"]
always = ["bottles.Acc < 5"]

[[scenario]]
name  = "a reload"
steps = ["reload crates2.toml", "reload crates2.toml", "expect: bottles.Acc == 0"]
"#,
        expect![[r#"
            7:11 test-step
              an `always` line does not fit this program: nothing is called `bottles`
                did you mean `bottle.Acc`?
            7:65 unknown-name
              nothing is called `bottles`
                did you mean `bottle.Acc`?
        "#]],
    );
}

#[test]
fn a_file_with_nothing_to_test_or_prove_gives_a_warning() {
    check_file(
        "ladder = [\"crates.toml\"]\nalways = [\"pusher & bottle | start\"]",
        expect![[r#"
            2:12 warning mixed-and-or
              `&` and `|` are mixed without parentheses
                as it is read now: `(pusher & bottle) | start`
            always 0: pusher & bottle | start
        "#]],
    );
    check_file(
        "",
        expect![[r#"
        1:1 missing-key
          the file names no ladder to test
            give it one: `ladder = ["ladder.toml"]`, or `controller = "rungd.toml"`
        1:1 warning test-empty
          a test file without a test
            write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
    "#]],
    );
    check_file(
        "scenario = 3",
        expect![[r#"
        1:1 missing-key
          the file names no ladder to test
            give it one: `ladder = ["ladder.toml"]`, or `controller = "rungd.toml"`
        1:12 wrong-type
          `scenario` of the file wants an array of tables (`[[scenario]]`), not an integer
    "#]],
    );
    check_file(
        "controller = \"nothing.toml\"\n[[scenario]]\nname = \"a\"\nsteps = [\"run\"]",
        expect![[r#"
            1:15 test-file
              cannot read `…/tests/suites/nothing.toml`: No such file or directory (os error 2)
                paths are relative to the test file
            4:14 test-step
              `run` wants a duration, or a number of scans here
                write it as `run 2s`
        "#]],
    );
}

#[test]
fn files_of_other_kinds_and_files_with_errors_are_reported() {
    check_file(
        "ladder = [\"rungd.toml\"]",
        expect![[r#"
        1:1 warning test-empty
          a test file without a test
            write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
        rungd.toml2:1 controller
          this is a controller file, not a ladder file
            give the ladder that it names: `crates.toml`
    "#]],
    );
    check_file(
        "controller = \"crates.toml\"",
        expect![[r#"
        1:1 warning test-empty
          a test file without a test
            write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
        crates.toml2:2 controller
          this is a ladder file, not a controller file
            a controller file names it: `ladder = ["crates.toml"]`
    "#]],
    );
    check_file(
        "controller = \"crates.test.toml\"",
        expect![[r#"
        1:1 warning test-empty
          a test file without a test
            write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
        crates.test.toml4:1 test-file
          this is a test file, not a controller file
            `rungd test` runs it, and reports its mistakes
    "#]],
    );
    check_file(
        "ladder = [\"crates.test.toml\"]",
        expect![[r#"
        1:1 warning test-empty
          a test file without a test
            write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
        crates.test.toml4:1 test-file
          this is a test file, not a ladder file
            `rungd test` runs it, and reports its mistakes
    "#]],
    );
    check_file(
        "ladder = [\"wrong.toml\"]",
        expect![[r#"
            1:1 warning test-empty
              a test file without a test
                write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`
            wrong.toml9:10 unknown-name
              nothing is called `missing`
                declare it under [tags]: `missing = { type = "bit" }`, or "int", "real"; or with
        "#]],
    );
}

#[test]
fn the_numbers_of_tests_and_steps_are_limited() {
    let head = "ladder = [\"crates.toml\"]\n".to_owned();
    let test = |name: usize, steps: usize| {
        let steps = "\"stop\",".repeat(steps);
        format!("[[scenario]]\nname = \"{name}\"\nsteps = [{steps}]\n")
    };
    let tests: String = (0..10_001).map(|name| test(name, 1)).collect();
    check_file(
        &(head.clone() + &tests),
        expect![[r#"
        2:3 test-file
          10001 tests; a file has at most 10000
            divide it into several files
    "#]],
    );
    check_file(
        &(head + &test(0, 100_001)),
        expect![[r#"
        2:3 test-file
          100001 steps; a file has at most 100000
            divide it into several files
    "#]],
    );
}
