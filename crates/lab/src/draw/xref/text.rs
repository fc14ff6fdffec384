//! A cross-reference as text for a terminal.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::answer::{CrossReference, FileLine, TestPlace, WritePlace};
use rungd_language::source::wording::counted;

/// The most characters of a column. A longer text moves the next column only in its own line.
const COLUMN_MAX: usize = 44;

/// A line below a title: the text, the rung, the line of a file, and a note.
struct ListRow {
    text: String,
    rung: String,
    place: String,
    note: String,
}

/// The whole cross-reference: each list below its title.
pub fn whole(reference: &CrossReference) -> String {
    let mut text = headline(reference);
    if let Some(declared) = &reference.declared {
        let _ = writeln!(text, "  declared at {}", line(declared));
    }
    list(&mut text, "written by", written(reference));
    for block in &reference.turned {
        let _ = writeln!(text, "  {block} itself, as it starts and ends");
    }
    let read = reference
        .read
        .iter()
        .map(|read_place| row(&read_place.text, &read_place.rung, &read_place.place));
    let called = reference.called.iter().map(|call| row(&call.text, &call.rung, &call.place));
    list(&mut text, "called by", called.collect());
    let named = reference.constants.iter().map(|place| row("", "", place));
    list(&mut text, "read by", read.chain(named).collect());
    let outside = reference.outside.iter().map(|outside_use| ListRow {
        text: outside_use.text.clone(),
        rung: String::new(),
        place: outside_use.place.as_ref().map(line).unwrap_or_default(),
        note: String::new(),
    });
    list(&mut text, "controller file", outside.collect());
    if reference.retained {
        text.push_str("retentive memory keeps it\n");
    }
    list(&mut text, "tests", tests(reference));
    if is_untouched(reference) {
        text.push_str("nothing writes it, nothing reads it\n");
    }
    text
}

/// A summary: the number of places that write and read the operand, and its other uses.
pub fn short(reference: &CrossReference) -> String {
    let places = |count: usize| counted(count as u64, "place");
    let tests: BTreeSet<_> = reference
        .tests
        .iter()
        .map(|test_place| (&test_place.place.file, &test_place.test))
        .collect();
    let mut text = headline(reference);
    let _ =
        writeln!(text, "  written at {}", places(reference.written.len() + reference.turned.len()));
    let _ =
        writeln!(text, "  read at {}", places(reference.read.len() + reference.constants.len()));
    if !reference.called.is_empty() {
        let _ = writeln!(text, "  called at {}", places(reference.called.len()));
    }
    for outside in &reference.outside {
        let _ = writeln!(text, "  {}", outside.text);
    }
    if reference.retained {
        text.push_str("  retentive memory keeps it\n");
    }
    if !tests.is_empty() {
        let _ = writeln!(text, "  touched by {}", counted(tests.len() as u64, "test"));
    }
    text
}

fn headline(reference: &CrossReference) -> String {
    let address = reference.address.as_ref().map(|at| format!(" ({at})")).unwrap_or_default();
    let doc = reference.doc.as_ref().map(|doc| format!(": {doc}")).unwrap_or_default();
    format!("{}{address}{doc}\n", reference.name)
}

fn is_untouched(reference: &CrossReference) -> bool {
    reference.written.is_empty()
        && reference.turned.is_empty()
        && reference.read.is_empty()
        && reference.called.is_empty()
        && reference.constants.is_empty()
        && reference.outside.is_empty()
}

fn written(reference: &CrossReference) -> Vec<ListRow> {
    let row = |write_place: &WritePlace| {
        let end = write_place.reset_at_end_of.as_ref();
        let note = end.map(|block| format!("; the end of {block} resets it")).unwrap_or_default();
        ListRow { note, ..row(&write_place.text, &write_place.rung, &write_place.place) }
    };
    reference.written.iter().map(row).collect()
}

/// A row for each test, with the lines that name the operand.
fn tests(reference: &CrossReference) -> Vec<ListRow> {
    let mut rows: Vec<ListRow> = Vec::new();
    for TestPlace { test, is_of_observer, text, place } in &reference.tests {
        let other = if *is_of_observer { text } else { "always" };
        let name = test.as_deref().unwrap_or(other);
        let of_file = format!("{}:", place.file);
        match rows.last_mut().filter(|row| row.place == name && row.text.starts_with(&of_file)) {
            Some(row) => {
                let _ = write!(row.text, ", {}", place.line);
            }
            None => rows.push(ListRow {
                text: line(place),
                rung: String::new(),
                place: name.to_owned(),
                note: String::new(),
            }),
        }
    }
    rows
}

fn row(text: &str, rung: &str, place: &FileLine) -> ListRow {
    let (text, rung) = (text.to_owned(), rung.to_owned());
    ListRow { text, rung, place: line(place), note: String::new() }
}

fn line(place: &FileLine) -> String {
    format!("{}:{}", place.file, place.line)
}

/// Appends a list in columns.
fn list(text: &mut String, title: &str, rows: Vec<ListRow>) {
    if rows.is_empty() {
        return;
    }
    let _ = writeln!(text, "{title}");
    let wide = |column: fn(&ListRow) -> &str| {
        let widths = rows.iter().map(|row| column(row).chars().count());
        widths.filter(|width| *width <= COLUMN_MAX).max().unwrap_or(0)
    };
    let (first, second) = (wide(|row| &row.text), wide(|row| &row.rung));
    for ListRow { text: what, rung, place, note } in &rows {
        let mut line = String::new();
        for (column, width) in [(what, first), (rung, second)] {
            if width > 0 || !column.is_empty() {
                let _ = write!(line, "{column:width$}  ");
            }
        }
        let _ = writeln!(text, "  {}", format!("{line}{place}{note}").trim_end());
    }
}
