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
use rungd_config::controller::panel::is_drawing_name;
use rungd_lab::svg::escaped;

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

/// What only an attribute says.
const ATTRIBUTES: [&str; 40] = [
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
];

/// What an attribute says, or a declaration of a `style`.
const STYLES: [&str; 25] = [
    "display",
    "visibility",
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
    if !is_drawing_name(name) {
        return Err(format!("`{name}` is no name of a file in the folder of `--mimics`"));
    }
    let text = read_small_text(&folder.join(name)).map_err(|why| format!("{name}: {why}"))?;
    made_safe(&text).map_err(|why| format!("{name}, {why}"))
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
    // The one end of a line of XML (1.0, section 2.11).
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let mut reader = XmlReader::new(&text);
    while let Some(part) = reader.next()? {
        writer.take(part).map_err(|why| XmlFailure::new(reader.line(), why))?;
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
    /// The names of the open elements that are written.
    open: Vec<&'static str>,
    /// The number of open elements within one that is left out, and of itself.
    skipped: usize,
    elements: usize,
    left_out: BTreeSet<String>,
    tags: BTreeSet<String>,
}

impl SafeWriter {
    fn take(&mut self, part: XmlPart<'_>) -> Result<(), String> {
        match part {
            XmlPart::Begin { name, attributes, is_empty } => {
                self.elements += 1;
                if self.elements > ELEMENTS_MAX || self.open.len() + self.skipped >= DEPTH_MAX {
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
            XmlPart::End => self.svg.extend(self.open.pop().map(|name| format!("</{name}>"))),
            XmlPart::Text(text) if self.skipped == 0 && !self.open.is_empty() => {
                self.svg.push_str(&escaped(&text));
            }
            XmlPart::Text(_) => {}
        }
        Ok(())
    }

    /// Whether an element may stand here: `svg` is the outermost, and once.
    fn fits(&self, name: &str) -> bool {
        if name == "svg" { self.svg.is_empty() } else { !self.open.is_empty() }
    }

    fn begin(&mut self, name: &'static str, attributes: &[XmlAttribute<'_>], is_empty: bool) {
        self.svg.push('<');
        self.svg.push_str(name);
        if name == "svg" {
            self.svg.push_str(" xmlns=\"http://www.w3.org/2000/svg\"");
        }
        let (styles, plain): (Vec<_>, Vec<_>) =
            attributes.iter().partition(|attribute| attribute.name == "style");
        // As in SVG, a style wins over an attribute of the same name.
        let mut written: Vec<&str> = Vec::new();
        if let Some(style) = styles.first() {
            self.style(&style.value, &mut written);
        }
        for attribute in plain {
            self.plain(attribute, &mut written);
        }
        self.svg.push_str(if is_empty { "/>" } else { ">" });
        if !is_empty {
            self.open.push(name);
        }
    }

    /// Writes an attribute that is allowed and not `written`.
    fn plain(&mut self, attribute: &XmlAttribute<'_>, written: &mut Vec<&str>) {
        let key = attribute.name;
        let allowed = ATTRIBUTES.into_iter().chain(STYLES).find(|allowed| *allowed == key);
        match allowed.and_then(|key| Some((key, safe_value(key, &attribute.value)?))) {
            Some((key, _)) if written.contains(&key) => {}
            Some((key, value)) => {
                written.push(key);
                if key == "data-tag" {
                    self.tags.insert(value.trim().to_owned());
                }
                self.attribute(key, &value);
            }
            None if key.starts_with("xmlns") || key.contains(':') => {}
            None => self.leave_out(key),
        }
    }

    /// Writes the declarations of a style as attributes: a page has no styles of others. Of two
    /// with one key the last is written, as in CSS.
    fn style(&mut self, style: &str, written: &mut Vec<&str>) {
        let mut declared: Vec<(&str, String)> = Vec::new();
        for declaration in style.split(';').map(str::trim).filter(|text| !text.is_empty()) {
            let (key, value) = declaration.split_once(':').unwrap_or((declaration, ""));
            let (key, value) = (key.trim(), value.trim());
            let allowed = STYLES.into_iter().find(|allowed| *allowed == key && !value.is_empty());
            match allowed.and_then(|key| Some((key, safe_value(key, value)?))) {
                Some((key, value)) => {
                    declared.retain(|(other, _)| *other != key);
                    declared.push((key, value));
                }
                // A key of one program, such as `-inkscape-font-specification`.
                None if key.starts_with('-') => {}
                None => self.leave_out(key),
            }
        }
        for (key, value) in declared {
            written.push(key);
            self.attribute(key, &value);
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

#[cfg(test)]
#[path = "mimic_tests.rs"]
mod tests;
