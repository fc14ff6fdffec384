//! An engine under the direct control of a test: operands by name, and time that advances by scans.

use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_engine::{BlockEvent, Cell, Element, Engine, EngineCall, ScanEnd, ScanTimes};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;

use super::run;

pub struct Plc {
    pub program: Program,
    pub symbols: Symbols,
    pub engine: Engine,
    pub now_ns: u64,
    pub period_ns: u64,
    pub times: ScanTimes,
    pub local: LocalTime,
}

/// A started engine before its first scan. `main` has the rungs of Main and any further blocks.
pub fn plc(main: &str) -> Plc {
    let mut plc = stopped(main);
    plc.engine.start(0);
    plc
}

/// The same engine, not started yet.
pub fn stopped(main: &str) -> Plc {
    of_ladder(&format!("[[program]]\nname = \"Main\"\n{main}\n"))
}

/// The engine of a whole ladder file, not started yet.
pub fn of_ladder(ladder: &str) -> Plc {
    retaining(ladder, &[])
}

/// The engine of a ladder file, not started yet; `programs`: those whose Stages are retained.
pub fn retaining(ladder: &str, programs: &[&str]) -> Plc {
    let program = run::load(ladder);
    let mut program = program.unwrap_or_else(|errors| panic!("{errors}"));
    for block in program.blocks.iter_mut().filter(|block| programs.contains(&&*block.name)) {
        block.retains_stages = true;
    }
    Plc::of(program)
}

impl Plc {
    /// The engine of a program, not started yet.
    pub fn of(program: Program) -> Plc {
        let (engine_program, symbols) = lower(&program);
        Plc {
            program,
            symbols,
            engine: Engine::new(engine_program),
            now_ns: 0,
            period_ns: 10_000_000,
            times: ScanTimes::default(),
            local: LocalTime::default(),
        }
    }

    pub fn cell(&self, name: &str) -> Cell {
        run::cell(&self.program, &self.symbols, name).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn value(&self, name: &str) -> i64 {
        run::value(self.engine.image(), self.cell(name))
    }

    /// The values of some operands.
    pub fn values<const N: usize>(&self, names: [&str; N]) -> [i64; N] {
        names.map(|name| self.value(name))
    }

    pub fn force(&mut self, name: &str, value: i32) {
        match self.cell(name) {
            Cell::Bit(bit) => self.engine.force_bit(bit, value != 0),
            Cell::Word(word) => self.engine.force_word(word, value),
            Cell::WordBit(_) => panic!("{name} is a bit of a word"),
        }
    }

    pub fn release(&mut self, name: &str) {
        match self.cell(name) {
            Cell::Bit(bit) => self.engine.release_bit(bit),
            Cell::Word(word) => self.engine.release_word(word),
            Cell::WordBit(_) => panic!("{name} is a bit of a word"),
        }
    }

    /// Makes one scan with these inputs and queued writes, one period after the last scan.
    pub fn scan(&mut self, changes: &[(&str, i32)]) -> ScanEnd {
        self.engine.begin_scan(self.now_ns, &self.times, &self.local);
        for (name, value) in changes {
            let input = match self.program.scope().address(name) {
                Ok(Address::Bit(Bit::Space(BitSpace::X, n))) => Some(n),
                _ => None,
            };
            match (input, self.cell(name)) {
                (Some(n), _) => self.engine.set_input(n, *value != 0),
                (None, cell) => self.engine.apply(EngineCall::Write(cell, *value)),
            }
        }
        self.now_ns += self.period_ns;
        self.engine.execute()
    }

    /// Makes this number of scans without changes.
    pub fn scans(&mut self, count: u32) {
        (0..count).for_each(|_| {
            self.scan(&[]);
        });
    }

    /// An orderly stop: a last scan and the termination passes.
    pub fn stop(&mut self) {
        self.engine.request_stop();
        assert!(self.scan(&[]).last);
        self.engine.terminate();
    }

    /// The events of the last scan, as text: `started P`.
    pub fn events(&self) -> Vec<String> {
        self.engine.events().iter().map(|event| self.event(*event)).collect()
    }

    fn event(&self, event: BlockEvent) -> String {
        let names = &self.symbols.names;
        let block = |id| &names.block(id).name;
        match event {
            BlockEvent::Started(id) => format!("started {}", block(id)),
            BlockEvent::Stopped(id) => format!("stopped {}", block(id)),
            BlockEvent::Completed(id) => format!("completed {}", block(id)),
            BlockEvent::Terminated(Element::Block(id)) => format!("terminated {}", block(id)),
            BlockEvent::Terminated(Element::Stage(id)) => format!("terminated {}", names.stage(id)),
            BlockEvent::StageOn(stage) => format!("on {}", names.stage(stage)),
            BlockEvent::StageOff(stage) => format!("off {}", names.stage(stage)),
        }
    }
}
