//! The room for what templates stand for: an expansion ends quickly, whatever is written.

/// The most contacts, operands, rungs and tags of all uses together: files can hold about as many.
pub(super) const PARTS_MAX: usize = 1_000_000;

/// The room that is left.
pub(super) struct Room {
    left: usize,
}

impl Room {
    pub fn new() -> Room {
        Room { left: PARTS_MAX }
    }

    /// Takes room for some parts; `None` once there is too little.
    pub fn take(&mut self, parts: usize) -> Option<()> {
        match self.left.checked_sub(parts) {
            Some(left) => {
                self.left = left;
                Some(())
            }
            None => {
                self.left = 0;
                None
            }
        }
    }

    /// Whether no more is written out.
    pub fn is_over(&self) -> bool {
        self.left == 0
    }
}
