//! Reads the text of an XML file as a sequence of parts: elements, texts.
//!
//! Used by `mimic`. It knows no meaning, follows no reference, and has no entities but the five of
//! XML and numbers: a document type with declarations is refused. Comments and instructions are no
//! parts. It is not roxmltree, with which `rungd import` reads: that takes either no document type
//! at all, also none without declarations as Inkscape writes it, or one with entities.

use std::fmt;

/// The most attributes of an element.
const ATTRIBUTES_MAX: usize = 64;

/// A part of the text.
#[derive(Debug)]
pub(super) enum XmlPart<'a> {
    /// An element begins; an empty one ends at once.
    Begin {
        name: &'a str,
        /// In order, with their values.
        attributes: Vec<XmlAttribute<'a>>,
        is_empty: bool,
    },
    /// The last element that has begun ends.
    End,
    /// Text.
    Text(String),
}

/// An attribute of an element, with its value.
#[derive(Debug)]
pub(super) struct XmlAttribute<'a> {
    pub name: &'a str,
    pub value: String,
}

/// Why a text is not read further.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct XmlFailure {
    line: usize,
    why: String,
}

impl XmlFailure {
    pub fn new(line: usize, why: String) -> XmlFailure {
        XmlFailure { line, why }
    }
}

impl fmt::Display for XmlFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

/// A reader.
pub(super) struct XmlReader<'a> {
    text: &'a str,
    rest: &'a str,
    open: Vec<&'a str>,
}

impl<'a> XmlReader<'a> {
    pub fn new(text: &'a str) -> XmlReader<'a> {
        XmlReader { text, rest: text.trim_start_matches('\u{feff}'), open: Vec::new() }
    }

    /// The line that is reached, from 1.
    pub fn line(&self) -> usize {
        let read = self.text.len() - self.rest.len();
        self.text.as_bytes()[..read].iter().filter(|byte| **byte == b'\n').count() + 1
    }

    fn fail<T>(&self, why: impl Into<String>) -> Result<T, XmlFailure> {
        Err(XmlFailure::new(self.line(), why.into()))
    }

    /// The next part; `None` at the end.
    ///
    /// # Errors
    /// The text is no XML, or ends within an element.
    pub fn next(&mut self) -> Result<Option<XmlPart<'a>>, XmlFailure> {
        loop {
            if self.rest.is_empty() && !self.open.is_empty() {
                return self.fail("an element has no end");
            }
            if self.rest.is_empty() {
                return Ok(None);
            }
            if let Some(rest) = self.rest.strip_prefix("<!--") {
                self.skip(rest, "-->")?;
            } else if let Some(rest) = self.rest.strip_prefix("<![CDATA[") {
                let text = self.skip(rest, "]]>")?;
                return Ok(Some(XmlPart::Text(text.to_owned())));
            } else if let Some(rest) = self.rest.strip_prefix("<?") {
                self.skip(rest, "?>")?;
            } else if let Some(rest) = self.rest.strip_prefix("<!") {
                if self.skip(rest, ">")?.contains('[') {
                    return self.fail("it declares entities, which a drawing may not");
                }
            } else if let Some(rest) = self.rest.strip_prefix("</") {
                return self.end(rest).map(Some);
            } else if let Some(rest) = self.rest.strip_prefix('<') {
                return self.begin(rest).map(Some);
            } else {
                let (text, rest) = split(self.rest, self.rest.find('<'));
                self.rest = rest;
                return self.decoded(text).map(|text| Some(XmlPart::Text(text)));
            }
        }
    }

    /// Goes behind the end of what begins at `rest`; returns what is before the end.
    fn skip(&mut self, rest: &'a str, end: &str) -> Result<&'a str, XmlFailure> {
        let Some((inner, behind)) = rest.split_once(end) else {
            return self.fail(format!("`{end}` is missing"));
        };
        self.rest = behind;
        Ok(inner)
    }

    fn end(&mut self, rest: &'a str) -> Result<XmlPart<'a>, XmlFailure> {
        let name = self.skip(rest, ">")?.trim();
        match self.open.pop() {
            Some(begun) if begun == name => Ok(XmlPart::End),
            _ => self
                .fail(format!("`</{}>` ends nothing", name.chars().take(40).collect::<String>())),
        }
    }

    fn begin(&mut self, rest: &'a str) -> Result<XmlPart<'a>, XmlFailure> {
        let (name, mut rest) = split(rest, rest.find(|c| !is_name_char(c)));
        if name.is_empty() {
            return self.fail("`<` without the name of an element");
        }
        let mut attributes = Vec::new();
        loop {
            rest = rest.trim_start();
            self.rest = rest;
            if let Some(behind) = rest.strip_prefix("/>") {
                self.rest = behind;
                return Ok(XmlPart::Begin { name, attributes, is_empty: true });
            }
            if let Some(behind) = rest.strip_prefix('>') {
                self.rest = behind;
                self.open.push(name);
                return Ok(XmlPart::Begin { name, attributes, is_empty: false });
            }
            let (key, behind) = split(rest, rest.find(|c| !is_name_char(c)));
            let value = behind.trim_start().strip_prefix('=').map(str::trim_start);
            let quote = value.and_then(|value| value.chars().next());
            let (Some(value), Some(quote @ ('"' | '\'')), false) = (value, quote, key.is_empty())
            else {
                return self.fail("an attribute is written as `name=\"value\"`");
            };
            let Some((value, behind)) = value[1..].split_once(quote) else {
                return self.fail("a value has no end");
            };
            if attributes.len() == ATTRIBUTES_MAX {
                return self.fail(format!("an element has more than {ATTRIBUTES_MAX} attributes"));
            }
            attributes.push(XmlAttribute { name: key, value: self.decoded(value)? });
            rest = behind;
        }
    }

    /// A text with its entities decoded.
    fn decoded(&self, text: &str) -> Result<String, XmlFailure> {
        let mut decoded = String::with_capacity(text.len());
        let mut rest = text;
        while let Some((before, behind)) = rest.split_once('&') {
            decoded.push_str(before);
            let (name, behind) = match behind.split_once(';') {
                Some((name, behind)) if name.len() <= 10 => (name, behind),
                _ => return self.fail("`&` begins no entity: write `&amp;`"),
            };
            let Some(c) = entity(name) else {
                return self.fail(format!("`&{name};` is no entity of XML"));
            };
            decoded.push(c);
            rest = behind;
        }
        decoded.push_str(rest);
        Ok(decoded)
    }
}

/// A text before and from a place; without a place, the whole text and nothing.
fn split(text: &str, at: Option<usize>) -> (&str, &str) {
    text.split_at(at.unwrap_or(text.len()))
}

fn is_name_char(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':')
}

fn entity(name: &str) -> Option<char> {
    match name {
        "amp" => Some('&'),
        "lt" => Some('<'),
        "gt" => Some('>'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let number = name.strip_prefix('#')?;
            let code = match number.strip_prefix(['x', 'X']) {
                Some(hex) => u32::from_str_radix(hex, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code).filter(|c| !c.is_control() || matches!(c, '\n' | '\t' | '\r'))
        }
    }
}
