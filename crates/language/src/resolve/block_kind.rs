//! The kinds of blocks. Part of the resolved program and of its names.

use rungd_engine::isa::BlockBit;

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
    /// Rungs that CALL executes.
    Subroutine,
}

impl BlockKind {
    /// The bits that each block of this kind has.
    pub fn bits(self) -> &'static [BlockBit] {
        match self {
            BlockKind::Program => &[BlockBit::Running],
            BlockKind::Subroutine => &[],
            BlockKind::Task
            | BlockKind::FirstScan
            | BlockKind::TopOfScan
            | BlockKind::BottomOfScan
            | BlockKind::LastScan => &BlockBit::ALL,
        }
    }

    /// Whether nothing starts or stops a block of this kind.
    pub fn is_built_in(self) -> bool {
        match self {
            BlockKind::FirstScan
            | BlockKind::TopOfScan
            | BlockKind::BottomOfScan
            | BlockKind::LastScan => true,
            BlockKind::Program | BlockKind::Task | BlockKind::Subroutine => false,
        }
    }

    /// Its kind in a sentence: `program`, `task` or `subroutine`.
    pub fn word(self) -> &'static str {
        match self {
            BlockKind::Program => "program",
            BlockKind::Subroutine => "subroutine",
            BlockKind::Task
            | BlockKind::FirstScan
            | BlockKind::TopOfScan
            | BlockKind::BottomOfScan
            | BlockKind::LastScan => "task",
        }
    }

    /// Its kind at the beginning of a title: `Program`, `Task` or `Subroutine`.
    pub fn title(self) -> &'static str {
        match self.word() {
            "program" => "Program",
            "subroutine" => "Subroutine",
            _ => "Task",
        }
    }
}
