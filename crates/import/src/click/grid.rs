//! The power at the rows of a rung, as conditions of the contacts in its grid.
//!
//! A cell is a wire (`-`, `T` with a line down, `|`), or a contact. `T:X001` is a contact with a
//! line down from its left side. Power goes through contacts to the right only, through wires in
//! any direction, as in CLICK.

use std::collections::HashMap;

use super::sheet::{COLUMNS, SheetRow};
use crate::condition::RungCondition;

/// Most contacts of the power of a row.
const SIZE_MAX: usize = 2000;
/// Most lines through which the power of a row comes.
const CONDUCTORS_MAX: usize = 400;

/// The conductors and contacts of a rung.
pub(super) struct ClickGrid<'r> {
    rows: &'r [SheetRow],
    joined: Vec<usize>,
    /// The contacts into each conductor.
    contacts: HashMap<usize, Vec<GridContact>>,
    rail: Option<usize>,
}

/// A contact between two conductors.
#[derive(Clone, Debug)]
struct GridContact {
    from: usize,
    condition: RungCondition,
}

/// The contact that a cell has, if it is no wire.
pub(super) fn contact_text(cell: &str) -> Option<&str> {
    let is_wire = matches!(cell, "" | "-" | "T" | "|");
    (!is_wire).then(|| cell.strip_prefix("T:").unwrap_or(cell))
}

fn left(row: usize, column: usize) -> usize {
    2 * (row * COLUMNS + column)
}

fn right(row: usize, column: usize) -> usize {
    left(row, column) + 1
}

impl<'r> ClickGrid<'r> {
    /// The grid of a rung; `contact` says what a contact means.
    ///
    /// # Errors
    /// A contact means nothing that rungd can say.
    pub(super) fn of(
        rows: &'r [SheetRow],
        mut contact: impl FnMut(&str) -> Result<RungCondition, String>,
    ) -> Result<ClickGrid<'r>, String> {
        let joined = (0..2 * rows.len() * COLUMNS).collect();
        let mut grid = ClickGrid { rows, joined, contacts: HashMap::new(), rail: None };
        grid.join_wires();
        for (row, sheet_row) in rows.iter().enumerate() {
            for (column, cell) in sheet_row.cells.iter().enumerate() {
                let Some(text) = contact_text(cell) else { continue };
                let condition = contact(text)?;
                let (from, to) = (grid.root(left(row, column)), grid.root(right(row, column)));
                if from != to {
                    grid.contacts.entry(to).or_default().push(GridContact { from, condition });
                }
            }
        }
        Ok(grid)
    }

    fn join_wires(&mut self) {
        let rows = self.rows;
        let cell = |row: usize, column: usize| rows[row].cells[column].as_str();
        for row in 0..rows.len() {
            for column in 0..COLUMNS {
                if matches!(cell(row, column), "-" | "T" | "|") {
                    self.join(left(row, column), right(row, column));
                }
                let continues = column + 1 < COLUMNS && !matches!(cell(row, column), "" | "|");
                if continues && !cell(row, column + 1).is_empty() {
                    self.join(right(row, column), left(row, column + 1));
                }
            }
            if !cell(row, 0).is_empty() {
                let rail = *self.rail.get_or_insert(left(row, 0));
                self.join(rail, left(row, 0));
            }
        }
        self.join_down();
    }

    /// Joins the lines down; a side of a cell takes one line only.
    fn join_down(&mut self) {
        let rows = self.rows;
        let cell = |row: usize, column: usize| rows[row].cells[column].as_str();
        for row in 0..rows.len().saturating_sub(1) {
            let mut taken = std::collections::HashSet::new();
            for column in 0..COLUMNS {
                let text = cell(row, column);
                if !(matches!(text, "T" | "|") || text.starts_with("T:")) {
                    continue;
                }
                let from = left(row, column);
                let below = left(row + 1, column);
                if !cell(row + 1, column).is_empty() && taken.insert(below) {
                    self.join(from, below);
                } else if column > 0 && !cell(row + 1, column - 1).is_empty() {
                    let below = right(row + 1, column - 1);
                    if taken.insert(below) {
                        self.join(from, below);
                    }
                }
            }
        }
    }

    fn root(&mut self, mut at: usize) -> usize {
        while self.joined[at] != at {
            self.joined[at] = self.joined[self.joined[at]];
            at = self.joined[at];
        }
        at
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.root(one), self.root(other));
        self.joined[one.max(other)] = one.min(other);
    }

    /// The power at the end of a row.
    ///
    /// # Errors
    /// The contacts make a loop, or are too many.
    pub(super) fn power(&mut self, row: usize) -> Result<RungCondition, String> {
        let last = self.rows[row].cells.iter().rposition(|cell| !cell.is_empty());
        let Some(last) = last else { return Ok(RungCondition::Constant(true)) };
        let end = self.root(right(row, last));
        let rail = self.rail.map(|rail| self.root(rail));
        let mut known = HashMap::new();
        let condition = self.conductor(end, rail, &mut known)?;
        match condition.size() > SIZE_MAX {
            true => Err(format!("more than {SIZE_MAX} contacts")),
            false => Ok(condition),
        }
    }

    fn conductor(
        &self,
        at: usize,
        rail: Option<usize>,
        known: &mut HashMap<usize, Option<RungCondition>>,
    ) -> Result<RungCondition, String> {
        if Some(at) == rail {
            return Ok(RungCondition::Constant(true));
        }
        match known.get(&at) {
            Some(Some(condition)) => return Ok(condition.clone()),
            Some(None) => return Err("a loop of contacts".to_owned()),
            None => {}
        }
        if known.len() >= CONDUCTORS_MAX {
            return Err(format!("more than {CONDUCTORS_MAX} lines before a row"));
        }
        known.insert(at, None);
        let mut lines = Vec::new();
        for contact in self.contacts.get(&at).into_iter().flatten() {
            let before = self.conductor(contact.from, rail, known)?;
            let line = RungCondition::all([before, contact.condition.clone()]);
            if line.size() > SIZE_MAX {
                return Err(format!("more than {SIZE_MAX} contacts"));
            }
            if line != RungCondition::Constant(false) {
                lines.push(line);
            }
        }
        let condition = RungCondition::any(lines);
        known.insert(at, Some(condition.clone()));
        Ok(condition)
    }
}
