//! Function blocks in ladder for rungd's own timers and counters, and for the time of a scan.
//!
//! Each does, scan by scan, what `docs/semantics.md` says of its instruction. A block gets `.Acc`
//! and gives it back as `NewAcc`, so that other rungs can write it. Times are whole milliseconds in
//! a DINT, because the standard lets nobody count in a TIME: `clock` makes them.

mod clock;
mod counters;
mod timers;

use super::project::{
    BlockCall, CallInput, CallResult, CallSource, CoilAction, ExportedNetwork, ExportedUnit,
    ExportedVariable, NetworkBody, NetworkCoil, NetworkPower, VariableRole,
};
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
}

impl LibraryBlock {
    /// All blocks.
    pub(super) const ALL: [LibraryBlock; 9] = all_variants![
        LibraryBlock::Clock,
        LibraryBlock::Tmr,
        LibraryBlock::Offdtmr,
        LibraryBlock::Tmrdown,
        LibraryBlock::Tmra,
        LibraryBlock::Tmradown,
        LibraryBlock::Cnt,
        LibraryBlock::Cntdn,
        LibraryBlock::Udc,
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
        }
    }

    /// Its definition.
    pub(super) fn unit(self) -> ExportedUnit {
        match self {
            LibraryBlock::Clock => clock::unit(),
            LibraryBlock::Tmr => timers::up(),
            LibraryBlock::Offdtmr => timers::off_delay(),
            LibraryBlock::Tmrdown => timers::down(),
            LibraryBlock::Tmra => timers::accumulating_up(),
            LibraryBlock::Tmradown => timers::accumulating_down(),
            LibraryBlock::Cnt => counters::up(),
            LibraryBlock::Cntdn => counters::down(),
            LibraryBlock::Udc => counters::up_down(),
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

/// A function block that is being written.
struct BlockBody(ExportedUnit);

impl BlockBody {
    fn new(block: LibraryBlock, doc: &str) -> BlockBody {
        BlockBody(ExportedUnit {
            name: block.name().to_owned(),
            doc: doc.to_owned(),
            ..ExportedUnit::default()
        })
    }

    fn declare(mut self, usage: VariableRole, type_name: &str, names: &[&str]) -> BlockBody {
        for name in names {
            self.0.variables.push(ExportedVariable {
                name: (*name).to_owned(),
                type_name: type_name.to_owned(),
                usage,
                address: None,
                initial: None,
                doc: String::new(),
            });
        }
        self
    }

    fn inputs(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Input, type_name, names)
    }

    fn outputs(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Output, type_name, names)
    }

    fn locals(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Local, type_name, names)
    }

    fn network(mut self, body: NetworkBody) -> BlockBody {
        self.0.networks.push(ExportedNetwork { doc: String::new(), body });
        self
    }

    /// A coil behind contacts.
    fn coil(self, variable: &str, power: NetworkPower) -> BlockBody {
        let coil = NetworkCoil {
            power: NetworkPower::Constant(true),
            variable: variable.to_owned(),
            action: CoilAction::Assign,
        };
        self.network(NetworkBody::Coils { power, coils: vec![coil] })
    }

    /// A compare whose result is a coil.
    fn compare(self, variable: &str, name: &str, sides: [CallSource; 2]) -> BlockBody {
        let [left, right] = sides;
        let call = super::functions::call_of_two(name, left, right);
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: true }];
        self.network(NetworkBody::Call { call, results })
    }

    /// A value that is stored.
    fn store(self, variable: &str, value: CallSource) -> BlockBody {
        let call = match value {
            CallSource::Call(call) => call,
            source @ (CallSource::Power(_) | CallSource::Text(_)) => {
                BlockCall::function("MOVE", vec![CallInput { pin: "IN", source }])
            }
        };
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.network(NetworkBody::Call { call, results })
    }

    /// A value that is stored while a bit is ON.
    fn store_while(self, enable: &str, variable: &str, value: CallSource) -> BlockBody {
        let power = CallSource::Power(super::project::on(enable));
        let inputs =
            vec![CallInput { pin: "EN", source: power }, CallInput { pin: "IN", source: value }];
        let call = BlockCall::function("MOVE", inputs);
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.network(NetworkBody::Call { call, results })
    }
}
