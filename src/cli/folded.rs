//! Folds the long lines of drawn findings for a terminal: titles and helps, at spaces.
//!
//! A terminal breaks a long line within a word, and begins the rest at its edge, below the place of
//! the finding. Lines with source text stay as they are: their marks stand below them. A text in
//! backticks stays whole if it has room, because a reader copies it.

/// The most columns, as in the log on a terminal.
pub(super) const COLUMNS_MAX: usize = 100;
/// The fewest columns: in less room a terminal breaks lines by itself.
const COLUMNS_MIN: usize = 40;

/// The text with its titles and helps folded.
pub(super) fn folded(drawn: &str, columns: usize) -> String {
    let columns = columns.clamp(COLUMNS_MIN, COLUMNS_MAX);
    let lines = drawn.split_inclusive('\n');
    lines.map(|line| fold(line, columns)).collect()
}

fn fold(line: &str, columns: usize) -> String {
    let (text, end) = match line.strip_suffix('\n') {
        Some(text) => (text, "\n"),
        None => (line, ""),
    };
    let Some(indent) = indent(&without_codes(text)).filter(|_| width(text) > columns) else {
        return line.to_owned();
    };
    let (mut told, mut used) = (String::new(), 0);
    for word in words(text, columns - indent) {
        let length = width(word);
        let is_first = told.is_empty();
        if !is_first && used + 1 + length > columns {
            told.push('\n');
            told.push_str(&" ".repeat(indent));
            used = indent;
        } else if !is_first {
            told.push(' ');
            used += 1;
        }
        told.push_str(word);
        used += length;
    }
    told + end
}

/// The column at which the rest of a long line goes on; `None`: the line shows source text.
fn indent(text: &str) -> Option<usize> {
    let body = text.trim_start();
    let before = text.len() - body.len();
    let is_source = body.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    if is_source.starts_with('|') || body.starts_with("-->") || body.starts_with(":::") {
        return None;
    }
    match body.strip_prefix("= ").and_then(|rest| rest.split_once(": ")) {
        Some((kind, _)) => Some(before + kind.len() + 4),
        None if before > 0 => Some(before),
        None => Some(2),
    }
}

/// The words of a line, with the spaces before the first one; a text in backticks is one word if it
/// has room.
fn words(text: &str, room: usize) -> Vec<&str> {
    let (mut words, mut begin, mut quote) = (Vec::new(), 0, None);
    let first = text.len() - text.trim_start().len();
    for (at, c) in text.char_indices().skip_while(|(at, _)| *at < first) {
        match (c, quote) {
            ('`', None) => quote = Some(at),
            ('`', Some(_)) => quote = None,
            (' ', Some(from)) if has_room(text, from, room) => {}
            (' ', _) => {
                quote = None;
                words.push(&text[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    words.push(&text[begin..]);
    words
}

/// Whether the text in backticks from here on has an end, and room in a line.
fn has_room(text: &str, from: usize, room: usize) -> bool {
    text[from + 1..].find('`').is_some_and(|end| width(&text[from..from + end + 2]) <= room)
}

/// The number of characters that a terminal shows.
fn width(text: &str) -> usize {
    without_codes(text).chars().count()
}

/// The text without the escape codes of colours.
fn without_codes(text: &str) -> String {
    let mut pieces = text.split('\x1b');
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(first, |told, piece| told + piece.split_once('m').map_or("", |(_, rest)| rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWN: &str = "error[unknown-name]: nothing is called `bin_ful`, and nothing else is \
        called like it, though a very long message goes on and on\n  --> a.toml:1:2\n   |\n88 | \
        do   = [\"OUT bin_ful\", \"OUT bin_ful\", \"OUT bin_ful\", \"OUT bin_ful\", \"OUT \
        bin_ful\", \"OUT x\"]\n   |              ^^^^^^^\n   |\n   = help: write \
        `leg.up = [\"part_eye\"], leg.rst = [\"bin_away\"]` where the rung has only one leg, and \
        then do the same in the next rung\n\n1 error, 0 warnings\n";

    #[test]
    fn titles_and_helps_are_folded_at_spaces_but_source_text_is_not() {
        let told = folded(DRAWN, 80);
        let is_source = |line: &&str| line.starts_with("88 |");
        assert!(told.lines().filter(|l| !is_source(l)).all(|l| l.chars().count() <= 80), "{told}");
        assert!(told.lines().filter(is_source).all(|line| DRAWN.contains(line)), "{told}");
        assert!(told.contains("`leg.up = [\"part_eye\"], leg.rst = [\"bin_away\"]`"), "{told}");
        assert!(told.contains("\n           "), "the help goes on below itself: {told}");
        let letters = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(letters(&told), letters(DRAWN), "no word is lost");
    }

    #[test]
    fn a_short_text_and_escape_codes_are_kept() {
        let short = "\x1b[31merror\x1b[0m: no\n   \x1b[2m=\x1b[0m \x1b[1mhelp\x1b[0m: x\n";
        assert_eq!(folded(short, 40), short);
        let long = format!("\x1b[1m{}\x1b[0m", "word ".repeat(20));
        let told = folded(&long, 40);
        assert!(told.lines().all(|line| width(line) <= 40), "{told:?}");
        assert_eq!(without_codes(&told).split_whitespace().count(), 20);
    }

    #[test]
    fn a_long_or_unclosed_text_in_backticks_is_folded() {
        for text in [format!("`{}` is long", "word ".repeat(30)), "open ` ".to_owned() + DRAWN] {
            let told = folded(&text, 60);
            let long = told.lines().find(|line| line.chars().count() > 60 && !line.contains('|'));
            assert_eq!(long, None, "{told}");
        }
    }
}
