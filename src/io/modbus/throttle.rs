//! How many lines the server may log: a burst, then one a second. What it held back is counted.
//!
//! A client that misbehaves, or a crowd of them, must not fill the log. Each kind of line has a
//! throttle of its own, so that a flood of one does not hide another.

use std::sync::{Mutex, PoisonError};

/// Lines at once.
const BURST: u32 = 20;
/// Then one in so long.
const REFILL_MS: u64 = 1000;

/// The throttle of one kind of line.
#[derive(Debug)]
pub struct Throttle(Mutex<State>);

#[derive(Debug)]
struct State {
    left: u32,
    refilled_ms: u64,
    held_back: u64,
}

impl Default for Throttle {
    fn default() -> Self {
        Throttle::new()
    }
}

impl Throttle {
    /// A whole burst left.
    pub fn new() -> Throttle {
        Throttle(Mutex::new(State { left: BURST, refilled_ms: 0, held_back: 0 }))
    }

    /// Whether a line may be logged now, and then how many were held back since the last.
    pub fn pass(&self, now_ms: u64) -> Option<u64> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let due = now_ms.saturating_sub(state.refilled_ms) / REFILL_MS;
        state.left = u32::try_from(due).unwrap_or(BURST).saturating_add(state.left).min(BURST);
        state.refilled_ms += due * REFILL_MS;
        if state.left == 0 {
            state.held_back += 1;
            return None;
        }
        state.left -= 1;
        Some(std::mem::take(&mut state.held_back))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_then_one_a_second_with_the_count_of_the_rest() {
        let throttle = Throttle::new();
        let passed = (0..100).filter(|_| throttle.pass(500) == Some(0)).count();
        assert_eq!(passed, BURST as usize);
        assert_eq!(throttle.pass(999), None);
        assert_eq!(throttle.pass(1000), Some(81));
        assert_eq!(throttle.pass(1001), None);
        assert_eq!(throttle.pass(60_000), Some(1));
        assert_eq!((0..100).filter_map(|_| throttle.pass(60_000)).count(), BURST as usize - 1);
    }
}
