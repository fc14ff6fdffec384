//! A ladder body as a graph: which element another one is connected to.

use std::collections::HashMap;

use super::elements::{BlockElement, BlockPin, Connection, ElementBody, LadderElement};

/// The graph of a body.
#[derive(Debug)]
pub(super) struct LadderGraph<'e> {
    pub(super) elements: &'e [LadderElement],
    by_id: HashMap<u64, usize>,
    connectors: HashMap<&'e str, usize>,
    /// How many pins, contacts and coils an output of a block goes to; by element and pin.
    consumers: HashMap<(usize, usize), Vec<usize>>,
}

/// An output of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct BlockOutput {
    pub(super) element: usize,
    pub(super) pin: usize,
}

impl<'e> LadderGraph<'e> {
    pub(super) fn of(elements: &'e [LadderElement]) -> LadderGraph<'e> {
        let mut graph = LadderGraph {
            elements,
            by_id: HashMap::new(),
            connectors: HashMap::new(),
            consumers: HashMap::new(),
        };
        for (at, element) in elements.iter().enumerate() {
            graph.by_id.entry(element.id).or_insert(at);
            if let ElementBody::Connector { name, .. } = &element.body {
                graph.connectors.entry(name).or_insert(at);
            }
        }
        for (at, element) in elements.iter().enumerate() {
            if matches!(element.body, ElementBody::RightRail) {
                continue;
            }
            for connection in inputs(element) {
                let Some(source) = graph.by_id.get(&connection.id).copied() else { continue };
                let ElementBody::Block(block) = &elements[source].body else { continue };
                if let Ok(pin) = output(&elements[source], block, connection) {
                    graph.consumers.entry((source, pin)).or_default().push(at);
                }
            }
        }
        graph
    }

    /// The element that a connection comes from.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn source(&self, connection: &Connection) -> Result<usize, String> {
        let found = self.by_id.get(&connection.id).copied();
        found.ok_or_else(|| {
            format!("a connection to the element {}, which does not exist", connection.id)
        })
    }

    /// The output of a block that a connection comes from.
    ///
    /// # Errors
    /// The block has several, and the connection names none.
    pub(super) fn output(&self, at: usize, connection: &Connection) -> Result<usize, String> {
        let block = self.elements[at].body.block();
        let block = block.ok_or("a connection to an element without outputs")?;
        output(&self.elements[at], block, connection)
    }

    /// The connector of a continuation.
    pub(super) fn connector(&self, name: &str) -> Option<usize> {
        self.connectors.get(name).copied()
    }

    /// The lines into the connector of a continuation; `None` without such a connector.
    pub(super) fn continued(&self, name: &str) -> Option<&'e [Connection]> {
        let body = &self.elements[self.connector(name)?].body;
        if let ElementBody::Connector { input, .. } = body { Some(input) } else { None }
    }

    /// The elements that an output goes to.
    pub(super) fn consumers(&self, output: BlockOutput) -> &[usize] {
        self.consumers.get(&(output.element, output.pin)).map_or(&[], Vec::as_slice)
    }
}

/// All connections into an element.
pub(super) fn inputs(element: &LadderElement) -> Vec<&Connection> {
    match &element.body {
        ElementBody::Contact { input, .. }
        | ElementBody::Coil { input, .. }
        | ElementBody::OutVariable { input, .. }
        | ElementBody::InOutVariable { input, .. }
        | ElementBody::Connector { input, .. }
        | ElementBody::Other { input, .. } => input.iter().collect(),
        ElementBody::Condition(condition) => condition.lines().iter().collect(),
        ElementBody::Block(block) => block.inputs.iter().flat_map(|pin| &pin.input).collect(),
        ElementBody::LeftRail
        | ElementBody::RightRail
        | ElementBody::InVariable { .. }
        | ElementBody::Continuation { .. }
        | ElementBody::Comment(_) => Vec::new(),
    }
}

/// The output of a block that a connection comes from: by its name, by its place, or the only one.
fn output(
    element: &LadderElement,
    block: &BlockElement,
    connection: &Connection,
) -> Result<usize, String> {
    let is_named = |pin: &BlockPin| {
        connection.pin.as_ref().is_some_and(|name| pin.name.eq_ignore_ascii_case(name))
    };
    if let Some(at) = block.outputs.iter().position(is_named) {
        return Ok(at);
    }
    if let Some(name) = &connection.pin
        && !(block.outputs.len() == 1 && name.eq_ignore_ascii_case("OUT"))
    {
        return Err(format!("a connection to the output {name}, which {} has not", block.kind));
    }
    let is_there = |pin: &BlockPin| connection.end == Some([element.x + pin.x, element.y + pin.y]);
    match block.outputs.iter().position(is_there) {
        Some(at) => Ok(at),
        None if block.outputs.len() == 1 => Ok(0),
        None => Err(format!("a connection to {} that names no output", block.kind)),
    }
}
