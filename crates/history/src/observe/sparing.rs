//! An engine of the whole program that executes only what can change something.
//!
//! Its memory after each call is that of an engine that executes everything. Playbacks that follow
//! a running controller use it: little changes from scan to scan, so the scans of a large ladder
//! take little time.

use std::sync::Arc;

use super::slice_run::{SliceHolder, SliceRun};
use super::subject::Subject;
use rungd_engine::{Engine, EngineCall, EngineState, Slice};

/// A program with all its operations, to be executed by several engines.
#[derive(Clone)]
pub struct WholeProgram {
    pub(super) subject: Arc<Subject>,
    pub(super) slice: Arc<Slice>,
}

impl WholeProgram {
    /// The whole program of a subject.
    pub fn new(subject: Arc<Subject>) -> WholeProgram {
        let slice = Arc::new(subject.seen.whole());
        WholeProgram { subject, slice }
    }

    /// An engine of it, as after a cold start.
    pub fn sparing_engine(&self) -> SparingEngine {
        SparingEngine { run: SliceRun::new(&self.subject, self.clone()) }
    }
}

impl SliceHolder for WholeProgram {
    fn slice(&self) -> &Slice {
        &self.slice
    }
}

/// An engine that leaves out what would change nothing.
pub struct SparingEngine {
    run: SliceRun<WholeProgram>,
}

impl SparingEngine {
    /// The engine, after the last call.
    pub fn engine(&self) -> &Engine {
        self.run.seen_engine()
    }

    /// Continues from a state; returns false, and changes nothing, if the state does not fit.
    pub fn resume(&mut self, state: &EngineState) -> bool {
        self.run.resume(state)
    }

    /// Makes a call.
    pub fn apply(&mut self, call: EngineCall) {
        self.run.call(0, call, None);
    }
}
