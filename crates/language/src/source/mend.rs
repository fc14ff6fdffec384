//! Replaces the parts of a text that are not TOML by spaces, so that the rest can be read.
//!
//! Called by the reader for a file with syntax errors, so that an editor shows findings while a
//! person types. The rest keeps its place, and [`LostText`] lists the missing parts. All text below
//! a header that cannot be read is replaced too, because it would join a different table. This
//! module never adds text: a value that is not closed is lost. It makes no findings.

use std::collections::HashSet;
use std::ops::Range;

use toml::de::{DeTable, Error};

use super::lost::LostText;
use super::lost_tables::LostTables;
use super::statements::{
    Statement, closed_lines, first_line, is_idle, is_toml, plain_key, statements,
};
use rungd_base::progress::Progress;

/// Maximum number of times that a text is parsed. Each time, statements may contradict each other:
/// two keys of the same name, for example.
const ROUNDS_MAX: usize = 4;

/// The text without its broken parts, which is TOML, and its missing parts.
pub(super) struct MendedText {
    pub text: String,
    pub lost: LostText,
    /// The parser's errors that do not follow from others.
    pub errors: Vec<Error>,
}

/// Mends a text in which the parser found the errors `found`; `None` if the text cannot be mended,
/// or if the load must end.
pub(super) fn mend(source: &str, found: &[Error], progress: &Progress) -> Option<MendedText> {
    let statements = statements(source);
    let lost = vec![false; statements.len()];
    let (places, contradictions) = (Vec::new(), HashSet::new());
    let headers = headers_of(&statements);
    let mut mending = Mending { source, statements, headers, lost, places, contradictions };
    mending.drop_broken();
    for _ in 0..ROUNDS_MAX {
        if progress.is_over() {
            return None;
        }
        let text = mending.text();
        let errors = DeTable::parse_recoverable(&text).1;
        if errors.is_empty() {
            let lost = mending.lost_text();
            return Some(MendedText { text, lost, errors: mending.causes(found) });
        }
        let before = mending.places.len();
        for error in errors {
            mending.drop_contradiction(place_of(&error));
        }
        if mending.places.len() == before {
            return None;
        }
    }
    None
}

/// For each statement: the newest header before it.
fn headers_of(statements: &[Statement]) -> Vec<Option<usize>> {
    let mut newest = None;
    let header = |(at, statement): (usize, &Statement)| {
        let before = newest;
        newest = statement.header.map(|_| at).or(newest);
        before
    };
    statements.iter().enumerate().map(header).collect()
}

/// A text that is being mended.
struct Mending<'a> {
    source: &'a str,
    statements: Vec<Statement>,
    /// For each statement: the header above it.
    headers: Vec<Option<usize>>,
    /// For each statement: whether it is lost as a whole.
    lost: Vec<bool>,
    /// The places that are replaced, in no order.
    places: Vec<Range<usize>>,
    /// The places of the parser's errors about statements that contradict each other.
    contradictions: HashSet<usize>,
}

impl Mending<'_> {
    /// Drops the statements that are not TOML by themselves.
    fn drop_broken(&mut self) {
        for at in 0..self.statements.len() {
            let statement = &self.statements[at];
            if self.lost[at] || statement.is_toml {
                continue;
            }
            if let Some(depth) = statement.header {
                self.drop_tables(at, depth);
            } else if let Some(lines) = broken_elements(self.source, &statement.range) {
                self.places.extend(lines);
            } else {
                self.drop_one(at);
            }
        }
    }

    /// The statement at or before a place.
    fn statement_at(&self, place: usize) -> Option<usize> {
        self.statements.partition_point(|statement| statement.range.start <= place).checked_sub(1)
    }

    /// Drops the statement at a place where it contradicts an earlier one.
    fn drop_contradiction(&mut self, place: usize) {
        self.contradictions.insert(place);
        let Some(at) = self.statement_at(place).filter(|at| !self.lost[*at]) else { return };
        if let Some(depth) = self.statements[at].header {
            // Usually the header of the table above is missing, and the following statements belong
            // to it.
            let above = if depth > 1 { depth - 1 } else { depth };
            return self.drop_tables(at, above);
        }
        if !self.headers[at].is_some_and(|header| self.is_list(header)) {
            return self.drop_one(at);
        }
        // Usually the header of the next list entry is missing, before this key.
        let keys =
            self.statements[at..].iter().take_while(|statement| statement.header.is_none()).count();
        (at..at + keys).for_each(|at| self.drop_one(at));
    }

    /// Drops a header with its keys, and all statements up to the next header of at most this
    /// depth.
    fn drop_tables(&mut self, header: usize, depth: usize) {
        self.drop_one(header);
        let below = |statement: &&Statement| {
            statement.header.is_none_or(|header_depth| header_depth > depth)
        };
        let count = self.statements[header + 1..].iter().take_while(below).count();
        (header + 1..=header + count).for_each(|at| self.drop_one(at));
    }

    /// Whether a header begins an entry of a list.
    fn is_list(&self, header: usize) -> bool {
        self.text_of(header).trim_start().starts_with("[[")
    }

    fn drop_one(&mut self, at: usize) {
        if !std::mem::replace(&mut self.lost[at], true) {
            self.places.push(self.statements[at].range.clone());
        }
    }

    /// The text with spaces instead of the lost parts. Line ends are kept.
    fn text(&self) -> String {
        let mut bytes = self.source.as_bytes().to_vec();
        for place in &self.places {
            for at in place.clone() {
                let ends_line =
                    bytes[at] == b'\n' || bytes[at] == b'\r' && bytes.get(at + 1) == Some(&b'\n');
                if !ends_line {
                    bytes[at] = b' ';
                }
            }
        }
        String::from_utf8(bytes).expect("statements are whole lines")
    }

    fn lost_text(&mut self) -> LostText {
        self.places.sort_unstable_by_key(|place| place.start);
        let mut tables = LostTables::of(self.source.len());
        let mut places = self.places.iter().peekable();
        for (at, statement) in self.statements.iter().enumerate() {
            match statement.header {
                Some(depth) if self.lost[at] => tables.lose_below(depth),
                Some(depth) => tables.begin(&statement.range, depth, self.is_list(at)),
                None if plain_key(self.text_of(at)) == Some("name") => {
                    tables.name(&statement.range)
                }
                None => {}
            }
            while places.next_if(|place| place.start < statement.range.end).is_some() {
                tables.lose();
            }
        }
        let mut lost = LostText::of(&tables, self.source, &self.places);
        let mut headers = self.statements.iter().zip(&self.lost);
        if headers.any(|(statement, lost)| *lost && statement.header.is_some()) {
            lost.lose_header();
        }
        lost
    }

    /// The errors without those that follow from a broken statement further up. Such an error is
    /// about a statement that is TOML by itself and contradicts no other statement.
    fn causes(&self, errors: &[Error]) -> Vec<Error> {
        let mut sorted: Vec<&Error> = errors.iter().collect();
        sorted.sort_by_key(|error| place_of(error));
        let mut broken = None;
        let mut told = None;
        let mut causes = Vec::new();
        let mut next = 0;
        for error in sorted {
            let at = self.statement_at(place_of(error)).unwrap_or(0);
            while next <= at && next < self.statements.len() {
                broken = if self.statements[next].is_toml { broken } else { Some(next) };
                next += 1;
            }
            let is_cause = broken.is_none()
                || broken == Some(at)
                || broken != told
                || self.contradictions.contains(&place_of(error));
            if is_cause {
                told = broken;
                causes.push(error.clone());
            }
        }
        causes
    }

    fn text_of(&self, statement: usize) -> &str {
        &self.source[self.statements[statement].range.clone()]
    }
}

