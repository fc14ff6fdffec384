//! Mimics: a drawing of the machine, an SVG file of its owner, made safe for a page.
//!
//! Called by `api`. Nothing of the file reaches a browser as it is: the file is read, and a new
//! text is written from what the lists here allow: shapes, texts, gradients, and the `data-`
//! attributes that bind them to tags. So no script, no link, no style sheet, no picture, no
//! reference outside of the file, and no copy of a part (`use`), of which few lines could make a
//! million. Limits hold the size, the depth and the number of elements.

use std::collections::BTreeSet;
use std::path::Path;

use super::mimic_xml::{XmlAttribute, XmlFailure, XmlPart, XmlReader};
use rungd_base::regular_file::read_small_text;

/// The most bytes of a drawing.
const BYTES_MAX: usize = 1 << 20;
/// The most elements, and the greatest depth, of a drawing.
const ELEMENTS_MAX: usize = 10_000;
const DEPTH_MAX: usize = 64;
/// What every identifier of a drawing begins with on a page, so that it is none of the page's own.
const ID: &str = "mimic-";

const ELEMENTS: [&str; 20] = [
    "svg",
    "g",
    "defs",
    "path",
    "rect",
    "circle",
    "ellipse",
    "line",
    "polyline",
    "polygon",
    "text",
    "tspan",
    "title",
    "desc",
    "linearGradient",
    "radialGradient",
    "stop",
    "clipPath",
    "marker",
    "symbol",
];

const ATTRIBUTES: [&str; 63] = [
    "d",
    "x",
    "y",
    "x1",
    "y1",
    "x2",
    "y2",
    "cx",
    "cy",
    "fx",
    "fy",
    "r",
    "rx",
    "ry",
    "dx",
    "dy",
    "width",
    "height",
    "points",
    "transform",
    "viewBox",
    "preserveAspectRatio",
    "id",
    "offset",
    "gradientUnits",
    "gradientTransform",
    "spreadMethod",
    "clipPathUnits",
    "refX",
    "refY",
    "markerWidth",
    "markerHeight",
    "orient",
    "data-tag",
    "data-on",
    "data-off",
    "data-show",
    "data-text",
    "data-decimals",
    "data-unit",
    "fill",
    "fill-opacity",
    "fill-rule",
    "stroke",
    "stroke-width",
    "stroke-opacity",
    "stroke-linecap",
    "stroke-linejoin",
    "stroke-dasharray",
    "stroke-miterlimit",
    "opacity",
    "stop-color",
    "stop-opacity",
    "font-size",
    "font-family",
    "font-weight",
    "font-style",
    "text-anchor",
    "dominant-baseline",
    "clip-path",
    "clip-rule",
    "marker-start",
    "marker-end",
];

/// The first of [`ATTRIBUTES`] that a `style` may have too.
const STYLED_FROM: usize = 40;

/// A drawing that is safe, and what is left out of it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Mimic {
    /// The text of the drawing.
    pub svg: String,
    /// The names of the elements and attributes that are left out, each once.
    pub left_out: Vec<String>,
    /// The tags that it shows, each once.
    pub tags: Vec<String>,
}

/// Reads a drawing of a folder.
///
/// # Errors
/// The name is no name of a file, the file cannot be read, or it is no SVG.
pub(super) fn read(folder: &Path, name: &str) -> Result<Mimic, String> {
    if !is_file_name(name) {
        return Err(format!("`{name}` is no name of a file in the folder of `--mimics`"));
    }
    let text = read_small_text(&folder.join(name)).map_err(|why| format!("{name}: {why}"))?;
    made_safe(&text).map_err(|why| format!("{name}, {why}"))
}

/// Whether a text is the name of an SVG file, without a folder.
fn is_file_name(name: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ');
    name.ends_with(".svg") && !name.starts_with('.') && name.len() <= 200 && name.chars().all(fits)
}

/// Makes a drawing from the text of an SVG file.
///
/// # Errors
/// The text is no SVG, or exceeds a limit; with the line.
pub(super) fn made_safe(text: &str) -> Result<Mimic, XmlFailure> {
    if text.len() > BYTES_MAX {
        return Err(XmlFailure::new(1, format!("it has more than {BYTES_MAX} bytes")));
    }
    let mut writer = SafeWriter::default();
    let mut reader = XmlReader::new(text);
    while let Some(part) = reader.next()? {
        writer.take(part).map_err(|why| XmlFailure::new(reader.line(), why))?;
    }
    if writer.depth > 0 || writer.skipped > 0 {
        return Err(XmlFailure::new(reader.line(), "an element has no end".to_owned()));
    }
    if !writer.svg.starts_with("<svg") {
        return Err(XmlFailure::new(1, "it is no SVG: its first element is not `svg`".to_owned()));
    }
    let (left_out, tags) =
        (writer.left_out.into_iter().collect(), writer.tags.into_iter().collect());
    Ok(Mimic { svg: writer.svg, left_out, tags })
}

