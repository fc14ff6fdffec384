//! Latches that are merged before a proof: only those that are always alike.

use super::bench::{Asked, model};
use rungd_prove::deduce::Patience;
use rungd_prove::model::Target;
use rungd_prove::race::{Decision, by_deducing};
use rungd_test_support::patience::PATIENCE;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What deducing says of the first judged bit: is it ever OFF?
fn deduced(asked: Asked) -> Decision {
    let model = model(asked);
    let target = Target { bit: model.judged[0], value: false };
    by_deducing(&model, target, &Patience::new(PATIENCE, &Arc::new(AtomicBool::new(false))))
}

#[test]
fn bits_that_differ_in_a_rare_scan_alone_are_not_taken_for_one() {
    let names: Vec<String> = (0..21).map(|n| format!("X{n}")).collect();
    let inputs: Vec<&str> = names.iter().map(String::as_str).collect();
    let all = |count: usize| format!("\"{}\"", inputs[..count].join("\", \""));
    // Random inputs turn neither of them ON.
    let ladder = format!(
        "[[program]]\nname = \"Main\"\nrung = [\n\
         {{ when = [\"C0 & !C1\"], do = [\"OUT Y0\"] }},\n\
         {{ when = [{}], do = [\"SET C0\"] }},\n{{ when = [{}], do = [\"SET C1\"] }},\n\
         {{ when = [\"X0 & !X0\"], do = [\"RST C0\", \"RST C1\"] }},\n]",
        all(20),
        all(21)
    );
    let asked = Asked { ladder: &ladder, inputs: &inputs, judged: &["!Y0"], assume: &[] };
    let decision = deduced(asked);
    assert!(matches!(decision, Decision::Found(..)), "{decision:?}");
}

#[test]
fn bits_that_are_always_alike_stay_alike_and_those_that_are_opposite_opposite() {
    let ladder = r#"
[tags]
opposite = { at = "C2", initial = true }
[[program]]
name = "Main"
rung = [
    { when = ["C0 & !C1"], do = ["OUT Y0"] },
    { when = ["(C0 & opposite) | (!C0 & !opposite)"], do = ["OUT Y1"] },
    { when = ["X0"], do = ["OUT C0", "OUT C1"] },
    { when = ["!X0"], do = ["OUT opposite"] },
]
"#;
    for judged in ["!Y0", "!Y1"] {
        let judged = &[judged];
        let decision = deduced(Asked { ladder, inputs: &["X0"], judged, assume: &[] });
        assert!(matches!(decision, Decision::Never(..)), "{decision:?}");
    }
}
