//! Reads a text into a [`TomlTree`], token by token. No mistake stops it: an array that is not
//! closed ends before a line that begins with a header or a key, and an inline table with its line.
//!
//! A text that is TOML 1.0 has no such line within an array, so its tree is exact.
// `_` matches the kinds of tokens that have no meaning at that place; the parser defines the enum.
#![allow(clippy::wildcard_enum_match_arm)]

use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use super::statements::{is_name, looks_begun};
use super::toml_tree::{
    Brackets, Content, InlineTable, Piece, Tail, TextEnd, TextSlice, TomlArray, TomlHead, TomlPair,
    TomlRow, TomlTree,
};

/// The maximum depth of arrays and inline tables that are read; the parser refuses deeper ones.
const DEPTH_MAX: usize = 100;

/// The maximum column of comments behind lines.
const COLUMN_MAX: usize = 100;

impl<'a> TomlTree<'a> {
    /// The tree of a text.
    pub fn read(text: &'a str) -> TomlTree<'a> {
        let tokens = Source::new(text).lex().into_vec();
        let mut reader =
            TreeReader { text, tokens, at: 0, depth: 0, tables: 0, pieces: Vec::new() };
        reader.document()
    }
}

struct TreeReader<'a> {
    text: &'a str,
    tokens: Vec<Token>,
    at: usize,
    /// The number of open arrays and inline tables.
    depth: usize,
    /// How many of them are inline tables.
    tables: usize,
    pieces: Vec<Piece<'a>>,
}

impl<'a> TreeReader<'a> {
    fn kind(&self) -> TokenKind {
        self.tokens.get(self.at).map_or(TokenKind::Eof, Token::kind)
    }

    fn start(&self) -> usize {
        self.tokens.get(self.at).map_or(self.text.len(), |token| token.span().start())
    }

    /// The end of the last token that was read.
    fn end(&self) -> usize {
        let last = self.at.checked_sub(1).and_then(|last| self.tokens.get(last));
        last.map_or(0, |token| token.span().end())
    }

