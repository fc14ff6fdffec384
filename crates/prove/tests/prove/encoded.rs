//! The gates of a scan have the values of the engine, for every cell and in every scan; their AIGER
//! files, too.
//!
//! The ladders of `tests/semantics` show each rule alone. Other programs come from the generator of the reference model; each seed gives one program.
//! `RUNGD_PROVE_PROGRAMS` (25) is the number of programs, `RUNGD_PROVE_SEED` (1) the first seed,
//! `RUNGD_PROVE_SCANS` (40) the number of scans. Each program runs with several sequences of random
//! inputs at once. A cut gets the value that the engine has there.

use super::aiger_file::WrittenSystem;
use super::bench::{Asked, model, model_of};
use super::drawn::{fresh, with_stages_at_start};
use super::lanes::{LANES, Lanes};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::status::dst;
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, Cell, EngineProgram, Layout, ResumeBits, WordCell};
use rungd_lab::traces::stimulus::StimulusTarget;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_prove::deduce::Patience;
use rungd_prove::encode::{AccForm, Encoding, encode, encode_cells};
use rungd_prove::events::{DownTime, ModelEvents, RetainedCell, ScanEvent};
use rungd_prove::gates::{Held, content};
use rungd_prove::model::{FreeInput, ProofModel, Run, Target};
use rungd_prove::race::{Decision, by_deducing};
use rungd_test_support::case::{self, Expects, all as semantic_cases};
use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::run::{load, target};
use rungd_test_support::setting::setting;
use rungd_test_support::shares::in_shares;
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The same program with a batch for each operation, so that an observer sees the value of each
/// cut. MATHs in columns stay together: none of them reads what another one writes.
fn in_single_batches(code: &EngineProgram) -> EngineProgram {
    let mut single = code.clone();
    let (mut batches, mut starts) = (Vec::new(), vec![0]);
    for batch in &code.tables.batches {
        if batch.kind == rungd_engine::ops::OpKind::Columns {
            batches.push(*batch);
        } else {
            let each = batch.first..batch.first + batch.count;
            batches.extend(each.map(|first| rungd_engine::Batch { first, count: 1, ..*batch }));
        }
        starts.push(batches.len() as u32);
    }
    let own = single.blocks.iter_mut().map(|block| &mut block.own);
    for element in own.chain(&mut single.stages) {
        let range = &mut element.batches;
        *range = starts[range.start as usize]..starts[range.end as usize];
    }
    single.tables.batches = batches;
    single
}

/// A random content of an input.
fn drawn(rng: &mut Rng, input: FreeInput, before: i32) -> i32 {
    let FreeInput { low, high, .. } = input;
    let value = match rng.below(8) {
        0 | 1 => before,
        2 => low,
        3 => high,
        4 => rng.range(low.into(), high.into()) as i32,
        _ => rng.range(-3, 12) as i32,
    };
    value.clamp(low, high)
}

