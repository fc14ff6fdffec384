//! A bit that follows an input bit after a delay: contactors, switches, doors.
//!
//! Used by the parts of a plant. A change that is shorter than its delay has no effect. This module
//! has no clock: the time is an argument.

/// The present value, and the time of a change that is not followed yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BitFollower {
    on: bool,
    /// The time since which the input bit differs from `on`.
    differs_ms: Option<u64>,
}

impl BitFollower {
    /// The value at this time. The time never goes back.
    pub fn step(&mut self, now_ms: u64, bit: bool, after_ms: u32, release_ms: u32) -> bool {
        if bit == self.on {
            self.differs_ms = None;
            return self.on;
        }
        let since_ms = *self.differs_ms.get_or_insert(now_ms);
        let delay_ms = if bit { after_ms } else { release_ms };
        if now_ms - since_ms >= delay_ms.into() {
            *self = BitFollower { on: bit, differs_ms: None };
        }
        self.on
    }
}