    /// Reads a token.
    fn take(&mut self) -> TextSlice<'a> {
        let start = self.start();
        self.at += 1;
        TextSlice::new(self.text, start..self.end())
    }

    fn skip_while(&mut self, is_skipped: impl Fn(TokenKind) -> bool) {
        while is_skipped(self.kind()) {
            self.at += 1;
        }
    }

    fn skip_spaces(&mut self) {
        self.skip_while(|kind| kind == TokenKind::Whitespace);
    }

    fn document(&mut self) -> TomlTree<'a> {
        use TokenKind as T;
        // Whether the line has only had spaces so far.
        let mut is_fresh = true;
        while self.kind() != T::Eof {
            match self.kind() {
                T::Whitespace => self.at += 1,
                T::Newline => {
                    self.at += 1;
                    if is_fresh && !matches!(self.pieces.last(), None | Some(Piece::Blank)) {
                        self.pieces.push(Piece::Blank);
                    }
                    is_fresh = true;
                }
                T::Comment => {
                    self.remark(is_fresh);
                    is_fresh = false;
                }
                _ => {
                    self.statement();
                    is_fresh = false;
                }
            }
        }
        let is_comment = |last: usize| self.tokens[last].kind() == T::Comment;
        let end = match self.at.checked_sub(1).is_some_and(is_comment) {
            true => TextEnd::Comment,
            false if is_fresh => TextEnd::LineStart,
            false => TextEnd::Statement,
        };
        TomlTree { pieces: std::mem::take(&mut self.pieces), end }
    }

    /// Reads a header or a pair, and skips the rest of its line up to a comment.
    fn statement(&mut self) {
        let piece = match self.kind() {
            TokenKind::LeftSquareBracket => Some(Piece::Head(self.head())),
            _ => self.pair().map(Piece::Pair),
        };
        self.pieces.extend(piece);
        use TokenKind::{Comment, Eof, Newline};
        self.skip_while(|kind| !matches!(kind, Newline | Comment | Eof));
    }

    /// Reads a comment: behind the last piece, or on a line of its own.
    fn remark(&mut self, is_fresh: bool) {
        let tail = self.tail();
        match self.pieces.last_mut() {
            Some(Piece::Head(head)) if !is_fresh => head.tail = Some(tail),
            Some(Piece::Pair(pair)) if !is_fresh => pair.tail = Some(tail),
            _ => self.pieces.push(Piece::Remark(tail.text)),
        }
    }

    fn tail(&mut self) -> Tail<'a> {
        let before = self.text.get(..self.start()).unwrap_or_default();
        let line = before.rfind('\n').map_or(0, |at| at + 1);
        let column = before[line..].chars().count().min(COLUMN_MAX);
        let text = self.take();
        Tail { text: text.text().trim_end_matches([' ', '\t', '\r']), column }
    }

    fn head(&mut self) -> TomlHead<'a> {
        let start = self.start();
        self.at += 1;
        let is_array = self.kind() == TokenKind::LeftSquareBracket;
        self.at += usize::from(is_array);
        let path = self.key();
        self.skip_while(|kind| kind == TokenKind::RightSquareBracket);
        TomlHead { path, is_array, span: start..self.end(), tail: None }
    }

    /// The parts of a key, up to its `=` or the end of the header; none if no key begins here.
    fn key(&mut self) -> Vec<TextSlice<'a>> {
        let mut parts = Vec::with_capacity(2);
        loop {
            self.skip_spaces();
            let is_part = is_key_part(self.kind());
            if is_part {
                parts.push(self.take());
                self.skip_spaces();
            } else if !parts.is_empty() {
                parts.push(TextSlice::new(self.text, self.start()..self.start()));
            }
            if !is_part || self.kind() != TokenKind::Dot {
                return parts;
            }
            self.at += 1;
        }
    }

    /// Reads a key and its value; `None` if no key begins here.
    fn pair(&mut self) -> Option<TomlPair<'a>> {
        let key = self.key();
        let end = key.last()?.unquoted().span().end;
        let is_assigned = self.kind() == TokenKind::Equals;
        let value = if is_assigned {
            self.at += 1;
            self.skip_spaces();
            self.value()
        } else {
            self.missing(end)
        };
        Some(TomlPair { key, is_assigned, value, tail: None })
    }

    fn missing(&self, place: usize) -> Content<'a> {
        Content::Scalar(TextSlice::new(self.text, place..place))
    }

    /// Reads a value; an empty one if none begins here.
    fn value(&mut self) -> Content<'a> {
        use TokenKind as T;
        match self.kind() {
            T::LeftSquareBracket if self.depth < DEPTH_MAX => Content::Array(self.array()),
            T::LeftCurlyBracket if self.depth < DEPTH_MAX => Content::Table(self.table()),
            T::BasicString | T::LiteralString | T::MlBasicString | T::MlLiteralString => {
                Content::Scalar(self.take())
            }
            T::Atom | T::Dot => {
                let start = self.start();
                // `1.5` is three tokens.
                self.skip_while(|kind| matches!(kind, T::Atom | T::Dot));
                if self.is_date_before_time(start) {
                    self.at += 1;
                    self.skip_while(|kind| matches!(kind, T::Atom | T::Dot));
                }
                Content::Scalar(TextSlice::new(self.text, start..self.end()))
            }
            _ => self.missing(self.start()),
        }
    }

    /// Whether a date from `start` on has been read, and a time follows behind one space:
    /// `1979-05-27 07:32:00`.
    fn is_date_before_time(&self, start: usize) -> bool {
        let is_date =
            self.end() - start == 10 && self.text.as_bytes().get(start + 4) == Some(&b'-');
        let mut rest = self.text.get(self.end()..).unwrap_or_default().bytes();
        is_date && rest.next() == Some(b' ') && rest.next().is_some_and(|b| b.is_ascii_digit())
    }

    fn array(&mut self) -> TomlArray<'a> {
        use TokenKind as T;
        let start = self.start();
        self.at += 1;
        self.depth += 1;
        let (mut array, mut is_fresh, mut is_closed) = (TomlArray::default(), false, false);
        array.brackets.is_open_for_next = true;
        while !is_closed && self.kind() != T::Eof {
            if is_fresh && self.begins_statement() {
                self.at = self.tokens[..self.at].iter().rposition(is_newline).unwrap_or(self.at);
                break;
            }
            match self.kind() {
                T::RightSquareBracket => is_closed = true,
                T::RightCurlyBracket if self.tables > 0 => break,
                T::Comma => array.brackets.is_open_for_next = true,
                T::Newline => {
                    array.line_end(is_fresh);
                    is_fresh = true;
                }
                T::Comment => {
                    let tail = self.tail();
                    array.remark(tail, is_fresh);
                    is_fresh = false;
                    continue;
                }
                T::Whitespace | T::Equals | T::RightCurlyBracket => {}
                _ => {
                    let begin = self.at;
                    let value = self.value();
                    is_fresh = false;
                    if self.at > begin {
                        array.add(value);
                        continue;
                    }
                }
            }
            self.at += 1;
        }
        self.depth -= 1;
        array.brackets = Brackets { span: start..self.end(), is_closed, ..array.brackets };
        array
    }

    /// Whether a statement begins here. A word alone at the end of the text is a key, too.
    fn begins_statement(&self) -> bool {
        let rest = self.text.get(self.start()..).unwrap_or_default();
        let is_in_key = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        looks_begun(rest) || is_name(rest) && rest.chars().all(is_in_key)
    }

    fn table(&mut self) -> InlineTable<'a> {
        use TokenKind as T;
        let start = self.start();
        self.at += 1;
        (self.depth, self.tables) = (self.depth + 1, self.tables + 1);
        let (mut pairs, mut is_closed, mut is_open_for_next) = (Vec::new(), false, true);
        while !is_closed {
            match self.kind() {
                T::Newline | T::Comment | T::Eof | T::RightSquareBracket => break,
                T::RightCurlyBracket => is_closed = true,
                T::Comma => is_open_for_next = true,
                T::Whitespace => {}
                _ => {
                    if let Some(pair) = self.pair() {
                        pairs.push(pair);
                        is_open_for_next = false;
                        continue;
                    }
                }
            }
            self.at += 1;
        }
        (self.depth, self.tables) = (self.depth - 1, self.tables - 1);
        let brackets = Brackets { span: start..self.end(), is_closed, is_open_for_next };
        InlineTable { pairs, brackets }
    }
}

