//! The power in a drawn rung: the wires, contacts and outlets with power, computed from the
//! conducting contacts.
//!
//! Called for each picture of a running program; `text` and `live_svg` draw it. Pure: the caller
//! provides the states of the contacts. Power flows from the rail to the right, through conducting
//! contacts; a wire joins all its points. Power never flows back through a contact, since a rung
//! has no such way.

use super::circuit::ContactSymbol;
use super::grid::{GridPlace, RungGrid};

/// The parts of a rung with power. Each list is in the order of the grid's own list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlowOfPower {
    /// The power of the wires along rows.
    pub along: Vec<bool>,
    /// The power of the wires down.
    pub down: Vec<bool>,
    /// The power at the contacts.
    pub contacts: Vec<ContactPower>,
    /// The power of the instructions: one value for each leg, or a single value.
    pub outlets: Vec<Vec<bool>>,
}

/// The power at a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContactPower {
    /// Whether the contact conducts.
    pub conducts: bool,
    /// Whether power reaches the contact.
    pub before: bool,
    /// Whether the wire after the contact has power, from this contact or from a parallel one.
    pub behind: bool,
}

/// The flow of power through an executed rung.
pub fn flow_of_power(grid: &RungGrid, conducts: &dyn Fn(&ContactSymbol) -> bool) -> FlowOfPower {
    let mut nodes = Nodes::of(grid);
    let conducting: Vec<bool> =
        grid.contacts.iter().map(|contact| conducts(&contact.symbol)).collect();
    let has_power = nodes.reached(grid, &conducting);
    let mut at = |column: usize, row: usize| has_power[nodes.node(GridPlace { column, row })];
    let mut flow = FlowOfPower {
        along: grid.along.iter().map(|wire| at(wire.from, wire.line)).collect(),
        down: grid.down.iter().map(|wire| at(wire.line, wire.from)).collect(),
        ..FlowOfPower::default()
    };
    for (contact, conducts) in grid.contacts.iter().zip(conducting) {
        let (before, behind) =
            (at(contact.column, contact.row), at(contact.column + 1, contact.row));
        flow.contacts.push(ContactPower { conducts, before, behind });
    }
    for instruction in &grid.instructions {
        let rows: Vec<usize> = match instruction.legs.is_empty() {
            true => vec![instruction.row],
            false => instruction.legs.iter().map(|(_, row)| *row).collect(),
        };
        flow.outlets.push(rows.into_iter().map(|row| at(grid.columns, row)).collect());
    }
    flow
}

/// The points of a grid, joined to nodes by the wires. A disjoint-set forest: each point leads to
/// another point of its node, and the root of the node leads to itself.
struct Nodes {
    rows: usize,
    leads: Vec<usize>,
}

impl Nodes {
    fn of(grid: &RungGrid) -> Nodes {
        let rows = grid.rows.max(1);
        let mut nodes = Nodes { rows, leads: (0..(grid.columns + 1) * rows).collect() };
        let point = |column, row| GridPlace { column, row };
        // The rail joins the left ends of all rows.
        for row in 1..rows {
            nodes.join(point(0, 0), point(0, row));
        }
        for wire in &grid.along {
            for column in wire.from..wire.to {
                nodes.join(point(column, wire.line), point(column + 1, wire.line));
            }
        }
        for wire in &grid.down {
            for row in wire.from..wire.to {
                nodes.join(point(wire.line, row), point(wire.line, row + 1));
            }
        }
        nodes
    }

    fn join(&mut self, one: GridPlace, other: GridPlace) {
        let (one, other) = (self.node(one), self.node(other));
        self.leads[one.max(other)] = one.min(other);
    }

    /// The node of a point.
    fn node(&mut self, point: GridPlace) -> usize {
        let mut at = point.column * self.rows + point.row;
        while self.leads[at] != at {
            // Path halving: each walk shortens the path.
            self.leads[at] = self.leads[self.leads[at]];
            at = self.leads[at];
        }
        at
    }

    /// Whether each node has power, by the root of the node.
    fn reached(&mut self, grid: &RungGrid, conducting: &[bool]) -> Vec<bool> {
        let mut behind = vec![Vec::new(); self.leads.len()];
        for (contact, _) in grid.contacts.iter().zip(conducting).filter(|(_, conducts)| **conducts)
        {
            let before = GridPlace { column: contact.column, row: contact.row };
            let from = self.node(before);
            behind[from].push(self.node(GridPlace { column: contact.column + 1, ..before }));
        }
        let mut has_power = vec![false; self.leads.len()];
        let mut todo = vec![self.node(GridPlace { column: 0, row: 0 })];
        while let Some(node) = todo.pop() {
            if !std::mem::replace(&mut has_power[node], true) {
                todo.append(&mut behind[node]);
            }
        }
        has_power
    }
}
