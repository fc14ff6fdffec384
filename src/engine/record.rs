//! A structure's record: its flags, and what its instructions remember between executions.
//!
//! A leaf: layout, reach and memory address records, counters and timers give their bits a
//! meaning.

/// Bits of one structure, side by side: the flags that a program sees (four; of a Sensaphone
/// counter five), then what the owning instruction remembers between its executions. One look-up
/// finds them all, in one cache line. The number of a record is that of the structure's `.Acc`
/// among the words too.
pub(super) const RECORD: usize = 8;

/// How many bits of a record the program sees of a counter or timer; the rest is [`State`].
pub(super) const FLAGS: usize = 4;

/// How many bits of a Sensaphone counter's record the program sees.
pub(super) const SENSAPHONE_FLAGS: u32 = 5;

/// What the owner of a counter or timer remembers: four bits, a byte each.
///
/// Read and written in one go: such loops wait for loads and stores more than for arithmetic.
#[derive(Clone, Copy, Default)]
pub(super) struct State(pub u32);

impl State {
    /// The state in which these bits (0 or 1) are as given, all others OFF.
    #[inline(always)]
    pub fn of<const N: usize>(bits: [(u32, u8); N]) -> State {
        State(bits.iter().fold(0, |all, (place, bit)| all | u32::from(*bit) << (8 * place)))
    }

    /// One of its bits.
    #[inline(always)]
    pub fn bit(self, place: u32) -> u8 {
        (self.0 >> (8 * place)) as u8
    }

    /// The same with one bit ON.
    pub fn with(self, place: u32) -> State {
        State(self.0 | 1 << (8 * place))
    }

    /// The same with one bit OFF.
    pub fn without(self, place: u32) -> State {
        State(self.0 & !(1 << (8 * place)))
    }
}

/// The bits of a counter's state.
pub(super) mod counter_state {
    /// Edge history of UP.
    pub const UP: u32 = 0;
    /// Edge history of DN.
    pub const DN: u32 = 1;
    /// A RSTCT reset is pending.
    pub const PENDING: u32 = 2;
    /// CNTDN: the preset was loaded once, or a pass came first.
    pub const LOADED: u32 = 3;
}

/// The bits of a timer's state.
pub(super) mod timer_state {
    /// Time was running at the last execution: the next one adds what has passed since.
    /// OFFDTMR: it is timing down.
    pub const RUNNING: u32 = 0;
    /// OFFDTMR: the leg was ON at the last execution.
    pub const LEG: u32 = 1;
    /// A RSTT reset is pending.
    pub const PENDING: u32 = 2;
    /// TMRADOWN: the preset was loaded once, or a pass came first.
    pub const LOADED: u32 = 3;
}

/// Where in a Sensaphone counter's record the edge histories lie.
pub(super) mod sensaphone_state {
    /// Of CTU.
    pub const UP: usize = 5;
    /// Of CTD.
    pub const DOWN: usize = 6;
}
