//! The lag of the simulated plant: a temperature, compared with its formula in virtual time.

use crate::io::simulated_plant::{bench, model};

const OVEN: &str = r#"part = [{ name = "oven", kind = "lag", gain = 20000, ambient = 2000,
    time-constant = "60s" }]"#;

/// The value of `OVEN` in hundredths of a degree, `ticks` after its value was `from` and its input
/// changed to `input` (in thousandths).
fn oven(from: f64, input: f64, ticks: u64) -> f64 {
    let end = 2000.0 + 20.0 * input;
    end + (from - end) * (-(ticks as f64) / 60_000.0).exp()
}

#[test]
fn a_lag_follows_its_formula_to_the_unit() {
    let mut bench = bench(OVEN, &["#oven.in"], &["#oven.out"]);
    let script = [(1, "oven.in", 1000), (100_001, "oven.in", 250), (160_001, "oven.in", 5000)];
    let hot = oven(2000.0, 1000.0, 100_000);
    let cooler = oven(hot, 250.0, 60_000);
    let mut last = (0, 2000);
    for now_ms in 0..=400_000 {
        for (_, point, value) in script.iter().filter(|(at_ms, ..)| *at_ms == now_ms) {
            bench.drive(point, *value);
        }
        bench.step(now_ms).expect("it is not lost");
        let exact = match now_ms {
            0 => 2000.0,
            1..=100_000 => oven(2000.0, 1000.0, now_ms),
            100_001..=160_000 => oven(hot, 250.0, now_ms - 100_000),
            // An input above 1000 thousandths acts like 1000.
            _ => oven(cooler, 1000.0, now_ms - 160_000),
        };
        let told = bench.now("oven.out");
        assert!((f64::from(told) - exact).abs() <= 0.5001, "at {now_ms}: {told}, not {exact}");
        last = (now_ms, told);
    }
    // Four time constants cover 98.2 % of the way.
    assert_eq!(last, (400_000, oven(cooler, 1000.0, 240_000).round() as i32));
}

#[test]
fn a_bit_switches_a_lag_that_starts_at_its_initial_value() {
    let parts = r#"part = [
        { name = "oven", kind = "lag", gain = 1000, ambient = 20, time-constant = "1s",
          initial = 520 },
        { name = "cooler", kind = "lag", gain = -100, time-constant = "1ms", in = "oven.in" },
        { name = "hot", kind = "sensor", of = "oven.out", on-at = 600, off-at = 500 }]"#;
    let told = ["#oven.out", "#cooler.out", "hot.out"];
    let mut bench = bench(parts, &["oven.in"], &told);
    bench.run(3000, &[(100, "oven.in", 1), (1000, "oven.in", 0)]);
    assert_eq!(
        bench.changes_of("oven.out")[0],
        (0, 520),
        "a tick shrinks the distance by a thousandth"
    );
    // The first tick covers 63.2 % of the way to -100, a tick after the input.
    assert_eq!(bench.changes_of("cooler.out")[..4], [(0, 0), (101, -63), (102, -86), (103, -95)]);
    assert_eq!(bench.changes_of("hot.out").len(), 3);
}

#[test]
fn an_r_word_drives_and_receives_a_lag() {
    let rows = "map = [{ from = \"R1\", to = \"oven.in\", divide = 10 },\
                { from = \"oven.out\", to = \"R0\", divide = 100 }]";
    let mut model = model(&format!(
        "ladder = [\"a.toml\"]\n[[device]]\nname = \"plant\"\ndriver = \"simulated\"\n{rows}\n{}",
        OVEN.replace("\n    ", " ")
    ));
    let cell = |number: f32| number.to_bits() as i32;
    let mut inputs = [0];
    for now_ms in 0..=60_000 {
        model.step(now_ms, &[cell(50.0)], &mut inputs).expect("it is not lost");
    }
    // After one time constant and a tick at 50 % of the power: 20 °C + 100 °C * 63.2 %.
    let exact = oven(2000.0, 500.0, 60_001).round() / 100.0;
    assert_eq!(inputs[0], cell(exact as f32));
}
