//! The tags that the map of a field device brings or takes: inputs and outputs of modules, and what
//! else the program reads and does not write.

use super::memory::{LogixMemory, LogixVariable};
use super::types::Kind;
use crate::model::UnwrittenTag;

/// The tags that the program reads, and nothing in it writes.
pub(super) fn unwritten(memory: &LogixMemory) -> Vec<UnwrittenTag> {
    listed(memory, |variable| variable.is_read && !variable.is_written)
}

/// The tags of modules that the program writes.
pub(super) fn outputs(memory: &LogixMemory) -> Vec<UnwrittenTag> {
    listed(memory, |variable| variable.is_written && module(memory, variable).is_some())
}

fn listed(memory: &LogixMemory, wanted: impl Fn(&LogixVariable) -> bool) -> Vec<UnwrittenTag> {
    let templates: Vec<usize> =
        memory.scopes.iter().filter(|scope| !scope.is_open).map(|scope| scope.home).collect();
    let mut rows = Vec::new();
    for (id, variable) in memory.variables.iter().enumerate() {
        if templates.contains(&variable.home) || !wanted(variable) {
            continue;
        }
        let source = source(memory, variable);
        for (path, name) in memory.parts_of(id) {
            let dot = if path.is_empty() { "" } else { "." };
            let was = format!("{}{dot}{path}", variable.original);
            rows.push(UnwrittenTag { name, was, source: source.clone() });
        }
    }
    rows
}

/// What brings or takes a variable.
fn source(memory: &LogixMemory, variable: &LogixVariable) -> String {
    match module(memory, variable) {
        Some(module) => module,
        None if variable.is_guessed => "not declared in the file".to_owned(),
        None => "an operator, or a constant".to_owned(),
    }
}

/// The module that a variable belongs to, as far as the file tells it.
fn module(memory: &LogixMemory, variable: &LogixVariable) -> Option<String> {
    if let Some(module) = &variable.module {
        return Some(format!("the module {module}"));
    }
    if let Some((place, _)) = variable.original.rsplit_once(':') {
        return Some(format!("the module at {place}, which the file does not contain"));
    }
    let Kind::Struct(kind) = &variable.kind else { return None };
    let kind = memory.types.spelling(kind);
    kind.contains(':').then(|| format!("a module, as its type is {kind}"))
}
