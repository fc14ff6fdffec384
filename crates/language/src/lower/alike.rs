//! Groups MATHs whose formulas differ only in their cells. The engine then executes each step for
//! all formulas of a group.
//!
//! Called by `assembler`, once for each batch of MATHs that `schedule` makes. Two MATHs may change
//! places if neither writes a cell that the other reads or writes. The status bits of mishaps do
//! not count here unless one of the two MATHs reads them, because every MATH only turns them ON. In
//! columns, all formulas are evaluated before any result is stored, so no formula may read a cell
//! that an earlier one writes. A MATH that reads a status bit of mishaps, or that reads or writes a
//! moving element, keeps its place among all operations. These are executed in rows, as are groups
//! of fewer than [`HEIGHT_MIN`], MATHs with `if`, `&&` or `||`, and those of more steps or slots
//! than columns have. The events of an element's MATHs are kept in the order of its rungs.

use std::collections::HashMap;

use super::last_uses::LastUses;
pub use rungd_engine::ops::{
    Accumulator, FormulaStep, Formulas, Math, Op, StepShape, TouchedCells, shapes,
};

/// The least number of MATHs in columns: with fewer, the loops cost more than the dispatches. Two
/// in a debug build, so that the small programs of tests have columns too.
const HEIGHT_MIN: usize = if cfg!(debug_assertions) { 2 } else { 8 };

/// MATHs that are executed one after the other, or in columns.
#[derive(Debug, Default)]
pub(super) struct AlikeMaths {
    pub maths: Vec<Math>,
    pub in_columns: bool,
}

/// Puts MATHs into groups. `steps` are those of all formulas.
pub(super) fn groups(
    maths: Vec<Math>,
    steps: &[FormulaStep],
    formulas: Formulas,
) -> Vec<AlikeMaths> {
    let touches = TouchedCells { formulas, ..TouchedCells::default() };
    let mut grouping = Grouping { touches, ..Grouping::default() };
    for math in maths {
        grouping.place(math, steps);
    }
    let mut groups: Vec<AlikeMaths> = Vec::new();
    for AlikeMaths { maths, in_columns } in grouping.groups {
        let in_columns = in_columns && maths.len() >= HEIGHT_MIN;
        match groups.last_mut() {
            Some(last) if !in_columns && !last.in_columns => last.maths.extend(maths),
            _ => groups.push(AlikeMaths { maths, in_columns }),
        }
    }
    groups
}

/// The steps of a formula without their cells; `None`: the formula needs rows.
type FormulaShape = Option<(Vec<StepShape>, Accumulator)>;

#[derive(Default)]
struct Grouping<'f> {
    groups: Vec<AlikeMaths>,
    /// The positions of the groups of each shape, ascending.
    of_shape: HashMap<FormulaShape, Vec<usize>>,
    uses: LastUses,
    /// No group before this one accepts a further MATH.
    open_from: usize,
    touches: TouchedCells<'f>,
}

impl Grouping<'_> {
    fn place(&mut self, math: Math, steps: &[FormulaStep]) {
        self.touches.clear();
        Op::Math(math).touches(&mut self.touches);
        let stays = self.stays();
        let formula = &steps[math.first as usize..][..math.count as usize];
        let shape = if stays { None } else { shapes(formula).map(|shape| (shape, math.result)) };
        let in_columns = shape.is_some();
        // In columns, an earlier group must have written the cells that it reads.
        let earliest = match stays {
            true => self.groups.len(),
            false => self.uses.earliest(&self.touches, in_columns).max(self.open_from),
        };
        let at = self.group_at_or_behind(shape, earliest);
        self.uses.mark(&self.touches, at);
        self.groups[at].maths.push(math);
        if stays {
            self.open_from = self.groups.len();
        }
    }

    /// Whether it must keep its place among all MATHs: it reads the status bit of a mishap, or
    /// touches an array at an index known only at run time. Removes the status bits from the cells
    /// that it writes.
    fn stays(&mut self) -> bool {
        let touches = &mut self.touches;
        let status = touches.formulas.mishaps();
        touches.bits_written.retain(|cell| !status.contains(cell));
        let reads_status = touches.bits_read.iter().any(|cell| status.contains(cell));
        let arrays = [
            &touches.bit_arrays_read,
            &touches.bit_arrays_written,
            &touches.word_arrays_read,
            &touches.word_arrays_written,
        ];
        reads_status || arrays.iter().any(|arrays| !arrays.is_empty())
    }

    fn group_at_or_behind(&mut self, shape: FormulaShape, earliest: usize) -> usize {
        let in_columns = shape.is_some();
        let positions = self.of_shape.entry(shape).or_default();
        let first = positions.partition_point(|at| *at < earliest);
        if let Some(at) = positions.get(first) {
            return *at;
        }
        self.groups.push(AlikeMaths { maths: Vec::new(), in_columns });
        positions.push(self.groups.len() - 1);
        self.groups.len() - 1
    }
}
