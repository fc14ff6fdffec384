//! The power in a drawn rung: which wires, contacts and outlets have it, of which contacts conduct.
//!
//! Called for each picture of a running program; `live_text` draws it. Pure: what a contact does
//! comes from the caller. Power goes from the rail to the right, through contacts that conduct; a
//! wire joins all points on it. It never goes back through a contact: a rung has no such way.

use super::circuit::ContactSymbol;
use super::grid::RungGrid;

/// Which parts of a rung have power; each list is in the order of the grid's own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlowOfPower {
    /// Of the wires along rows.
    pub along: Vec<bool>,
    /// Of the wires down.
    pub down: Vec<bool>,
    /// Of the contacts.
    pub contacts: Vec<ContactPower>,
    /// Of the instructions: one for each leg, or one alone.
    pub outlets: Vec<Vec<bool>>,
}

/// The power at a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContactPower {
    /// Whether it conducts.
    pub conducts: bool,
    /// Whether power reaches it.
    pub before: bool,
    /// Whether the wire behind it has power, from it or from a contact beside it.
    pub behind: bool,
}

/// The flow of power through a rung whose block executes.
pub fn flow_of_power(grid: &RungGrid, conducts: &dyn Fn(&ContactSymbol) -> bool) -> FlowOfPower {
    let mut nodes = Nodes::of(grid);
    let conducting: Vec<bool> = grid.contacts.iter().map(|of| conducts(&of.symbol)).collect();
    let has_power = nodes.reached(grid, &conducting);
    let mut at = |column: usize, row: usize| has_power[nodes.node(column, row)];
    let mut flow = FlowOfPower {
        along: grid.along.iter().map(|(row, from, _)| at(*from, *row)).collect(),
        down: grid.down.iter().map(|(column, from, _)| at(*column, *from)).collect(),
        ..FlowOfPower::default()
    };
    for (of, conducts) in grid.contacts.iter().zip(conducting) {
        let (before, behind) = (at(of.column, of.row), at(of.column + 1, of.row));
        flow.contacts.push(ContactPower { conducts, before, behind });
    }
    for of in &grid.instructions {
        let rows: Vec<usize> = match of.legs.is_empty() {
            true => vec![of.row],
            false => of.legs.iter().map(|(_, row)| *row).collect(),
        };
        flow.outlets.push(rows.into_iter().map(|row| at(grid.columns, row)).collect());
    }
    flow
}

/// The points of a grid, of which wires make nodes: a forest in which each point leads to another
/// one of its node, and the last one to itself.
struct Nodes {
    rows: usize,
    leads: Vec<usize>,
}

impl Nodes {
    fn of(grid: &RungGrid) -> Nodes {
        let rows = grid.rows.max(1);
        let mut nodes = Nodes { rows, leads: (0..(grid.columns + 1) * rows).collect() };
        // The rail is at the left of all rows.
        for row in 1..rows {
            nodes.join((0, 0), (0, row));
        }
        for (row, from, to) in &grid.along {
            (*from..*to).for_each(|column| nodes.join((column, *row), (column + 1, *row)));
        }
        for (column, from, to) in &grid.down {
            (*from..*to).for_each(|row| nodes.join((*column, row), (*column, row + 1)));
        }
        nodes
    }

    fn join(&mut self, one: (usize, usize), other: (usize, usize)) {
        let (one, other) = (self.node(one.0, one.1), self.node(other.0, other.1));
        self.leads[one.max(other)] = one.min(other);
    }

    /// The node of a point.
    fn node(&mut self, column: usize, row: usize) -> usize {
        let mut at = column * self.rows + row;
        while self.leads[at] != at {
            // Half of the way is cut at each walk, so that ways stay short.
            self.leads[at] = self.leads[self.leads[at]];
            at = self.leads[at];
        }
        at
    }

    /// By point that stands for a node: whether the node has power.
    fn reached(&mut self, grid: &RungGrid, conducting: &[bool]) -> Vec<bool> {
        let mut behind = vec![Vec::new(); self.leads.len()];
        for (of, _) in grid.contacts.iter().zip(conducting).filter(|(_, conducts)| **conducts) {
            let from = self.node(of.column, of.row);
            behind[from].push(self.node(of.column + 1, of.row));
        }
        let mut has_power = vec![false; self.leads.len()];
        let mut todo = vec![self.node(0, 0)];
        while let Some(node) = todo.pop() {
            if !std::mem::replace(&mut has_power[node], true) {
                todo.append(&mut behind[node]);
            }
        }
        has_power
    }
}
