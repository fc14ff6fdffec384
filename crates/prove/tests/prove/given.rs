//! Questions from the state of a running program: the state goes over whole, and both ways agree.
//!
//! `RUNGD_PROVE_GIVEN` (6) is the number of programs, `RUNGD_PROVE_SEED` (1) the first seed. Before
//! the question, a program runs with random inputs, times between scans and forces.

use super::drawn::{Drawn, drawn_without_any};
use super::ways::{Tally, judge};
use rungd_base::calendar::LocalTime;
use rungd_engine::{BitCell, Cell, Engine, EngineState, KeptCells, ScanTimes, WordCell};
use rungd_prove::model::{ProofStart, Run, Target};
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;

/// The program without judges, after some scans.
fn run_before(drawn: &Drawn, rng: &mut Rng) -> Option<Engine> {
    let mut engine = Engine::new(drawn.plain.clone());
    let mut now_ns = 3_000_700_000;
    engine.start(now_ns);
    let mut inputs = Vec::new();
    for _ in 0..rng.range(1, 40) {
        let period_ns = i64::from(drawn.model.period_ms()) * 1_000_000;
        let late_ns = if rng.chance(20) { rng.range(0, 30_000_000) } else { 0 };
        now_ns += (period_ns + late_ns).cast_unsigned();
        engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
        inputs = drawn.inputs(rng, &inputs);
        write(&mut engine, drawn, &inputs);
        if engine.execute().last {
            return None;
        }
    }
    for _ in 0..rng.weighted(&[50, 30, 20]) {
        force(&mut engine, drawn, rng);
    }
    (!engine.stops()).then_some(engine)
}

fn write(engine: &mut Engine, drawn: &Drawn, inputs: &[i32]) {
    for (input, value) in drawn.model.inputs.iter().zip(inputs) {
        match input.cell {
            Cell::Bit(bit) => engine.write_bit(bit, *value != 0),
            Cell::Word(word) => engine.write_word(word, *value),
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
    }
}

/// Forces a bit or word that the program writes, but no input.
fn force(engine: &mut Engine, drawn: &Drawn, rng: &mut Rng) {
    let layout = &drawn.plain.layout;
    let cell = loop {
        let cell = match rng.chance(70) {
            true => Cell::Bit(BitCell(rng.below(layout.bit_count() as usize) as u32)),
            false => Cell::Word(WordCell(rng.below(layout.word_count() as usize) as u32)),
        };
        let is_input = drawn.model.inputs.iter().any(|input| input.cell == cell);
        let address = layout.address(cell).filter(|address| match address {
            rungd_engine::isa::Address::Bit(bit) => bit.forcible(),
            rungd_engine::isa::Address::Word(word) => word.writable(),
            rungd_engine::isa::Address::Structure(_) => false,
        });
        if !is_input && address.is_some() {
            break cell;
        }
    };
    match cell {
        Cell::Bit(bit) => engine.force_bit(bit, rng.chance(50)),
        Cell::Word(word) => engine.force_word(word, rng.range(0, 3) as i32),
        Cell::WordBit(_) => unreachable!("it is a whole cell"),
    }
}

/// The same model from the state of an engine.
fn given(mut drawn: Drawn, plain: &mut Engine) -> Drawn {
    let forces: Vec<Cell> = EngineState::of(plain).forced(&drawn.plain.layout).collect();
    let mut judged = Engine::new(drawn.model.code.clone());
    judged.adopt(plain, &drawn.transfer, true, &forces);
    let state = EngineState::of(&judged).at_whole_ms();
    drawn.model.start = ProofStart::Given(Box::new(state));
    drawn
}

/// The public memory is the same. Of private cells, the time that a RETURN withholds differs while
/// no timer wants it.
fn assert_same(plain: &Engine, run: &Run, drawn: &Drawn) {
    let (plain, judged) = (plain.image(), run.engine.image());
    let place = |first: u32, count: u32| first as usize..(first + count) as usize;
    let layout = &drawn.plain.layout;
    for KeptCells { from, to, count } in &drawn.transfer.bits {
        let count = (*count).min(layout.bit_count().saturating_sub(*from));
        let found = &judged.bits()[place(*to, count)];
        assert_eq!(&plain.bits()[place(*from, count)], found, "{}", drawn.text);
    }
    for KeptCells { from, to, count } in &drawn.transfer.words {
        let count = (*count).min(layout.word_count().saturating_sub(*from));
        let found = &judged.words()[place(*to, count)];
        assert_eq!(&plain.words()[place(*from, count)], found, "{}", drawn.text);
    }
}

#[test]
fn a_judged_program_goes_on_like_the_program_whose_state_it_has() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    for seed in first..first + 5 * setting("RUNGD_PROVE_GIVEN", 6) {
        let mut rng = Rng::new(seed ^ 0x61);
        let fresh = drawn_without_any(seed);
        let Some(mut plain) = run_before(&fresh, &mut rng) else { continue };
        let drawn = given(fresh, &mut plain);
        let (mut run, mut inputs) = (Run::new(&drawn.model), Vec::new());
        for _ in 0..30 {
            let now_ns = plain.now_ns() + u64::from(drawn.model.period_ms()) * 1_000_000;
            inputs = drawn.inputs(&mut rng, &inputs);
            plain.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
            write(&mut plain, &drawn, &inputs);
            let is_last = plain.execute().last;
            let outcome = run.scan(&inputs);
            assert_eq!(outcome.is_last, is_last, "{}", drawn.text);
            if is_last {
                break;
            }
            assert_same(&plain, &run, &drawn);
        }
    }
}

#[test]
fn both_ways_agree_about_random_programs_from_the_state_of_a_run() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let mut tally = Tally::default();
    for seed in first..first + setting("RUNGD_PROVE_GIVEN", 6) {
        let fresh = drawn_without_any(seed);
        let Some(mut plain) = run_before(&fresh, &mut Rng::new(seed ^ 0x61)) else { continue };
        let drawn = given(fresh, &mut plain);
        for bit in &drawn.model.judged {
            judge(&drawn, Target { bit: *bit, value: seed % 2 == 0 }, &mut tally);
        }
    }
    println!("{tally:?}");
    assert!(tally.never + tally.found > 0, "{tally:?}");
}
