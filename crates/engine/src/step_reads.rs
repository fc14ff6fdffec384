//! The cells that the steps of a formula read, for the scheduler.

use super::role::FormulaReads;
use super::steps::{FormulaStep, StepCode, cells};

/// The cells that the steps of a formula read.
pub fn reads(steps: &[FormulaStep]) -> FormulaReads {
    let is_bit =
        |step: &&FormulaStep| matches!(step.code, StepCode::LoadBit | StepCode::LoadMishap);
    let bits = steps.iter().filter(is_bit).map(|step| step.a);
    let words = steps.iter().flat_map(|step| step.words().into_iter().flatten());
    let is_word =
        |step: &&FormulaStep| matches!(step.code, StepCode::CheckIndex | StepCode::LoadWordBit);
    let others = steps.iter().filter(is_word).map(|step| step.a);
    let step_reads = |codes: &'static [StepCode]| {
        steps.iter().filter(move |step| codes.contains(&step.code)).map(|step| cells(*step))
    };
    FormulaReads {
        bits: bits.collect(),
        words: words.chain(others).collect(),
        bit_arrays: step_reads(&[StepCode::BitOf]).collect(),
        word_arrays: step_reads(&[StepCode::WordOf, StepCode::RealOf]).collect(),
    }
}
