//! Conditions as tables: a condition, the memory, and whether it is true.

use std::path::Path;

use super::condition::Condition;
use super::names::{Observation, TestNames};
use super::programs::test_program;
use super::suite::TestProgram;
use rungd_config::load;
use rungd_engine::{Cell, Engine, EngineCall};
use rungd_language::lower::lower;
use rungd_language::resolve::LoadOptions;
use rungd_language::source::condition;
use rungd_language::source::span::{FileId, Span};

/// The ladder of `tests/suites`, with its memory.
struct TestPlant {
    program: TestProgram,
    engine: Engine,
}

impl TestPlant {
    fn new() -> TestPlant {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suites");
        let loaded = load::controller_file(&folder.join("rungd.toml")).expect("readable");
        let program = test_program(loaded).expect("no errors");
        let engine = Engine::new(lower(&program.program).0);
        TestPlant { program, engine }
    }

    fn condition(&self, text: &str) -> Result<Condition, Vec<String>> {
        let options = LoadOptions::default();
        let mut names = TestNames::of(&self.program, &Observation::default(), &options);
        let span = Span { file: FileId(0), start: 0, end: text.len() as u32 };
        let written = condition::condition(text, span).map_err(|of| vec![of.message])?;
        names
            .condition(&written)
            .map_err(|all| all.into_iter().map(|finding| finding.message).collect())
    }

    /// Writes `name=value` pairs: contents of cells; for reals, their numbers.
    fn write(&mut self, memory: &str) {
        for pair in memory.split_whitespace() {
            let (name, value) = pair.split_once('=').expect("a pair");
            let options = LoadOptions::default();
            let names = TestNames::of(&self.program, &Observation::default(), &options);
            let target = names.forced(name, Span::default()).expect("an operand");
            let word = rungd_language::source::span::Located {
                value: value.to_owned(),
                span: Span::default(),
            };
            let content = super::given::word(&target, &word).expect("a value");
            self.engine.apply(EngineCall::Write(target.operand.cell, content));
        }
    }

    fn is_true(&self, condition: &Condition, edges: &mut [bool]) -> bool {
        condition.is_true(self.engine.image(), edges)
    }
}

/// Checks each row. The memory of a row is written over the memory of the rows before.
fn check(rows: &[(&str, &str, bool)]) {
    let mut plant = TestPlant::new();
    for (memory, text, expected) in rows {
        plant.write(memory);
        let condition = plant.condition(text).expect("a condition");
        let mut edges = vec![false; condition.edges];
        assert_eq!(plant.is_true(&condition, &mut edges), *expected, "{memory}: {text}");
    }
}

#[test]
fn contacts_are_evaluated_as_in_a_ladder() {
    check(&[
        ("", "pusher", false),
        ("", "!pusher & $On & !$Off", true),
        ("pusher=1", "pusher", true),
        ("", "Y0 & !Y1 | full_lamp", true),
        ("", "full_lamp | !(pusher & X0)", true),
        ("full_lamp=1 bottle=1", "!(pusher & X0 & full_lamp)", false),
        ("", "Drain.Open | Drain.Running | Main.Running", false),
        ("late.Done=1", "late.Done", true),
    ]);
}

#[test]
fn compares_are_signed_and_do_not_overflow() {
    check(&[
        ("", "shift == 0", true),
        ("shift=-2147483648", "shift < 0 & shift != 1", true),
        ("", "shift - 1 < shift", true),
        ("", "shift * shift > shift", true),
        ("", "0x10 == 16", true),
        ("", "late.Acc < 2s500ms & patience == 2500", true),
        ("late.Acc=2500", "late.Acc >= patience", true),
        ("", "-3 < -2 & 3 > -3", true),
    ]);
}

#[test]
fn an_ampersand_within_the_parentheses_of_a_sum_is_the_bit_operator() {
    check(&[
        ("shift=0x1B", "(shift & 0x0F) == 0x0B & (shift & 0x04) == 0", true),
        ("", "0x10 == (shift & 0x10) & shift == 27", true),
        ("", "(shift & 0x03 + 0x08) == 0x0B & ((shift & 0x03) + 0x08) * 2 == 22", true),
        ("shift=-1", "(shift & -1) == -1 & (shift & 0x7FFFFFFF) == 2147483647", true),
        ("pusher=1 full_lamp=0", "(pusher & full_lamp) == 0 & (pusher & $On) == 1", true),
        ("", "(pusher & $On) & (pusher | full_lamp)", true),
        ("", "(pusher & full_lamp) + 1 > 1", false),
    ]);
    let refused = TestPlant::new().condition("(level & 3) == 1").map(|_| ());
    let sentence = "`&` works on the bits of integers, not on a real";
    assert_eq!(refused, Err(vec![sentence.to_owned()]));
}

#[test]
fn arithmetic_follows_the_rules_of_math() {
    check(&[
        ("shift=7 weight=2", "shift / weight == 3 & shift % weight == 1", true),
        ("shift=-7", "shift / weight == -3 & shift % weight == -1", true),
        ("weight=0", "shift / weight == 0 & shift % weight == 0", true),
        ("weight=2", "2 + 3 * 4 == 14 & (2 + 3) * 4 == 20 & 20 - 5 - 5 == 10", true),
        ("", "100 / 10 / 5 == 2 & 7 - -3 == 10 & 17 % 10 * 2 == 14", true),
        // Integers stay at the limits of 64 bits.
        (
            "shift=2147483647",
            "shift * shift * shift == shift * shift * shift * shift + shift",
            true,
        ),
        ("", "shift * shift * shift > 0 & 0 - shift * shift * shift - shift < 0", true),
        // One real operand makes an operator real; the other operators stay integer.
        ("shift=7", "shift / 2 * 1.5 == 4.5 & shift / 2.0 == 3.5 & 1.5 * shift / 2 == 5.25", true),
        ("level=12.5", "level == 12.5 & level * 2 == 25 & level - 0.5 == 12", true),
        ("", "level / 0 == 0 & level % 5 == 2.5 & 0.0 - level < 0", true),
        ("level=0.1", "level == 0.1 & level + 0.2 != 0.3", true),
        ("", "1e38 * 10 > 3e38 & 1e38 * 1e38 * 1e38 > 1e38", true),
        ("", "2.5 > 2 & 2 < 2.5 & 3 >= 2.5 & -0.5 < 0", true),
        // A bit in a sum is 0 or 1.
        ("pusher=1 gate[1]=1", "pusher + gate[0] + gate[1] == 2", true),
        ("step=1", "gate[step] + 1 == 2", true),
    ]);
}

