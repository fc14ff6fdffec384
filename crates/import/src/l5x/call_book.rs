//! What can be called: routines, and Add-On Instructions.
//!
//! Filled by `project` and `own_instruction`, read where rungs are translated.

use std::collections::{HashMap, HashSet};

use super::rll::RllInstruction;
use super::types::Kind;
use crate::model::{ProjectRung, RungBody, UseArgument};

/// What can be called.
#[derive(Debug, Default)]
pub(crate) struct CallBook {
    /// The routines, by scope and name in small letters.
    pub(crate) routines: HashMap<RoutineKey, Callee>,
    /// The tasks that have programs in the file, in small letters.
    pub(crate) tasks: HashSet<String>,
    /// The Add-On Instructions, by their names in small letters.
    pub(crate) instructions: HashMap<String, Result<OwnInstruction, String>>,
    /// The scope of each Add-On Instruction's logic.
    pub(crate) logic: Vec<usize>,
    /// The parameters of Add-On Instructions, as `name/parameter` in small letters, of which
    /// several uses have the same argument: there two coils would drive one bit.
    pub(crate) shared: HashSet<String>,
}

/// The name of a routine.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct RoutineKey {
    pub(crate) scope: usize,
    pub(crate) name: String,
}

/// A routine that can be called.
#[derive(Clone, Debug)]
pub(crate) struct Callee {
    /// The subroutine here, or why there is none.
    pub(crate) name: Result<String, String>,
    /// The operands of SBR: where the values of the call go.
    pub(crate) inputs: Vec<String>,
    /// The operands of RET: where the values come from; `None` if there are different ones.
    pub(crate) outputs: Option<Vec<String>>,
}

impl CallBook {
    /// Whether a name is that of an Add-On Instruction.
    pub(crate) fn is_own_instruction(&self, name: &str) -> bool {
        self.instructions.contains_key(&name.to_lowercase())
    }

    /// Whether a bit is the one that is ON while the logic of an Add-On Instruction executes.
    pub(crate) fn is_enable(&self, scope: usize, text: &str) -> bool {
        self.logic.contains(&scope) && text.eq_ignore_ascii_case("EnableIn")
    }
}

/// A template for an Add-On Instruction.
#[derive(Debug)]
pub(crate) struct OwnInstruction {
    pub(crate) template: String,
    /// The template of its prescan, if it has one.
    pub(crate) prescan: Option<String>,
    pub(crate) parameters: Vec<OwnParameter>,
    /// The parts of the instance's data that it names.
    pub(crate) parts: Vec<OwnPart>,
    /// The parts of what it uses by reference.
    pub(crate) references: Vec<OwnReference>,
}

/// A parameter of the original.
#[derive(Debug)]
pub(crate) struct OwnParameter {
    pub(crate) name: String,
    pub(crate) usage: String,
    pub(crate) is_required: bool,
}

/// A parameter of the template for a tag of the instance.
#[derive(Debug)]
pub(crate) struct OwnPart {
    /// The members' names with dots.
    pub(crate) path: String,
    pub(crate) parameter: String,
}

/// A parameter of the template for a tag of an InOut parameter.
#[derive(Debug)]
pub(crate) struct OwnReference {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) part: OwnPart,
}

/// The operands of SBR and RET of a routine.
pub(crate) fn callee(name: Result<String, String>, instructions: &[&RllInstruction]) -> Callee {
    let of = |wanted: &'static str| {
        let all = instructions.iter().filter(move |one| one.name == wanted);
        all.map(|one| one.operands.clone())
    };
    let mut returns = of("RET");
    let first = returns.next().unwrap_or_default();
    let is_same = returns.all(|other| other == first);
    Callee { name, inputs: of("SBR").next().unwrap_or_default(), outputs: is_same.then_some(first) }
}

/// The instance of a use, as the argument of its prescan.
pub(crate) fn prescan_rung(template: &str, name: &str, arguments: &[UseArgument]) -> ProjectRung {
    ProjectRung {
        name: Some(name.to_owned()),
        doc: String::new(),
        body: RungBody::Use { template: template.to_owned(), arguments: arguments.to_vec() },
    }
}
