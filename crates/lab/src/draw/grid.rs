//! A circuit on a grid of columns and rows, with symbols in cells, and wires between them.
//!
//! `text` and `svg` draw the same grid. A wire is on the middle line of a row, or on the boundary
//! between two columns. Points that are joined by wires are one node, and no two nodes touch.

use super::circuit::{Circuit, ContactSymbol, InstructionSymbol, Outlet, RungCircuit};

/// A rung with the positions of its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RungGrid {
    /// The number of columns of contacts. The instructions are in one more column.
    pub columns: usize,
    /// The number of rows.
    pub rows: usize,
    /// The contacts.
    pub contacts: Vec<PlacedContact>,
    /// The instructions.
    pub instructions: Vec<PlacedInstruction>,
    /// Wires along rows: a row, and the boundaries at the start and at the end of the wire.
    pub along: Vec<(usize, usize, usize)>,
    /// Wires down: a boundary, and the first and the last row. The number of a boundary is the
    /// number of the column after it.
    pub down: Vec<(usize, usize, usize)>,
}

/// A contact in a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedContact {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub column: usize,
    /// The contact.
    pub symbol: ContactSymbol,
}

/// An instruction at the end of one or several rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedInstruction {
    /// Its first row.
    pub row: usize,
    /// The names and rows of several legs; empty for one leg.
    pub legs: Vec<(&'static str, usize)>,
    /// The instruction.
    pub symbol: InstructionSymbol,
}

impl RungGrid {
    /// Places a rung.
    pub fn of(rung: &RungCircuit) -> RungGrid {
        let mut grid = RungGrid::default();
        match rung {
            RungCircuit::Plain(contacts, outlets) => grid.plain(contacts, outlets),
            RungCircuit::Legs(legs, symbol) => grid.legs(legs, symbol),
        }
        grid
    }

    fn plain(&mut self, contacts: &Circuit, outlets: &[Outlet]) {
        let (width, height) = self.place(contacts, (0, 0));
        let wide = outlets.iter().map(|outlet| match outlet {
            Outlet::Instruction(_) => 0,
            Outlet::Branch(circuit, _) => size(circuit).0,
        });
        self.columns = width + wide.max().unwrap_or(0);
        let (mut row, mut last) = (0, 0);
        for outlet in outlets {
            last = row;
            row = match outlet {
                Outlet::Instruction(symbol) => {
                    self.end(symbol, (width, row));
                    row + 1
                }
                Outlet::Branch(circuit, body) => self.branch((circuit, body), (width, row)),
            };
        }
        self.wire_down(width, (0, last));
        self.rows = row.max(height);
    }

    /// Places the contacts of a branch, with their instructions. Returns the row after the branch.
    fn branch(
        &mut self,
        (circuit, body): (&Circuit, &[InstructionSymbol]),
        (column, row): (usize, usize),
    ) -> usize {
        let (width, height) = self.place(circuit, (column, row));
        let (at, count) = (column + width, body.len());
        for (n, symbol) in body.iter().enumerate() {
            self.end(symbol, (at, row + n));
        }
        self.wire_down(at, (row, row + count.saturating_sub(1)));
        row + height.max(count).max(1)
    }

    fn legs(&mut self, legs: &[(&'static str, Circuit)], symbol: &InstructionSymbol) {
        self.columns = legs.iter().map(|(_, circuit)| size(circuit).0).max().unwrap_or(0);
        let (mut row, mut rows) = (0, Vec::new());
        for (name, circuit) in legs {
            let (width, height) = self.place(circuit, (0, row));
            self.wire_along(row, (width, self.columns));
            rows.push((*name, row));
            row += height;
        }
        self.rows = row;
        self.instructions.push(PlacedInstruction { row: 0, legs: rows, symbol: symbol.clone() });
    }

    /// Places an instruction at the end of a row, with the wire that leads to it.
    fn end(&mut self, symbol: &InstructionSymbol, (column, row): (usize, usize)) {
        self.wire_along(row, (column, self.columns));
        let symbol = symbol.clone();
        self.instructions.push(PlacedInstruction { row, legs: Vec::new(), symbol });
    }

    /// Places a circuit at a column and row. Returns its width and height.
    fn place(&mut self, circuit: &Circuit, (column, row): (usize, usize)) -> (usize, usize) {
        match circuit {
            Circuit::Contact(symbol) => {
                self.contacts.push(PlacedContact { row, column, symbol: symbol.clone() });
                (1, 1)
            }
            Circuit::Series(parts) => {
                let (mut width, mut height) = (0, 1);
                for part in parts {
                    let placed_size = self.place(part, (column + width, row));
                    (width, height) = (width + placed_size.0, height.max(placed_size.1));
                }
                (width, height)
            }
            Circuit::Parallel(parts) => {
                let width = size(circuit).0;
                let (mut height, mut last) = (0, row);
                for part in parts {
                    last = row + height;
                    let placed_size = self.place(part, (column, last));
                    self.wire_along(last, (column + placed_size.0, column + width));
                    height += placed_size.1;
                }
                self.wire_down(column, (row, last));
                self.wire_down(column + width, (row, last));
                (width, height)
            }
        }
    }

    fn wire_along(&mut self, row: usize, (from, to): (usize, usize)) {
        if from < to {
            self.along.push((row, from, to));
        }
    }

    fn wire_down(&mut self, column: usize, (from, to): (usize, usize)) {
        if from < to {
            self.down.push((column, from, to));
        }
    }
}

/// The width and height of a circuit.
fn size(circuit: &Circuit) -> (usize, usize) {
    match circuit {
        Circuit::Contact(_) => (1, 1),
        Circuit::Series(parts) => parts
            .iter()
            .map(size)
            .fold((0, 1), |all, part_size| (all.0 + part_size.0, all.1.max(part_size.1))),
        Circuit::Parallel(parts) => parts
            .iter()
            .map(size)
            .fold((0, 0), |all, part_size| (all.0.max(part_size.0), all.1 + part_size.1)),
    }
}
