//! The models in which what nobody changes stays as it is: the time of day, and the times of scans.
//!
//! For `how`, which asks them before the whole model: they have fewer states, and a way in one of
//! them rests on no value that nobody sets. A proof needs the whole model.

use crate::model::ProofModel;
use rungd_engine::isa::status::dst;
use rungd_engine::isa::{Address, Word, WordSpace};

/// First the time of day and the times of scans stay, then the times of scans alone. A cold start
/// has no time of day that could stay. None of them is the whole model, and no two are the same.
pub(super) fn still_models(model: &ProofModel, is_cold: bool) -> Vec<ProofModel> {
    let steps: [fn(u32) -> bool; 2] = [dst::is_given, dst::is_of_scans];
    let mut all: Vec<ProofModel> = Vec::new();
    for stays in &steps[usize::from(is_cold)..] {
        let still = with_still(model, stays);
        let known = all.last().unwrap_or(model);
        if still.inputs != model.inputs && still.inputs != known.inputs {
            all.push(still);
        }
    }
    all
}

/// The model in which some DST keep the values of its start.
fn with_still(model: &ProofModel, stays: impl Fn(u32) -> bool) -> ProofModel {
    let mut still = model.clone();
    for (input, level) in still.inputs.iter_mut().zip(model.resting()) {
        let address = model.code.layout.address(input.cell);
        if matches!(address, Some(Address::Word(Word::Space(WordSpace::Dst, n))) if stays(n)) {
            (input.low, input.high) = (level, level);
        }
    }
    still
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::question::Questions;
    use rungd_lab::testing::read_suite;
    use rungd_test_support::folder::TestFolder;
    use std::fs;

    /// The numbers of inputs that stay in each of the models about a condition on its inputs.
    fn stay(condition: &str, is_cold: bool) -> Vec<usize> {
        let folder = TestFolder::new("prove-still");
        let path = folder.path().join("a.test.toml");
        let rung = format!("{{ when = [\"{condition}\", \"X0\"], do = [\"OUT Y0\"] }}");
        let ladder = format!("[[program]]\nname = \"Main\"\nrung = [{rung}]\n");
        fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
        let test = "ladder = [\"ladder.toml\"]\n[prove]\ncan = [\"Y0\"]\n";
        fs::write(&path, test).expect("a test file");
        let suite = read_suite(&path).expect("a file").suite.expect("a suite");
        let models = still_models(&Questions::new(suite).model, is_cold);
        let count = |model: &ProofModel| {
            model.inputs.iter().filter(|input| input.low == input.high).count()
        };
        models.iter().map(count).collect()
    }

    #[test]
    fn no_two_models_are_the_same() {
        assert_eq!(stay("$MaxScanTime > 500 & $Hour > 3", false), [2, 1]);
        assert_eq!(stay("$MaxScanTime > 500", false), [1]);
        assert_eq!(stay("$Hour > 3", false), [1]);
        assert_eq!(stay("X1", false), [0; 0]);
    }

    #[test]
    fn at_a_cold_start_no_time_of_day_stays() {
        assert_eq!(stay("$MaxScanTime > 500 & $Hour > 3", true), [1]);
        assert_eq!(stay("$Hour > 3", true), [0; 0]);
    }
}
