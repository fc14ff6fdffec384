//! What happens to the controller and its field devices in a proof is what happens to them on the
//! rig, as `rungd test` plays it: what the rig brings is allowed in a proof, and after each scan all
//! memory that both have is the same. A dead end of a proof is one on the rig.
//!
//! `RUNGD_PROVE_RIG` (6) is the number of random programs, and half the number of those with
//! lost devices; `RUNGD_PROVE_SEED` (1) is the first seed.

use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit};
use rungd_engine::{Cell, Image};
use rungd_lab::rig::{PowerOff, Rig, RigMode, RigSetup};
use rungd_lab::testing::read_suite;
use rungd_prove::answer::AnswerVerdict;
use rungd_prove::decide::{DecideLimits, decide_can};
use rungd_prove::events::ScanEvent;
use rungd_prove::model::{FreeInput, Run};
use rungd_prove::question::Questions;
use rungd_prove::rig_memory::differing_at;
use rungd_test_support::folder::TestFolder;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;
use std::fs;
use std::time::Duration;

/// The questions of a test file beside `ladder.toml` and, if it names it, `controller.toml`.
pub fn questions(ladder: &str, controller: &str, test: &str) -> Questions {
    let folder = TestFolder::new("prove-rig-events");
    let path = folder.path().join("a.test.toml");
    fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
    fs::write(folder.path().join("controller.toml"), controller).expect("a controller file");
    fs::write(&path, test).expect("a test file");
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

fn happen(rig: &mut Rig, event: Option<ScanEvent>, down_ms: u32) {
    match event {
        Some(ScanEvent::Stop) => rig.start(),
        Some(ScanEvent::Restart) => rig.restart(down_ms),
        Some(ScanEvent::PowerCut | ScanEvent::PowerCutBeforeImage) => {
            rig.power_cut(PowerOff { down_ms, lose_ms: 0 });
        }
        Some(ScanEvent::KeepImage) | None => {}
    }
}

/// What differs, for people.
fn differing(rig: &Rig, run: &Run) -> Vec<String> {
    let [own, model] = [&rig.program().symbols.layout, &run.model().code.layout];
    let told = |address: Address| {
        let value = |image: &Image, cell: Option<Cell>| cell.map(|cell| image.value(cell));
        let of_rig = value(rig.image(), own.cell(address));
        let of_proof = value(run.engine.image(), model.cell(address));
        format!("{address:?}: {of_rig:?} on the rig, {of_proof:?} in the proof")
    };
    differing_at(rig, run).into_iter().map(told).collect()
}

/// Some retained ranges.
pub fn retained_ranges(rng: &mut Rng) -> String {
    let spaces =
        ["C0..C7", "D0..D7", "V0..V3", "CT0..CT3", "T0..T3", "N0..N1", "R0..R3", "MC1..MC4"];
    let ranges: Vec<String> =
        spaces.iter().filter(|_| rng.chance(60)).map(|range| format!("\"{range}\"")).collect();
    ranges.join(", ")
}

/// The Programs whose Stages are retained: often all.
pub fn retained_stages(ladder: &str, rng: &mut Rng) -> &'static str {
    let retains = ladder.contains("[[program.stage]]") && rng.chance(70);
    if retains { "\"*\"" } else { "" }
}

/// Whether the rig brings an input.
pub fn is_brought(address: Option<Address>) -> bool {
    let bits = |bit| matches!(bit, Bit::Space(BitSpace::X, _) | Bit::Device(..));
    matches!(address, Some(Address::Bit(bit)) if bits(bit))
}

/// Moves the inputs of the rig, and loses its devices or lets them come back.
pub fn move_inputs(rig: &mut Rig, questions: &Questions, rng: &mut Rng) {
    let layout = &questions.model.code.layout;
    for input in &questions.model.inputs {
        match layout.address(input.cell) {
            Some(Address::Bit(Bit::Space(BitSpace::X, x))) => rig.set_input(x, rng.chance(50)),
            Some(Address::Bit(Bit::Device(device, DeviceBit::Ok))) if rng.chance(25) => {
                match rng.chance(50) {
                    true => rig.lose_device(device),
                    false => rig.restore_device(device),
                }
            }
            Some(_) | None => {}
        }
    }
}