/// Writes what is allowed.
#[derive(Default)]
struct SafeWriter {
    svg: String,
    /// The number of open elements that are written, and of those within one that is left out.
    depth: usize,
    skipped: usize,
    elements: usize,
    left_out: BTreeSet<String>,
    tags: BTreeSet<String>,
    /// The names of the open elements that are written.
    open: Vec<&'static str>,
}

impl SafeWriter {
    fn take(&mut self, part: XmlPart<'_>) -> Result<(), String> {
        match part {
            XmlPart::Begin { name, attributes, is_empty } => {
                self.elements += 1;
                if self.elements > ELEMENTS_MAX || self.depth + self.skipped >= DEPTH_MAX {
                    let most = format!("{ELEMENTS_MAX} elements, or is deeper than {DEPTH_MAX}");
                    return Err(format!("it has more than {most}"));
                }
                let allowed = ELEMENTS.into_iter().find(|allowed| *allowed == name);
                match allowed.filter(|name| self.skipped == 0 && self.fits(name)) {
                    Some(name) => self.begin(name, &attributes, is_empty),
                    None => {
                        if self.skipped == 0 {
                            self.leave_out(name);
                        }
                        self.skipped += usize::from(!is_empty);
                    }
                }
            }
            XmlPart::End if self.skipped > 0 => self.skipped -= 1,
            XmlPart::End => {
                let name = self.open.pop().ok_or("an element ends that has not begun")?;
                self.depth -= 1;
                self.svg.push_str(&format!("</{name}>"));
            }
            XmlPart::Text(text) if self.skipped == 0 && self.depth > 0 => {
                self.svg.push_str(&escaped(&text));
            }
            XmlPart::Text(_) => {}
        }
        Ok(())
    }

    /// Whether an element may stand here: `svg` is the outermost, and once.
    fn fits(&self, name: &str) -> bool {
        if name == "svg" { self.svg.is_empty() } else { self.depth > 0 }
    }

    fn begin(&mut self, name: &'static str, attributes: &[XmlAttribute<'_>], is_empty: bool) {
        self.svg.push('<');
        self.svg.push_str(name);
        if name == "svg" {
            self.svg.push_str(" xmlns=\"http://www.w3.org/2000/svg\"");
        }
        let mut written: Vec<&str> = Vec::new();
        for XmlAttribute { name: key, value } in attributes {
            if *key == "style" {
                self.style(value, &mut written);
                continue;
            }
            let allowed = ATTRIBUTES.into_iter().find(|allowed| allowed == key);
            match allowed.and_then(|key| Some((key, safe_value(key, value)?))) {
                Some((key, value)) if !written.contains(&key) => {
                    written.push(key);
                    if key == "data-tag" {
                        self.tags.insert(value.trim().to_owned());
                    }
                    self.attribute(key, &value);
                }
                Some(_) => {}
                None if key.starts_with("xmlns") || key.contains(':') => {}
                None => self.leave_out(key),
            }
        }
        self.svg.push_str(if is_empty { "/>" } else { ">" });
        if !is_empty {
            self.depth += 1;
            self.open.push(name);
        }
    }

    /// Writes the declarations of a style as attributes: a page has no styles of others.
    fn style(&mut self, style: &str, written: &mut Vec<&str>) {
        for declaration in style.split(';') {
            let Some((key, value)) = declaration.split_once(':') else { continue };
            let key = key.trim();
            let allowed = ATTRIBUTES[STYLED_FROM..].iter().find(|allowed| **allowed == key);
            let Some(key) = allowed.filter(|key| !written.contains(key)) else { continue };
            if let Some(value) = safe_value(key, value.trim()) {
                written.push(key);
                self.attribute(key, &value);
            }
        }
    }

    fn attribute(&mut self, key: &str, value: &str) {
        self.svg.push_str(&format!(" {key}=\"{}\"", escaped(value)));
    }

    fn leave_out(&mut self, name: &str) {
        if self.left_out.len() < 20 {
            let name: String = name.chars().take(40).collect();
            self.left_out.insert(name);
        }
    }
}

/// The value of an attribute as it is written; `None`: it is left out.
fn safe_value(key: &str, value: &str) -> Option<String> {
    if key == "id" {
        return is_id(value).then(|| format!("{ID}{value}"));
    }
    if key.starts_with("data-") && !matches!(key, "data-on" | "data-off") {
        return (value.len() <= 200).then(|| value.to_owned());
    }
    // The one reference that is allowed is to a part of the same file.
    if let Some(rest) = value.trim().strip_prefix("url(") {
        let inner = rest.strip_suffix(')')?.trim().trim_matches(['"', '\'']);
        let id = inner.strip_prefix('#').filter(|id| is_id(id))?;
        return Some(format!("url(#{ID}{id})"));
    }
    let fits = |c: char| c.is_alphanumeric() || " \t\n\r.,#%()+-_'\"".contains(c);
    let is_plain = !value.to_ascii_lowercase().contains("url") && value.chars().all(fits);
    is_plain.then(|| value.to_owned())
}

fn is_id(text: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    !text.is_empty() && text.len() <= 100 && text.chars().all(fits)
}

fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() && !matches!(c, '\n' | '\t' | '\r') => {}
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
#[path = "mimic_tests.rs"]
mod tests;
