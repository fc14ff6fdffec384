//! The direction of a swap: to a new program, or back to the one before.
//!
//! Used by `reload`.

use rungd_runtime::exchange::FaultReason;

/// The direction of a swap.
#[derive(Clone, Copy)]
pub(super) enum SwapDirection {
    /// To the program of the files.
    Forward,
    /// To the previous program: a rollback. If a fault of the new program is the reason, the mode
    /// changes from FAULT to RUN.
    Back(Option<FaultReason>),
}

impl SwapDirection {
    /// Whether it is a rollback.
    pub fn is_back(self) -> bool {
        matches!(self, SwapDirection::Back(_))
    }
}
