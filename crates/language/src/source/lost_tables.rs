//! The tables of a text, with their headers, and whether they have missing parts.
//!
//! [`super::mend`] adds the tables in the order of the file; [`super::lost`] uses the result.

use std::ops::Range;

/// A table: the bytes from its header to the next header.
pub(super) type TableRange = Range<u32>;

impl TableState {
    fn new(range: TableRange, depth: usize, is_list: bool) -> TableState {
        TableState { range, depth, is_list, above: 0, is_lossy: false, names: Vec::new() }
    }
}

/// The tables of a text, in order. The first one is the root.
pub(super) struct LostTables {
    all: Vec<TableState>,
    /// The length of the text.
    end: usize,
}

struct TableState {
    range: TableRange,
    /// The number of parts of its name.
    depth: usize,
    /// Whether it is an entry of a list.
    is_list: bool,
    /// The index of the table above it.
    above: usize,
    is_lossy: bool,
    /// Its header, and the value of its `name`.
    names: Vec<TableRange>,
}

impl LostTables {
    /// The root table only, for a text of `end` bytes.
    pub fn of(end: usize) -> LostTables {
        let range = 0..end as u32;
        LostTables { all: vec![TableState::new(range, 0, true)], end }
    }

    /// Begins a table with its header.
    pub fn begin(&mut self, header: &Range<usize>, depth: usize, is_list: bool) {
        let (above, start) = (self.open_above(depth), header.start as u32);
        if let Some(last) = self.all.last_mut() {
            last.range.end = start;
        }
        let table = TableState::new(start..self.end as u32, depth, is_list);
        self.all.push(TableState { above, ..table });
        self.name(header);
    }

    /// Adds the place of a name to the newest table.
    pub fn name(&mut self, place: &Range<usize>) {
        if let Some(last) = self.all.last_mut() {
            last.names.push(place.start as u32..place.end as u32);
        }
    }

    /// The newest table whose name has fewer than `depth` parts.
    fn open_above(&self, depth: usize) -> usize {
        let mut at = self.all.len() - 1;
        while self.all[at].depth >= depth && at > 0 {
            at = self.all[at].above;
        }
        at
    }

    /// Marks the newest table as lossy, and the table that it is a part of.
    pub fn lose(&mut self) {
        self.lose_in(self.all.len() - 1);
    }

    /// Marks the parent of a lost table as lossy; the lost table's name has `depth` parts.
    pub fn lose_below(&mut self, depth: usize) {
        self.lose_in(self.open_above(depth));
    }

    fn lose_in(&mut self, mut at: usize) {
        while !std::mem::replace(&mut self.all[at].is_lossy, true) {
            // An entry of a list and a table of the root are not parts of a different table.
            if self.all[at].is_list || self.all[at].depth <= 1 {
                break;
            }
            at = self.all[at].above;
        }
    }

    /// The tables with missing parts.
    pub fn lossy(&self) -> Vec<TableRange> {
        let lossy = self.all.iter().filter(|table| table.is_lossy);
        lossy.map(|table| table.range.clone()).collect()
    }

    /// The places of the headers and names of the tables with missing parts.
    pub fn lossy_names(&self) -> impl Iterator<Item = &TableRange> {
        self.all.iter().filter(|table| table.is_lossy).flat_map(|table| &table.names)
    }

    /// The tables with missing parts, each extended to all tables of its block or device.
    pub fn lossy_groups(&self) -> Vec<TableRange> {
        let mut groups: Vec<(TableRange, bool)> = Vec::new();
        for table in &self.all {
            match groups.last_mut() {
                Some((group, is_lossy)) if table.depth > 1 => {
                    group.end = table.range.end;
                    *is_lossy |= table.is_lossy;
                }
                Some(_) | None => groups.push((table.range.clone(), table.is_lossy)),
            }
        }
        groups.into_iter().filter(|(_, is_lossy)| *is_lossy).map(|(range, _)| range).collect()
    }
}
