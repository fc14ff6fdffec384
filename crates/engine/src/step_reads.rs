//! The cells that the steps of a formula read, for the scheduler.

use super::role::Reads;
use super::steps::{Code, Step, cells};

/// The cells that the steps of a formula read.
pub fn reads(steps: &[Step]) -> Reads {
    let is_bit = |step: &&Step| matches!(step.code, Code::LoadBit | Code::LoadMishap);
    let bits = steps.iter().filter(is_bit).map(|step| step.a);
    let words = steps.iter().flat_map(|step| step.words().into_iter().flatten());
    let indexes = steps.iter().filter(|step| step.code == Code::CheckIndex).map(|step| step.a);
    let of = |codes: &'static [Code]| {
        steps.iter().filter(move |step| codes.contains(&step.code)).map(|step| cells(*step))
    };
    Reads {
        bits: bits.collect(),
        words: words.chain(indexes).collect(),
        bit_arrays: of(&[Code::BitOf]).collect(),
        word_arrays: of(&[Code::WordOf, Code::RealOf]).collect(),
    }
}
