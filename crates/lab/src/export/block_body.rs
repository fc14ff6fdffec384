//! A function block that is being written, network by network. Used by `library`.

use super::functions;
use super::project::{
    BlockCall, CallResult, CallSource, CoilAction, ExportedNetwork, ExportedUnit, ExportedVariable,
    NetworkBody, NetworkCoil, NetworkPower, VariableRole, on,
};

/// A function block that is being written.
pub(super) struct BlockBody(pub(super) ExportedUnit);

impl BlockBody {
    pub(super) fn new(name: &str, doc: &str) -> BlockBody {
        BlockBody(ExportedUnit {
            name: name.to_owned(),
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

    pub(super) fn inputs(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Input, type_name, names)
    }

    pub(super) fn outputs(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Output, type_name, names)
    }

    pub(super) fn locals(self, type_name: &str, names: &[&str]) -> BlockBody {
        self.declare(VariableRole::Local, type_name, names)
    }

    pub(super) fn network(mut self, body: NetworkBody) -> BlockBody {
        self.0.networks.push(ExportedNetwork { doc: String::new(), body });
        self
    }

    /// A coil behind contacts.
    pub(super) fn coil(self, variable: &str, power: NetworkPower) -> BlockBody {
        let coil = NetworkCoil {
            power: NetworkPower::Constant(true),
            variable: variable.to_owned(),
            action: CoilAction::Assign,
        };
        self.network(NetworkBody::Coils { power, coils: vec![coil] })
    }

    /// A compare whose result is a coil.
    pub(super) fn compare(self, variable: &str, name: &str, sides: [CallSource; 2]) -> BlockBody {
        let [left, right] = sides;
        let call = functions::call_of_two(name, left, right);
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: true }];
        self.network(NetworkBody::Call { call, results })
    }

    /// A value that is stored.
    pub(super) fn store(self, variable: &str, value: CallSource) -> BlockBody {
        self.stored(variable, functions::stored(value, NetworkPower::Constant(true)))
    }

    /// A value that is stored while a bit is ON.
    pub(super) fn store_while(self, enable: &str, variable: &str, value: CallSource) -> BlockBody {
        self.stored(variable, functions::stored(value, on(enable)))
    }

    fn stored(self, variable: &str, call: BlockCall) -> BlockBody {
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.network(NetworkBody::Call { call, results })
    }
}
