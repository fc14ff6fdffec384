//! MATHs whose formulas differ only in their cells are executed together, as a column. Neither
//! memory nor an event shows a difference from executing them one by one.

use std::fmt::Write as _;

use rungd_base::calendar::LocalTime;
use rungd_engine::{Engine, ScanTimes};
use rungd_language::lower::{lower, lower_with};
use rungd_test_support::numbers::Numbers;
use rungd_test_support::plc::{Plc, plc};
use rungd_test_support::run::load;

/// Parts of formulas, drawn.
trait DrawnFormula: Sized {
    /// The name of a cell among this many of its space.
    fn name(&mut self, space: &str, count: u64) -> String;

    fn pick<'t>(&mut self, texts: &[&'t str]) -> &'t str;

    /// A formula in which `#`, `@`, `?` and `_` stand for words, reals, bits and numbers.
    fn formula(&mut self) -> String;
}

impl DrawnFormula for Numbers {
    fn name(&mut self, space: &str, count: u64) -> String {
        format!("{space}{}", self.below(count))
    }

    fn pick<'t>(&mut self, texts: &[&'t str]) -> &'t str {
        texts[self.below(texts.len() as u64) as usize]
    }

    fn formula(&mut self) -> String {
        let shapes = [
            "# + # * #",
            "(# - _) * # + # * #",
            "# / # - _",
            "# % # + ?",
            "(# + #) * (# - #) * 100000 * 100000 * #",
            "@ * 1.5 + #",
            "# + @ / #",
            "sqrt(@ - #) + 0.25",
            "# < #",
            "@ >= # && ?",
            "if(?, #, # + 1)",
            "max(#, #, # - _)",
            "round(@ * @) - #",
            "~# & #",
            "# ** 2 - #",
            "(# + _) * (@ - (# - (@ + #) * #))",
            "levels[# % 8] + #",
            "? + $Overflow * 2",
            "$DivideByZero + #",
            "-@",
        ];
        // Most formulas have one of few shapes, so that columns have several rows.
        let few = if self.below(4) == 0 { shapes.len() } else { 8 };
        let mut text = String::new();
        for sign in self.pick(&shapes[..few]).chars() {
            match sign {
                '#' => text += &self.name("D", 60),
                '@' => text += &self.name("R", 20),
                '?' => text += &self.name("C", 20),
                '_' => text += &self.name("", 90),
                _ => text.push(sign),
            }
        }
        text
    }
}

fn ladder(numbers: &mut Numbers) -> String {
    let mut text = "[tags]\nlevels = { at = \"D50\", count = 8 }\n\
                    small = { at = \"D3\", min = -5, max = 90 }\n\
                    [[program]]\nname = \"Main\"\nrung = [\n"
        .to_owned();
    for _ in 0..300 {
        let leg = match numbers.below(4) {
            0 => numbers.name("C", 20),
            _ => numbers.name("X", 6),
        };
        let target = match numbers.below(10) {
            0 => numbers.name("C", 20),
            1 => numbers.name("R", 20),
            2 => numbers.name("V", 20),
            3 => "levels[D1 % 9]".to_owned(),
            _ => numbers.name("D", 400),
        };
        let math = numbers.formula();
        let _ = writeln!(text, "{{ when = [\"{leg}\"], do = [\"MATH {target} = {math}\"] }},");
    }
    text + "]\n"
}

/// The results of a scan: words, bits, the reported MATHs with their mishaps, and the number of
/// reports that were dropped.
type Left = (Vec<i32>, Vec<u8>, Vec<(u32, String)>, u32);

