//! The place of a cursor in a file: its table, and whether it is at a key, in a value or in a
//! header.
//!
//! [`CompletionSite::of`] reads the tree of the text from the last header to the cursor: its last
//! statement is what is around the cursor. `complete` derives the proposals from the place.

use crate::file::EditorFile;
use rungd_language::source::toml_tree::{
    Content, Piece, TextEnd, TextSlice, TomlPair, TomlRow, TomlTree,
};

/// The properties of a place in a file that decide what could be written there.
#[derive(Clone, Debug)]
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

impl CompletionSite {
    /// The place of a byte.
    pub fn of(file: &EditorFile, offset: usize) -> CompletionSite {
        let offset = offset.min(file.text.len());
        let line = file.line(offset);
        let headers = &file.outline.headers;
        let behind = headers.partition_point(|header| header.span.start < line.start);
        if let Some(header) = headers.get(behind).filter(|header| header.span.start <= offset) {
            let place = match file.slice(header.span.start..offset).contains(']') {
                true => SitePlace::Nowhere,
                false => SitePlace::Header(header.span.start),
            };
            return SiteReader::new(file, behind, offset, 0).site(place);
        }
        let start = behind.checked_sub(1).map_or(0, |last| headers[last].span.end.min(offset));
        let tree = TomlTree::read(file.slice(start..offset));
        SiteReader::new(file, behind, start, offset - start).tree(&tree)
    }
}

/// The state while a place is found: what is around it so far.
struct SiteReader {
    object: usize,
    /// The path of the object.
    kind: String,
    /// The keys from the object on; in a table in an array, also the keys around that table.
    path: Vec<String>,
    /// How many keys of `path` belong to the path of the table.
    inner: usize,
    brace: Option<usize>,
    in_array: bool,
    /// The byte of the file at which the text that is read begins.
    start: usize,
    /// The byte of that text at which the cursor is.
    end: usize,
}

impl SiteReader {
    /// A reader of the text from the byte `start` to the cursor, `end` bytes later, below the
    /// header with the number `behind - 1`.
    fn new(file: &EditorFile, behind: usize, start: usize, end: usize) -> SiteReader {
        let outline = &file.outline;
        let header = behind.checked_sub(1).and_then(|number| outline.headers.get(number));
        let object = header.map_or(0, |header| header.object);
        let kind = outline.objects[object].kind.clone();
        let path = header
            .map_or(Vec::new(), |header| header.keys.iter().map(|key| key.text.clone()).collect());
        SiteReader { object, kind, path, inner: 0, brace: None, in_array: false, start, end }
    }

    fn site(mut self, place: SitePlace) -> CompletionSite {
        let keys = self.path.split_off(self.inner);
        let SiteReader { object, mut kind, path, brace, in_array, .. } = self;
        for key in path {
            if !kind.is_empty() {
                kind.push('.');
            }
            kind.push_str(&key);
        }
        CompletionSite { object, kind, keys, place, brace, in_array }
    }

    /// The place at the end of a tree.
    fn tree(mut self, tree: &TomlTree<'_>) -> CompletionSite {
        let place = match tree.pieces.last() {
            Some(Piece::Pair(pair)) if tree.end != TextEnd::LineStart => self.pair(pair),
            _ => self.new_key(),
        };
        let is_comment = tree.end == TextEnd::Comment;
        self.site(if is_comment { SitePlace::Nowhere } else { place })
    }

    fn new_key(&self) -> SitePlace {
        SitePlace::Key { start: self.start + self.end, quoted: false }
    }

    /// Whether a key or value ends at the cursor and may continue.
    fn continues(&self, text: &TextSlice<'_>) -> bool {
        text.span().end == self.end && !text.is_closed()
    }

    fn pair(&mut self, pair: &TomlPair<'_>) -> SitePlace {
        let mut keys = pair.key.as_slice();
        let typed = keys.split_last().filter(|(last, _)| !pair.is_assigned && self.continues(last));
        keys = typed.map_or(keys, |(_, before)| before);
        self.path.extend(keys.iter().map(|key| key.unquoted().text().to_owned()));
        match typed {
            Some((last, _)) => {
                let start = self.start + last.unquoted().span().start;
                SitePlace::Key { start, quoted: last.quote().is_some() }
            }
            None if pair.is_assigned => self.value(&pair.value),
            None => SitePlace::Nowhere,
        }
    }

    fn value(&mut self, value: &Content<'_>) -> SitePlace {
        match value {
            Content::Scalar(text) => self.scalar(text),
            Content::Array(array) if !array.brackets.is_closed => {
                self.in_array = true;
                match array.rows.iter().rev().find_map(TomlRow::element) {
                    _ if array.brackets.is_open_for_next => SitePlace::Bare(self.start + self.end),
                    Some(last) => self.value(last),
                    None => SitePlace::Nowhere,
                }
            }
            Content::Table(table) if !table.brackets.is_closed => {
                if std::mem::take(&mut self.in_array) {
                    self.inner = self.path.len();
                    self.brace = Some(self.start + table.brackets.span.start);
                }
                match table.pairs.last() {
                    Some(last) if !table.brackets.is_open_for_next => self.pair(last),
                    Some(_) | None => self.new_key(),
                }
            }
            Content::Array(_) | Content::Table(_) => SitePlace::Nowhere,
        }
    }

    fn scalar(&self, text: &TextSlice<'_>) -> SitePlace {
        if text.is_empty() {
            return SitePlace::Bare(self.start + self.end);
        }
        let start = self.start + text.unquoted().span().start;
        match text.quote() {
            _ if !self.continues(text) || text.is_multi_line() => SitePlace::Nowhere,
            Some(_) => SitePlace::Text(start),
            None => SitePlace::Bare(start),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::lines::ColumnUnit;

    fn told(text: &str) -> String {
        let offset = text.find('|').expect("a cursor");
        let text = text.replacen('|', "", 1);
        let file = EditorFile::new(Path::new("a.toml"), text.as_str().into(), ColumnUnit::Utf8);
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
    fn the_site_of_a_cursor_has_its_table_its_key_and_the_typed_text() {
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
