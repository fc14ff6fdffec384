//! The place of a cursor in a file: its table, and whether it is at a key, in a value or in a
//! header.
//!
//! [`CompletionSite::of`] reads from the last header to the cursor and nothing after it, so the
//! text may be incomplete. `complete` derives the proposals from the place.

use crate::file::EditorFile;

/// The properties of a place in a file that decide what could be written there.
#[derive(Debug)]
pub(super) struct CompletionSite {
    /// The number of the object that contains it; in an inline table in an array, the object with
    /// the array.
    pub object: usize,
    /// The path of its table: `program.rung`; for an inline table in an array, the array's path.
    pub kind: String,
    /// The keys below that table: for a value its own keys, for a key the keys before it.
    pub keys: Vec<String>,
    /// The kind of text at the place.
    pub place: SitePlace,
    /// The byte of the `{`, if the place is in an inline table in an array.
    pub brace: Option<usize>,
    /// Whether the place is in an array.
    pub in_array: bool,
}

/// The kind of text at a cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SitePlace {
    /// A header, from its first bracket on.
    Header(usize),
    /// A key, from its first byte on.
    Key {
        /// Its first byte.
        start: usize,
        /// Whether a quote is before it.
        quoted: bool,
    },
    /// A string, from the byte after its quote on.
    Text(usize),
    /// A value without a quote, from its first byte on.
    Bare(usize),
    /// A place without proposals: in a comment, or after something complete.
    Nowhere,
}

/// An array or inline table around a place, with the state to restore after it. It copies no keys:
/// thousands of nested brackets cost no more than the same number of brackets in a row.
#[derive(Debug)]
struct TableFrame {
    is_table: bool,
    /// The length of `path` before it.
    length: usize,
    /// The `inner` of the reader before it.
    inner: usize,
    brace: Option<usize>,
}

impl CompletionSite {
    /// The place of a byte.
    pub fn of(file: &EditorFile, offset: usize) -> CompletionSite {
        let offset = offset.min(file.text.len());
        let line = file.line(offset);
        let headers = &file.outline.headers;
        let behind = headers.partition_point(|header| header.span.start < line.start);
        if let Some(header) = headers.get(behind).filter(|of| of.span.start <= offset) {
            let place = match file.slice(header.span.start..offset).contains(']') {
                true => SitePlace::Nowhere,
                false => SitePlace::Header(header.span.start),
            };
            return SiteReader::new(file, behind, line.start).site(place);
        }
        SiteReader::new(file, behind, offset).read()
    }
}

struct SiteReader<'f> {
    text: &'f str,
    /// The next byte.
    at: usize,
    end: usize,
    object: usize,
    /// The path of the object at the last header.
    kind: String,
    /// How many keys of `path` come from the header.
    prefix: usize,
    /// The keys from the object on; in a table in an array, also the keys around that table.
    path: Vec<String>,
    /// How many keys of `path` belong to the path of the table.
    inner: usize,
    brace: Option<usize>,
    stack: Vec<TableFrame>,
    /// How many of `stack` are tables.
    tables: usize,
    /// How much of a key, `=` and value was read.
    state: SiteState,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum SiteState {
    /// A part of a key may follow.
    Key,
    /// A dot or `=` must follow.
    KeyRead,
    /// A value may follow.
    Value,
    /// A comma, a bracket or a new line must follow.
    ValueRead,
}

