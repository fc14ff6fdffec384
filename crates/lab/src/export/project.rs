//! A project of IEC 61131-3 ladders: what `xml` writes.
//!
//! `rungs` makes the networks of a program, `library` those of the function blocks. A network is
//! one line of power with its coils, or one call of a block or function. A call with a result is
//! always stored, so that the order of the networks is the order of their effects.

use super::literals::CallLiteral;

/// A project: one program, and the function blocks that it uses.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportedProject {
    /// The name of the ladder.
    pub name: String,
    /// Function blocks first, the program last.
    pub units: Vec<ExportedUnit>,
}

/// A program or function block.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExportedUnit {
    pub name: String,
    pub doc: String,
    pub is_program: bool,
    pub variables: Vec<ExportedVariable>,
    pub networks: Vec<ExportedNetwork>,
}

/// A declared variable.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportedVariable {
    pub name: String,
    /// `BOOL`, `DINT`, `TIME`, `REAL`, or the name of a function block.
    pub type_name: String,
    pub usage: VariableRole,
    /// `%IX0.0`.
    pub address: Option<String>,
    pub initial: Option<String>,
    pub doc: String,
}

/// In which list of its unit a variable is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableRole {
    Input,
    Output,
    Local,
}

/// A network.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportedNetwork {
    /// A comment above it; empty: none.
    pub doc: String,
    pub body: NetworkBody,
}

/// What a network does.
#[derive(Clone, Debug, PartialEq)]
pub enum NetworkBody {
    /// Contacts that all coils share, then each coil behind contacts of its own.
    Coils { power: NetworkPower, coils: Vec<NetworkCoil> },
    /// A call with results that are stored.
    Call { call: BlockCall, results: Vec<CallResult> },
}

/// A condition of contacts.
#[derive(Clone, Debug, PartialEq)]
pub enum NetworkPower {
    /// A wire, or an open end.
    Constant(bool),
    Contact {
        variable: String,
        is_negated: bool,
    },
    Series(Vec<NetworkPower>),
    Parallel(Vec<NetworkPower>),
    /// The power of the rung, whose contacts are chosen when all of its networks are known.
    OfRung {
        is_negated: bool,
    },
}

/// A coil behind contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkCoil {
    pub power: NetworkPower,
    pub variable: String,
    pub action: CoilAction,
}

/// What a coil does with its power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoilAction {
    Assign,
    Set,
    Reset,
}

/// A call of a function block or function.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockCall {
    pub type_name: String,
    /// The variable of a function block; `None`: a function.
    pub instance: Option<String>,
    pub inputs: Vec<CallInput>,
}

/// An input of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct CallInput {
    pub pin: &'static str,
    pub source: CallSource,
}

/// What comes to an input.
#[derive(Clone, Debug, PartialEq)]
pub enum CallSource {
    Power(NetworkPower),
    Variable(String),
    Literal(CallLiteral),
    /// The result of a function.
    Call(BlockCall),
}

/// Where a result goes.
#[derive(Clone, Debug, PartialEq)]
pub struct CallResult {
    pub pin: &'static str,
    pub variable: String,
    /// Into a coil; else into a variable at the end of a line.
    pub is_coil: bool,
}

impl NetworkPower {
    /// Contacts in series; a wire without any.
    pub(super) fn all(parts: impl IntoIterator<Item = NetworkPower>) -> NetworkPower {
        let mut series = Vec::new();
        for part in parts {
            match part {
                NetworkPower::Constant(true) => {}
                NetworkPower::Constant(false) => return NetworkPower::Constant(false),
                NetworkPower::Series(inner) => series.extend(inner),
                part @ (NetworkPower::Contact { .. }
                | NetworkPower::Parallel(_)
                | NetworkPower::OfRung { .. }) => series.push(part),
            }
        }
        match series.len() {
            0 => NetworkPower::Constant(true),
            1 => series.remove(0),
            _ => NetworkPower::Series(series),
        }
    }

    /// Contacts in parallel; an open end without any.
    pub(super) fn any(parts: impl IntoIterator<Item = NetworkPower>) -> NetworkPower {
        let mut parallel = Vec::new();
        for part in parts {
            match part {
                NetworkPower::Constant(false) => {}
                NetworkPower::Constant(true) => return NetworkPower::Constant(true),
                NetworkPower::Parallel(inner) => parallel.extend(inner),
                part @ (NetworkPower::Contact { .. }
                | NetworkPower::Series(_)
                | NetworkPower::OfRung { .. }) => parallel.push(part),
            }
        }
        match parallel.len() {
            0 => NetworkPower::Constant(false),
            1 => parallel.remove(0),
            _ => NetworkPower::Parallel(parallel),
        }
    }