/// Runs the engine and the gates with random inputs, and compares every cell after every scan.
fn compare(model: &ProofModel, seed: u64, scans: u64) {
    let encoding = encode_cells(model);
    let simple = encoding.gates.without_constants();
    let mut rng = Rng::new(seed);
    let mut lanes = Lanes::new(model, &encoding.gates);
    let mut simple_lanes = lanes.of_gates(&simple);
    let mut written = WrittenSystem::of(&simple);
    let mut inputs = vec![vec![0; model.inputs.len()]; LANES];
    let (begun, encoded) = (Run::new(model), EncodedCells::of(&encoding));
    for scan in 0..scans {
        for values in &mut inputs {
            values.truncate(model.inputs.len());
            for (value, input) in values.iter_mut().zip(&model.inputs) {
                *value = drawn(&mut rng, *input, *value);
                // No real is -0.
                let is_real = |word| model.code.layout.is_real(word);
                if matches!(input.cell, Cell::Word(word) if is_real(word)) && *value == -1 {
                    *value = input.low.max(0);
                }
            }
            for choice in &model.choices()[model.inputs.len()..] {
                // Nothing happens behind most scans.
                let rests = choice.low == 0 && rng.chance(80);
                let high = if rests { 0 } else { choice.high };
                values.push(rng.range(choice.low.into(), high.into()) as i32);
            }
        }
        lanes.scan(&inputs);
        let values = lanes.evaluate(&encoding.gates);
        let simple_values = simple_lanes.evaluate_with(&simple, &lanes);
        for lane in (0..LANES).filter(|lane| !lanes.active().contains(lane)) {
            let is_on = |literal| simple_values.of_literal(literal) >> lane & 1 == 1;
            let allowed = simple.constraints.iter().all(|bit| is_on(*bit));
            assert!(!allowed, "seed {seed}, lane {lane}: a scan follows the last one");
        }
        let written_values = written.step(&simple_lanes.inputs(&simple, &lanes));
        for lane in lanes.active() {
            let place = format!("seed {seed}, scan {scan}, lane {lane}");
            let is_on = |literal| values.of_literal(literal) >> lane & 1 == 1;
            let is_simply_on = |literal| simple_values.of_literal(literal) >> lane & 1 == 1;
            let outcome = lanes.outcome(lane);
            let allowed = encoding.gates.constraints.iter().all(|bit| is_on(*bit));
            assert_eq!(allowed, outcome.is_allowed, "{place}: allowed");
            let allowed = simple.constraints.iter().all(|bit| is_simply_on(*bit));
            assert_eq!(allowed, outcome.is_allowed, "{place}: allowed, without constants");
            for (at, judged) in outcome.judged.iter().enumerate() {
                assert_eq!(is_on(encoding.gates.judged[at]), *judged, "{place}: judged {at}");
                assert_eq!(is_simply_on(simple.judged[at]), *judged, "{place}: judged {at}");
            }
            let bad = written_values.bad.iter().map(|value| value >> lane & 1 == 1);
            assert!(bad.eq(outcome.judged.iter().map(|on| !on)), "{place}: the AIGER file");
            let kept = written_values.constraints.iter().all(|value| value >> lane & 1 == 1);
            assert_eq!(kept, outcome.is_allowed, "{place}: the AIGER file");
            check_cells(model, &encoding, lanes.image(lane), is_on, &place);
            check_others(model, &encoded, [begun.engine.image(), lanes.image(lane)]);
            assert_eq!(encoding.gates.input_values(is_on), inputs[lane], "{place}: inputs");
        }
        lanes.end(&values, &encoding.gates);
        simple_lanes.end(&simple_values, &simple);
    }
}

fn check_cells(
    model: &ProofModel,
    encoding: &Encoding,
    image: &rungd_engine::Image,
    is_on: impl Fn(rungd_prove::aig::Literal) -> bool,
    place: &str,
) {
    let name = |cell| format!("{:?} ({cell:?})", model.code.layout.address(cell));
    for (bit, literal) in &encoding.bits {
        let found = is_on(*literal);
        assert_eq!(found, image.bit(*bit), "{place}: {}", name(Cell::Bit(*bit)));
    }
    for (word, bits) in &encoding.words {
        let found = content(bits, &is_on);
        let form = encoding.acc_forms.iter().find(|(cell, _)| cell == word);
        let period_ms = model.period_ms().cast_signed();
        let expected = match (image.word(*word), form) {
            (value, None) => value,
            (value, Some((_, AccForm::Limited { low, high }))) => value.clamp(*low, *high),
            (value, Some((_, AccForm::Scans { high }))) => {
                (value / period_ms + i32::from(value % period_ms > 0)).min(*high)
            }
        };
        assert_eq!(found, expected, "{place}: {}, {form:?}", name(Cell::Word(*word)));
    }
}

/// The cells that have gates.
struct EncodedCells {
    bits: HashSet<BitCell>,
    words: HashSet<WordCell>,
}

impl EncodedCells {
    fn of(encoding: &Encoding) -> EncodedCells {
        let mut cells = EncodedCells {
            bits: encoding.bits.iter().map(|(cell, _)| *cell).collect(),
            words: encoding.words.iter().map(|(cell, _)| *cell).collect(),
        };
        // What an event behind the scan alone writes is in latches.
        for latch in &encoding.gates.latches {
            if let Held::Bit(bit) = latch.holds {
                cells.bits.insert(bit);
            }
            if let Held::WordBit(word, _) | Held::TimerScans(word, _) = latch.holds {
                cells.words.insert(word);
            }
        }
        cells
    }
}

