//! The tokens of a string of contacts, and the place of the next one.
//!
//! `contact_parser` reads contacts from them, and `side_parser` the sides of compares.

use super::contact_lexer::Token;
use super::contact_use::ContactUse;
use super::contact_words::TokensAround;
use super::finding::{Code, Finding};
use super::span::Span;

/// The tokens of a string, and the place of the next one.
pub(super) struct Parser<'a> {
    pub(super) text: &'a str,
    pub(super) span: Span,
    pub(super) tokens: Vec<(Token, Span)>,
    pub(super) at: usize,
    pub(super) used: ContactUse,
}

impl Parser<'_> {
    pub(super) fn peek(&self) -> Option<(&Token, Span)> {
        self.tokens.get(self.at).map(|(token, span)| (token, *span))
    }

    pub(super) fn next(&mut self) -> Option<(Token, Span)> {
        let token = self.tokens.get(self.at).cloned();
        self.at += usize::from(token.is_some());
        token
    }

    pub(super) fn around(&self) -> TokensAround<'_> {
        let (tokens, at) = (&*self.tokens, self.at);
        TokensAround { text: self.text, span: self.span, tokens, at }
    }

    pub(super) fn take(&mut self, wanted: &Token) -> Option<Span> {
        let (token, span) = self.peek()?;
        if token != wanted {
            return None;
        }
        self.at += 1;
        Some(span)
    }

    /// The place after the last byte.
    pub(super) fn end(&self) -> Span {
        Span { start: self.span.end, ..self.span }
    }

    pub(super) fn error(&self, place: Span, message: impl Into<String>) -> Finding {
        Finding::new(Code::ContactSyntax, place, message)
    }
}