/// The number of scans that showed a lost device.
fn compare(questions: &Questions, seed: u64) -> u32 {
    let (model, mut rng) = (&questions.model, Rng::new(seed));
    let address = |cell| model.code.layout.address(cell);
    let down = model.events.down.map(|down| Cell::Word(down.next));
    let is_down = |input: &FreeInput| Some(input.cell) == down;
    if !model.inputs.iter().all(|input| is_down(input) || is_brought(address(input.cell))) {
        // The time of day is free in a proof.
        return 0;
    }
    let setup = RigSetup { keeps_images: true, ..RigSetup::default() };
    let (mut rig, mut run) = (Rig::new(&questions.programs[0], &setup), Run::new(model));
    let mut lost = 0;
    for number in 0..60 {
        move_inputs(&mut rig, questions, &mut rng);
        let event = model.choices().split_off(model.inputs.len());
        let event = event.iter().map(|choice| match rng.chance(70) {
            true => choice.resting,
            false => rng.range(choice.low.into(), choice.high.into()) as i32,
        });
        let event: Vec<i32> = event.collect();
        let happening = model.event(&[vec![0; model.inputs.len()], event.clone()].concat());
        scan(&mut rig, happening);
        let of_rig = |cell| {
            let layout = &rig.program().symbols.layout;
            rig.image().value(address(cell).and_then(|at| layout.cell(at)).expect("a cell"))
        };
        let down_s = rng.range(0, 3) as i32;
        let brought = model.inputs.iter().map(|input| match is_down(input) {
            true => down_s,
            false => of_rig(input.cell),
        });
        let brought: Vec<i32> = brought.collect();
        lost += u32::from(model.inputs.iter().zip(&brought).any(|(input, value)| {
            let is_ok = |bit| matches!(bit, Bit::Device(_, DeviceBit::Ok));
            *value == 0 && matches!(address(input.cell), Some(Address::Bit(bit)) if is_ok(bit))
        }));
        let outcome = run.scan(&[brought, event].concat());
        assert!(outcome.is_allowed, "seed {seed}, scan {number}: the rig does what no proof does");
        if outcome.is_last || rig.mode() == RigMode::Stop && happening.is_none() {
            return lost;
        }
        if happening.is_none() {
            let differ = differing(&rig, &run);
            assert!(differ.is_empty(), "seed {seed}, scan {number}: {differ:#?}");
            continue;
        }
        happen(&mut rig, happening, down_s.unsigned_abs() * 1000);
        run.settle();
        let differ = differing(&rig, &run);
        assert!(differ.is_empty(), "seed {seed}, behind scan {number}, {happening:?}: {differ:#?}");
    }
    lost
}

#[test]
fn random_programs_begin_again_in_a_proof_as_on_the_rig() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    for seed in first..first + setting("RUNGD_PROVE_RIG", 6) {
        let case = generate(seed);
        let mut rng = Rng::new(seed ^ 0xB16);
        let test = format!(
            "ladder = [\"ladder.toml\"]\nperiod = \"{period}ms\"\nalways = [\"!Y0 | rise(Y1)\"]\n\
             [retain]\nranges = [{ranges}]\nstages = [{stages}]\ninterval = \"10ms\"\n\
             [prove]\nevents = [\"power-cut\", \"restart\", \"stop\"]\n",
            period = case.period.max(10),
            ranges = retained_ranges(&mut rng),
            stages = retained_stages(&case.ladder(), &mut rng),
        );
        compare(&questions(&case.ladder(), "", &test), seed);
    }
}

/// What a controller does with the bits of its devices.
const DO: [&str; 6] =
    ["SET C5", "RST C5", "PONOFF C6", "ADD D2 1 to=D2", "TMR T30 preset=40ms", "OUT Y3"];

/// Rungs that read the bits of two devices.
fn rungs(rng: &mut Rng) -> String {
    let contact = |rng: &mut Rng| {
        let bit = ["line1.Ok", "line1.Stale", "line2.Ok", "line2.Stale"][rng.below(4)];
        ["", "!"][rng.below(2)].to_owned()
            + &["BIT", "rise(BIT)", "fall(BIT)"][rng.below(3)].replace("BIT", bit)
    };
    let mut text = String::new();
    for action in DO {
        let [one, two] = [contact(rng), contact(rng)];
        let sign = ["&", "|"][rng.below(2)];
        text +=
            &format!("[[program.rung]]\nwhen = [\"{one} {sign} {two}\"]\ndo = [\"{action}\"]\n\n");
    }
    text
}