/// The places at which two memories differ. Most parts are the same, and compared as a whole.
fn differing<T: PartialEq>(before: &[T], now: &[T]) -> impl Iterator<Item = u32> {
    const PART: usize = 64;
    let parts = before.chunks(PART).zip(now.chunks(PART)).enumerate();
    parts.filter(|(_, (before, now))| before != now).flat_map(|(at, (before, now))| {
        let cells = before.iter().zip(now).enumerate();
        let differ = cells.filter(|(_, (before, now))| before != now);
        differ.map(move |(place, _)| (at * PART + place) as u32)
    })
}

/// What has no gates keeps its value: no write was left out of them.
fn check_others(model: &ProofModel, encoded: &EncodedCells, images: [&rungd_engine::Image; 2]) {
    let [before, now] = images;
    let EncodedCells { bits, words } = encoded;
    let changed_bits = differing(before.bits(), now.bits()).map(BitCell);
    let changed_bits = changed_bits.filter(|at| !bits.contains(at));
    let changed_words = differing(before.words(), now.words()).map(WordCell);
    let changed_words = changed_words.filter(|at| !words.contains(at));
    for cell in changed_bits.map(Cell::Bit).chain(changed_words.map(Cell::Word)) {
        let is_input = model.inputs.iter().any(|input| input.cell == cell);
        let address = model.code.layout.address(cell);
        let is_exempt = match address {
            // Cells of the lowering, between two operations.
            None => true,
            Some(Address::Bit(Bit::Space(BitSpace::St, _))) => true,
            Some(Address::Word(Word::Space(WordSpace::Dst, _))) => true,
            Some(_) => is_input,
        };
        assert!(is_exempt, "{address:?} ({cell:?}) changes, and no gate writes it");
    }
}

/// A model of a program with a batch for each operation; `names` may change before each scan. What
/// cannot be written from outside is left out, and so are bits of words.
fn model_with<'n>(
    program: &Program,
    asked: Asked,
    names: impl Iterator<Item = &'n String>,
) -> ProofModel {
    let (_, symbols) = lower(program);
    let model = model_of(program, asked);
    let mut inputs = model.inputs;
    for name in names {
        let (cell, low, high) = match target(program, &symbols, name) {
            Ok(StimulusTarget::Input(n)) => (x_cell(&symbols.layout, n), 0, 1),
            Ok(StimulusTarget::Bit(Cell::Bit(bit))) => (Cell::Bit(bit), 0, 1),
            Ok(StimulusTarget::Word(cell, (min, max))) => (Cell::Word(cell), min, max),
            Ok(StimulusTarget::Real(cell, (min, max))) => {
                (Cell::Word(cell), min.cell(), max.cell())
            }
            Ok(StimulusTarget::Bit(_)) | Err(_) => continue,
        };
        let address = symbols.layout.address(cell).expect("it has an address");
        let cell = model.code.layout.cell(address).expect("it has a cell");
        if inputs.iter().all(|input| input.cell != cell) {
            inputs.push(FreeInput { cell, low, high, cold: None });
        }
    }
    ProofModel { code: in_single_batches(&model.code), inputs, ..model }
}

fn x_cell(layout: &Layout, n: u32) -> Cell {
    Cell::Bit(layout.bit(Bit::Space(BitSpace::X, n)))
}

