//! Makes the `outline` of a text from its tree, which every text has.

use std::collections::HashMap;
use std::ops::Range;

use super::outline::{KeyPair, KeyPart, Outline, OutlineValue, TableHeader, TableObject};
use rungd_language::source::toml_tree::{
    Content, InlineTable, Piece, TextSlice, TomlArray, TomlHead, TomlPair, TomlRow, TomlTree,
};

/// The maximum depth of arrays and inline tables that are read.
const DEPTH_MAX: usize = 8;
/// The maximum number of parts of a key that are kept.
const PARTS_MAX: usize = 16;

/// The outline of a text.
pub(super) fn read(text: &str) -> Outline {
    let extent = 0..text.len();
    let root = TableObject { kind: String::new(), parent: 0, extent, around: None };
    let mut outline = Outline::default();
    outline.objects.push(root);
    let (prefix, latest) = (Vec::new(), HashMap::new());
    let mut reader = OutlineReader { outline, prefix, into: 0, latest };
    for piece in TomlTree::read(text).pieces {
        match piece {
            Piece::Head(head) => reader.header(&head),
            Piece::Pair(pair) => reader.pair(&pair, reader.into, reader.prefix.clone(), 0),
            Piece::Blank | Piece::Remark(_) => {}
        }
    }
    reader.close(text.trim_end().len());
    reader.outline.indexed()
}

/// The state while a tree is read into an outline.
struct OutlineReader {
    outline: Outline,
    /// The keys that the last header puts before the keys below it.
    prefix: Vec<KeyPart>,
    /// The object that keys belong to now.
    into: usize,
    /// The latest object of each kind.
    latest: HashMap<String, usize>,
}

impl OutlineReader {
    fn header(&mut self, head: &TomlHead<'_>) {
        self.close(head.span.start);
        let path = parts(&head.path);
        let names: Vec<&str> = path.iter().map(|key| key.text.as_str()).collect();
        let name = names.join(".");
        let (parent, known) = self.parent(&names, head.is_array);
        if head.is_array {
            self.into = self.object(name.clone(), parent, head.span.clone());
            self.prefix.clear();
        } else {
            self.into = parent;
            self.prefix = path[known..].to_vec();
        }
        let (object, keys, span) = (self.into, self.prefix.clone(), head.span.clone());
        let (path, is_array, end) = (name, head.is_array, span.end);
        if !keys.is_empty() {
            // A header can declare a tag, too: `[tags.eye]`.
            let keys = keys.clone();
            self.outline.pairs.push(KeyPair { object, keys, outer: 0, value: end..end });
        }
        self.outline.headers.push(TableHeader { path, span, is_array, object, keys });
    }

    fn object(&mut self, kind: String, parent: usize, extent: Range<usize>) -> usize {
        self.latest.insert(kind.clone(), self.outline.objects.len());
        self.outline.objects.push(TableObject { kind, parent, extent, around: None });
        self.outline.objects.len() - 1
    }

    /// The latest object whose path begins a header's path, and the number of parts that the two
    /// paths share. A header of an array of tables belongs to an object above it.
    fn parent(&self, names: &[&str], is_array: bool) -> (usize, usize) {
        let most = names.len().saturating_sub(usize::from(is_array));
        for known in (1..=most).rev() {
            if let Some(last) = self.latest.get(&names[..known].join(".")) {
                return (*last, known);
            }
        }
        (0, 0)
    }

    /// Closes the open objects at a header or at the end of the file. Their extent ends with the
    /// last line before `at` that is neither a comment nor empty.
    fn close(&mut self, at: usize) {
        let end = self.outline.pairs.last().map_or(0, |pair| pair.value.end.max(pair.end()));
        let header = self.outline.headers.last().map_or(0, |header| header.span.end);
        let end = end.max(header).min(at);
        let mut object = self.into;
        while object != 0 {
            let table = &mut self.outline.objects[object];
            table.extent.end = table.extent.end.max(end);
            object = table.parent;
        }
    }

    /// Adds a key and its value. `outer`: the keys of the header and of the braces around them.
    fn pair(&mut self, pair: &TomlPair<'_>, object: usize, outer: Vec<KeyPart>, depth: usize) {
        let mut keys = outer;
        let outer = keys.len();
        keys.extend(parts(&pair.key));
        if keys.len() == outer {
            return;
        }
        let number = self.outline.pairs.len();
        let value = pair.value.span();
        self.outline.pairs.push(KeyPair { object, keys, outer, value });
        self.value(&pair.value, number, depth);
    }

