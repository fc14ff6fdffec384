//! What elements of a ladder body call of each other: which file does what.

use super::body::{BlockValue, ElementCalls, LadderBody};
use super::graph::BlockOutput;
use super::memory::LocatedPlace;
use crate::condition::RungCondition;

impl ElementCalls for LadderBody<'_, '_> {
    fn run_element(&mut self, at: usize) -> Result<(), String> {
        self.act(at)
    }

    fn run_block(
        &mut self,
        output: BlockOutput,
        target: Option<&LocatedPlace>,
    ) -> Result<(), String> {
        self.execute(output, target)
    }

    fn run_function(
        &mut self,
        output: BlockOutput,
        target: Option<&LocatedPlace>,
    ) -> Result<(), String> {
        self.function(output, target)
    }

    fn output_value(&mut self, output: BlockOutput) -> Result<BlockValue, String> {
        self.value(output)
    }

    fn kept_output(&mut self, output: BlockOutput) -> Result<LocatedPlace, String> {
        self.kept_value(output)
    }

    fn early_output(&mut self, output: BlockOutput) -> Result<BlockValue, String> {
        self.early(output)
    }

    fn enable_output(&mut self, at: usize) -> Result<RungCondition, String> {
        self.eno(at)
    }

    fn keep_output(&mut self, output: BlockOutput, power: RungCondition) {
        self.keep_power(output, power);
    }
}
