//! The calls of an engine as data: everything that enters the engine.
//!
//! The tape of the scan thread keeps the calls, `record` writes them to a recording, and a replay
//! applies them. An engine is deterministic, so equal calls from an equal state lead to an equal
//! state.

use super::eye::ScanObserver;
use super::layout::Cell;
use super::scan::{Engine, ScanTimes};
use crate::isa::BlockId;
use rungd_base::calendar::LocalTime;

/// One call of an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EngineCall {
    /// RUN begins.
    Start {
        /// The time, monotonic.
        now_ns: u64,
    },
    /// Makes the next scan the last one.
    RequestStop,
    /// Step 1 of a scan.
    Begin {
        /// Its timestamp, monotonic.
        now_ns: u64,
        /// The scan times for the status words.
        times: ScanTimes,
        /// Local time, as seconds since 1970-01-01 00:00:00 of the local clock.
        local_s: i64,
    },
    /// Steps 2 and 3: an input or a queued write. A bit is 0 or 1.
    Write(Cell, i32),
    /// Steps 4 to 7.
    Execute,
    /// The passes after the last scan.
    Terminate,
    /// A force. A bit is 0 or 1.
    Force(Cell, i32),
    /// The end of a force.
    Release(Cell),
}

impl Engine {
    /// Makes the call.
    pub fn apply(&mut self, call: EngineCall) {
        match call {
            EngineCall::Start { now_ns } => self.start(now_ns),
            EngineCall::RequestStop => self.request_stop(),
            EngineCall::Begin { now_ns, times, local_s } => {
                self.begin_scan(now_ns, &times, &LocalTime::of(local_s));
            }
            EngineCall::Write(Cell::Bit(cell), value) => self.write_bit(cell, value != 0),
            EngineCall::Write(Cell::Word(cell), value) => self.write_word(cell, value),
            EngineCall::Write(Cell::WordBit(cell), value) => {
                self.change_word_bit(cell, value != 0);
            }
            EngineCall::Execute => {
                self.execute();
            }
            EngineCall::Terminate => self.terminate(),
            EngineCall::Force(Cell::Bit(cell), value) => self.force_bit(cell, value != 0),
            EngineCall::Force(Cell::Word(cell), value) => self.force_word(cell, value),
            EngineCall::Release(Cell::Bit(cell)) => self.release_bit(cell),
            EngineCall::Release(Cell::Word(cell)) => self.release_word(cell),
            EngineCall::Force(Cell::WordBit(_), _) | EngineCall::Release(Cell::WordBit(_)) => {
                unreachable!("a bit of a word is never forced")
            }
        }
    }

    /// Makes the call like [`Engine::apply`]; `eye` sees each step of a scan and of the passes.
    pub fn apply_seen(&mut self, call: EngineCall, eye: &mut impl ScanObserver) {
        match call {
            EngineCall::Execute => {
                self.execute_seen(eye);
            }
            EngineCall::Terminate => self.terminate_seen(eye),
            EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. }
            | EngineCall::Write(..)
            | EngineCall::Force(..)
            | EngineCall::Release(..) => self.apply(call),
        }
    }

    /// Starts a stopped Program, as the instruction RUN does. For a copy of an engine that is used
    /// for a trial.
    pub fn try_run(&mut self, program: BlockId) {
        self.machine.start_program(program);
    }
}