#[test]
fn an_element_outside_of_its_array_is_off_and_compares_as_false() {
    check(&[
        ("recipe[0]=5 recipe[3]=8 gate[3]=1 step=3", "recipe[step] == 8 & gate[step]", true),
        ("step=0", "recipe[step] == 5 & !gate[step]", true),
        ("step=4", "recipe[step] == 0 | recipe[step] != 0 | gate[step]", false),
        ("step=-1", "recipe[step] + 1 > 0 | gate[step] + 1 > 0", false),
        ("", "!gate[step] & !(recipe[step] == 0) & recipe[3] == 8", true),
    ]);
}

#[test]
fn edges_compare_with_the_previous_scan() {
    let mut plant = TestPlant::new();
    let rise = plant.condition("rise(shift > 5) | fall(!pusher)").unwrap();
    let nested = plant.condition("pusher & rise(rise(bottle) | full_lamp)").unwrap();
    assert_eq!((rise.edges, nested.edges), (2, 2));
    let mut seen = (vec![false; 2], vec![false; 2]);
    let mut scan = |memory: &str| {
        plant.write(memory);
        (plant.is_true(&rise, &mut seen.0), plant.is_true(&nested, &mut seen.1))
    };
    // Before the first scan all values inside edges are OFF, so a value that is ON in the first
    // scan rises.
    assert_eq!(scan("shift=6 pusher=1 bottle=1"), (true, true));
    assert_eq!(scan(""), (false, false));
    assert_eq!(scan("pusher=0"), (false, false));
    assert_eq!(scan("pusher=1"), (true, false));
    assert_eq!(scan("shift=5 full_lamp=1"), (false, true));
    // An edge is evaluated in every scan, whatever the values next to it are.
    assert_eq!(scan("shift=6 pusher=0 full_lamp=0"), (true, false));
    assert_eq!(scan("full_lamp=1"), (false, false));
    assert_eq!(scan("pusher=1"), (true, false));
}

#[test]
fn operands_are_listed_once_in_order_and_array_elements_by_their_index() {
    let mut plant = TestPlant::new();
    let text = "size + weight > recipe[step] & pusher & Y0 & !gate[step] & size < late.Acc";
    let condition = plant.condition(text).unwrap();
    let names: Vec<&str> = condition.operands.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["size", "weight", "step", "pusher", "late.Acc"]);
    let is_bit: Vec<bool> =
        condition.operands.iter().map(|(_, cell)| matches!(cell, Cell::Bit(_))).collect();
    assert_eq!(is_bit, [false, false, false, true, false]);
    plant.write("step=2");
    let elements = |plant: &TestPlant| -> Vec<String> {
        let all = condition.elements(plant.engine.image());
        all.into_iter().map(|(name, _)| name).collect()
    };
    assert_eq!(elements(&plant), ["recipe[2]", "gate[2]"]);
    plant.write("step=9");
    assert_eq!(elements(&plant), [""; 0]);
}

#[test]
fn deep_and_long_conditions_are_evaluated() {
    let plant = TestPlant::new();
    let long = format!("1{} == 10001", " + 1".repeat(10_000));
    let condition = plant.condition(&long).unwrap();
    assert!(plant.is_true(&condition, &mut []));
    let deep = format!("{}1{} == 32", "1 + 0 * (".repeat(31), ")".repeat(31));
    let condition = plant.condition(&deep).unwrap();
    assert!(!plant.is_true(&condition, &mut []));
    let deeper = format!("{}1{} == 1", "(".repeat(100_000), ")".repeat(100_000));
    let mistake = plant.condition(&deeper).unwrap_err();
    assert_eq!(mistake, ["more than 32 levels of parentheses, calls and signs"]);
    let not = format!("{}(1 + {}1{} == 2)", "!(".repeat(20), "(".repeat(20), ")".repeat(20));
    assert!(plant.condition(&not).is_err());
}

#[test]
fn each_mistake_in_a_condition_has_its_own_message() {
    let plant = TestPlant::new();
    for (text, expected) in [
        ("size + 1", "`size + 1` is a number, not a contact"),
        ("pusher == 1", "`pusher` is a bit, not a number"),
        ("size & pusher", "`size` is a word, not a bit"),
        ("(size) & pusher", "`size` is a word, not a bit"),
        ("recipe > 3", "`recipe` is an array, not a number"),
        ("size ^ 3 == 1", "`^` in a contact"),
        ("size - == 1", "a value is missing here"),
        ("3 == 3 + ", "a value is missing here"),
        ("3 == ", "a value is missing after `==`"),
        ("rise(pusher) + 1 == 1", "a sum stands in a compare"),
        ("rise(size + 1)", "`size + 1` is a number, not a contact"),
        ("pusher + 1 & full_lamp == 1", "`pusher + 1` is a number, not a contact"),
    ] {
        assert_eq!(plant.condition(text).unwrap_err(), [expected], "{text}");
    }
}