    /// Adds a value of a pair, or an element of its array.
    fn value(&mut self, value: &Content<'_>, pair: usize, depth: usize) {
        match value {
            Content::Array(TomlArray { rows, .. }) if depth < DEPTH_MAX => {
                for row in rows {
                    match row {
                        TomlRow::Element(Content::Table(table), _) => {
                            self.row(table, pair, depth + 1);
                        }
                        TomlRow::Element(value, _) => self.value(value, pair, depth + 1),
                        TomlRow::Blank | TomlRow::Remark(_) => {}
                    }
                }
            }
            Content::Table(table) if depth < DEPTH_MAX => {
                let KeyPair { object, keys, .. } = &self.outline.pairs[pair];
                let (object, keys) = (*object, keys.clone());
                self.table(table, object, &keys, depth + 1);
            }
            Content::Scalar(text) if !text.is_empty() && !text.is_multi_line() => {
                let (span, inner) = (text.span(), text.unquoted().span());
                let is_string = text.quote().is_some();
                self.outline.values.push(OutlineValue { pair, span, inner, is_string });
            }
            Content::Array(_) | Content::Table(_) | Content::Scalar(_) => {}
        }
    }

    /// Adds an inline table in an array: it is an object of its own.
    fn row(&mut self, table: &InlineTable<'_>, pair: usize, depth: usize) {
        let key_pair = &self.outline.pairs[pair];
        let (kind, parent) = (self.outline.path(key_pair), key_pair.object);
        let object = self.object(kind, parent, table.brackets.span.clone());
        self.outline.objects[object].around = Some(pair);
        self.table(table, object, &[], depth);
    }

    fn table(&mut self, table: &InlineTable<'_>, object: usize, outer: &[KeyPart], depth: usize) {
        for pair in &table.pairs {
            self.pair(pair, object, outer.to_vec(), depth);
        }
    }
}

/// The parts of a key. No key of rungd has more parts, and to copy thousands of parts would take
/// long.
fn parts(key: &[TextSlice<'_>]) -> Vec<KeyPart> {
    let parts = key.iter().filter(|part| !part.is_empty()).take(PARTS_MAX);
    let part = |part: TextSlice<'_>| KeyPart { text: part.text().to_owned(), span: part.span() };
    parts.map(|slice| part(slice.unquoted())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> Vec<String> {
        let outline = read(text);
        let value = |value: &OutlineValue| {
            let pair = &outline.pairs[value.pair];
            let path = outline.path(pair);
            format!("{path} {}", &text[value.inner.clone()])
        };
        outline.values.iter().map(value).collect()
    }

    #[test]
    fn every_value_has_the_path_of_its_keys() {
        let text = "[tags]\neye = { at = \"X0\" }\n[[program]]\nname = 'Main'\n[[program.rung]]\n\
                    leg.up = [\"eye\", \"X1\"]\ndo = [\"CNT CT0 preset=3\"]\n";
        let wanted = [
            "tags.eye.at X0",
            "program.name Main",
            "program.rung.leg.up eye",
            "program.rung.leg.up X1",
            "program.rung.do CNT CT0 preset=3",
        ];
        assert_eq!(told(text), wanted);
    }

    #[test]
    fn tables_in_arrays_are_objects() {
        let text = "[[task]]\nname = \"T\"\nrung = [ { when = [\"$On\"] }, { do = [\"EXIT\"] } ]\n";
        let outline = read(text);
        let kinds: Vec<&str> = outline.objects.iter().map(|object| object.kind.as_str()).collect();
        assert_eq!(kinds, ["", "task", "task.rung", "task.rung"]);
        assert_eq!(told(text)[1..], ["task.rung.when $On", "task.rung.do EXIT"]);
        assert_eq!(&text[outline.objects[2].extent.clone()], "{ when = [\"$On\"] }");
    }

    #[test]
    fn an_unclosed_value_hides_nothing_after_its_line() {
        for broken in ["when = [\"X0\",", "when = [\"X0", "when = \"X0", "when =", "when", "w = {"]
        {
            let text = format!("[[program.rung]]\n{broken}\ndo = [\"OUT Y0\"]\n[tags]\na = 1\n");
            let values = told(&text);
            assert!(values.contains(&"program.rung.do OUT Y0".to_owned()), "{broken}: {values:?}");
            assert!(values.contains(&"tags.a 1".to_owned()), "{broken}: {values:?}");
        }
    }

    #[test]
    fn headers_without_brackets_add_to_the_keys_of_their_object() {
        let text =
            "[[template]]\n[template.parameters]\nx = { type = \"bit\" }\n[[template.rung]]\n";
        let outline = read(text);
        assert_eq!(told(text), ["template.parameters.x.type bit"]);
        let parents: Vec<usize> = outline.objects.iter().map(|object| object.parent).collect();
        assert_eq!(parents, [0, 0, 1]);
    }

    #[test]
    fn a_tag_may_have_a_header_or_dotted_keys() {
        let text = "[tags.eye]\nat = \"X0\"\n[tags]\njam.at = \"C0\"\njam.doc = \"d\"\n";
        assert_eq!(told(text), ["tags.eye.at X0", "tags.jam.at C0", "tags.jam.doc d"]);
        let outline = read(text);
        assert_eq!(outline.pairs[0].key().text, "eye");
        let value = outline.value_below(0, "at").expect("a value");
        assert_eq!(&text[value.inner.clone()], "X0");
    }
}
