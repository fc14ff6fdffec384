//! The rungs of a CLICK ladder in CSV: rows of a marker, 31 conditions, and an instruction.
//!
//! Called by `click::read`. What a cell means is not known here.

use crate::csv::{CsvRecord, records};

/// The cells of conditions of a row.
pub(super) const COLUMNS: usize = 31;
/// Most rungs of a file.
const RUNGS_MAX: usize = 100_000;
/// Most rows of a rung.
const ROWS_MAX: usize = 1000;

/// A rung.
#[derive(Clone, Debug, Default)]
pub(super) struct SheetRung {
    pub(super) comment: String,
    pub(super) rows: Vec<SheetRow>,
}

/// A row of a rung.
#[derive(Clone, Debug)]
pub(super) struct SheetRow {
    /// The cells of conditions; always [`COLUMNS`].
    pub(super) cells: Vec<String>,
    /// The instruction; empty: none.
    pub(super) call: String,
}

/// Reads the rungs of a file.
///
/// # Errors
/// A row is none; the reason has the line.
pub(super) fn rungs(text: &str) -> Result<Vec<SheetRung>, String> {
    let mut rungs: Vec<SheetRung> = Vec::new();
    let mut comment = String::new();
    let mut is_open = false;
    for record in records(text)?.into_iter().skip(1) {
        let CsvRecord { line, mut fields } = record;
        let marker = fields.first().map_or("", String::as_str).trim().to_owned();
        if marker == "#" {
            let text = fields.get(1).map_or("", String::as_str);
            comment += if comment.is_empty() { "" } else { "\n" };
            comment += text;
            is_open = false;
            continue;
        }
        if fields.len() != COLUMNS + 2 {
            let found = fields.len();
            return Err(format!("line {line}: {found} columns; a row has {}", COLUMNS + 2));
        }
        let call = fields.pop().unwrap_or_default().trim().to_owned();
        let cells = fields.drain(1..).map(|cell| cell.trim().to_owned()).collect();
        let is_begin = marker
            .strip_prefix('R')
            .is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()));
        let is_full = rungs.len() >= RUNGS_MAX;
        match (is_begin, marker.is_empty() && is_open, rungs.last_mut()) {
            (true, _, _) if is_full => {
                return Err(format!("line {line}: at most {RUNGS_MAX} rungs are read"));
            }
            (true, _, _) => {
                let comment = std::mem::take(&mut comment);
                rungs.push(SheetRung { comment, rows: vec![SheetRow { cells, call }] });
                is_open = true;
            }
            (false, true, Some(rung)) if rung.rows.len() < ROWS_MAX => {
                rung.rows.push(SheetRow { cells, call });
            }
            (false, true, _) => {
                return Err(format!("line {line}: a rung has at most {ROWS_MAX} rows"));
            }
            (false, false, _) => {
                return Err(format!("line {line}: `{marker}` begins no rung; `R` does"));
            }
        }
    }
    Ok(rungs)
}