    /// The contacts that have power exactly when these have none.
    pub(super) fn opposite(self) -> NetworkPower {
        let all = |parts: Vec<NetworkPower>| parts.into_iter().map(NetworkPower::opposite);
        match self {
            NetworkPower::Constant(is_on) => NetworkPower::Constant(!is_on),
            NetworkPower::Contact { variable, is_negated } => {
                NetworkPower::Contact { variable, is_negated: !is_negated }
            }
            NetworkPower::Series(parts) => NetworkPower::any(all(parts)),
            NetworkPower::Parallel(parts) => NetworkPower::all(all(parts)),
            NetworkPower::OfRung { is_negated } => NetworkPower::OfRung { is_negated: !is_negated },
        }
    }

    /// With other contacts in place of the rung's power.
    pub(super) fn with_rung(self, rung: &NetworkPower) -> NetworkPower {
        let all = |parts: Vec<NetworkPower>| {
            parts.into_iter().map(|part| part.with_rung(rung)).collect::<Vec<_>>()
        };
        match self {
            NetworkPower::OfRung { is_negated: true } => rung.clone().opposite(),
            NetworkPower::OfRung { is_negated: false } => rung.clone(),
            NetworkPower::Series(parts) => NetworkPower::all(all(parts)),
            NetworkPower::Parallel(parts) => NetworkPower::any(all(parts)),
            power @ (NetworkPower::Constant(_) | NetworkPower::Contact { .. }) => power,
        }
    }

    /// Adds the variables of its contacts.
    pub(super) fn read(&self, names: &mut Vec<String>) {
        match self {
            NetworkPower::Contact { variable, .. } => names.push(variable.clone()),
            NetworkPower::Series(parts) | NetworkPower::Parallel(parts) => {
                parts.iter().for_each(|part| part.read(names));
            }
            NetworkPower::Constant(_) | NetworkPower::OfRung { .. } => {}
        }
    }

    /// The number of its contacts.
    pub(super) fn weight(&self) -> usize {
        let mut names = Vec::new();
        self.read(&mut names);
        names.len()
    }

    /// Whether the rung's power is a part of it.
    pub(super) fn has_rung(&self) -> bool {
        match self {
            NetworkPower::OfRung { .. } => true,
            NetworkPower::Series(parts) | NetworkPower::Parallel(parts) => {
                parts.iter().any(NetworkPower::has_rung)
            }
            NetworkPower::Constant(_) | NetworkPower::Contact { .. } => false,
        }
    }
}

impl BlockCall {
    /// A call of a function.
    pub(super) fn function(type_name: &str, inputs: Vec<CallInput>) -> BlockCall {
        BlockCall { type_name: type_name.to_owned(), instance: None, inputs }
    }

    /// With the power of each input, and of those of its functions, changed.
    pub(super) fn mapped(self, change: &dyn Fn(NetworkPower) -> NetworkPower) -> BlockCall {
        let source = |source: CallSource| match source {
            CallSource::Power(power) => CallSource::Power(change(power)),
            CallSource::Call(call) => CallSource::Call(call.mapped(change)),
            source @ (CallSource::Variable(_) | CallSource::Literal(_)) => source,
        };
        let inputs = self.inputs.into_iter();
        let inputs = inputs.map(|input| CallInput { pin: input.pin, source: source(input.source) });
        BlockCall { inputs: inputs.collect(), ..self }
    }

    /// Whether the rung's power comes to an input.
    pub(super) fn has_rung(&self) -> bool {
        self.inputs.iter().any(|input| match &input.source {
            CallSource::Power(power) => power.has_rung(),
            CallSource::Call(call) => call.has_rung(),
            CallSource::Variable(_) | CallSource::Literal(_) => false,
        })
    }
}

/// An open contact.
pub(super) fn on(variable: &str) -> NetworkPower {
    NetworkPower::Contact { variable: variable.to_owned(), is_negated: false }
}

/// A closed contact.
pub(super) fn off(variable: &str) -> NetworkPower {
    NetworkPower::Contact { variable: variable.to_owned(), is_negated: true }
}