fn is_newline(token: &Token) -> bool {
    token.kind() == TokenKind::Newline
}

fn is_key_part(kind: TokenKind) -> bool {
    matches!(kind, TokenKind::Atom | TokenKind::BasicString | TokenKind::LiteralString)
}

impl<'a> TomlArray<'a> {
    fn add(&mut self, value: Content<'a>) {
        self.is_split |= matches!(&value, Content::Array(inner) if inner.is_split);
        self.has_remarks |= value.has_remarks();
        self.brackets.is_open_for_next = false;
        self.rows.push(TomlRow::Element(value, None));
    }

    /// A comment: on a line of its own, or behind an element or the bracket.
    fn remark(&mut self, tail: Tail<'a>, is_fresh: bool) {
        self.has_remarks = true;
        let is_first = self.rows.is_empty() && self.opening.is_none();
        match self.rows.last_mut() {
            Some(TomlRow::Element(_, behind @ None)) if !is_fresh => *behind = Some(tail),
            None if !is_fresh && is_first => self.opening = Some(tail),
            _ => self.rows.push(TomlRow::Remark(tail.text)),
        }
    }

    fn line_end(&mut self, is_fresh: bool) {
        self.is_split = true;
        if is_fresh && matches!(self.rows.last(), Some(TomlRow::Element(..) | TomlRow::Remark(_))) {
            self.rows.push(TomlRow::Blank);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the headers, and the keys with their values; the values are shown without spaces.
    fn check(text: &str, expected: &[&str]) {
        let shown = |piece: &Piece<'_>| match piece {
            Piece::Head(head) => Some(text[head.span.clone()].to_owned()),
            Piece::Pair(pair) => Some(pair_text(pair)),
            Piece::Blank | Piece::Remark(_) => None,
        };
        let found: Vec<String> = TomlTree::read(text).pieces.iter().filter_map(shown).collect();
        assert_eq!(found, expected, "{text}");
    }

    fn pair_text(pair: &TomlPair<'_>) -> String {
        let key: Vec<&str> = pair.key.iter().map(|part| part.text()).collect();
        format!("{}={}", key.join("."), value_text(&pair.value))
    }

    fn value_text(value: &Content<'_>) -> String {
        match value {
            Content::Scalar(text) => text.text().to_owned(),
            Content::Array(array) => {
                let rows: Vec<String> =
                    array.rows.iter().filter_map(TomlRow::element).map(value_text).collect();
                format!("[{}]", rows.join(","))
            }
            Content::Table(table) => {
                let pairs: Vec<String> = table.pairs.iter().map(pair_text).collect();
                format!("{{{}}}", pairs.join(","))
            }
        }
    }

    #[test]
    fn valid_toml_is_read_exactly() {
        check(
            "a.'b c' = [ # one\n  [true, 1.5],\n  [inf],\n\n]\n[t]\n\
             at = 1979-05-27 07:32:00 # two\n\
             s = '''\n[[x]]\ny = 1\n'''\nw = { x = [\n{ y = 1 },\n] }",
            &[
                "a.'b c'=[[true,1.5],[inf]]",
                "[t]",
                "at=1979-05-27 07:32:00",
                "s='''\n[[x]]\ny = 1\n'''",
                "w={x=[{y=1}]}",
            ],
        );
    }

    #[test]
    fn an_unclosed_value_ends_before_the_next_statement() {
        check("a = [\"x\",\nb = 1", &["a=[\"x\"]", "b=1"]);
        check("a = [\"x\n[[t]]\nb = \"y\nc.d", &["a=[\"x]", "[[t]]", "b=\"y", "c.d="]);
        check("[[t]\n'q' = { x = [1,\n\"r\" = 2", &["[[t]", "'q'={x=[1]}", "\"r\"=2"]);
    }

    #[test]
    fn an_unclosed_row_ends_with_its_line() {
        check("r = [\n{ a = 1, b\n{ a = 2 },\n]", &["r=[{a=1,b=},{a=2}]"]);
        check("r = [{ a = [1 }, { a = 2 ]", &["r=[{a=[1]},{a=2}]"]);
    }

    #[test]
    fn the_tree_knows_whether_a_text_ends_in_a_statement_or_a_comment() {
        let end = |text| TomlTree::read(text).end;
        assert_eq!(["", "a = 1\n  "].map(end), [TextEnd::LineStart; 2]);
        assert_eq!(["# a", "a = [ # b"].map(end), [TextEnd::Comment; 2]);
        assert_eq!(["a", "a = ", "a = [\n", "[t]"].map(end), [TextEnd::Statement; 4]);
    }
}
