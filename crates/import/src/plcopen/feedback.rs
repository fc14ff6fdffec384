//! Functions in a circle, as a NOT that leads over a timer to itself: what type a value has that
//! the last scan left.
//!
//! Asked by `functions` for an output that is read before its function was executed in any pass.
//! Only what is a BOOL by its form is known: an output of a logic function to which only BOOLs
//! lead.

use super::body::LadderBody;
use super::calculations::is_compare;
use super::elements::{BlockElement, Connection, ElementBody};
use super::graph::BlockOutput;
use super::literals::{IecLiteral, literal};
use super::types::IecType;

/// Most elements that are looked at. What more of them lead to is not taken for a BOOL.
const STEPS_MAX: usize = 1_000;

impl LadderBody<'_, '_> {
    /// Whether an output is a BOOL, whatever is executed.
    pub(super) fn is_bit_output(&mut self, output: BlockOutput) -> bool {
        let graph = self.graph;
        let mut seen = Vec::new();
        let mut waiting = vec![output.element];
        while let Some(at) = waiting.pop() {
            if seen.contains(&at) {
                continue;
            }
            if seen.len() == STEPS_MAX {
                return false;
            }
            seen.push(at);
            let Some(block) = graph.elements[at].body.block() else { return false };
            if !matches!(block.kind.to_uppercase().as_str(), "NOT" | "AND" | "OR" | "XOR") {
                return false;
            }
            let lines = block.inputs.iter().flat_map(|pin| &pin.input);
            for line in lines {
                match self.logic_before(line) {
                    Some(LogicSource::Bit) => {}
                    Some(LogicSource::Function(at)) => waiting.push(at),
                    None => return false,
                }
            }
        }
        true
    }

    /// What a line comes from; `None` if that may be a number.
    fn logic_before(&mut self, line: &Connection) -> Option<LogicSource> {
        let graph = self.graph;
        let at = graph.source(line).ok()?;
        match &graph.elements[at].body {
            ElementBody::LeftRail | ElementBody::Contact { .. } | ElementBody::Coil { .. } => {
                Some(LogicSource::Bit)
            }
            ElementBody::InVariable { expression, .. } => {
                let is_bit = match literal(expression) {
                    Some(literal) => matches!(literal, IecLiteral::Bool(_)),
                    None => self.read(expression, false).ok()?.kind == IecType::Bool,
                };
                is_bit.then_some(LogicSource::Bit)
            }
            ElementBody::Block(block) => {
                let pin = graph.output(at, line).ok()?;
                match is_bit_of_block(block, pin) {
                    true => Some(LogicSource::Bit),
                    false => Some(LogicSource::Function(at)),
                }
            }
            ElementBody::RightRail
            | ElementBody::OutVariable { .. }
            | ElementBody::InOutVariable { .. }
            | ElementBody::Connector { .. }
            | ElementBody::Continuation { .. }
            | ElementBody::Comment(_)
            | ElementBody::Condition(_)
            | ElementBody::Other { .. } => None,
        }
    }
}

/// What a line of a logic function comes from.
enum LogicSource {
    Bit,
    Function(usize),
}

/// Whether an output of a block of the standard is a BOOL: of a compare, and Q of the others.
fn is_bit_of_block(block: &BlockElement, pin: usize) -> bool {
    let kind = block.kind.to_uppercase();
    let is_block = matches!(
        kind.as_str(),
        "TON" | "TOF" | "TP" | "CTU" | "CTD" | "CTUD" | "R_TRIG" | "F_TRIG" | "SR" | "RS"
    );
    let is_q = block.outputs.get(pin).is_some_and(|pin| pin.name.starts_with('Q'));
    is_compare(&kind) || is_block && is_q
}
