//! The limit for the size of an expansion, so that it ends quickly whatever the files contain.

/// Maximum number of contacts, operands, rungs and tags of all uses together: about as many as
/// files can contain.
pub(super) const PARTS_MAX: usize = 1_000_000;

/// The room that is left.
pub(super) struct ExpansionRoom {
    left: usize,
}

impl ExpansionRoom {
    pub fn new() -> ExpansionRoom {
        ExpansionRoom { left: PARTS_MAX }
    }

    /// Takes room for this number of parts; `None` if there is too little.
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

    /// Whether the expansion ends because there is no room left.
    pub fn is_over(&self) -> bool {
        self.left == 0
    }
}
