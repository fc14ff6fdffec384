//! A function block that is being written, network by network. Used by `library`.

use super::project::{
    BlockCall, CallInput, CallResult, CallSource, CoilAction, ExportedNetwork, ExportedUnit,
    ExportedVariable, NetworkBody, NetworkCoil, NetworkPower, VariableRole,
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
        let call = super::functions::call_of_two(name, left, right);
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: true }];
        self.network(NetworkBody::Call { call, results })
    }

    /// A value that is stored.
    pub(super) fn store(self, variable: &str, value: CallSource) -> BlockBody {
        let call = match value {
            CallSource::Call(call) => call,
            source @ (CallSource::Power(_) | CallSource::Variable(_) | CallSource::Literal(_)) => {
                BlockCall::function("MOVE", vec![CallInput { pin: "IN", source }])
            }
        };
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.network(NetworkBody::Call { call, results })
    }

    /// A value that is stored while a bit is ON.
    pub(super) fn store_while(self, enable: &str, variable: &str, value: CallSource) -> BlockBody {
        let power = CallSource::Power(super::project::on(enable));
        let inputs =
            vec![CallInput { pin: "EN", source: power }, CallInput { pin: "IN", source: value }];
        let call = BlockCall::function("MOVE", inputs);
        let variable = variable.to_owned();
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.network(NetworkBody::Call { call, results })
    }
}
