//! A ladder that stands for a part of the world: an engine that scans at its own period, up to the
//! times that its caller gives.
//!
//! Used by [`LadderPlant`](super::LadderPlant), and by the rig for the own side of a Modbus device.
//! It has no clock: the first scan is at time 0, scan k at k × period. What is written is in memory
//! at once, before the next scan.

use std::sync::Arc;

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::{Cell, Engine, EngineProgram, Image};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_runtime::{ScanStart, ScannedMachine};

/// A ladder that stands for a part of the world, lowered once.
#[derive(Debug)]
pub struct LadderProgram {
    pub(super) code: EngineProgram,
    /// Its names and cells.
    pub symbols: Symbols,
    /// The time between two scans, ns.
    pub period_ns: u64,
}

impl LadderProgram {
    /// Lowers a ladder that has no errors; `period`: its scan period.
    pub fn new(program: &Program, period: ScanPeriod) -> LadderProgram {
        let (code, symbols) = lower(program);
        LadderProgram { code, symbols, period_ns: period.ns() }
    }
}

/// A ladder with its memory.
pub struct LadderMachine {
    program: Arc<LadderProgram>,
    engine: Engine,
    next_ns: u64,
    scans: u64,
    /// Whether its ladder has stopped it.
    is_stopped: bool,
    forces: Vec<Cell>,
}

impl LadderMachine {
    /// A ladder after a cold start at time 0.
    pub fn new(program: &Arc<LadderProgram>) -> LadderMachine {
        let mut engine = Engine::new(program.code.clone());
        engine.start(0);
        let program = Arc::clone(program);
        LadderMachine {
            program,
            engine,
            next_ns: 0,
            scans: 0,
            is_stopped: false,
            forces: Vec::new(),
        }
    }

    /// The time of the next scan, ns.
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// Whether its ladder has stopped it: it scans no more.
    pub fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    /// Executes the scans up to a time. Before each of them, `inputs` may write to memory.
    pub fn scan_up_to(&mut self, now_ns: u64, mut inputs: impl FnMut(&mut Engine)) {
        while self.next_ns <= now_ns && !self.is_stopped {
            let (number, now_ns) = (self.scans + 1, self.next_ns);
            let start = ScanStart { number, now_ns, times: Default::default(), local_s: 0 };
            ScannedMachine::begin_scan(&mut self.engine, &start);
            inputs(&mut self.engine);
            self.is_stopped = ScannedMachine::execute(&mut self.engine);
            self.scans += 1;
            self.next_ns += self.program.period_ns;
        }
    }

    /// Writes a bit or word.
    pub fn write(&mut self, cell: Cell, value: i32) {
        ScannedMachine::write(&mut self.engine, cell, value);
    }

    /// Forces a bit or word: it keeps this value until it is released.
    pub fn force(&mut self, cell: Cell, value: i32) {
        ScannedMachine::force(&mut self.engine, cell, value);
        if !self.forces.contains(&cell) {
            self.forces.push(cell);
        }
    }

    /// Ends a force; returns false if there is none.
    pub fn release(&mut self, cell: Cell) -> bool {
        let Some(at) = self.forces.iter().position(|forced| *forced == cell) else { return false };
        self.forces.remove(at);
        ScannedMachine::release(&mut self.engine, cell);
        true
    }

    /// The engine, for writes of other forms.
    pub fn engine(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Memory.
    pub fn image(&self) -> &Image {
        self.engine.image()
    }
}
