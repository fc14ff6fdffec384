//! A generated ladder, executed with its stimulus: the tape, cut into sections.

use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_history::observe::Subject;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{SectionStart, TapeEntry, TapeSection};
use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

pub struct Bench {
    pub case: Case,
    pub text: String,
    pub program: Arc<Program>,
    pub subject: Subject,
    pub sections: Vec<Arc<TapeSection>>,
    /// Complete scans.
    pub scans: u64,
    /// The operands for questions.
    pub operands: Vec<String>,
    /// The operands that changed.
    pub lively: Vec<String>,
    /// The cells of the names that were looked up: a look-up takes long.
    cells: RefCell<HashMap<String, Option<Cell>>>,
}

fn section(engine: &Engine, number: u64, running: bool) -> TapeSection {
    let stopped = Mode::Stop(rungd_runtime::exchange::StopReason::NotStarted);
    TapeSection {
        start: SectionStart {
            generation: 1,
            number,
            mode: if running { Mode::Run } else { stopped },
            unix_offset_ns: 0,
            lost: 0,
            follows: true,
        },
        state: EngineState::of(engine),
        entries: Vec::new(),
        who: Vec::new(),
    }
}

/// An engine, and all its calls.
pub struct Recorder {
    engine: Engine,
    pub sections: Vec<TapeSection>,
}

impl Recorder {
    /// The state before the start.
    pub fn new(engine: Engine) -> Recorder {
        let sections = vec![section(&engine, 0, false)];
        Recorder { engine, sections }
    }

    /// Begins a new section, before a scan.
    pub fn cut(&mut self, scan: u64) {
        let next = section(&self.engine, scan, true);
        self.sections.push(next);
    }

    pub fn call(&mut self, call: EngineCall) {
        self.engine.apply(call);
        self.sections.last_mut().expect("a section").entries.push(TapeEntry::Call(call));
    }
}

impl Bench {
    pub fn new(seed: u64) -> Bench {
        let case = generate(seed);
        let text = case.ladder();
        let file = SourceFile { name: "random.toml".into(), text: text.clone() };
        let (program, findings) =
            load_ladders(std::slice::from_ref(&file), &LoadOptions::default());
        let program = Arc::new(program.unwrap_or_else(|| panic!("seed {seed}: {findings:?}")));
        let subject = Subject::new(Arc::clone(&program), vec![file]);
        let mut recorder = Recorder::new(Engine::new(lower(&program).0));
        let mut rng = Rng::new(seed ^ 0x7461_7065);
        recorder.call(EngineCall::Start { now_ns: 0 });
        let scans = run(&case, &subject, &mut recorder, &mut rng);
        let operands = case.watch().into_iter().filter(|name| !is_status(name));
        let operands: Vec<String> = operands.collect();
        let sections: Vec<Arc<TapeSection>> = recorder.sections.into_iter().map(Arc::new).collect();
        let changes = |name: &&String| {
            let cell = subject.cell(name).expect("an operand");
            let first = sections[0].state.value(cell);
            let end = EngineState::of(&recorder.engine).value(cell);
            first != end || sections.iter().any(|section| section.state.value(cell) != first)
        };
        let lively = operands.iter().filter(changes).cloned().collect();
        let cells = RefCell::default();
        Bench { case, text, program, subject, sections, scans, operands, lively, cells }
    }

    /// The cell of an operand; `None` for every other text.
    pub fn cell(&self, name: &str) -> Option<Cell> {
        if let Some(cell) = self.cells.borrow().get(name) {
            return *cell;
        }
        let cell = self.subject.cell(name).ok();
        self.cells.borrow_mut().insert(name.to_owned(), cell);
        cell
    }
}

fn is_status(name: &str) -> bool {
    name.starts_with('$') || name.starts_with("ST") || name.starts_with("DST")
}

fn run(case: &Case, subject: &Subject, recorder: &mut Recorder, rng: &mut Rng) -> u64 {
    let cell = |name: &str| subject.cell(name).expect("an operand");
    let columns: Vec<Cell> = case.columns.iter().map(|name| cell(name)).collect();
    let forced = ["Y0", "C0", "X1", "C1"].map(cell);
    let length = 1 + rng.below(20) as i64;
    for scan in 0..case.scans {
        if scan > 0 && scan % length == 0 {
            recorder.cut(scan as u64);
        }
        if case.stop && scan + 1 == case.scans {
            recorder.call(EngineCall::RequestStop);
        }
        let now_ns = (scan * case.period) as u64 * 1_000_000;
        recorder.call(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        for (_, cells) in case.rows.iter().filter(|(at, _)| *at == scan) {
            for (cell, value) in columns.iter().zip(cells) {
                if let Some(value) = value {
                    recorder.call(EngineCall::Write(*cell, content(subject, *cell, *value)));
                }
            }
        }
        if rng.chance(2) {
            recorder.call(EngineCall::Force(*rng.pick(&forced), rng.below(2) as i32));
        }
        if rng.chance(6) {
            recorder.call(EngineCall::Release(*rng.pick(&forced)));
        }
        recorder.call(EngineCall::Execute);
        let on = subject.cell("$LastScan").expect("a status bit");
        if EngineState::of(&recorder.engine).value(on) != 0 {
            recorder.call(EngineCall::Terminate);
            return scan as u64 + 1;
        }
    }
    case.scans as u64
}

/// A number of the stimulus as the content of this cell.
fn content(subject: &Subject, cell: Cell, value: i64) -> i32 {
    match cell {
        Cell::Word(word) if subject.symbols().layout.is_real(word) => {
            rungd_engine::isa::Real::stored(value as f64).real.cell()
        }
        Cell::Bit(_) | Cell::Word(_) | Cell::WordBit(_) => value as i32,
    }
}
