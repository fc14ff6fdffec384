//! What a process finds on the rig is a start of a proof with `from = "retained"`, and the process
//! goes on as the proof does.
//!
//! `RUNGD_PROVE_RIG` (6) is a third of the number of random programs, `RUNGD_PROVE_SEED` (1) the
//! first seed.

use super::rig_events::{is_brought, move_inputs, questions, retained_ranges, retained_stages};
use rungd_engine::isa::{Address, Bit, BlockId, Structure, Word};
use rungd_engine::{BitCell, Cell, ResumeBits};
use rungd_lab::rig::{PowerOff, Rig, RigMode, RigSetup};
use rungd_prove::answer::AnswerVerdict;
use rungd_prove::decide::{DecideLimits, decide};
use rungd_prove::kept::KeptAnswers;
use rungd_prove::model::{FreeInput, Run};
use rungd_prove::question::Questions;
use rungd_prove::rig_memory::differing_at;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;
use std::time::Duration;

/// The value that the rig begins with for an input of the model.
fn found_on(rig: &Rig, questions: &Questions, input: &FreeInput) -> i32 {
    let own = &questions.programs[0].symbols.identity.kept;
    let starts = questions.model.stage_starts.iter().zip(own);
    for (start, own) in starts {
        let bits = ResumeBits::bits(own.stages);
        let Cell::Bit(BitCell(bit)) = input.cell else { continue };
        let Some(at) = bit.checked_sub(start.chosen.first).filter(|at| *at < bits) else {
            continue;
        };
        let holds = rig.image().bit(own.holds());
        let found = i32::from(rig.image().bit(BitCell(own.first + at)));
        return if holds { found } else { input.cold.expect("it is free before the first scan") };
    }
    rig.image().value(of_rig(questions, input.cell))
}

/// The cell of the rig for one of the model: by its address, or by its place in a record.
fn of_rig(questions: &Questions, cell: Cell) -> Cell {
    let (layout, own) = (&questions.model.code.layout, &questions.programs[0].symbols.layout);
    if let Some(address) = layout.address(cell) {
        return own.cell(address).expect("a cell");
    }
    let Cell::Bit(BitCell(bit)) = cell else {
        panic!("a private word is never retained: {cell:?}")
    };
    let all = (0..64)
        .flat_map(|n| [Structure::Counter(n), Structure::Timer(n), Structure::Sensaphone(n)]);
    let structures = all.filter(|at| layout.cell(Address::Word(Word::Acc(*at))).is_some());
    let mut records = structures.map(|at| [layout.record_bits(at), own.record_bits(at)]);
    let place = match records.find(|[of_model, _]| of_model.contains(&bit)) {
        Some([of_model, of_rig]) => of_rig.start + bit - of_model.start,
        // Private bits stand behind the public ones, in the same order.
        None => own.bit_count() + bit - layout.bit_count(),
    };
    Cell::Bit(BitCell(place))
}

/// Whether a Program may begin in any of its Stages.
fn starts_free(questions: &Questions, program: BlockId) -> bool {
    questions.model.stage_starts.iter().any(|start| start.chosen.program == program)
}

/// Whether an address is a Stage of such a Program, or that it runs.
fn is_of_free_stages(questions: &Questions, address: &Address) -> bool {
    match address {
        Address::Bit(Bit::Running(program)) => starts_free(questions, *program),
        Address::Bit(Bit::Stage(stage)) => {
            let stages = &questions.programs[0].symbols.names.stages;
            starts_free(questions, stages[stage.0 as usize].block)
        }
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
    }
}

