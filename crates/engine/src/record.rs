//! A structure's record: its flags, and the private state of its instructions.
//!
//! A leaf module: `layout`, `reach` and `memory` address records; `counters`, `timers` and
//! `sensaphone` use their bits, and so do proofs.

/// Number of bits in a record: the public flags (four; five for a Sensaphone counter), then the
/// private state of the owning instruction. One look-up finds them all, in one cache line. A record
/// and the structure's `.Acc` have the same number.
pub const RECORD: usize = 8;

/// Number of public flags of a counter or timer; the rest of its record is [`OwnerState`].
pub const FLAGS: usize = 4;

/// Number of public flags of a Sensaphone counter.
pub const SENSAPHONE_FLAGS: u32 = 5;

/// The private state of a counter's or timer's owner: four bits, one byte each.
///
/// All four are read and written together, because loops over operations wait longer for loads and
/// stores than for arithmetic.
#[derive(Clone, Copy, Default)]
pub(super) struct OwnerState(pub u32);

impl OwnerState {
    /// The state with these bits (0 or 1), all others OFF.
    #[inline(always)]
    pub fn of<const N: usize>(bits: [(u32, u8); N]) -> OwnerState {
        OwnerState(bits.iter().fold(0, |all, (place, bit)| all | u32::from(*bit) << (8 * place)))
    }

    /// One of its bits.
    #[inline(always)]
    pub fn bit(self, place: u32) -> u8 {
        (self.0 >> (8 * place)) as u8
    }

    /// The same state with one bit ON.
    pub fn with(self, place: u32) -> OwnerState {
        OwnerState(self.0 | 1 << (8 * place))
    }

    /// The same state with one bit OFF.
    pub fn without(self, place: u32) -> OwnerState {
        OwnerState(self.0 & !(1 << (8 * place)))
    }
}

/// The bits of a counter's state.
pub mod counter_state {
    /// Edge history of UP.
    pub const UP: u32 = 0;
    /// Edge history of DN.
    pub const DN: u32 = 1;
    /// A RSTCT reset is pending.
    pub const PENDING: u32 = 2;
    /// CNTDN: the preset was loaded, or a termination pass ran before the first load.
    pub const LOADED: u32 = 3;
}

/// The bits of a timer's state.
pub mod timer_state {
    /// The timer was timing at the last execution: the next execution adds the time since then.
    /// OFFDTMR: it is timing down.
    pub const RUNNING: u32 = 0;
    /// OFFDTMR: the leg was ON at the last execution.
    pub const LEG: u32 = 1;
    /// A RSTT reset is pending.
    pub const PENDING: u32 = 2;
    /// TMRADOWN: the preset was loaded, or a termination pass ran before the first load.
    pub const LOADED: u32 = 3;
}

/// The edge histories in a Sensaphone counter's record.
pub mod sensaphone_state {
    /// The history of CTU.
    pub const UP: usize = 5;
    /// The history of CTD.
    pub const DOWN: usize = 6;
}

/// The public flags of a Sensaphone counter, by their place in its record.
pub mod sensaphone_flags {
    /// CTU's rung was ON.
    pub const CU: u32 = 0;
    /// CTD's rung was ON.
    pub const CD: u32 = 1;
    /// ACC has reached PRE.
    pub const DN: u32 = 2;
    /// ACC has wrapped upwards.
    pub const OV: u32 = 3;
    /// ACC has wrapped downwards.
    pub const UN: u32 = 4;
}