fn place_of(error: &Error) -> usize {
    error.span().map_or(0, |span| span.start)
}

/// The broken elements of an array over several lines, if the rest of the array is TOML without
/// them.
fn broken_elements(source: &str, array: &Range<usize>) -> Option<Vec<Range<usize>>> {
    let text = &source[array.clone()];
    let head = first_line(text);
    if !head.split('#').next()?.trim_end().ends_with('[') {
        return None;
    }
    let tail = text.rfind("\n]").or_else(|| text.trim_end().rfind('\n'))? + 1;
    let (mut rest, mut broken) = (String::from(head), Vec::new());
    let (mut at, mut stop) = (head.len(), 0);
    while at < tail {
        if stop <= at {
            stop = next_element(text, at).min(tail);
        }
        let line = first_line(&text[at..]);
        let closed = closed_lines(&text[at..stop]).filter(|_| !is_idle(line));
        let end = if is_idle(line) { at + line.len() } else { closed.map_or(stop, |n| at + n) };
        if is_idle(line) || is_element(&text[at..end]) {
            rest.push_str(&text[at..end]);
        } else {
            broken.push(array.start + at..array.start + end);
        }
        at = end;
    }
    rest.push_str(text.get(at..)?);
    (!broken.is_empty() && is_toml(&rest)).then_some(broken)
}

/// The start of the next line that begins with a table, behind the line at `start`.
fn next_element(text: &str, start: usize) -> usize {
    let mut at = start;
    for (number, line) in text[start..].split_inclusive('\n').enumerate() {
        if number > 0 && line.trim_start().starts_with('{') {
            break;
        }
        at += line.len();
    }
    at
}

fn is_element(text: &str) -> bool {
    is_toml(&format!("x = [\n{text}\n]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the text that is kept of each line.
    fn check(source: &str, expected: &str) {
        let mended = mend(source, &[], &Progress::default()).expect("it can be mended");
        assert_eq!(mended.text.len(), source.len());
        let stays = mended.text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
        assert_eq!(stays, expected);
    }

    #[test]
    fn repair_removes_only_the_unclosed_value() {
        check("a = [\"x\nb = 1\n[t]\nc = \"\n d = 2", "\nb = 1\n[t]\n\n d = 2");
    }

    #[test]
    fn repair_removes_only_the_broken_element_of_a_multi_line_array() {
        check(
            "rung = [\n { a = [\"x] },\n { a = 1 }, # one\n \"y,\n]\nb = 2",
            "rung = [\n\n { a = 1 }, # one\n\n]\nb = 2",
        );
        check("a = [\n 1,\n [\n 2,\n ],\n 3 4,\n 5,\n]", "a = [\n 1,\n [\n 2,\n ],\n\n 5,\n]");
        check("a = [\n 1\n 2\n]\nb = 2", "\n\n\n\nb = 2");
    }

    #[test]
    fn repair_removes_a_broken_header_with_its_keys_and_subtables() {
        check(
            "[[p]]\na = 1\n[[p.s]\nb = 2\n[[p.s.r]]\nc = 3\n[[p.s]]\nd = 4",
            "[[p]]\na = 1\n\n\n\n\n[[p.s]]\nd = 4",
        );
    }

    #[test]
    fn repair_removes_the_second_of_two_duplicates() {
        check("[t]\na = 1\na = 2\nb = 3", "[t]\na = 1\n\nb = 3");
        check("[[t]]\na = 1\na = 2\nb = 3\n[[t]]\nb = 4", "[[t]]\na = 1\n\n\n[[t]]\nb = 4");
        check("[t]\na = 1\n[t]\nb = 2\n[u]\nc = 3", "[t]\na = 1\n\n\n[u]\nc = 3");
    }
}