/// Lets a random run on the rig begin a new process, which goes on beside the proof; whether it
/// found something.
fn compare(questions: &Questions, seed: u64) -> bool {
    let (model, mut rng) = (&questions.model, Rng::new(seed));
    let every_scan = model.inputs.iter().filter(|input| input.cold.is_none());
    if !every_scan.into_iter().all(|input| is_brought(model.code.layout.address(input.cell))) {
        return false;
    }
    let setup = RigSetup { keeps_images: true, ..RigSetup::default() };
    let mut rig = Rig::new(&questions.programs[0], &setup);
    for _ in 0..rng.range(1, 40) {
        move_inputs(&mut rig, questions, &mut rng);
        let is_last = rig.scan();
        rig.end_scan(is_last);
        if rig.mode() == RigMode::Stop {
            return false;
        }
    }
    if rng.chance(50) {
        rig.request_stop();
        let is_last = rig.scan();
        rig.end_scan(is_last);
        rig.restart(0);
    } else {
        rig.power_cut(PowerOff { down_ms: 0, lose_ms: 0 });
    }
    let mut run = Run::new(model);
    let found: Vec<i32> =
        model.inputs.iter().map(|input| found_on(&rig, questions, input)).collect();
    for (input, found) in model.inputs.iter().zip(&found).filter(|(input, _)| input.cold.is_some())
    {
        let is_free = (input.low..=input.high).contains(found);
        assert!(is_free, "seed {seed}: {found} of {input:?} is no start of a proof");
    }
    let is_any = model
        .inputs
        .iter()
        .zip(&found)
        .any(|(input, found)| input.cold.is_some_and(|cold| cold != *found));
    // What nothing reads has its value of a cold start in a proof.
    let mut unread = differing_at(&rig, &run);
    let is_free = |address: &Address| {
        let cell = model.code.layout.cell(*address);
        is_of_free_stages(questions, address)
            || model.inputs.iter().any(|input| Some(input.cell) == cell)
    };
    unread.retain(|address| !is_free(address));
    for number in 0..30 {
        move_inputs(&mut rig, questions, &mut rng);
        let is_last = rig.scan();
        let choices = model.inputs.iter().zip(&found).map(|(input, found)| match input.cold {
            Some(_) => *found,
            None => rig.image().value(of_rig(questions, input.cell)),
        });
        let outcome = run.scan(&choices.collect::<Vec<i32>>());
        assert!(outcome.is_allowed);
        let mut differ = differing_at(&rig, &run);
        differ.retain(|address| !unread.contains(address));
        assert!(differ.is_empty(), "seed {seed}, scan {number}: {differ:?}, not read: {unread:?}");
        rig.end_scan(is_last);
        if is_last || outcome.is_last {
            break;
        }
    }
    is_any
}

#[test]
fn what_a_process_finds_on_the_rig_is_a_start_of_a_proof_from_retained_memory() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let mut found = 0;
    for seed in first..first + 3 * setting("RUNGD_PROVE_RIG", 6) {
        let (case, mut rng) = (generate(seed), Rng::new(seed ^ 0x4E7));
        let test = format!(
            "ladder = [\"ladder.toml\"]\nperiod = \"{period}ms\"\nalways = [\"!Y0 | rise(Y1)\"]\n\
             [retain]\nranges = [{ranges}]\nstages = [{stages}]\ninterval = \"10ms\"\n\
             [prove]\nfrom = \"retained\"\n",
            period = case.period.max(10),
            ranges = retained_ranges(&mut rng),
            stages = retained_stages(&case.ladder(), &mut rng),
        );
        found += u32::from(compare(&questions(&case.ladder(), "", &test), seed));
    }
    println!("{found} processes found something");
    assert!(found > 0);
}

#[test]
fn counterexamples_that_begin_in_retained_stages_hold_on_the_rig() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let (mut seed, mut violated) = (first, 0);
    let most = setting("RUNGD_PROVE_RIG", 6).div_ceil(3);
    while seed < first + 6 * most && violated < most {
        let case = generate(seed);
        let test = format!(
            "ladder = [\"ladder.toml\"]\nperiod = \"{period}ms\"\n\
             always = [\"!Y0 | !$FirstScan\", \"!Y1 | $FirstScan\"]\n\
             [retain]\nstages = [\"*\"]\ninterval = \"{period}ms\"\n\
             [prove]\nfrom = \"retained\"\ninputs = [\"X0\", \"X1\"]\nstates = 300\n",
            period = case.period.max(10),
        );
        seed += 1;
        if !case.ladder().contains("[[program.stage]]") {
            continue;
        }
        let questions = questions(&case.ladder(), "", &test);
        for line in &questions.lines {
            let limits = DecideLimits {
                time: Duration::from_secs(600),
                memory: 100_000_000,
                given_up: Default::default(),
            };
            let answer = decide(&questions, line, &limits, &KeptAnswers::default());
            match &answer.verdict {
                AnswerVerdict::Violated { scenario, .. } => {
                    violated += u64::from(scenario.contains("set   = {"));
                }
                AnswerVerdict::NotDecided { cause, .. } => {
                    let is_tried = cause.contains("in a test") && answer.cuts.is_empty();
                    assert!(!is_tried, "seed {seed}, {}: {answer:#?}", line.text);
                }
                AnswerVerdict::Proved { .. } => {}
            }
        }
    }
    println!("{violated} counterexamples that begin in retained Stages");
    assert!(violated > 0);
}
