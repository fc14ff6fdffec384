//! Reads a text into its [`Piece`]s, from the events of the TOML parser.
//!
//! Called by `format` for texts that are valid TOML. It checks nothing; for an invalid text it
//! makes pieces of the parts that it recognizes, or none.

use toml_parser::Source;
use toml_parser::parser::{Event, EventKind, RecursionGuard, parse_document};

use super::tree::{Array, Content, Head, Pair, Piece, Row, Tail};

/// Nesting limit of values. The reader has already refused values that are deeper.
const DEPTH_MAX: u32 = 100;

/// The maximum column of comments behind lines.
const COLUMN_MAX: usize = 100;

/// The pieces of a text, in their order.
pub(super) fn pieces(text: &str) -> Vec<Piece<'_>> {
    let tokens = Source::new(text).lex().into_vec();
    let mut events = Vec::with_capacity(tokens.len());
    let mut receiver = |event: Event| events.push(event);
    let mut guard = RecursionGuard::new(&mut receiver, DEPTH_MAX);
    parse_document(&tokens, &mut guard, &mut ());
    let mut parser = EventReader { text, events, at: 0, pieces: Vec::new(), is_fresh: true };
    while parser.piece().is_some() {}
    parser.pieces
}

struct EventReader<'a> {
    text: &'a str,
    events: Vec<Event>,
    at: usize,
    pieces: Vec<Piece<'a>>,
    /// Whether the line has only had spaces so far.
    is_fresh: bool,
}

impl<'a> EventReader<'a> {
    fn peek(&self) -> Option<EventKind> {
        self.events.get(self.at).map(Event::kind)
    }

    /// Takes the next event, and returns its text.
    fn take(&mut self) -> &'a str {
        let event = self.events.get(self.at);
        self.at += 1;
        let range = event.map_or(0..0, |event| event.span().start()..event.span().end());
        self.text.get(range).unwrap_or_default()
    }

    fn skip_spaces(&mut self) {
        while self.peek() == Some(EventKind::Whitespace) {
            self.at += 1;
        }
    }

    /// Takes the next piece. `None` at the end.
    fn piece(&mut self) -> Option<()> {
        use EventKind as E;
        match self.peek()? {
            E::StdTableOpen => self.head(false),
            E::ArrayTableOpen => self.head(true),
            E::SimpleKey => {
                let key = self.key();
                let value = self.value();
                self.pieces.push(Piece::Pair(Pair { key, value, tail: None }));
                self.is_fresh = false;
            }
            E::Comment => self.remark(),
            E::Newline => {
                self.at += 1;
                if self.is_fresh && !matches!(self.pieces.last(), None | Some(Piece::Blank)) {
                    self.pieces.push(Piece::Blank);
                }
                self.is_fresh = true;
            }
            E::Whitespace
            | E::StdTableClose
            | E::ArrayTableClose
            | E::InlineTableOpen
            | E::InlineTableClose
            | E::ArrayOpen
            | E::ArrayClose
            | E::KeySep
            | E::KeyValSep
            | E::Scalar
            | E::ValueSep
            | E::Error => self.at += 1,
        }
        Some(())
    }

    /// A comment: behind the last piece, or on a line of its own.
    fn remark(&mut self) {
        let is_fresh = self.is_fresh;
        let tail = self.tail();
        match self.pieces.last_mut() {
            Some(Piece::Head(head)) if !is_fresh => head.tail = Some(tail),
            Some(Piece::Pair(pair)) if !is_fresh => pair.tail = Some(tail),
            _ => self.pieces.push(Piece::Remark(tail.text)),
        }
        self.is_fresh = false;
    }

    fn tail(&mut self) -> Tail<'a> {
        let start = self.events.get(self.at).map_or(0, |event| event.span().start());
        let before = self.text.get(..start).unwrap_or_default();
        let line = before.rfind('\n').map_or(0, |at| at + 1);
        let column = before[line..].chars().count().min(COLUMN_MAX);
        Tail { text: self.take().trim_end_matches([' ', '\t', '\r']), column }
    }

    fn head(&mut self, is_array: bool) {
        self.at += 1;
        let path = self.key();
        self.pieces.push(Piece::Head(Head { path, is_array, tail: None }));
        self.is_fresh = false;
    }

    /// The parts of a key, up to its `=` or the end of the header.
    fn key(&mut self) -> Vec<&'a str> {
        let mut parts = Vec::with_capacity(2);
        loop {
            let kind = self.peek();
            if kind == Some(EventKind::SimpleKey) {
                parts.push(self.take());
            } else if matches!(kind, Some(EventKind::Whitespace | EventKind::KeySep)) {
                self.at += 1;
            } else {
                return parts;
            }
        }
    }

    fn value(&mut self) -> Content<'a> {
        self.skip_spaces();
        if self.peek() == Some(EventKind::KeyValSep) {
            self.at += 1;
            self.skip_spaces();
        }
        let kind = self.peek();
        if kind == Some(EventKind::ArrayOpen) {
            Content::Array(self.array())
        } else if kind == Some(EventKind::InlineTableOpen) {
            Content::Table(self.table())
        } else {
            Content::Scalar(self.take())
        }
    }

    fn table(&mut self) -> Vec<Pair<'a>> {
        self.at += 1;
        let mut pairs = Vec::new();
        while let Some(kind) = self.peek() {
            if kind == EventKind::SimpleKey {
                let key = self.key();
                let value = self.value();
                pairs.push(Pair { key, value, tail: None });
                continue;
            }
            self.at += 1;
            if kind == EventKind::InlineTableClose {
                break;
            }
        }
        pairs
    }

    fn array(&mut self) -> Array<'a> {
        use EventKind as E;
        self.at += 1;
        let (mut array, mut is_fresh) = (Array::default(), false);
        while let Some(kind) = self.peek() {
            if matches!(kind, E::ArrayOpen | E::InlineTableOpen | E::Scalar) {
                let value = self.value();
                array.add(value);
                is_fresh = false;
            } else if kind == E::Comment {
                let tail = self.tail();
                array.remark(tail, is_fresh);
                is_fresh = false;
            } else {
                self.at += 1;
                if kind == E::ArrayClose {
                    break;
                } else if kind == E::Newline {
                    array.line_end(is_fresh);
                    is_fresh = true;
                }
                // A comma at the beginning of a line belongs to the line before.
            }
        }
        array
    }
}

impl<'a> Array<'a> {
    fn add(&mut self, value: Content<'a>) {
        self.is_split |= matches!(&value, Content::Array(inner) if inner.is_split);
        self.has_remarks |= value.has_remarks();
        self.rows.push(Row::Element(value, None));
    }

    /// A comment: on a line of its own, or behind an element or the bracket.
    fn remark(&mut self, tail: Tail<'a>, is_fresh: bool) {
        self.has_remarks = true;
        let is_first = self.rows.is_empty() && self.opening.is_none();
        match self.rows.last_mut() {
            Some(Row::Element(_, behind @ None)) if !is_fresh => *behind = Some(tail),
            None if !is_fresh && is_first => self.opening = Some(tail),
            _ => self.rows.push(Row::Remark(tail.text)),
        }
    }

    fn line_end(&mut self, is_fresh: bool) {
        self.is_split = true;
        if is_fresh && matches!(self.rows.last(), Some(Row::Element(..) | Row::Remark(_))) {
            self.rows.push(Row::Blank);
        }
    }
}
