//! A lag of first order: a temperature, a pressure, a flow that follows its input.
//!
//! Called by `part` once a millisecond. The input is constant within a tick, so each tick takes the
//! exact step of the differential equation: the distance to the end value shrinks by exp(-1 ms /
//! time constant). The state is a binary64. Its rounding does not add up, because every tick
//! shrinks the earlier errors too: with values up to a million and a time constant up to a day, the
//! error stays below a hundredth of a unit. The factor is computed only by additions,
//! multiplications and divisions, which have the same result on every machine. The result of a
//! system's `exp` may differ.

use super::settings::opening;

/// A lag with its state.
#[derive(Clone, Debug)]
pub(super) struct Lag {
    gain: f64,
    ambient: f64,
    /// The part of the distance to the end value that a tick covers.
    step: f64,
    value: f64,
}

impl Lag {
    /// A lag at its initial value.
    pub fn new([gain, ambient, initial]: [i32; 3], time_ms: u32) -> Lag {
        let step = covered(1.0 / f64::from(time_ms.max(1)));
        Lag { gain: gain.into(), ambient: ambient.into(), step, value: initial.into() }
    }

    /// Moves it by one millisecond, with an input in thousandths.
    pub fn tick(&mut self, input: u64) {
        let end = self.ambient + self.gain * input as f64 / f64::from(opening::FULL);
        self.value += (end - self.value) * self.step;
    }

    /// Its value, to the nearest whole number.
    pub fn value(&self) -> i32 {
        // For a number beyond an i32, `as` returns the nearest i32.
        self.value.round() as i32
    }
}

/// 1 - exp(-x) for x from 0 to 1, by its series.
fn covered(x: f64) -> f64 {
    let (mut sum, mut term) = (0.0, -1.0);
    for n in 1..=20_u32 {
        term *= -x / f64::from(n);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_approximates_the_exponential_function() {
        for time_ms in [1_u32, 2, 3, 10, 1000, 86_400_000, u32::MAX] {
            let x = 1.0 / f64::from(time_ms);
            let (ours, theirs) = (covered(x), -(-x).exp_m1());
            assert!((ours - theirs).abs() <= theirs * 1e-15, "{time_ms}: {ours} {theirs}");
        }
    }

    #[test]
    fn rounding_errors_do_not_accumulate() {
        let time_ms = 86_400_000;
        let mut lag = Lag::new([100_000, 2_000, 2_000], time_ms);
        for _ in 0..10_000_000 {
            lag.tick(1000);
        }
        let exact = 2_000.0 + 100_000.0 * -(-10_000_000.0 / f64::from(time_ms)).exp_m1();
        assert!((lag.value - exact).abs() < 1e-3, "{} instead of {exact}", lag.value);
    }
}
