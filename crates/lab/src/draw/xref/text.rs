//! A cross-reference as text for a terminal.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::answer::{CrossReference, FileLine, TestPlace, WritePlace};
use rungd_language::source::wording::counted;

/// The most characters of a column. A longer text moves the next column only in its own line.
const COLUMN_MAX: usize = 44;

/// A line below a title: the text, the rung, the line of a file, and a note.
struct Row {
    text: String,
    rung: String,
    place: String,
    note: String,
}

/// The whole cross-reference: each list below its title.
pub fn whole(of: &CrossReference) -> String {
    let mut text = headline(of);
    if let Some(declared) = &of.declared {
        let _ = writeln!(text, "  declared at {}", line(declared));
    }
    list(&mut text, "written by", written(of));
    for block in &of.turned {
        let _ = writeln!(text, "  {block} itself, as it starts and ends");
    }
    let read = of.read.iter().map(|of| row(&of.text, &of.rung, &of.place));
    let named = of.constants.iter().map(|place| row("", "", place));
    list(&mut text, "read by", read.chain(named).collect());
    let outside = of.outside.iter().map(|of| Row {
        text: of.text.clone(),
        rung: String::new(),
        place: of.place.as_ref().map(line).unwrap_or_default(),
        note: String::new(),
    });
    list(&mut text, "controller file", outside.collect());
    if of.retained {
        text.push_str("retentive memory keeps it\n");
    }
    list(&mut text, "tests", tests(of));
    if is_untouched(of) {
        text.push_str("nothing writes it, nothing reads it\n");
    }
    text
}

/// A summary: the number of places that write and read the operand, and its other uses.
pub fn short(of: &CrossReference) -> String {
    let places = |count: usize| counted(count as u64, "place");
    let tests: BTreeSet<_> = of.tests.iter().map(|of| (&of.place.file, &of.test)).collect();
    let mut text = headline(of);
    let _ = writeln!(text, "  written at {}", places(of.written.len() + of.turned.len()));
    let _ = writeln!(text, "  read at {}", places(of.read.len() + of.constants.len()));
    for outside in &of.outside {
        let _ = writeln!(text, "  {}", outside.text);
    }
    if of.retained {
        text.push_str("  retentive memory keeps it\n");
    }
    if !tests.is_empty() {
        let _ = writeln!(text, "  touched by {}", counted(tests.len() as u64, "test"));
    }
    text
}

fn headline(of: &CrossReference) -> String {
    let address = of.address.as_ref().map(|at| format!(" ({at})")).unwrap_or_default();
    let doc = of.doc.as_ref().map(|doc| format!(": {doc}")).unwrap_or_default();
    format!("{}{address}{doc}\n", of.name)
}

fn is_untouched(of: &CrossReference) -> bool {
    of.written.is_empty()
        && of.turned.is_empty()
        && of.read.is_empty()
        && of.constants.is_empty()
        && of.outside.is_empty()
}

fn written(of: &CrossReference) -> Vec<Row> {
    let row = |of: &WritePlace| {
        let end = of.reset_at_end_of.as_ref();
        let note = end.map(|block| format!("; the end of {block} resets it")).unwrap_or_default();
        Row { note, ..row(&of.text, &of.rung, &of.place) }
    };
    of.written.iter().map(row).collect()
}

/// A row for each test, with the lines that name the operand.
fn tests(of: &CrossReference) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for TestPlace { test, place, .. } in &of.tests {
        let name = test.as_deref().unwrap_or("always");
        let of_file = format!("{}:", place.file);
        match rows.last_mut().filter(|row| row.place == name && row.text.starts_with(&of_file)) {
            Some(row) => {
                let _ = write!(row.text, ", {}", place.line);
            }
            None => rows.push(Row {
                text: line(place),
                rung: String::new(),
                place: name.to_owned(),
                note: String::new(),
            }),
        }
    }
    rows
}

fn row(text: &str, rung: &str, place: &FileLine) -> Row {
    let (text, rung) = (text.to_owned(), rung.to_owned());
    Row { text, rung, place: line(place), note: String::new() }
}

fn line(place: &FileLine) -> String {
    format!("{}:{}", place.file, place.line)
}

/// Appends a list in columns.
fn list(text: &mut String, title: &str, rows: Vec<Row>) {
    if rows.is_empty() {
        return;
    }
    let _ = writeln!(text, "{title}");
    let wide = |column: fn(&Row) -> &str| {
        let widths = rows.iter().map(|row| column(row).chars().count());
        widths.filter(|width| *width <= COLUMN_MAX).max().unwrap_or(0)
    };
    let (first, second) = (wide(|row| &row.text), wide(|row| &row.rung));
    for Row { text: what, rung, place, note } in &rows {
        let mut line = String::new();
        for (column, width) in [(what, first), (rung, second)] {
            if width > 0 || !column.is_empty() {
                let _ = write!(line, "{column:width$}  ");
            }
        }
        let _ = writeln!(text, "  {}", format!("{line}{place}{note}").trim_end());
    }
}
