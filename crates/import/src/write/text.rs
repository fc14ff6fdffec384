//! Pieces of TOML.

/// A string of one line, or of several.
pub(super) fn quoted(text: &str) -> String {
    let text: String = text.chars().map(|c| if is_plain(c) { c } else { ' ' }).collect();
    let text = text.trim();
    if text.contains('\n') {
        let text = text.replace('\\', "\\\\").replace("\"\"\"", "\"\"\\\"");
        let text = text.strip_suffix('"').map_or(text.clone(), |text| format!("{text}\\\""));
        return format!("\"\"\"\n{text}\"\"\"");
    }
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A string of one line.
pub(super) fn quoted_line(text: &str) -> String {
    quoted(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}

fn is_plain(letter: char) -> bool {
    letter == '\n' || !letter.is_control()
}

/// A string of a contact or an instruction, which has no escapes.
pub(super) fn literal(text: &str) -> String {
    format!("\"{text}\"")
}

/// An array of contacts or instructions.
pub(super) fn array(texts: &[String]) -> String {
    let texts: Vec<String> = texts.iter().map(|text| literal(text)).collect();
    let line = format!("[{}]", texts.join(", "));
    if line.len() <= 88 {
        return line;
    }
    format!("[\n{}]", texts.iter().map(|text| format!("    {text},\n")).collect::<String>())
}

/// Lines of a comment.
pub(super) fn comment(text: &str) -> String {
    let mut lines = String::new();
    for paragraph in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            let word: String = word.chars().filter(|c| !c.is_control()).collect();
            if !line.is_empty() && line.chars().count() + word.chars().count() > 96 {
                lines += &format!("# {line}\n");
                line.clear();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line += &word;
        }
        if !line.is_empty() {
            lines += &format!("# {line}\n");
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_string_keeps_its_text_whatever_it_contains() {
        for text in ["plain", "a \"b\" \\ c", "two\nlines", "two\n\"\"\"lines\"", "ends \\\nx\\"] {
            let toml = format!("doc = {}\n", quoted(text));
            let (read, findings) = rungd_language::source::reader::document(
                &toml,
                rungd_language::source::span::FileId(0),
                |_| (),
            );
            assert!(read.is_some() && findings.len() <= 1, "{toml}\n{findings:?}");
        }
        assert_eq!(quoted_line("a\r\n b"), "\"a b\"");
    }

    #[test]
    fn a_comment_has_lines_of_a_page() {
        let text = "word ".repeat(40);
        assert!(comment(&text).lines().all(|line| line.len() <= 100 && line.starts_with("# ")));
    }
}
