//! The table of a case: inputs from outside on the left of `|`, expected values on the right.
//!
//! ```text
//! scan X0 D1 | CT0.Acc Y0=output
//! 0    1  .  | 1       0          : first-edge
//! stop .  .  | 0       .
//! ```
//! On the left, `.` means no input; on the right, no comparison. `Y0=output` gives a column a
//! different name. A row may have a label; then each of its cells is a separate test, named after
//! case, label and column: `offdtmr-leg-on-output`.

/// The name of a row: a scan, or `stop` for the memory after an orderly stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowName {
    Scan(u64),
    Stop,
}

/// A column on the right of `|`.
#[derive(Clone, Debug)]
pub struct Column {
    pub operand: String,
    /// The column's name in the names of tests.
    pub alias: String,
}

#[derive(Clone, Debug)]
pub struct Row {
    pub name: RowName,
    pub label: Option<String>,
    pub stimulus: Vec<Option<String>>,
    /// The text of the expected value of each column.
    pub expected: Vec<Option<String>>,
}

#[derive(Clone, Debug)]
pub struct Table {
    pub inputs: Vec<String>,
    pub columns: Vec<Column>,
    pub rows: Vec<Row>,
}

impl Table {
    pub fn parse(text: &str) -> Result<Table, String> {
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let header = lines.next().ok_or("the table is empty")?;
        let (left, right) = header.split_once('|').ok_or("the header has no `|`")?;
        let mut inputs = left.split_whitespace().map(str::to_owned);
        if inputs.next().as_deref() != Some("scan") {
            return Err("the header begins with `scan`".to_owned());
        }
        let inputs: Vec<String> = inputs.collect();
        let columns: Vec<Column> = right.split_whitespace().map(Column::parse).collect();
        let mut rows: Vec<Row> = Vec::new();
        for line in lines {
            let row = Row::parse(line, inputs.len(), columns.len())?;
            if rows.last().is_some_and(|last| !last.name.is_before(row.name)) {
                return Err(format!("`{line}`: rows ascend, and `stop` is the last"));
            }
            rows.push(row);
        }
        Ok(Table { inputs, columns, rows })
    }

    /// The number of scans that the table needs.
    pub fn scans(&self) -> u64 {
        let scans = self.rows.iter().filter_map(|row| match row.name {
            RowName::Scan(scan) => Some(scan + 1),
            RowName::Stop => None,
        });
        scans.max().unwrap_or(0)
    }

    /// The inputs from outside, in the form of a stimulus file.
    pub fn stimulus(&self) -> String {
        let mut csv = String::from("scan");
        for input in &self.inputs {
            csv += &format!(",{input}");
        }
        for row in &self.rows {
            if let RowName::Scan(scan) = row.name {
                csv += &format!("\n{scan}");
                for cell in &row.stimulus {
                    csv += &format!(",{}", cell.as_deref().unwrap_or(""));
                }
            }
        }
        csv
    }
}

impl Column {
    fn parse(text: &str) -> Column {
        let (operand, alias) = text.split_once('=').unwrap_or((text, ""));
        let last = operand.rsplit('.').next().unwrap_or(operand).to_lowercase();
        let alias = if alias.is_empty() { last } else { alias.to_owned() };
        Column { operand: operand.to_owned(), alias }
    }
}

impl RowName {
    fn is_before(self, next: RowName) -> bool {
        match (self, next) {
            (RowName::Scan(a), RowName::Scan(b)) => a < b,
            (RowName::Scan(_), RowName::Stop) => true,
            (RowName::Stop, _) => false,
        }
    }
}

impl std::fmt::Display for RowName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            RowName::Scan(scan) => write!(f, "scan {scan}"),
            RowName::Stop => write!(f, "row stop"),
        }
    }
}

impl Row {
    fn parse(line: &str, inputs: usize, columns: usize) -> Result<Row, String> {
        let wrong = |what: &str| format!("`{line}`: {what}");
        let (cells, label) = match line.split_once(':') {
            Some((cells, label)) => (cells, Some(label.trim().to_owned())),
            None => (line, None),
        };
        let (left, right) = cells.split_once('|').ok_or_else(|| wrong("no `|`"))?;
        let mut left = left.split_whitespace();
        let name = match left.next() {
            Some("stop") => RowName::Stop,
            Some(scan) => RowName::Scan(scan.parse().map_err(|_| wrong("no scan"))?),
            None => return Err(wrong("no scan")),
        };
        let stimulus: Vec<Option<String>> =
            left.map(|cell| (cell != ".").then(|| cell.to_owned())).collect();
        let mut expected = Vec::new();
        for cell in right.split_whitespace() {
            expected.push(match cell {
                "." => None,
                value if value.parse::<f64>().is_ok() => Some(value.to_owned()),
                _ => return Err(wrong("a value is no number")),
            });
        }
        if stimulus.len() != inputs || expected.len() != columns {
            return Err(wrong("as many cells as the header has, please"));
        }
        Ok(Row { name, label, stimulus, expected })
    }
}
