//! What happens to the controller in a proof is what happens to it on the rig, as `rungd test` plays
//! it: after each scan, all memory that both have is the same.
//!
//! `RUNGD_PROVE_RIG` (6) is the number of random programs, `RUNGD_PROVE_SEED` (1) the first seed.

use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, Cell, WordCell};
use rungd_lab::rig::{PowerOff, Rig, RigMode, RigSetup};
use rungd_lab::testing::read_suite;
use rungd_prove::events::ScanEvent;
use rungd_prove::model::Run;
use rungd_prove::question::Questions;
use rungd_test_support::folder::TestFolder;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;
use std::fs;

const NOW: PowerOff = PowerOff { down_ms: 0, lose_ms: 0 };

/// The questions of a test file over a ladder.
fn questions(ladder: &str, test: &str) -> Questions {
    let folder = TestFolder::new("prove-rig-events");
    let path = folder.path().join("a.test.toml");
    fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
    fs::write(&path, format!("ladder = [\"ladder.toml\"]\n{test}")).expect("a test file");
    let read = read_suite(&path).expect("a file");
    let found: Vec<&String> = read.findings.iter().map(|finding| &finding.message).collect();
    Questions::new(read.suite.unwrap_or_else(|| panic!("{found:?}\n{ladder}{test}")))
}

/// Lets happen on the rig what is chosen with a scan, and executes the scan.
fn scan(rig: &mut Rig, event: Option<ScanEvent>) {
    if event.is_some_and(ScanEvent::ends_run) {
        rig.request_stop();
    }
    let is_last = rig.scan();
    rig.end_scan(is_last);
}

fn happen(rig: &mut Rig, event: Option<ScanEvent>) {
    match event {
        Some(ScanEvent::Stop) => rig.start(),
        Some(ScanEvent::Restart) => rig.restart(0),
        Some(ScanEvent::PowerCut | ScanEvent::PowerCutBeforeImage) => rig.power_cut(NOW),
        Some(ScanEvent::KeepImage) | None => {}
    }
}

/// The cells that differ, but for the time of day and those that a run shows before the passes of a
/// last scan.
fn differing(rig: &Rig, run: &Run) -> Vec<String> {
    let layout = &rig.program().symbols.layout;
    let model = &run.model().code.layout;
    let bits = (0..layout.bit_count()).map(|bit| Cell::Bit(BitCell(bit)));
    let words = (0..layout.word_count()).map(|word| Cell::Word(WordCell(word)));
    let mut all = Vec::new();
    for cell in bits.chain(words) {
        let Some(address) = layout.address(cell) else { continue };
        let is_status = match address {
            Address::Bit(Bit::Space(BitSpace::St, _)) => true,
            Address::Word(Word::Space(WordSpace::Dst, _)) => true,
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
        };
        let Some(of_model) = model.cell(address).filter(|_| !is_status) else { continue };
        let values = [rig.image().value(cell), run.engine.image().value(of_model)];
        if values[0] != values[1] {
            all.push(format!("{address:?}: {} on the rig, {} in the proof", values[0], values[1]));
        }
    }
    all
}

fn compare(questions: &Questions, seed: u64) {
    let (model, mut rng) = (&questions.model, Rng::new(seed));
    let is_x = |address| matches!(address, Some(Address::Bit(Bit::Space(BitSpace::X, _))));
    let addresses = model.inputs.iter().map(|input| model.code.layout.address(input.cell));
    if !addresses.into_iter().all(is_x) {
        // The time of day is free in a proof.
        return;
    }
    let setup = RigSetup { keeps_images: true, ..RigSetup::default() };
    let (mut rig, mut run) = (Rig::new(&questions.programs[0], &setup), Run::new(model));
    for number in 0..60 {
        let mut choices = Vec::new();
        for choice in model.choices() {
            let rests = choice.high > 1 && rng.chance(70);
            let value = rng.range(choice.low.into(), choice.high.into()) as i32;
            choices.push(if rests { choice.resting } else { value });
        }
        for (input, value) in model.inputs.iter().zip(&choices) {
            if let Some(Address::Bit(Bit::Space(BitSpace::X, x))) =
                model.code.layout.address(input.cell)
            {
                rig.set_input(x, *value != 0);
            }
        }
        let event = model.event(&choices);
        scan(&mut rig, event);
        let outcome = run.scan(&choices);
        if outcome.is_last || rig.mode() == RigMode::Stop && event.is_none() {
            return;
        }
        if event.is_none() {
            let differ = differing(&rig, &run);
            assert!(differ.is_empty(), "seed {seed}, scan {number}: {differ:#?}");
            continue;
        }
        happen(&mut rig, event);
        run.settle();
        let differ = differing(&rig, &run);
        assert!(differ.is_empty(), "seed {seed}, behind scan {number}, {event:?}: {differ:#?}");
    }
}

#[test]
fn random_programs_begin_again_in_a_proof_as_on_the_rig() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    for seed in first..first + setting("RUNGD_PROVE_RIG", 6) {
        let case = generate(seed);
        let mut rng = Rng::new(seed ^ 0xB16);
        let spaces =
            ["C0..C7", "D0..D7", "V0..V3", "CT0..CT3", "T0..T3", "N0..N1", "R0..R3", "MC1..MC4"];
        let ranges: Vec<String> =
            spaces.iter().filter(|_| rng.chance(60)).map(|range| format!("\"{range}\"")).collect();
        let test = format!(
            "period = \"{period}ms\"\nalways = [\"!Y0 | rise(Y1)\"]\n\
             [retain]\nranges = [{ranges}]\nstages = [{stages}]\ninterval = \"10ms\"\n\
             [prove]\nevents = [\"power-cut\", \"restart\", \"stop\"]\n",
            period = case.period.max(10),
            ranges = ranges.join(", "),
            stages = if case.ladder().contains("[[program.stage]]") && rng.chance(70) {
                "\"*\""
            } else {
                ""
            },
        );
        compare(&questions(&case.ladder(), &test), seed);
    }
}
