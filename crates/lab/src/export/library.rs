//! Function blocks in ladder for rungd's own timers and counters, and for the time of a scan.
//!
//! Each does, scan by scan, what `docs/semantics.md` says of its instruction. A block gets `.Acc`
//! and gives it back as `NewAcc`, so that other rungs can write it. Times are whole milliseconds in
//! a DINT, because the standard lets nobody count in a TIME: `clock` makes them.

mod clock;
mod counters;
mod sensaphone;
mod timers;

use super::project::{ExportedUnit, VariableRole};
use rungd_base::variants::all_variants;
use rungd_engine::isa::Mnemonic;

/// A function block of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LibraryBlock {
    /// The time since the last scan.
    Clock,
    /// TMR, ONDTMR.
    Tmr,
    Offdtmr,
    Tmrdown,
    /// TMRA, TMRAG.
    Tmra,
    Tmradown,
    Cnt,
    Cntdn,
    /// UDC, UDCG.
    Udc,
    Ctu,
    Ctd,
}

impl LibraryBlock {
    /// All blocks.
    pub(super) const ALL: [LibraryBlock; 11] = all_variants![
        LibraryBlock::Clock,
        LibraryBlock::Tmr,
        LibraryBlock::Offdtmr,
        LibraryBlock::Tmrdown,
        LibraryBlock::Tmra,
        LibraryBlock::Tmradown,
        LibraryBlock::Cnt,
        LibraryBlock::Cntdn,
        LibraryBlock::Udc,
        LibraryBlock::Ctu,
        LibraryBlock::Ctd,
    ];

    /// The block of a timer or counter; `None` for other instructions.
    pub(super) fn of(mnemonic: Mnemonic) -> Option<LibraryBlock> {
        let blocks = [
            (Mnemonic::Tmr, LibraryBlock::Tmr),
            (Mnemonic::Ondtmr, LibraryBlock::Tmr),
            (Mnemonic::Offdtmr, LibraryBlock::Offdtmr),
            (Mnemonic::Tmrdown, LibraryBlock::Tmrdown),
            (Mnemonic::Tmra, LibraryBlock::Tmra),
            (Mnemonic::Tmrag, LibraryBlock::Tmra),
            (Mnemonic::Tmradown, LibraryBlock::Tmradown),
            (Mnemonic::Cnt, LibraryBlock::Cnt),
            (Mnemonic::Cntdn, LibraryBlock::Cntdn),
            (Mnemonic::Udc, LibraryBlock::Udc),
            (Mnemonic::Udcg, LibraryBlock::Udc),
        ];
        let found = blocks.into_iter().find(|(of_block, _)| *of_block == mnemonic);
        found.map(|(_, block)| block)
    }

    /// The name of its type.
    pub(super) fn name(self) -> &'static str {
        match self {
            LibraryBlock::Clock => "Rungd_Clock",
            LibraryBlock::Tmr => "Rungd_TMR",
            LibraryBlock::Offdtmr => "Rungd_OFFDTMR",
            LibraryBlock::Tmrdown => "Rungd_TMRDOWN",
            LibraryBlock::Tmra => "Rungd_TMRA",
            LibraryBlock::Tmradown => "Rungd_TMRADOWN",
            LibraryBlock::Cnt => "Rungd_CNT",
            LibraryBlock::Cntdn => "Rungd_CNTDN",
            LibraryBlock::Udc => "Rungd_UDC",
            LibraryBlock::Ctu => "Rungd_CTU",
            LibraryBlock::Ctd => "Rungd_CTD",
        }
    }

    /// Its definition.
    pub(super) fn unit(self) -> ExportedUnit {
        match self {
            LibraryBlock::Clock => clock::unit(self.name()),
            LibraryBlock::Tmr => timers::up(self.name()),
            LibraryBlock::Offdtmr => timers::off_delay(self.name()),
            LibraryBlock::Tmrdown => timers::down(self.name()),
            LibraryBlock::Tmra => timers::accumulating_up(self.name()),
            LibraryBlock::Tmradown => timers::accumulating_down(self.name()),
            LibraryBlock::Cnt => counters::up(self.name()),
            LibraryBlock::Cntdn => counters::down(self.name()),
            LibraryBlock::Udc => counters::up_down(self.name()),
            LibraryBlock::Ctu => sensaphone::up(self.name()),
            LibraryBlock::Ctd => sensaphone::down(self.name()),
        }
    }

    /// Whether it has an input with a name.
    pub(super) fn has_input(self, name: &str) -> bool {
        self.declares(name, VariableRole::Input)
    }

    /// Whether it has an output with a name.
    pub(super) fn has_output(self, name: &str) -> bool {
        self.declares(name, VariableRole::Output)
    }

    fn declares(self, name: &str, usage: VariableRole) -> bool {
        let variables = self.unit().variables;
        variables.iter().any(|variable| variable.usage == usage && variable.name == name)
    }
}
