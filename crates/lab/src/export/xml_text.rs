//! Text within XML. Used by `xml` and `ladder_xml`.

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<xhtml:p>{}</xhtml:p>", escaped(text))
}

/// A text without signs that mean something in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            letter if letter.is_control() => escaped.push(' '),
            letter => escaped.push(letter),
        }
    }
    escaped
}
