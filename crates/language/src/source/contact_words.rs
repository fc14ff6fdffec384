//! Findings about words and numbers where contacts need a sign or a compare: `X0 AND X1`,
//! `flags & 0x0F`.
//!
//! Part of the parser of contacts, which calls it when it cannot go on.

use super::atom::Atom;
use super::contact_habits::masked;
use super::contact_lexer::Token;
use super::contact_use::ContactUse;
use super::finding::{Code, Finding};
use super::fix::{Help, advise, possible, write};
use super::foreign_signs;
use super::span::Span;

/// The tokens of contacts, and the place of the next one.
pub(super) struct TokensAround<'t> {
    pub text: &'t str,
    pub span: Span,
    pub tokens: &'t [(Token, Span)],
    pub at: usize,
}

impl TokensAround<'_> {
    /// The finding for a number that was just read, if `&` or `|` joins it with a word.
    pub(super) fn mask(&self, number: &Atom, used: ContactUse) -> Option<Finding> {
        let read = &self.tokens[..self.at];
        let [.., (Token::Atom(word), _), (Token::And | Token::Or, sign), _] = read else {
            return None;
        };
        let text = |span: Span| {
            &self.text
                [(span.start - self.span.start) as usize..(span.end - self.span.start) as usize]
        };
        let (written, sign) = (text(number.span), text(*sign));
        let closes = |token: &&(Token, Span)| token.0 == Token::Close;
        let opens = read[..read.len() - 3].iter().rev().take_while(|token| token.0 == Token::Open);
        let opens = opens.count();
        let closed = self.tokens[self.at..].iter().take_while(closes).count();
        let end = self.at + closed;
        let (compare, end) = match &self.tokens[end..] {
            [(Token::Compare(how), _), (Token::Atom(atom), _), ..] => {
                (format!("{} {atom}", how.sign()), end + 2)
            }
            _ => ("!= 0".to_owned(), self.at + closed.min(opens)),
        };
        let place = read[read.len() - 3 - closed.min(opens)].1.to(self.tokens[end - 1].1);
        let formula = format!("{} {sign} {written}", word.name()?);
        let help = masked(&formula, &compare, used, place);
        let message = format!("`{written}` is a number, not a contact");
        let finding = Finding::new(Code::ContactSyntax, number.span, message);
        Some(finding.help(help))
    }

    /// The place and the help of a word that other notations have instead of a sign. The word is at
    /// the given place, or just before it.
    pub(super) fn habit(&self, place: Span) -> Option<(Span, Help)> {
        let at = self.tokens.iter().position(|(_, span)| *span == place)?;
        let first = self.tokens.first()?.1;
        let words = [self.tokens.get(at), at.checked_sub(1).and_then(|at| self.tokens.get(at))];
        words.into_iter().flatten().find_map(|(token, span)| {
            let Token::Atom(atom) = token else { return None };
            let name = atom.name()?;
            let help = match name.to_ascii_lowercase().as_str() {
                "or" if *span == first => advise(
                    "`|` stands between two contacts of one text: `{}`",
                    [possible("X0 | X1").at(self.span)],
                ),
                "rise" => "write `rise(…)`".into(),
                "fall" => "write `fall(…)`".into(),
                _ => write(foreign_signs::of_word(name)?.contact),
            };
            Some((*span, help))
        })
    }
}