/// A controller file with two devices, one of which brings inputs.
fn controller(rng: &mut Rng, period_ms: u64) -> String {
    let mut text = format!("ladder = [\"ladder.toml\"]\n[scan]\nperiod = \"{period_ms}ms\"\n");
    for (name, input) in [("line1", "X0"), ("line2", "X2")] {
        let poll_ms = period_ms * [1, 1, 3][rng.below(3)];
        let loss_after_ms = poll_ms * [2, 3, 5][rng.below(3)];
        let on_loss = ["hold", "zero"][rng.below(2)];
        text += &format!(
            "[[device]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\naddress = \"192.168.1.20:502\"\n\
             poll = \"{poll_ms}ms\"\nloss-after = \"{loss_after_ms}ms\"\non-loss = \"{on_loss}\"\n\
             map = [{{ from = \"discrete 0\", to = \"{input}\" }}]\n"
        );
    }
    text
}

#[test]
fn lost_devices_of_random_programs_are_in_a_proof_as_on_the_rig() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let mut lost = 0;
    for seed in first..first + 2 * setting("RUNGD_PROVE_RIG", 6) {
        let (case, mut rng) = (generate(seed), Rng::new(seed ^ 0x1057));
        let ladder =
            case.ladder().replacen("[ladder]\n", "[ladder]\ndevices = [\"line1\", \"line2\"]\n", 1);
        let main = "[[program]]\nname = \"Main\"\n\n";
        let ladder = ladder.replacen(main, &format!("{main}{}", rungs(&mut rng)), 1);
        let period_ms = case.period.max(10).cast_unsigned();
        let begins = match seed % 2 {
            0 => "controller = \"controller.toml\"".to_owned(),
            _ => format!("ladder = [\"ladder.toml\"]\nperiod = \"{period_ms}ms\""),
        };
        let test = format!(
            "{begins}\nalways = [\"!Y0 | line1.Stale | rise(line2.Ok)\"]\n\
             [prove]\nevents = [\"device-loss\", \"restart\", \"power-cut\", \"stop\"]\n"
        );
        lost += compare(&questions(&ladder, &controller(&mut rng, period_ms), &test), seed);
    }
    println!("{lost} scans with a lost device");
    assert!(lost > 0);
}

#[test]
fn dead_ends_of_random_programs_are_ones_on_the_rig() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let (mut dead, mut decided) = (0, 0);
    for seed in first..first + 2 * setting("RUNGD_PROVE_RIG", 6) {
        let (case, mut rng) = (generate(seed), Rng::new(seed ^ 0xDEAD));
        let test = format!(
            "ladder = [\"ladder.toml\"]\nperiod = \"{period}ms\"\n\
             [retain]\nranges = [{ranges}]\ninterval = \"{period}ms\"\n\
             [prove]\nevents = [\"power-cut\", \"restart\", \"stop\"]\n\
             inputs = [\"X0\", \"X1\"]\nstates = 300\n\
             can = [\"Y0\", \"!Y0\", \"Y1\", \"!Y1\"]\n",
            period = case.period.max(10),
            ranges = retained_ranges(&mut rng),
        );
        let questions = questions(&case.ladder(), "", &test);
        for line in &questions.can {
            let limits = DecideLimits {
                time: Duration::from_secs(600),
                memory: 100_000_000,
                given_up: Default::default(),
            };
            let answer = decide_can(&questions, line, &limits);
            match &answer.verdict {
                AnswerVerdict::Violated { .. } => dead += 1,
                AnswerVerdict::NotDecided { cause, .. } => {
                    let is_tried = cause.contains("in a test") && answer.cuts.is_empty();
                    assert!(!is_tried, "seed {seed}, {}: {answer:#?}", line.text);
                }
                AnswerVerdict::Proved { .. } => decided += 1,
            }
        }
    }
    println!("{dead} dead ends, {decided} lines without one");
    assert!(dead > 0);
}
