//! Test files as they read: the resolved tests, or the findings.

use std::path::Path;

use expect_test::{Expect, expect};

use super::reading::read_text;
use crate::source::finding::Severity;
use crate::source::span::SourceFile;

/// Checks a whole test file of `tests/suites`.
fn check_file(text: &str, expected: Expect) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suites/x.test.toml");
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
        told += &finding.help_text().map_or(String::new(), |help| format!("    {help}\n"));
    }
    if let Some(suite) = &read.suite {
        for (id, always) in suite.always.iter().enumerate() {
            always.iter().for_each(|of| told += &format!("always {id}: {}\n", of.text));
        }
        for scenario in &suite.scenarios {
            told += &format!("{}: {:?}\n", scenario.name, scenario.set);
            scenario.steps.iter().for_each(|step| told += &format!("  {:?}\n", step.value));
        }
        suite.randoms.iter().for_each(|random| told += &format!("{random:#?}\n"));
    }
    expected.assert_eq(&told);
}

/// Checks the steps of a scenario, one a line.
fn check(steps: &str, expected: Expect) {
    let steps: Vec<String> =
        steps.lines().map(|step| format!("    {:?},\n", step.trim())).collect();
    let steps = steps.concat();
    let text =
        format!("ladder = [\"crates.toml\"]\n[[scenario]]\nname = \"a\"\nsteps = [\n{steps}]\n");
    check_file(&text, expected);
}

