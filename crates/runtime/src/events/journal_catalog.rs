//! The catalogue in the journal's form: the text that `journalctl -x` shows beneath a line.
//!
//! `rungd events --catalog` prints it. `config/systemd/rungd.catalog` is a copy; a test compares
//! the two. `journalctl --update-catalog` makes systemd read the copy in
//! `/usr/lib/systemd/catalog/`.

use std::fmt::Write as _;

use super::row::Event;
use super::table::all;

/// The width of the text.
const WIDTH: usize = 78;

/// All events, in systemd's catalog format.
pub fn catalog() -> String {
    let mut text =
        "# The events of rungd, for journalctl -x. Made by: rungd events --catalog\n".to_owned();
    for event in all() {
        entry(event, &mut text);
    }
    text
}

fn entry(event: &Event, text: &mut String) {
    let Event { id, name, meaning, remedy, .. } = event;
    let code = event.code();
    let _ = write!(text, "\n-- {id}\nSubject: {name} ({code})\nDefined-By: rungd\n\n");
    wrap(meaning, text);
    text.push('\n');
    wrap(&format!("What to do: {remedy}"), text);
}

/// Wraps the words into lines. No line may begin with `--` or `#`: the catalog would not read it as
/// text.
fn wrap(words: &str, text: &mut String) {
    let mut column = 0;
    for word in words.split(' ') {
        if column > 0 && column + 1 + word.len() > WIDTH {
            text.push('\n');
            column = 0;
        }
        if column > 0 {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += word.len();
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_catalog_entry_contains_the_meaning_and_the_remedy() {
        let text = catalog();
        let event = crate::events::named("alarm-off").unwrap();
        let head =
            format!("\n-- {}\nSubject: alarm-off (RUNGD-0302)\nDefined-By: rungd\n\n", event.id);
        let entry = text.split(&head).nth(1).and_then(|rest| rest.split("\n-- ").next());
        let expected = "The alarm is over; lasted_ms says how long it stood.\n\n\
                        What to do: Nothing.\n";
        assert_eq!(entry, Some(expected));
        assert!(!text.lines().any(|line| line.len() > WIDTH + 2));
    }
}
