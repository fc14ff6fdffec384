//! The tables of a text by their headers, and those of them that lost something.
//!
//! [`super::mend`] fills it in the order of the file, for [`super::lost`].

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
    /// The table above it.
    above: usize,
    is_lossy: bool,
    /// Its header, and the value of its `name`.
    names: Vec<TableRange>,
}

impl LostTables {
    /// With the root.
    pub fn of(end: usize) -> LostTables {
        let range = 0..end as u32;
        LostTables { all: vec![TableState::new(range, 0, true)], end }
    }

    /// A table begins with its header.
    pub fn begin(&mut self, header: &Range<usize>, depth: usize, is_list: bool) {
        let (above, start) = (self.open_above(depth), header.start as u32);
        if let Some(last) = self.all.last_mut() {
            last.range.end = start;
        }
        let table = TableState::new(start..self.end as u32, depth, is_list);
        self.all.push(TableState { above, ..table });
        self.name(header);
    }

    /// The newest table has a name.
    pub fn name(&mut self, place: &Range<usize>) {
        if let Some(last) = self.all.last_mut() {
            last.names.push(place.start as u32..place.end as u32);
        }
    }

    /// The newest table whose name has fewer parts.
    fn open_above(&self, depth: usize) -> usize {
        let mut at = self.all.len() - 1;
        while self.all[at].depth >= depth && at > 0 {
            at = self.all[at].above;
        }
        at
    }

    /// The newest table loses something, and so does the table that it is a part of.
    pub fn lose(&mut self) {
        self.lose_in(self.all.len() - 1);
    }

    /// A table with so many parts of its name is lost.
    pub fn lose_below(&mut self, depth: usize) {
        self.lose_in(self.open_above(depth));
    }

    fn lose_in(&mut self, mut at: usize) {
        while !std::mem::replace(&mut self.all[at].is_lossy, true) {
            // A list's entry and a table of the root stand by themselves.
            if self.all[at].is_list || self.all[at].depth <= 1 {
                break;
            }
            at = self.all[at].above;
        }
    }

    /// The tables that lost something.
    pub fn lossy(&self) -> Vec<TableRange> {
        let lossy = self.all.iter().filter(|table| table.is_lossy);
        lossy.map(|table| table.range.clone()).collect()
    }

    /// The places of their headers and names.
    pub fn lossy_names(&self) -> impl Iterator<Item = &TableRange> {
        self.all.iter().filter(|table| table.is_lossy).flat_map(|table| &table.names)
    }

    /// The tables that lost something, each with all tables of its block or device.
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