#[test]
fn every_step_is_read() {
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
        stop
        start
        restart
        power-cut
        power-cut lose 2s
        clock 2026-11-22T06:00:00
        within 2s: pusher
        within 00:00:02:500: pusher
        hold 300ms : full_lamp & bottles.Acc == 3
        expect: !pusher",
        expect![[r#"
            a: []
              Pulse { operand: Operand { name: "bottle", cell: Bit(BitCell(4608)), input: Some(0) }, on: Ms(100), every: Ms(400), times: 3 }
              Pulse { operand: Operand { name: "bottle", cell: Bit(BitCell(4608)), input: Some(0) }, on: Ms(50), every: Ms(50), times: 1 }
              Beat { operand: Operand { name: "start", cell: Bit(BitCell(4610)), input: Some(2) }, on: Ms(100), every: Ms(1000) }
              Set(Operand { name: "in_front", cell: Bit(BitCell(4609)), input: Some(1) }, 1)
              Set(Operand { name: "size", cell: Word(WordCell(8762)), input: None }, 12)
              Set(Operand { name: "weight", cell: Word(WordCell(4679)), input: None }, 3000)
              Set(Operand { name: "level", cell: Word(WordCell(9791)), input: None }, 1095237632)
              Set(Operand { name: "level", cell: Word(WordCell(9791)), input: None }, 1077936128)
              Set(Operand { name: "gate[2]", cell: Bit(BitCell(10750)), input: None }, 1)
              Set(Operand { name: "recipe[1]", cell: Word(WordCell(8765)), input: None }, -4)
              Force(Operand { name: "pusher", cell: Bit(BitCell(6656)), input: None }, 1)
              Force(Operand { name: "late.Done", cell: Bit(BitCell(4088)), input: None }, 1)
              Unforce(Operand { name: "pusher", cell: Bit(BitCell(6656)), input: None })
              Run(Ms(2000))
              Run(Scans(2))
              Stop
              Start
              Restart
              PowerCut { lose_ms: 0 }
              PowerCut { lose_ms: 2000 }
              Clock(1795327200)
              Within(Ms(2000), Condition { text: "pusher", operands: [("pusher", Bit(BitCell(6656)))], edges: 0, selected: [], judge: Bit(BitCell(6656)) })
              Within(Ms(2500), Condition { text: "pusher", operands: [("pusher", Bit(BitCell(6656)))], edges: 0, selected: [], judge: Bit(BitCell(6656)) })
              Hold(Ms(300), Condition { text: "full_lamp & bottles.Acc == 3", operands: [("full_lamp", Bit(BitCell(6657))), ("bottles.Acc", Word(WordCell(255)))], edges: 0, selected: [], judge: All([Bit(BitCell(6657)), Compare(Word(WordCell(255)), Eq, Constant(Integer(3)))]) })
              Expect(Condition { text: "!pusher", operands: [("pusher", Bit(BitCell(6656)))], edges: 0, selected: [], judge: Not(Bit(BitCell(6656))) })
        "#]],
    );
}

#[test]
fn a_whole_file_is_read() {
    check_file(
        r#"
ladder = ["crates.toml"]
period = "20ms"
always = ["!(pusher & !full_lamp)", "level <= 95 | !start", "gate[0] + gate[1] <= 1"]

[retain]
tags = ["shift"]

[[scenario]]
name  = "a full crate is pushed out"
set   = { swapped = true, size = 4, "recipe[2]" = -1, level = 1.5, weight = "2s", bottle = 1 }
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
change = { start = "0.1%", level = { walk = "0..50.5", step = 0.5, chance = "10%" }, weight = { jump = "-9..9", chance = "100%" } }
"#,
        expect![[r#"
            always 0: !(pusher & !full_lamp)
            always 0: level <= 95 | !start
            always 0: gate[0] + gate[1] <= 1
            a full crate is pushed out: [(Operand { name: "swapped", cell: Bit(BitCell(10747)), input: None }, 1), (Operand { name: "size", cell: Word(WordCell(8762)), input: None }, 4), (Operand { name: "recipe[2]", cell: Word(WordCell(8766)), input: None }, -1), (Operand { name: "level", cell: Word(WordCell(9791)), input: None }, 1069547520), (Operand { name: "weight", cell: Word(WordCell(4679)), input: None }, 2000), (Operand { name: "bottle", cell: Bit(BitCell(4608)), input: Some(0) }, 1)]
              Expect(Condition { text: "bottles.Acc == 0 & shift == 0", operands: [("bottles.Acc", Word(WordCell(255))), ("shift", Word(WordCell(8763)))], edges: 0, selected: [], judge: All([Compare(Word(WordCell(255)), Eq, Constant(Integer(0))), Compare(Word(WordCell(8763)), Eq, Constant(Integer(0)))]) })
              Within(Ms(2000), Condition { text: "(size + 1) * 2 - recipe[step] % 3 >= -3 & rise(pusher | gate[step])", operands: [("size", Word(WordCell(8762))), ("step", Word(WordCell(8761))), ("pusher", Bit(BitCell(6656)))], edges: 1, selected: [("recipe[step]", ElementCells { first: Word(WordCell(8764)), is_real: false, count: 4, index: WordCell(8761) }), ("gate[step]", ElementCells { first: Bit(BitCell(10748)), is_real: false, count: 4, index: WordCell(8761) })], judge: All([Compare(Sum([Read(Word(WordCell(8762))), Read(Constant(Integer(1))), Compute(Add), Read(Constant(Integer(2))), Compute(Multiply), Read(Element(ElementCells { first: Word(WordCell(8764)), is_real: false, count: 4, index: WordCell(8761) })), Read(Constant(Integer(3))), Compute(Remainder), Compute(Subtract)]), Ge, Constant(Integer(-3))), Edge(Rise, 0, Any([Bit(BitCell(6656)), Element(ElementCells { first: Bit(BitCell(10748)), is_real: false, count: 4, index: WordCell(8761) })]))]) })
              PowerCut { lose_ms: 0 }
            RandomTest {
                name: "nobody can open both valves",
                span: Span {
                    file: FileId(
                        0,
                    ),
                    start: 462,
                    end: 472,
                },
                runs: 200,
                scans: 5000,
                seed: 7,
                set: [],
                changes: [
                    RandomChange {
                        operand: Operand {
                            name: "start",
                            cell: Bit(
                                BitCell(
                                    4610,
                                ),
                            ),
                            input: Some(
                                2,
                            ),
                        },
                        chance: Chance(
                            1000,
                        ),
                        motion: Toggle,
                    },
                    RandomChange {
                        operand: Operand {
                            name: "level",
                            cell: Word(
                                WordCell(
                                    9791,
                                ),
                            ),
                            input: None,
                        },
                        chance: Chance(
                            100000,
                        ),
                        motion: Walk {
                            low: 0.0,
                            high: 50.5,
                            step: 0.5,
                        },
                    },
                    RandomChange {
                        operand: Operand {
                            name: "weight",
                            cell: Word(
                                WordCell(
                                    4679,
                                ),
                            ),
                            input: None,
                        },
                        chance: Chance(
                            1000000,
                        ),
                        motion: Jump {
                            low: -9.0,
                            high: 9.0,
                        },
                    },
                ],
            }
        "#]],
    );
}
