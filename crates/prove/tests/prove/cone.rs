//! The cone of a question: its bits have the values of the whole model in every scan.
//!
//! `RUNGD_PROVE_PROGRAMS` (60) is the number of random programs, `RUNGD_PROVE_SEED` (1) the first
//! seed.

use super::bench::{Asked, model};
use super::drawn::drawn;
use rungd_prove::cone::{Share, cone};
use rungd_prove::model::{Path, Run};
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;

const TWO_PARTS: &str = r#"
[[program]]
name = "Main"
[[program.rung]]
when = ["X0", "!X1"]
do   = ["OUT Y0"]
[[program.rung]]
when = ["X2"]
do   = ["SET C0"]
[[program.rung]]
when = ["X3"]
do   = ["RUN Other"]
[[program.rung]]
when = ["X4"]
do   = ["STOP"]

[[program]]
name = "Other"
[[program.rung]]
when = ["C0"]
do   = ["OUT Y1", "EXIT"]
[[program.rung]]
when = ["X1"]
do   = ["OUT Y2"]
"#;

fn of_two_parts(judged: &str) -> (Vec<usize>, Share) {
    let asked = Asked {
        ladder: TWO_PARTS,
        inputs: &["X0", "X1", "X2", "X3", "X4"],
        assume: &[],
        judged: &[judged],
    };
    let model = model(asked);
    let cone = cone(&model, &model.judged);
    let place = |input: &rungd_prove::model::FreeInput| {
        model.inputs.iter().position(|whole| whole == input).expect("an input of the model")
    };
    (cone.model.inputs.iter().map(place).collect(), cone.operations)
}

#[test]
fn a_cone_has_the_inputs_that_can_change_its_bits_or_stop_the_controller() {
    let (inputs, operations) = of_two_parts("Y0");
    assert_eq!(inputs, [0, 1, 4]);
    assert!(operations.kept < operations.all, "{operations:?}");
}

#[test]
fn an_exit_belongs_to_the_cone_of_what_stands_behind_it() {
    assert_eq!(of_two_parts("Y2").0, [1, 2, 3, 4]);
    assert_eq!(of_two_parts("Y1").0, [2, 3, 4]);
}

#[test]
fn a_path_of_the_cone_becomes_one_of_the_whole_model() {
    let asked = Asked {
        ladder: TWO_PARTS,
        inputs: &["X2", "X0", "X1", "X4"],
        assume: &[],
        judged: &["Y0"],
    };
    let model = model(asked);
    let cone = cone(&model, &model.judged);
    let path = Path { scans: vec![vec![1, 0, 1], vec![0, 1, 0]] };
    let whole = cone.widened(&path);
    assert_eq!(whole.scans, [[0, 1, 0, 1], [0, 0, 1, 0]]);
}

#[test]
fn the_bits_of_a_cone_have_the_values_of_the_whole_model() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    for seed in first..first + setting("RUNGD_PROVE_PROGRAMS", 60) {
        let drawn = drawn(seed);
        for at in 0..drawn.model.judged.len() {
            let bit = drawn.model.judged[at];
            let cone = cone(&drawn.model, &[bit]);
            let mut rng = Rng::new(seed);
            let (mut whole, mut part) = (Run::new(&drawn.model), Run::new(&cone.model));
            let mut inputs = Vec::new();
            for scan in 0..120 {
                inputs = drawn.inputs(&mut rng, &inputs);
                let kept = |(at, _): &(usize, &i32)| {
                    let input = drawn.model.inputs.get(*at);
                    input.is_none_or(|input| cone.model.inputs.contains(input))
                };
                let kept: Vec<i32> =
                    inputs.iter().enumerate().filter(kept).map(|(_, value)| *value).collect();
                let (a, b) = (whole.scan(&inputs), part.scan(&kept));
                let of_bit = (a.is_allowed, a.judged[at], a.is_last);
                let same = of_bit == (b.is_allowed, b.judged[0], b.is_last);
                assert!(same, "condition {at}, scan {scan}: {a:?}, {b:?}\n{}", drawn.text);
                if a.is_last {
                    break;
                }
            }
        }
    }
}
