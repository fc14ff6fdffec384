//! Reads a text into an `outline`, token by token. No syntax error stops it: it starts again at
//! each line that begins with a key or a header, whatever was left open before.

// `_` matches the kinds of tokens that have no meaning at that place; the parser defines the enum.
#![allow(clippy::wildcard_enum_match_arm)]

use std::collections::HashMap;
use std::ops::Range;

use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use super::outline::{KeyPair, KeyPart, Outline, OutlineValue, TableHeader, TableObject};

/// The maximum depth of arrays and inline tables that are read.
const DEPTH_MAX: usize = 8;
/// The maximum number of parts of a key that are kept.
const PARTS_MAX: usize = 16;

/// The outline of a text.
pub(super) fn read(text: &str) -> Outline {
    let tokens: Vec<Token> = Source::new(text).lex().collect();
    let root = TableObject { kind: String::new(), parent: 0, extent: 0..text.len() };
    let mut outline = Outline::default();
    outline.objects.push(root);
    let open = TableHeader { path: String::new(), span: 0..0, is_array: false };
    let (prefix, latest) = (Vec::new(), HashMap::new());
    let mut reader = OutlineReader { text, tokens, at: 0, outline, open, prefix, into: 0, latest };
    reader.document();
    reader.close(text.trim_end().len());
    reader.outline.indexed()
}

/// The state while a text is read into an outline.
struct OutlineReader<'t> {
    text: &'t str,
    tokens: Vec<Token>,
    at: usize,
    outline: Outline,
    /// The last header.
    open: TableHeader,
    /// The keys that the last header puts before the keys below it.
    prefix: Vec<KeyPart>,
    /// The object that keys belong to now.
    into: usize,
    /// The latest object of each kind.
    latest: HashMap<String, usize>,
}

