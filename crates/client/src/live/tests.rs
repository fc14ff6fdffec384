//! The power that a page shows agrees with the explanation of `why`, on scans of shipped ladders
//! with random inputs.

use std::path::Path;
use std::sync::Arc;

use super::{LiveProgram, LiveView};
use rungd_base::random::SplitMix64;
use rungd_config::load;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_history::observe::{Cause, LadderCompare, Limits, PowerRun, QuestionTime};
use rungd_history::record::{RecordedFile, RecordedProgram};
use rungd_lab::draw::power::flow_of_power;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{SectionStart, TapeEntry, TapeSection};

/// The number of scans of a section.
const SCANS: u64 = 40;

/// The program of a shipped controller file.
fn program(path: &Path) -> LiveProgram {
    let loaded = load::controller_file(path).expect("it can be read");
    let file = |of: &rungd_language::source::span::SourceFile| RecordedFile {
        name: of.name.clone(),
        text: of.text.as_str().into(),
    };
    let files = loaded.files.iter().map(file).collect();
    let recorded = RecordedProgram { files, ..RecordedProgram::default() };
    LiveProgram::of(Arc::new(recorded)).expect("it loads")
}

/// In each scan, one of this many tags is tested.
const SOME: usize = 11;

/// Executes scans with random inputs.
struct RandomPlant {
    engine: Engine,
    random: SplitMix64,
    number: u64,
    inputs: Vec<Cell>,
}

impl RandomPlant {
    fn new(program: &LiveProgram, seed: u64) -> RandomPlant {
        let mut engine = Engine::new(program.subject.whole_code());
        engine.apply(EngineCall::Start { now_ns: 0 });
        let layout = &program.subject.symbols().layout;
        let input = |n| Cell::Bit(layout.bit(Bit::Space(BitSpace::X, n)));
        let inputs = (0..24).map(input).collect();
        RandomPlant { engine, random: SplitMix64(seed), number: 1, inputs }
    }

    fn section(&mut self) -> TapeSection {
        let start = SectionStart {
            generation: 0,
            number: self.number,
            mode: Mode::Run,
            unix_offset_ns: 0,
            lost: 0,
            follows: self.number > 1,
        };
        let state = EngineState::of(&self.engine);
        let mut section = TapeSection { start, state, entries: Vec::new(), who: Vec::new() };
        for _ in 0..SCANS {
            let now_ns = self.number * 100_000_000;
            let times = ScanTimes::default();
            self.call(&mut section, EngineCall::Begin { now_ns, times, local_s: 0 });
            let input = self.inputs[self.random.next() as usize % self.inputs.len()];
            let value = (self.random.next() % 2) as i32;
            self.call(&mut section, EngineCall::Write(input, value));
            self.call(&mut section, EngineCall::Execute);
            self.number += 1;
        }
        section
    }

    fn call(&mut self, section: &mut TapeSection, call: EngineCall) {
        self.engine.apply(call);
        section.entries.push(TapeEntry::Call(call));
    }
}

/// Compares some coils of a scan with the explanations of `why` for their bits. Returns the number
/// of compared coils.
fn compared(view: &LiveView, scan: u64) -> u32 {
    let power = view.at(scan).expect("it is in the minute");
    assert_eq!(power.scan, scan);
    let (program, limits) = (&view.program, Limits { depth: 0, nodes: 4, change: false });
    let mut compared = 0;
    for tag in program.tags().skip(scan as usize % SOME).step_by(SOME) {
        let Ok(cell @ Cell::Bit(_)) = program.subject.cell(tag.name) else { continue };
        let mut past = view.sections.clone();
        let asked = program.subject.why(&mut past, cell, QuestionTime::Scan(scan), limits);
        let root = asked.expect("it has an answer").root;
        assert_eq!(root.value, power.value(cell), "{} in scan {scan}", tag.name);
        let Cause::Instruction { rung, legs, .. } = &root.write.cause else { continue };
        let ([leg], true) = (legs.as_slice(), root.write.in_last_scan) else { continue };
        let (element, number) = (rung.element.name.as_str(), rung.number);
        let is_executed = view.is_executed(&power, element, number);
        assert!(is_executed, "{element}, rung {number} in scan {scan}");
        let rungs = program.rungs(element).expect("a block or Stage");
        let grid = &rungs[number as usize - 1].grid;
        let flow = flow_of_power(grid, &|contact| {
            view.conducts(&power, element, number, contact).expect("it was executed")
        });
        let coils = grid.instructions.iter().zip(&flow.outlets);
        let own = coils.filter(|(of, _)| of.symbol.coil.is_some());
        let mut own = own.filter(|(of, _)| of.symbol.label.name == tag.name);
        let (Some((_, outlet)), None) = (own.next(), own.next()) else { continue };
        assert_eq!(*outlet, [leg.on], "{} at {element}, rung {number} in scan {scan}", tag.name);
        compared += 1;
    }
    compared
}