/// The same model, in which RUN may begin again behind every scan; some of its cells are retained.
fn with_events(model: ProofModel, rng: &mut Rng) -> ProofModel {
    let mut code = model.code.clone();
    let layout = &model.code.layout;
    let bits = (0..layout.bit_count()).map(|bit| Cell::Bit(BitCell(bit)));
    let words = (0..layout.word_count()).map(|word| Cell::Word(WordCell(word)));
    let is_status = |cell: &Cell| match layout.address(*cell) {
        Some(Address::Bit(bit)) => !bit.forcible(),
        Some(Address::Word(word)) => !word.writable(),
        Some(Address::Structure(_)) | None => true,
    };
    let is_old = rng.chance(50);
    let mut retained = Vec::new();
    let kept = |cell: &Cell| {
        let of = |kept: &ResumeBits| kept.first..kept.first + ResumeBits::bits(kept.stages);
        matches!(cell, Cell::Bit(bit) if code.kept.iter().any(|kept| of(kept).contains(&bit.0)))
    };
    let stages: Vec<Cell> = bits.clone().filter(kept).collect();
    let others = bits.chain(words).filter(|cell| !is_status(cell));
    for cell in others.chain(stages.iter().copied()) {
        if rng.chance(30) || stages.contains(&cell) {
            let image = is_old.then(|| fresh(&mut code, cell));
            retained.push(RetainedCell { cell, limits: None, image });
        }
    }
    let mut kinds = vec![ScanEvent::Stop, ScanEvent::Restart, ScanEvent::PowerCut];
    let mut image_is_final = None;
    if is_old {
        kinds.extend([ScanEvent::KeepImage, ScanEvent::PowerCutBeforeImage]);
        let flag = fresh(&mut code, Cell::Bit(BitCell(0)));
        image_is_final = Some(match flag {
            Cell::Bit(bit) => bit,
            Cell::Word(_) | Cell::WordBit(_) => unreachable!("a bit"),
        });
    }
    let has_image = rng.chance(90);
    let word = model.code.layout.word(Word::Space(WordSpace::Dst, dst::DOWN_SECONDS));
    let next = WordCell(code.word_count);
    code.word_count += 1;
    let mut inputs = model.inputs.clone();
    inputs.push(FreeInput { cell: Cell::Word(next), low: 0, high: 4_000_000, cold: None });
    let down = Some(DownTime { word, next });
    let events =
        ModelEvents { kinds, has_image, retained, image_is_final, down, ..ModelEvents::default() };
    ProofModel { code, events, inputs, ..model }
}

/// The model of a generated case: its X are free, and some of what its stimulus writes.
fn model_of_case(case: &Case) -> ProofModel {
    let mut program = load(&case.ladder()).unwrap_or_else(|e| panic!("seed {}: {e}", case.seed));
    if case.seed.is_multiple_of(2) {
        let staged = program.blocks.iter_mut().filter(|block| !block.stages.is_empty());
        staged.for_each(|block| block.retains_stages = true);
    }
    let asked = Asked {
        ladder: "",
        inputs: &[],
        assume: &["X0 | !X1 | !Y0"],
        judged: &["Y0", "rise(Y1) & X0", "D0 > V0 | C0", "R0 < R1"],
    };
    let mut rng = Rng::new(case.seed);
    let names = case.columns.iter().filter(|name| name.starts_with('X') || rng.chance(25));
    let model = model_with(&program, asked, names);
    let begins_in_stages = rng.chance(50);
    let mut model = if begins_in_stages { with_stages_at_start(model, &mut rng) } else { model };
    if case.seed.is_multiple_of(5) {
        let hour = Word::Space(WordSpace::Dst, dst::HOUR);
        let cell = Cell::Word(model.code.layout.word(hour));
        model.inputs.push(FreeInput { cell, low: 0, high: 23, cold: None });
    }
    let late_max = if case.seed.is_multiple_of(3) { 4 } else { 1 };
    ProofModel { period: ScanPeriod::of_ms(case.period as u32), late_max, ..model }
}

#[test]
fn gates_of_the_ladder_of_every_rule_equal_the_engine() {
    let cases = semantic_cases().expect("they are read");
    in_shares(|share| {
        for (at, case) in cases.iter().enumerate().filter(|(at, _)| share.has(*at)) {
            gates_equal_the_engine(case, at as u64 + 1);
        }
    });
}

fn gates_equal_the_engine(case: &case::Case, seed: u64) {
    let Expects::Values(table) = &case.expects else { return };
    let program = load(&case.ladder).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    for (with_words, late_max) in [(false, 1), (true, 1), (true, 3)] {
        let is_x = |name: &&String| with_words || name.starts_with('X');
        let names = table.inputs.iter().filter(is_x);
        let asked = Asked { judged: &["X0"], ..Asked::default() };
        let model = model_with(&program, asked, names);
        let model = ProofModel { period: ScanPeriod::of_ms(case.period_ms), late_max, ..model };
        compare(&model, seed, 20);
    }
}