/// The results of seven scans with random inputs and words; `force`: one word and one bit are
/// forced.
fn scans(program: rungd_engine::EngineProgram, seed: u64, force: bool) -> Vec<Left> {
    let layout = program.layout.clone();
    let mut engine = Engine::new(program);
    let mut numbers = Numbers(seed);
    let word = |n| layout.word(rungd_engine::isa::Word::Space(rungd_engine::isa::WordSpace::D, n));
    engine.start(0);
    if force {
        engine.force_word(word(70), 7);
        let bit = rungd_engine::isa::Bit::Space(rungd_engine::isa::BitSpace::C, 3);
        engine.force_bit(layout.bit(bit), true);
    }
    let scan = |at: u64| {
        engine.begin_scan(at * 1_000_000, &ScanTimes::default(), &LocalTime::default());
        (0..6).for_each(|x| engine.set_input(x, numbers.below(4) != 0));
        for n in 0..60 {
            let value = match numbers.below(8) {
                0 => 0,
                1 => i32::MAX,
                _ => numbers.below(20_000) as i32 - 10_000,
            };
            engine.write_word(word(n), value);
        }
        engine.execute();
        let told = |event: &rungd_engine::MathEvent| {
            let bits: Vec<_> = event.mishaps.each().map(|mishap| mishap.nickname()).collect();
            (event.math, bits.join(" "))
        };
        let image = engine.image();
        let told = engine.maths().iter().map(told).collect();
        (image.words().to_vec(), image.bits().to_vec(), told, engine.events_dropped())
    };
    (1..8).map(scan).collect()
}

#[test]
fn maths_executed_together_give_the_results_of_single_execution() {
    let mut columns = 0;
    for seed in 1..12 {
        let text = ladder(&mut Numbers(seed));
        let program = load(&text).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{text}"));
        let together = lower(&program).0;
        let kinds = together.tables.batches.iter().map(|batch| format!("{:?}", batch.kind));
        columns += kinds.filter(|kind| kind == "Columns").count();
        let one_by_one = scans(lower_with(&program, 1).0, seed, seed % 3 == 0);
        let together = scans(together, seed, seed % 3 == 0);
        for (scan, (a, b)) in one_by_one.iter().zip(&together).enumerate() {
            assert!(a.0 == b.0, "seed {seed}, scan {scan}: the words differ\n{text}");
            assert!(a.1 == b.1, "seed {seed}, scan {scan}: the bits differ\n{text}");
            assert_eq!((&a.2, a.3), (&b.2, b.3), "seed {seed}, scan {scan}\n{text}");
        }
    }
    assert!(columns > 20, "{columns} columns");
}

/// An engine with twenty rungs; `maths` gives the MATHs of the rung with this number.
fn twenty(maths: impl Fn(u32) -> String) -> Plc {
    let rungs: String =
        (0..20).map(|n| format!("{{ when = [\"X0\"], do = [{}] }},\n", maths(n))).collect();
    plc(&format!("rung = [\n{rungs}]"))
}

#[test]
fn a_math_reads_the_result_of_the_math_before_it() {
    let mut plc = twenty(|n| format!("\"MATH D{} = D{n} + 1\"", n + 1));
    plc.scan(&[("X0", 1), ("D0", 5)]);
    assert_eq!(plc.values(["D1", "D10", "D20"]), [6, 15, 25]);
}

#[test]
fn a_math_reads_the_status_bits_of_the_maths_before_it() {
    let maths =
        |n| format!("\"MATH D{} = 1 / D{n}\", \"MATH D{} = $DivideByZero + 0\"", n + 100, n + 200);
    let mut plc = twenty(maths);
    let changes: Vec<(String, i32)> = (0..20).map(|n| (format!("D{n}"), 12 - n)).collect();
    let mut changes: Vec<(&str, i32)> = changes.iter().map(|(d, n)| (d.as_str(), *n)).collect();
    changes.push(("X0", 1));
    plc.scan(&changes);
    assert_eq!(plc.values(["D200", "D211", "D212", "D219"]), [0, 0, 1, 1]);
}

#[test]
fn maths_of_two_shapes_are_reported_in_the_order_of_their_rungs() {
    let maths = |n| format!("\"MATH D{} = 1 / D300\", \"MATH D{} = 7 % D300 - 1\"", n, n + 100);
    let mut plc = twenty(maths);
    plc.scan(&[("X0", 1)]);
    let told: Vec<u32> = plc.engine.maths().iter().map(|event| event.math).collect();
    assert_eq!(told, (0..16).collect::<Vec<u32>>());
    assert_eq!(plc.engine.events_dropped(), 24);
}
