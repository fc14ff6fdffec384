//! A bit that follows another one after a time: contactors, switches, doors.
//!
//! Used by the parts of a plant. A change that does not
//! last as long as its delay is not followed. No clock: the time is an argument.

/// What it is, and what it is about to become.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Follower {
    on: bool,
    /// Since when the bit differs from `on`.
    differs_ms: Option<u64>,
}

impl Follower {
    /// What it is at this time, which never goes back.
    pub fn step(&mut self, now_ms: u64, bit: bool, after_ms: u32, release_ms: u32) -> bool {
        if bit == self.on {
            self.differs_ms = None;
            return self.on;
        }
        let since_ms = *self.differs_ms.get_or_insert(now_ms);
        let delay_ms = if bit { after_ms } else { release_ms };
        if now_ms - since_ms >= delay_ms.into() {
            *self = Follower { on: bit, differs_ms: None };
        }
        self.on
    }
}