#[test]
fn gates_of_random_programs_equal_the_engine_over_stops_and_new_processes() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let scans = setting("RUNGD_PROVE_SCANS", 40);
    for seed in first..first + setting("RUNGD_PROVE_PROGRAMS", 25) {
        let case = generate(seed);
        let model = with_events(model_of_case(&case), &mut Rng::new(seed ^ 0xE7));
        println!("{}\n{:?}", case.ladder(), model.events);
        compare(&model, seed, scans);
    }
}

#[test]
fn gates_of_random_programs_equal_the_engine() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let scans = setting("RUNGD_PROVE_SCANS", 40);
    for seed in first..first + setting("RUNGD_PROVE_PROGRAMS", 25) {
        compare(&model_of_case(&generate(seed)), seed, scans);
    }
}

#[test]
fn whether_reals_are_divided_by_zero_is_known_without_their_quotient() {
    let decided = |divided: &str| {
        let ladder = format!(
            "[[program]]\nname = \"Main\"\nrung = [{{ when = [\"$On\"], do = [\"MATH R0 = {divided}\"] }}]"
        );
        let judged = &["!$DivideByZero"];
        let model = model(Asked { ladder: &ladder, inputs: &["X0"], judged, ..Asked::default() });
        let target = Target { bit: model.judged[0], value: false };
        let patience = Patience::new(PATIENCE, &Arc::new(AtomicBool::new(false)));
        by_deducing(&model, target, &patience)
    };
    for divided in ["R1 / (X0 + 1)", "R1 % (X0 + 2)", "R1 / 3.5"] {
        let decision = decided(divided);
        assert!(matches!(decision, Decision::Never(..)), "{decision:?}");
    }
    for divided in ["R1 / X0", "R1 / R1", "R1 % (X0 - 1)"] {
        let decision = decided(divided);
        assert!(matches!(decision, Decision::Found(..)), "{decision:?}");
    }
}

#[test]
fn an_acc_that_is_a_preset_or_an_interval_is_held_whole() {
    let ladder = r#"
[[program]]
name = "Main"
rung = [
    { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=1"] },
    { leg.up = ["X2"], leg.dn = ["X3"], leg.rst = ["$Off"], do = ["UDC CT1 up-preset=CT0.Acc dn-preset=0"] },
    { when = ["CT1.Done"], do = ["OUT Y0"] },
    { when = ["!X1"], do = ["TMR T0 preset=10ms"] },
    { when = ["X0"], do = ["ENTASK Job every=T0.Acc"] },
]
[[task]]
name = "Job"
rung = [{ when = ["$On"], do = ["PONOFF Y1", "ADD D0 1 to=D0"] }]
"#;
    let inputs = &["X0", "X1", "X2", "X3"];
    let model = model(Asked { ladder, inputs, judged: &["Y0 | Y1"], ..Asked::default() });
    (1..5).for_each(|seed| compare(&model, seed, 80));
}

#[test]
fn a_period_of_no_whole_milliseconds_has_no_gates() {
    let ladder = "[[program]]\nname = \"Main\"\nrung = [{ when = [\"X0\"], do = [\"OUT Y0\"] }]";
    let asked = Asked { ladder, inputs: &["X0"], judged: &["Y0 | !Y0"], ..Asked::default() };
    let period = ScanPeriod::of_us(1250).expect("a period");
    let model = ProofModel { period, ..model(asked) };
    let target = Target { bit: model.judged[0], value: false };
    let patience = Patience::new(PATIENCE, &Arc::new(AtomicBool::new(false)));
    let decision = by_deducing(&model, target, &patience);
    assert!(matches!(decision, Decision::Open(_)), "{decision:?}");
}

#[test]
fn gates_of_a_ladder_without_memory_have_no_latches() {
    let ladder = r#"
[[program]]
name = "Main"
rung = [
    { when = ["X0", "X1 | !X2"], do = ["OUT Y0"] },
    { when = ["V0 > 3"], do = ["OUT Y1"] },
]
"#;
    let asked = Asked { ladder, inputs: &["X0", "X1"], judged: &["Y0 | Y1"], ..Asked::default() };
    let gates = encode(&model(asked));
    assert_eq!(gates.latches, []);
    assert_eq!(gates.inputs.len(), 2);
    assert_eq!(gates.judged.len(), 1);
}