impl<'f> SiteReader<'f> {
    /// A reader of the text after the header with the number `behind - 1`.
    fn new(file: &'f EditorFile, behind: usize, end: usize) -> SiteReader<'f> {
        let outline = &file.outline;
        let header = behind.checked_sub(1).and_then(|number| outline.headers.get(number));
        let (mut object, mut path, mut at) = (0, Vec::new(), 0);
        if let Some(header) = header {
            at = header.span.end.min(end);
            let names: Vec<&str> = header.path.split('.').collect();
            let before = outline.objects.partition_point(|of| of.extent.start < header.span.start);
            let own = (before.max(1)..outline.objects.len())
                .find(|number| outline.objects[*number].extent.start == header.span.start)
                .filter(|_| header.is_array);
            let known = |length: &usize| {
                let kind = names[..*length].join(".");
                let found = (1..before).rev().find(|of| outline.objects[*of].kind == kind);
                found.map(|object| (object, *length))
            };
            let around = || (1..=names.len()).rev().find_map(|length| known(&length));
            let (of, length) = match own {
                Some(own) => (own, names.len()),
                None => around().unwrap_or((0, 0)),
            };
            object = of;
            path = names[length..].iter().map(|name| (*name).to_owned()).collect();
        }
        SiteReader {
            text: &file.text,
            at,
            end,
            object,
            kind: outline.objects[object].kind.clone(),
            prefix: path.len(),
            path,
            inner: 0,
            brace: None,
            stack: Vec::new(),
            tables: 0,
            state: SiteState::Key,
        }
    }

    fn site(mut self, place: SitePlace) -> CompletionSite {
        let in_array = self.stack.last().is_some_and(|frame| !frame.is_table);
        let keys = self.path.split_off(self.inner);
        let SiteReader { object, mut kind, path, brace, .. } = self;
        for key in path {
            if !kind.is_empty() {
                kind.push('.');
            }
            kind.push_str(&key);
        }
        CompletionSite { object, kind, keys, place, brace, in_array }
    }

    fn read(mut self) -> CompletionSite {
        while let Some(byte) = self.peek() {
            let found = match byte {
                b'\n' => self.line_ends(),
                b' ' | b'\t' | b'\r' => self.skip(1),
                b'#' => self.comment(),
                b'"' | b'\'' => self.quoted(byte),
                b'[' | b'{' if self.state == SiteState::Value => self.opened(byte == b'{'),
                b']' | b'}' => self.closed(byte == b'}'),
                b',' => self.comma(),
                b'=' if self.state == SiteState::KeyRead => self.goes_on(SiteState::Value),
                b'.' if self.state == SiteState::KeyRead => self.goes_on(SiteState::Key),
                _ => self.bare(),
            };
            if let Some(place) = found {
                return self.site(place);
            }
        }
        let start = self.at;
        let place = match self.state {
            SiteState::Key => SitePlace::Key { start, quoted: false },
            SiteState::Value => SitePlace::Bare(start),
            SiteState::KeyRead | SiteState::ValueRead => SitePlace::Nowhere,
        };
        self.site(place)
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes()[..self.end].get(self.at).copied()
    }

    fn skip(&mut self, bytes: usize) -> Option<SitePlace> {
        self.at += bytes;
        None
    }

    fn goes_on(&mut self, state: SiteState) -> Option<SitePlace> {
        self.state = state;
        self.skip(1)
    }

    /// Begins a new statement in the table of the header.
    fn begin(&mut self) {
        self.path.truncate(self.prefix);
        self.inner = 0;
        self.stack.clear();
        self.tables = 0;
        self.brace = None;
        self.state = SiteState::Key;
    }

    /// Inline tables end with their line; an array continues unless a statement begins.
    fn line_ends(&mut self) -> Option<SitePlace> {
        self.at += 1;
        while self.stack.last().is_some_and(|frame| frame.is_table) {
            self.close();
        }
        if self.stack.is_empty() || begins_statement(&self.text[self.at..]) {
            self.begin();
        }
        None
    }

    fn comment(&mut self) -> Option<SitePlace> {
        let rest = &self.text[self.at..self.end];
        match rest.find('\n') {
            Some(length) => self.skip(length),
            None => Some(SitePlace::Nowhere),
        }
    }

    /// A string, or a key in quotes. Without a closing quote, it ends with its line.
    fn quoted(&mut self, quote: u8) -> Option<SitePlace> {
        let rest = &self.text[self.at..self.end];
        let triple = [quote; 3];
        if rest.as_bytes().starts_with(&triple) {
            let close = rest.as_bytes()[3..].windows(3).position(|three| three == triple);
            self.at += 6 + close.unwrap_or(0);
            self.state = SiteState::ValueRead;
            return close.is_none().then_some(SitePlace::Nowhere);
        }
        let start = self.at + 1;
        let (mut length, mut escaped) = (0, false);
        for byte in self.text.as_bytes()[start..self.end].iter() {
            if *byte == b'\n' || (*byte == quote && !escaped) {
                let is_key = matches!(self.state, SiteState::Key | SiteState::KeyRead);
                if is_key {
                    self.path.push(self.text[start..start + length].to_owned());
                }
                self.state = if is_key { SiteState::KeyRead } else { SiteState::ValueRead };
                self.at = start + length + usize::from(*byte == quote);
                return None;
            }
            escaped = *byte == b'\\' && quote == b'"' && !escaped;
            length += 1;
        }
        Some(match self.state {
            SiteState::Key | SiteState::KeyRead => SitePlace::Key { start, quoted: true },
            SiteState::Value | SiteState::ValueRead => SitePlace::Text(start),
        })
    }

    fn opened(&mut self, is_table: bool) -> Option<SitePlace> {
        let in_array = self.stack.last().is_some_and(|frame| !frame.is_table);
        let (length, inner, brace) = (self.path.len(), self.inner, self.brace);
        self.stack.push(TableFrame { is_table, length, inner, brace });
        self.tables += usize::from(is_table);
        if is_table && in_array {
            self.inner = length;
            self.brace = Some(self.at);
        }
        self.goes_on(if is_table { SiteState::Key } else { SiteState::Value })
    }

    fn close(&mut self) {
        if let Some(frame) = self.stack.pop() {
            self.path.truncate(frame.length);
            (self.inner, self.brace) = (frame.inner, frame.brace);
            self.tables -= usize::from(frame.is_table);
            self.state = SiteState::ValueRead;
        }
    }

    /// Closes the innermost open array or table of this kind, and everything that is open in it.
    fn closed(&mut self, is_table: bool) -> Option<SitePlace> {
        let open = if is_table { self.tables } else { self.stack.len() - self.tables };
        if open > 0 {
            while self.stack.last().is_some_and(|frame| frame.is_table != is_table) {
                self.close();
            }
            self.close();
        }
        self.skip(1)
    }

    fn comma(&mut self) -> Option<SitePlace> {
        match self.stack.last() {
            None => self.skip(1),
            Some(frame) if !frame.is_table => self.goes_on(SiteState::Value),
            Some(frame) => {
                self.path.truncate(frame.length);
                self.goes_on(SiteState::Key)
            }
        }
    }

    fn bare(&mut self) -> Option<SitePlace> {
        let start = self.at;
        let is_key = matches!(self.state, SiteState::Key | SiteState::KeyRead);
        let ends = |c: char| match is_key {
            true => !(c.is_alphanumeric() || matches!(c, '_' | '-')),
            false => c.is_whitespace() || matches!(c, ',' | ']' | '}' | '#' | '[' | '{' | '"'),
        };
        let rest = &self.text[start..self.end];
        let length = rest.find(ends).unwrap_or(rest.len());
        if start + length == self.end && length > 0 {
            return Some(match self.state {
                SiteState::Key => SitePlace::Key { start, quoted: false },
                SiteState::Value => SitePlace::Bare(start),
                SiteState::KeyRead | SiteState::ValueRead => SitePlace::Nowhere,
            });
        }
        if length == 0 {
            return self.skip(rest.chars().next().map_or(1, char::len_utf8));
        }
        if self.state == SiteState::Key {
            self.path.push(rest[..length].to_owned());
        }
        self.state = if is_key { SiteState::KeyRead } else { SiteState::ValueRead };
        self.skip(length)
    }
}

/// Whether a line begins with a key and its `=`, or with a bare word. Then the brackets that are
/// open before it were left unclosed.
fn begins_statement(text: &str) -> bool {
    let line = text.lines().next().unwrap_or_default().trim_start();
    if line.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return true;
    }
    let Some(rest) = line.strip_prefix('"') else { return false };
    rest.split_once('"').is_some_and(|(_, behind)| behind.trim_start().starts_with('='))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::lines::Columns;

