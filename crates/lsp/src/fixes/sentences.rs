//! Helps that advise several changes, or a change in a different table: a declaration and its use,
//! a row of a map, a pair under a different header, a new table.
//!
//! Called by `help`, which reads all other helps itself.

use super::advice::Advice;

/// The advice of such a help; empty for other helps.
pub(super) fn read(head: &str) -> Vec<Advice> {
    let of = [computed(head), setting(head), row(head), under(head), table(head), removed(head)];
    of.into_iter().flatten().collect()
}

/// The text in backticks after some words.
fn quoted<'h>(head: &'h str, words: &str) -> Option<&'h str> {
    let (_, rest) = head.split_once(words)?;
    let (text, _) = rest.strip_prefix('`')?.split_once('`')?;
    (!text.contains('…')).then_some(text)
}

/// `declare … under [tags], write … in a rung before, and … here`
fn computed(head: &str) -> Option<Advice> {
    Some(Advice::Here {
        declare: quoted(head, "declare ")?.to_owned(),
        before: Some(quoted(head, "under [tags], write ")?.to_owned()),
        text: quoted(head, "in a rung before, and ")?.to_owned(),
    })
}

/// `say so by a tag: …, with its name … here`
fn setting(head: &str) -> Option<Advice> {
    let declare = quoted(head, "say so by a tag: ")?.to_owned();
    let text = quoted(head, ", with its name ")?.to_owned();
    Some(Advice::Here { declare, before: None, text })
}

fn row(head: &str) -> Option<Advice> {
    let row = quoted(head, "add a row to the map: ").or(quoted(head, "add a row to a map: "))?;
    Some(Advice::Row(row.to_owned()))
}

/// A pair in a table: ``in `[outputs]`: `on = …` ``, or `[retain] cold-start = …`.
fn under(head: &str) -> Option<Advice> {
    if let Some(text) = quoted(head, "write ")
        && let Some((table, text)) = text.strip_prefix('[').and_then(|of| of.split_once("] "))
    {
        return Some(Advice::Under { table: table.to_owned(), text: text.to_owned() });
    }
    let header = quoted(head, "write it in ")?;
    let table = header.strip_prefix('[')?.strip_suffix(']')?.to_owned();
    let text = quoted(head, &format!("`{header}`: "))?.to_owned();
    Some(Advice::Under { table, text })
}

fn table(head: &str) -> Option<Advice> {
    let header = quoted(head, "declare it: a ")?.to_owned();
    let line = quoted(head, &format!("`{header}` with "))?.to_owned();
    Some(Advice::Table { header, line })
}

/// ``take `KEY` away``, ``remove `KEY` ``; a sign such as `+` is no key.
fn removed(head: &str) -> Option<Advice> {
    let taken = quoted(head, "take ").filter(|key| head.contains(&format!("take `{key}` away")));
    let key = taken.or(quoted(head, "remove "))?;
    let is_key = key.starts_with(|first: char| first == '[' || first.is_ascii_alphabetic());
    is_key.then(|| Advice::Remove(key.to_owned()))
}
