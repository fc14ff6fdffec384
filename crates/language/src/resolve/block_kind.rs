//! The kinds of blocks. Part of the resolved program and of its names.

/// The kind of a block; it determines when the block executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BlockKind {
    /// A Program; `Main` has `autostart` set and never stops.
    Program,
    /// A Task that ENTASK starts.
    Task,
    FirstScan,
    TopOfScan,
    BottomOfScan,
    LastScan,
}

impl BlockKind {
    /// Whether nothing starts or stops a block of this kind.
    pub fn is_built_in(self) -> bool {
        !matches!(self, BlockKind::Program | BlockKind::Task)
    }
}
