//! The settings of a plant that is a ladder: its program, and the points that connect its memory
//! with that of the controller. Made by `controller` from a controller file.

use std::fmt;
use std::sync::Arc;

use super::machine::LadderProgram;
use crate::scaling::Scaling;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::Address;
use rungd_language::resolve::program::Program;

/// A plant that is a ladder.
#[derive(Clone)]
pub struct LadderSettings {
    /// The ladder, resolved. A controller file with an error is never executed, so it has none.
    pub program: Arc<Program>,
    /// Its scan period.
    pub period: ScanPeriod,
    /// The bits and words of the plant that are inputs of the controller.
    pub inputs: Vec<LadderPoint>,
    /// The bits and words of the plant that are outputs of the controller.
    pub outputs: Vec<LadderPoint>,
}

/// A bit or word of the plant's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LadderPoint {
    /// Its address; never a structure.
    pub address: Address,
    /// From the plant's number to the controller's memory; of a bit none.
    pub scaling: Scaling,
}

impl LadderSettings {
    /// The ladder, lowered.
    pub fn lowered(&self) -> Arc<LadderProgram> {
        Arc::new(LadderProgram::new(&self.program, self.period))
    }
}

impl PartialEq for LadderSettings {
    /// Two plants are equal if they execute the same operations on the same points: a comment of
    /// the ladder changes nothing.
    fn eq(&self, other: &LadderSettings) -> bool {
        let executes_same = || {
            let lowered = [self.lowered(), other.lowered()];
            let [ours, theirs] = lowered.map(|program| format!("{:?}", program.code));
            ours == theirs
        };
        self.period == other.period
            && self.inputs == other.inputs
            && self.outputs == other.outputs
            && (Arc::ptr_eq(&self.program, &other.program) || executes_same())
    }
}

impl fmt::Debug for LadderSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LadderSettings { program, period, inputs, outputs } = self;
        let mut text = f.debug_struct("LadderSettings");
        text.field("ladder", &program.name).field("period", period);
        text.field("inputs", inputs).field("outputs", outputs).finish()
    }
}