    fn told(text: &str) -> String {
        let offset = text.find('|').expect("a cursor");
        let text = text.replacen('|', "", 1);
        let file = EditorFile::new(Path::new("a.toml"), text.as_str().into(), Columns::Utf8);
        let site = CompletionSite::of(&file, offset);
        let typed = |start: usize| &text[start..offset];
        let place = match site.place {
            SitePlace::Header(start) => format!("header {}", typed(start)),
            SitePlace::Key { start, quoted } => format!("key {} {quoted}", typed(start)),
            SitePlace::Text(start) => format!("text {}", typed(start)),
            SitePlace::Bare(start) => format!("bare {}", typed(start)),
            SitePlace::Nowhere => "nowhere".to_owned(),
        };
        format!("{} {} {place}", site.kind, site.keys.join("."))
    }

    #[test]
    fn a_cursor_is_told_by_its_table_its_keys_and_what_stands_there() {
        for (text, wanted) in [
            ("|", "  key  false"),
            ("na|", "  key na false"),
            ("[[program]]\nna|", "program  key na false"),
            ("[[program]]\n[[program.rung]]\nleg.u|", "program.rung leg key u false"),
            ("[[program.rung]]\nwhen = |", "program.rung when bare "),
            ("[[program.rung]]\nwhen = [\"a\", \"b|", "program.rung when text b"),
            ("[[program.rung]]\nwhen = [\"a\",\n    \"b|\",\n]", "program.rung when text b"),
            ("[[program.rung]]\nwhen = [\"a\",\ndo = [\"b|", "program.rung do text b"),
            ("[[program.rung]]\nwhen = [\"a\ndo = [\"b|", "program.rung do text b"),
            ("[[program.rung]]\nwith = { x = \"a\", y|", "program.rung with key y false"),
            ("[[program.rung]]\nwith = { x = \"a|", "program.rung with.x text a"),
            ("[[program.rung]]\nwith = { x = \"a|\" }", "program.rung with.x text a"),
            (
                "[[template]]\n[template.parameters]\nx = { type = \"|",
                "template parameters.x.type text ",
            ),
            ("tags.eye = { at = \"X0\", |", " tags.eye key  false"),
            ("[[device]]\nmap = [\n  { from = \"a\", to = \"|", "device.map to text "),
            ("[[device]]\nmap = [\n  { from = \"a\", t| }\n]", "device.map  key t false"),
            ("[[device]]\nmap = [\n  { from = \"a\" },\n]\nna|", "device  key na false"),
            ("[[pro|", "  header [[pro"),
            ("[[program]|", "  nowhere"),
            ("a = 1 # b|", " a nowhere"),
            ("a = \"x\" |", " a nowhere"),
            ("a |", " a nowhere"),
            ("set = { \"p1.|", " set key p1. true"),
        ] {
            assert_eq!(told(text), wanted, "{text}");
        }
    }
}
