//! Reads sections of a page of `docs/`, and indents and wraps texts for a terminal.

/// A section of a page with its heading; empty if the page has no section with this title.
pub(super) fn section(page: &str, title: &str) -> String {
    let from = page.find(&format!("\n## {title}\n")).map_or(page.len(), |at| at + 1);
    let end = page[from..].find("\n## ").map_or(page.len(), |at| from + at + 1);
    page[from..end].to_owned()
}

pub(super) fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}\n")).collect()
}

pub(super) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].len() + 1 + word.len() > width {
            lines.push(word.to_owned());
            continue;
        }
        if !lines[last].is_empty() {
            lines[last].push(' ');
        }
        lines[last].push_str(word);
    }
    lines
}