impl OutlineReader<'_> {
    fn kind(&self) -> TokenKind {
        self.tokens.get(self.at).map_or(TokenKind::Eof, Token::kind)
    }

    fn span(&self) -> Range<usize> {
        self.tokens.get(self.at).map_or(self.text.len()..self.text.len(), |token| {
            token.span().start()..token.span().end()
        })
    }

    fn skip(&mut self, kinds: &[TokenKind]) {
        while kinds.contains(&self.kind()) {
            self.at += 1;
        }
    }

    /// Skips to the end of the line.
    fn skip_line(&mut self) {
        while !matches!(self.kind(), TokenKind::Newline | TokenKind::Eof) {
            self.at += 1;
        }
    }

    fn document(&mut self) {
        loop {
            self.skip(&[TokenKind::Whitespace, TokenKind::Newline, TokenKind::Comment]);
            match self.kind() {
                TokenKind::Eof => return,
                TokenKind::LeftSquareBracket => self.header(),
                _ => {
                    let begin = self.at;
                    self.pair(self.into, self.prefix.clone(), 0);
                    if self.at == begin {
                        self.at += 1;
                    }
                    self.skip_line();
                }
            }
        }
    }

    fn header(&mut self) {
        let begin = self.span().start;
        self.close(begin);
        self.at += 1;
        let is_array = self.kind() == TokenKind::LeftSquareBracket;
        self.at += usize::from(is_array);
        let path = self.keys();
        while self.kind() == TokenKind::RightSquareBracket {
            self.at += 1;
        }
        let end = self.tokens[self.at - 1].span().end();
        self.skip_line();
        let names: Vec<&str> = path.iter().map(|key| key.text.as_str()).collect();
        self.open = TableHeader { path: names.join("."), span: begin..end, is_array };
        let (parent, known) = self.parent(&names, is_array);
        if is_array {
            let kind = names.join(".");
            self.into = self.object(kind, parent, begin..end);
            self.prefix.clear();
        } else {
            self.into = parent;
            self.prefix = path[known..].to_vec();
        }
        let TableHeader { path, span, is_array } = &self.open;
        let header = TableHeader { path: path.clone(), span: span.clone(), is_array: *is_array };
        self.outline.headers.push(header);
        if !is_array && !self.prefix.is_empty() {
            // A header can declare a tag, too: `[tags.eye]`.
            let (object, keys, value) = (self.into, self.prefix.clone(), end..end);
            self.outline.pairs.push(KeyPair { object, keys, outer: 0, value });
        }
    }

    fn object(&mut self, kind: String, parent: usize, extent: Range<usize>) -> usize {
        self.latest.insert(kind.clone(), self.outline.objects.len());
        self.outline.objects.push(TableObject { kind, parent, extent });
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
        let end = end.max(self.open.span.end).min(at);
        let mut object = self.into;
        while object != 0 {
            let of = &mut self.outline.objects[object];
            of.extent.end = of.extent.end.max(end);
            object = of.parent;
        }
    }

    /// The parts of a dotted key.
    fn keys(&mut self) -> Vec<KeyPart> {
        let mut keys = Vec::new();
        loop {
            self.skip(&[TokenKind::Whitespace]);
            let span = self.span();
            let part = match self.kind() {
                TokenKind::Atom => span,
                TokenKind::BasicString | TokenKind::LiteralString => unquoted(self.text, span),
                _ => return keys,
            };
            // No key of rungd has more parts, and to copy thousands of parts would take long.
            if keys.len() < PARTS_MAX {
                keys.push(KeyPart { text: self.text[part.clone()].to_owned(), span: part });
            }
            self.at += 1;
            self.skip(&[TokenKind::Whitespace]);
            if self.kind() != TokenKind::Dot {
                return keys;
            }
            self.at += 1;
        }
    }

    /// Reads a key and its value. `outer`: the keys of the header and of the braces around them.
    fn pair(&mut self, object: usize, outer: Vec<KeyPart>, depth: usize) {
        let mut keys = outer;
        let known = keys.len();
        keys.extend(self.keys());
        if keys.len() == known {
            return;
        }
        let number = self.outline.pairs.len();
        let end = keys[keys.len() - 1].span.end;
        self.outline.pairs.push(KeyPair { object, keys, outer: known, value: end..end });
        if self.kind() != TokenKind::Equals {
            return;
        }
        self.at += 1;
        self.skip(&[TokenKind::Whitespace]);
        let begin = self.span().start;
        self.value(number, false, depth);
        let end = self.tokens[self.at - 1].span().end().max(begin);
        self.outline.pairs[number].value = begin..end;
    }

    /// Reads a value of a pair; `is_item`: the value is an element of an array.
    fn value(&mut self, pair: usize, is_item: bool, depth: usize) {
        let span = self.span();
        match self.kind() {
            TokenKind::LeftSquareBracket if depth < DEPTH_MAX => self.array(pair, depth + 1),
            TokenKind::LeftCurlyBracket if depth < DEPTH_MAX => {
                self.table(pair, is_item, depth + 1)
            }
            TokenKind::BasicString | TokenKind::LiteralString => {
                let inner = unquoted(self.text, span.clone());
                let value = OutlineValue { pair, span, inner, is_string: true };
                self.outline.values.push(value);
                self.at += 1;
            }
            TokenKind::Atom => {
                let begin = span.start;
                // `1.5` is three tokens.
                while matches!(self.kind(), TokenKind::Atom | TokenKind::Dot) {
                    self.at += 1;
                }
                let span = begin..self.tokens[self.at - 1].span().end();
                let value =
                    OutlineValue { pair, span: span.clone(), inner: span, is_string: false };
                self.outline.values.push(value);
            }
            TokenKind::MlBasicString | TokenKind::MlLiteralString => self.at += 1,
            TokenKind::LeftSquareBracket
            | TokenKind::LeftCurlyBracket
            | TokenKind::RightSquareBracket
            | TokenKind::RightCurlyBracket
            | TokenKind::Dot
            | TokenKind::Equals
            | TokenKind::Comma
            | TokenKind::Comment
            | TokenKind::Whitespace
            | TokenKind::Newline
            | TokenKind::Eof => {}
        }
    }

    fn array(&mut self, pair: usize, depth: usize) {
        self.at += 1;
        loop {
            let begins_line = self.skip_to_item();
            match self.kind() {
                TokenKind::Eof => return,
                TokenKind::RightSquareBracket => {
                    self.at += 1;
                    return;
                }
                _ if begins_line && self.begins_statement() => {
                    // The caller skips the line end before the statement.
                    while self.kind() != TokenKind::Newline {
                        self.at -= 1;
                    }
                    return;
                }
                TokenKind::Comma => self.at += 1,
                _ => {
                    let begin = self.at;
                    self.value(pair, true, depth);
                    self.at += usize::from(self.at == begin);
                }
            }
        }
    }

    /// Skips spaces, line ends and comments. Returns whether a line end was among them.
    fn skip_to_item(&mut self) -> bool {
        let begin = self.at;
        self.skip(&[TokenKind::Whitespace, TokenKind::Newline, TokenKind::Comment]);
        let skipped = &self.tokens[begin.min(self.tokens.len())..self.at.min(self.tokens.len())];
        skipped.iter().any(|token| token.kind() == TokenKind::Newline)
    }

    /// Whether a header, or a key with its `=`, begins here: the array before is then not closed.
    fn begins_statement(&self) -> bool {
        let mut rest = self.tokens[self.at..].iter().map(Token::kind);
        match rest.next() {
            Some(TokenKind::LeftSquareBracket) => true,
            Some(TokenKind::Atom | TokenKind::BasicString | TokenKind::LiteralString) => {
                let is_part = |kind: &TokenKind| {
                    matches!(kind, TokenKind::Dot | TokenKind::Atom | TokenKind::Whitespace)
                };
                rest.find(|kind| !is_part(kind)) == Some(TokenKind::Equals)
            }
            Some(_) | None => false,
        }
    }

    /// Reads an inline table. In an array it is an object of its own; elsewhere its keys are
    /// further keys of the pair.
    fn table(&mut self, pair: usize, is_item: bool, depth: usize) {
        let begin = self.span().start;
        self.at += 1;
        let of = &self.outline.pairs[pair];
        let (object, keys) = (of.object, of.keys.clone());
        let (object, keys) = match is_item {
            true => {
                let kind = self.outline.path(&self.outline.pairs[pair]);
                (self.object(kind, object, begin..begin), Vec::new())
            }
            false => (object, keys),
        };
        loop {
            self.skip(&[TokenKind::Whitespace, TokenKind::Comma]);
            match self.kind() {
                TokenKind::RightCurlyBracket => {
                    self.at += 1;
                    break;
                }
                TokenKind::Newline | TokenKind::Comment | TokenKind::Eof => break,
                _ => {
                    let before = self.at;
                    self.pair(object, keys.clone(), depth);
                    self.at += usize::from(self.at == before);
                }
            }
        }
        if is_item {
            self.outline.objects[object].extent.end = self.tokens[self.at - 1].span().end();
        }
    }
}

/// The place of a string without its quotes; the closing quote may be missing.
fn unquoted(text: &str, span: Range<usize>) -> Range<usize> {
    let raw = &text[span.clone()];
    let quote = raw.chars().next().filter(|quote| matches!(quote, '"' | '\''));
    let Some(quote) = quote else { return span };
    let closed = raw.len() >= 2 && raw.ends_with(quote);
    span.start + 1..span.end - usize::from(closed)
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
    fn values_have_paths() {
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
    fn what_is_not_closed_hides_nothing_behind_its_line() {
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
