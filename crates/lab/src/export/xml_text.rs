//! Paragraphs of text within XML. Used by `xml` and `ladder_xml`.

use crate::svg::escaped;

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<xhtml:p>{}</xhtml:p>", escaped(text))
}
