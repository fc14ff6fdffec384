//! Columns of a diagram that stand for many scans each: the least and the greatest value of each.
//!
//! `svg` passes any number of rows; `svg_wide` draws the columns. When there are too many columns,
//! each pair becomes one column, so the memory and the picture have a maximum size.

use super::trace::{RowName, TracedOperand};
use rungd_engine::isa::Real;

/// The maximum number of columns.
pub(super) const COLUMNS_MAX: usize = 1_200;

/// The least and the greatest value in a column, as contents of the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ColumnSpread {
    pub least: i32,
    pub greatest: i32,
}

/// A scan above its column.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColumnScan {
    pub name: RowName,
    /// Its time, µs.
    pub time_us: u64,
}

/// Columns of many scans.
#[derive(Debug)]
pub(super) struct WideColumns {
    /// The number of scans in each column; the last column may have fewer.
    pub scans: u64,
    /// The first scan of each column.
    pub heads: Vec<ColumnScan>,
    /// For each operand, a spread for each column.
    pub spreads: Vec<Vec<ColumnSpread>>,
    /// For each operand, whether it is a real.
    reals: Vec<bool>,
    /// The number of scans in the last column.
    in_last: u64,
}

impl WideColumns {
    /// No columns.
    pub fn new(watched: &[TracedOperand]) -> WideColumns {
        let spreads = vec![Vec::with_capacity(COLUMNS_MAX); watched.len()];
        let reals = watched.iter().map(|watched| watched.real).collect();
        WideColumns { scans: 1, heads: Vec::new(), spreads, reals, in_last: 0 }
    }

    /// Adds a row.
    pub fn put(&mut self, head: ColumnScan, values: &[i32]) {
        if !self.heads.is_empty() && self.in_last < self.scans {
            self.in_last += 1;
            for ((spreads, value), real) in self.spreads.iter_mut().zip(values).zip(&self.reals) {
                if let Some(last) = spreads.last_mut() {
                    *last = joined(*last, ColumnSpread { least: *value, greatest: *value }, *real);
                }
            }
            return;
        }
        if self.heads.len() == COLUMNS_MAX {
            self.halve();
        }
        self.heads.push(head);
        self.in_last = 1;
        for (spreads, value) in self.spreads.iter_mut().zip(values) {
            spreads.push(ColumnSpread { least: *value, greatest: *value });
        }
    }

    /// Merges each pair of columns into one.
    fn halve(&mut self) {
        self.scans *= 2;
        self.heads = self.heads.iter().step_by(2).copied().collect();
        for (spreads, real) in self.spreads.iter_mut().zip(&self.reals) {
            let pair =
                |pair: &[ColumnSpread]| pair[1..].iter().fold(pair[0], |a, b| joined(a, *b, *real));
            *spreads = spreads.chunks(2).map(pair).collect();
        }
    }

    /// The least and the greatest value of an operand.
    pub fn whole(&self, operand: usize) -> ColumnSpread {
        let spreads = self.spreads[operand].iter().copied();
        spreads.reduce(|a, b| joined(a, b, self.reals[operand])).unwrap_or_default()
    }
}

/// The number in a cell.
pub(super) fn number(content: i32, real: bool) -> f64 {
    if real { f64::from(Real::of_cell(content).number()) } else { f64::from(content) }
}

fn joined(a: ColumnSpread, b: ColumnSpread, real: bool) -> ColumnSpread {
    let is_less = |a: i32, b: i32| number(a, real) < number(b, real);
    let least = if is_less(b.least, a.least) { b.least } else { a.least };
    let greatest = if is_less(a.greatest, b.greatest) { b.greatest } else { a.greatest };
    ColumnSpread { least, greatest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::{Cell, WordCell};

    #[test]
    fn every_value_is_in_its_column_for_any_number_of_rows() {
        for rows in [1u64, 2, 1_199, 1_200, 1_201, 2_401, 50_000, 100_001] {
            let watched =
                [TracedOperand { name: "D0".into(), cell: Cell::Word(WordCell(0)), real: false }];
            let mut columns = WideColumns::new(&watched);
            let value = |row: u64| (row * 7_919 % 1_009) as i32 - 300;
            for row in 0..rows {
                let scan = ColumnScan { name: RowName::Scan(row), time_us: row };
                columns.put(scan, &[value(row)]);
            }
            assert!(columns.heads.len() <= COLUMNS_MAX, "{rows}");
            assert_eq!(columns.heads.len() as u64, rows.div_ceil(columns.scans), "{rows}");
            for (at, spread) in columns.spreads[0].iter().enumerate() {
                let from = at as u64 * columns.scans;
                let values = (from..rows.min(from + columns.scans)).map(value);
                let (least, greatest) = (values.clone().min().unwrap(), values.max().unwrap());
                let expected = ColumnSpread { least, greatest };
                assert_eq!((*spread, columns.heads[at].time_us), (expected, from), "{rows}");
            }
        }
    }

    #[test]
    fn reals_are_compared_as_reals() {
        let cells = [-2.0, 1.0, -1.0].map(|number| Real::finite(number).unwrap().cell());
        let watched =
            [TracedOperand { name: "R0".into(), cell: Cell::Word(WordCell(0)), real: true }];
        let mut columns = WideColumns::new(&watched);
        let stop = ColumnScan { name: RowName::Stop, time_us: 0 };
        cells.iter().for_each(|cell| columns.put(stop, &[*cell]));
        let wanted = ColumnSpread { least: cells[0], greatest: cells[1] };
        assert_eq!(columns.whole(0), wanted);
    }
}
