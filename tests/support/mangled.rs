//! A TOML file in a random layout, with the same meaning: different spaces, line ends within
//! arrays, blank lines, comments, and a different order of neighbouring keys.

use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

/// SplitMix64.
pub struct Chance(pub u64);

impl Chance {
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % limit
    }

    fn spaces(&mut self) -> &'static str {
        ["", " ", " ", "  ", "\t", "      "][self.below(6) as usize]
    }
}

/// The text of a header, of a key with its value, or of a comment; empty for a blank line.
struct Statement {
    text: String,
    is_pair: bool,
}

/// The same file in a random layout.
pub fn mangled(text: &str, seed: u64) -> String {
    let chance = &mut Chance(seed);
    let mut statements = Vec::new();
    let mut open: Vec<TokenKind> = Vec::new();
    let (mut line, mut is_pair, mut before) = (String::new(), false, TokenKind::Newline);
    for token in Source::new(text).lex() {
        let kind = token.kind();
        let is_value = is_pair && kind == TokenKind::LeftSquareBracket;
        if is_value || kind == TokenKind::LeftCurlyBracket {
            open.push(kind);
        }
        if open.is_empty() && matches!(kind, TokenKind::Newline | TokenKind::Eof) {
            let text = std::mem::take(&mut line);
            statements.push(Statement { text: text.trim().to_owned(), is_pair });
            is_pair = false;
        } else {
            write(token, text, &TokenContext { open: &open, before }, &mut line, chance);
        }
        is_pair |= open.is_empty() && kind == TokenKind::Equals;
        let closes = [TokenKind::RightSquareBracket, TokenKind::RightCurlyBracket];
        if closes.contains(&kind) {
            open.pop();
        }
        if kind != TokenKind::Whitespace {
            before = kind;
        }
    }
    while statements.last().is_some_and(|last| last.text.is_empty()) {
        statements.pop();
    }
    shuffle(&mut statements, chance);
    joined(&statements, chance)
}

/// What is before a token.
struct TokenContext<'o> {
    /// The brackets that are open.
    open: &'o [TokenKind],
    /// The last token that is not white space.
    before: TokenKind,
}

/// Writes a token, with random spaces and line ends.
fn write(token: Token, text: &str, context: &TokenContext, line: &mut String, chance: &mut Chance) {
    let TokenContext { open, before } = *context;
    let own = &text[token.span().start()..token.span().end()];
    let in_table = open.contains(&TokenKind::LeftCurlyBracket);
    let in_array = !open.is_empty() && !in_table;
    let starts_array = open.len() == 1 && own == "[";
    match token.kind() {
        TokenKind::Whitespace => line.push_str(chance.spaces()),
        TokenKind::Newline if before != TokenKind::Comment && chance.below(3) == 0 => {}
        TokenKind::Newline => line.push('\n'),
        TokenKind::Equals => {
            line.push_str(chance.spaces());
            line.push('=');
            line.push_str(chance.spaces());
        }
        TokenKind::Comma if in_array && chance.below(3) == 0 => line_end(",", line, chance),
        TokenKind::LeftSquareBracket if in_array && starts_array && chance.below(3) == 0 => {
            line_end("[", line, chance);
        }
        _ => line.push_str(own),
    }
}

/// Writes a mark and a line end, and sometimes a comment.
fn line_end(mark: &str, line: &mut String, chance: &mut Chance) {
    line.push_str(mark);
    match chance.below(6) {
        0 => line.push_str(&format!("{}# at {}\n", chance.spaces(), chance.below(1000))),
        1 => line.push_str(&format!("\n{}# on {}\n", chance.spaces(), chance.below(1000))),
        2 => line.push_str("\n\n"),
        _ => line.push('\n'),
    }
}

/// Swaps some neighbouring keys.
fn shuffle(statements: &mut [Statement], chance: &mut Chance) {
    for at in 1..statements.len() {
        let [a, b] = &mut statements[at - 1..=at] else { continue };
        if a.is_pair && b.is_pair && chance.below(2) == 0 {
            std::mem::swap(a, b);
        }
    }
}

fn joined(statements: &[Statement], chance: &mut Chance) -> String {
    let mut text = String::new();
    for statement in statements {
        let number = chance.below(1000);
        match chance.below(12) {
            0 => text.push('\n'),
            1 => text.push_str("\n  \n\n"),
            2 => text.push_str(&format!("{}# above {number}  \n", chance.spaces())),
            3 => text.push_str(&format!("# alone {number}\n\n")),
            _ => {}
        }
        text.push_str(chance.spaces());
        text.push_str(&statement.text);
        let has_comment = statement.text.lines().last().is_some_and(|line| line.contains('#'));
        if !has_comment && !statement.text.is_empty() && chance.below(8) == 0 {
            text.push_str(&format!("{}# behind {number}", chance.spaces()));
        }
        text.push_str(chance.spaces());
        text.push('\n');
    }
    text
}