/// Checks the values of a scan's compares against the states of their contacts; those of times and
/// of reals are shown in another form than they are compared. Returns the number of these compares.
fn judged(view: &LiveView, scan: u64) -> usize {
    let power = view.at(scan).expect("it is in the minute");
    let judge = |compare: LadderCompare| {
        let on = power.contact(compare.contact);
        let sides = power.compared(compare.contact);
        assert_eq!(on.is_some(), sides.is_some(), "contact {} in {scan}", compare.contact);
        let text = compare.text.with(sides?);
        let [left, sign, right] = text.split(' ').collect::<Vec<_>>()[..] else { return None };
        let (left, right): (i64, i64) = (left.parse().ok()?, right.parse().ok()?);
        let is_true = match sign {
            "==" => left == right,
            "!=" => left != right,
            "<" => left < right,
            "<=" => left <= right,
            ">" => left > right,
            _ => left >= right,
        };
        assert_eq!(on, Some(is_true), "{text} in scan {scan}");
        Some(())
    };
    view.program.subject.compares().into_iter().filter_map(judge).count()
}

#[test]
fn the_shown_power_equals_the_power_that_why_explains() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config");
    let (mut images, mut coils, mut compares) = (0, 0, 0);
    for name in ["lift-station", "filling-line", "traffic-light", "pump-station", "car-park"] {
        let program = Arc::new(program(&folder.join(format!("{name}.toml"))));
        let mut plant = RandomPlant::new(&program, 7);
        let sections: Vec<_> = (0..5).map(|_| Arc::new(plant.section())).collect();
        let mut run = PowerRun::new(Arc::clone(&program.subject));
        let mut last = None;
        for section in &sections {
            last = run.last_of(section);
        }
        let power = Arc::new(last.expect("it has scans"));
        let view =
            LiveView { program, power, has_minute: true, present: None, sections, earlier: None };
        let scans = view.scans().expect("it has scans");
        assert_eq!(scans, 1..=5 * SCANS);
        // A followed scan and the same scan executed again are equal.
        assert_eq!(view.at(*scans.end()), Ok((*view.power).clone()));
        images += scans.clone().count();
        coils += scans.clone().map(|scan| compared(&view, scan)).sum::<u32>();
        compares += scans.map(|scan| judged(&view, scan)).sum::<usize>();
        assert!(view.at(5 * SCANS + 1).is_err());
    }
    assert!(images >= 1000 && coils > 700, "{coils} coils of {images} images");
    assert!(compares > 1000, "{compares} compares");
}

/// Executing a growing section step by step gives the same power as executing it at once.
#[test]
fn a_growing_section_gives_the_power_of_the_whole_section() {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config/lift-station.toml");
    let program = program(&path);
    let whole = RandomPlant::new(&program, 3).section();
    let mut grows = PowerRun::new(Arc::clone(&program.subject));
    let mut at_once = PowerRun::new(Arc::clone(&program.subject));
    for entries in 0..=whole.entries.len() {
        let part = TapeSection { entries: whole.entries[..entries].to_vec(), ..whole.clone() };
        let alone = PowerRun::new(Arc::clone(&program.subject)).last_of(&part);
        assert_eq!(grows.last_of(&part), alone, "{entries} entries");
        assert_eq!(alone.is_some(), entries >= 3);
    }
    for scan in [SCANS, 1, 17, 16] {
        let seen = at_once.of_scan(&whole, scan).expect("it is in the section");
        assert_eq!(seen.scan, scan);
    }
    assert!(at_once.of_scan(&whole, SCANS + 1).is_none());
}
