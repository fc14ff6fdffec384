//! Ramps and soaks, compared with what a calculator says.

use super::{Bench, bench};

/// Up by 0.7 a second to 300, 90 s, down by 0.25 a second to 40, 600 s.
const ENDS_MS: [u64; 4] = [400_000, 490_000, 1_530_000, 2_130_000];

fn kiln(band: &str) -> Bench {
    let tags = r#"
        value = { at = "R0", initial = 20.0 }
        targets = { type = "real", count = 2, initial = [300.0, 40.0] }
        rates = { type = "real", count = 2, initial = [42.0, 15.0] }
        soaks = { type = "int", count = 2, initial = [90, 600] }"#;
    let uses = format!(
        "{{ use = \"RampSoak\", name = \"r\", with = {{ run = \"X0\", reset = \"X1\", value = \
         \"value\", band = {band}, targets = \"targets\", rates = \"rates\", soaks = \"soaks\", \
         size = 2 }} }},"
    );
    bench("ramp-soak", tags, &uses)
}

fn wanted(ms: u64) -> f64 {
    let seconds = ms as f64 / 1e3;
    match ms {
        ms if ms < ENDS_MS[0] => 20.0 + 0.7 * seconds,
        ms if ms < ENDS_MS[1] => 300.0,
        ms if ms < ENDS_MS[2] => 300.0 - 0.25 * (seconds - 490.0),
        _ => 40.0,
    }
}

#[test]
fn the_setpoint_follows_its_ramps_and_soaks_at_any_scan_period() {
    for period in [7, 10, 30, 90, 250] {
        let mut kiln = kiln("0.0").period(period);
        kiln.set("X0", 1).scan();
        let mut ms = 0;
        while ms <= ENDS_MS[3] + 1_000 {
            let off = (f64::from(kiln.real("r.setpoint")) - wanted(ms)).abs();
            // At the end of a soak the ramp begins one scan later.
            let late = 0.25 * period as f64 / 1e3 + 0.001;
            assert!(off <= late, "scans of {period} ms, {ms} ms: off by {off}");
            let done = kiln.on("r.done");
            assert!(done == (ms >= ENDS_MS[3]), "scans of {period} ms, {ms} ms: done {done}");
            kiln.scan();
            ms += period;
        }
    }
}

/// An oven that follows slowly: the soak is as long as it shall be all the same.
#[test]
fn a_band_extends_the_soak_until_the_value_is_near() {
    let mut kiln = kiln("10.0").period(100);
    kiln.set("X0", 1).scan();
    let (mut value, mut soaked_ms) = (20.0_f32, 0);
    while kiln.int("r.step") == 1 {
        value += (kiln.real("r.setpoint") - value).clamp(-0.02, 0.02);
        let near = (value - 300.0).abs() <= 10.0;
        soaked_ms += if kiln.on("r.soaking") && near { 100 } else { 0 };
        kiln.put("value", value).scan();
        assert!(kiln.real("r.setpoint") - value <= 10.2, "it waits");
    }
    assert!((90_000..=90_300).contains(&soaked_ms), "{soaked_ms} ms");
    assert!(kiln.plc.now_ns / 1_000_000 > 1_300_000, "longer than the program alone");
}
