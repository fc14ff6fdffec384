//! Elements of SVG as text, with escaping: the one writer of timing diagrams and ladder drawings.
//!
//! Called by `traces` and `draw`, which decide what is drawn, and where. All positions are px.

use std::fmt::{Display, Write as _};

/// Elements of a picture.
#[derive(Debug, Default)]
pub struct SvgWriter {
    /// The elements so far.
    pub text: String,
}

/// The place of a rectangle.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct SvgArea {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

impl SvgWriter {
    /// A rectangle.
    pub fn rect(&mut self, class: &str, SvgArea { x, y, width, height }: SvgArea) {
        let _ = write!(
            self.text,
            "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"
        );
    }

    /// A path; `d` is its data.
    pub fn path(&mut self, class: &str, d: impl Display) {
        let _ = write!(self.text, "<path class=\"{class}\" d=\"{d}\"/>");
    }

    /// A text; an empty `class` is none.
    pub fn label(&mut self, class: &str, [x, y]: [usize; 2], text: &str) {
        let text = escaped(text);
        let _ = match class {
            "" => write!(self.text, "<text x=\"{x}\" y=\"{y}\">{text}</text>"),
            _ => write!(self.text, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>"),
        };
    }

    /// The description of the element around it, shown by a pointer.
    pub fn title(&mut self, text: &str) {
        let _ = write!(self.text, "<title>{}</title>", escaped(text));
    }

    /// Ends a line of the text.
    pub fn end_line(&mut self) {
        self.text.push('\n');
    }

    /// The elements as a file of their own, with a style sheet.
    pub fn picture(&self, [width, height]: [usize; 2], style: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<style>{style}</style>\n{}</svg>\n",
            self.text
        )
    }
}

/// The element `svg` of a page around elements. `label`: its description for screen readers.
pub fn in_page(label: &str, [width, height]: [usize; 2], elements: &str) -> String {
    let label = escaped(label);
    format!(
        "<svg role=\"img\" aria-label=\"{label}\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n{elements}</svg>"
    )
}

/// Escapes a text for HTML, SVG and other XML. What XML does not allow becomes U+FFFD.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(c),
            c if c.is_control() || c == '\u{fffe}' || c == '\u{ffff}' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters_in_texts_are_escaped() {
        let mut svg = SvgWriter::default();
        svg.label("name", [8, 14], "</text><script>'\"&\u{1b}");
        svg.title("a<b");
        svg.label("", [6, 28], "ms");
        let wanted = "<text class=\"name\" x=\"8\" y=\"14\">\
            &lt;/text&gt;&lt;script&gt;&#39;&quot;&amp;\u{fffd}</text><title>a&lt;b</title>\
            <text x=\"6\" y=\"28\">ms</text>";
        assert_eq!(svg.text, wanted);
        assert!(in_page("\"", [1, 2], "").starts_with("<svg role=\"img\" aria-label=\"&quot;\" "));
    }
}
