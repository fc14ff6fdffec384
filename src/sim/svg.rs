//! Traces as SVG timing diagrams: a line a bit, a band a word, one column a scan.
//!
//! The same values as the CSV form, drawn by hand into text that depends on nothing but them, so a
//! diagram in a document can be held against the program.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::trace::{RowName, Trace, Watched};
use crate::engine::{Cell, Image};

/// More columns than a picture can show.
pub const SCANS_MAX: usize = 1_000;

const LABELS: usize = 150;
const COLUMN: usize = 28;
const COLUMN_MIN: usize = 4;
const WIDTH_MAX: usize = 1_200;
const ROW: usize = 30;
const HEAD: usize = 34;
const HIGH: usize = 7;
const LOW: usize = 23;

const STYLE: &str = "text{font:12px monospace;fill:#222}.t{font-size:10px;fill:#666}\
    .b{fill:none;stroke:#0a6;stroke-width:2}.w{fill:#eef4fb;stroke:#357}\
    .g{stroke:#ddd}";

/// Collects rows, and draws them at the end.
pub struct SvgTrace<'a> {
    watched: &'a [Watched],
    columns: Vec<(String, u64)>,
    values: Vec<Vec<i32>>,
}

impl<'a> SvgTrace<'a> {
    /// A diagram of these operands.
    pub fn new(watched: &'a [Watched]) -> SvgTrace<'a> {
        SvgTrace { watched, columns: Vec::new(), values: vec![Vec::new(); watched.len()] }
    }

    /// Draws what was collected.
    ///
    /// # Errors
    /// What the place it writes to gives.
    pub fn finish(&self, mut out: impl Write) -> io::Result<()> {
        let column = (WIDTH_MAX / self.columns.len().max(1)).clamp(COLUMN_MIN, COLUMN);
        let width = LABELS + column * self.columns.len() + 10;
        let height = HEAD + ROW * self.watched.len() + 6;
        let mut svg = String::new();
        let _ = writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<style>{STYLE}</style>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>"
        );
        self.head(&mut svg, column, height);
        for (at, watched) in self.watched.iter().enumerate() {
            let top = HEAD + ROW * at;
            let _ = writeln!(
                svg,
                "<text x=\"6\" y=\"{}\">{}</text>",
                top + 19,
                watched.name.replace('&', "&amp;").replace('<', "&lt;")
            );
            match watched.cell {
                Cell::Bit(_) => bit_line(&mut svg, &self.values[at], top, column),
                Cell::Word(_) => word_bands(&mut svg, &self.values[at], top, column),
            }
        }
        svg.push_str("</svg>\n");
        out.write_all(svg.as_bytes())?;
        out.flush()
    }

    /// Scan numbers, times below them, and a thin line at every labelled scan.
    fn head(&self, svg: &mut String, column: usize, height: usize) {
        let _ = writeln!(svg, "<text class=\"t\" x=\"6\" y=\"13\">scan</text>");
        let _ = writeln!(svg, "<text class=\"t\" x=\"6\" y=\"26\">ms</text>");
        let every = (40 / column).max(1);
        for (at, (name, time_ms)) in self.columns.iter().enumerate() {
            if at % every != 0 && name != "stop" {
                continue;
            }
            let x = LABELS + at * column;
            let _ = writeln!(
                svg,
                "<path class=\"g\" d=\"M{x} {HEAD}V{height}\"/>\
                 <text class=\"t\" x=\"{x}\" y=\"13\">{name}</text>\
                 <text class=\"t\" x=\"{x}\" y=\"26\">{time_ms}</text>"
            );
        }
    }
}

/// A bit: high while ON, low while OFF.
fn bit_line(svg: &mut String, values: &[i32], top: usize, column: usize) {
    let mut path = String::new();
    for (at, value) in values.iter().enumerate() {
        let y = top + if *value != 0 { HIGH } else { LOW };
        let _ = match at {
            0 => write!(path, "M{LABELS} {y}"),
            _ => write!(path, "V{y}"),
        };
        let _ = write!(path, "H{}", LABELS + (at + 1) * column);
    }
    let _ = writeln!(svg, "<path class=\"b\" d=\"{path}\"/>");
}

/// A word: a band for as long as it holds one value, with the value where there is room.
fn word_bands(svg: &mut String, values: &[i32], top: usize, column: usize) {
    let mut start = 0;
    while start < values.len() {
        let same = values[start..].iter().take_while(|v| **v == values[start]).count();
        let (x, width) = (LABELS + start * column, same * column);
        let _ = write!(
            svg,
            "<rect class=\"w\" x=\"{x}\" y=\"{}\" width=\"{width}\" height=\"{}\"/>",
            top + HIGH,
            LOW - HIGH
        );
        let text = values[start].to_string();
        if text.len() * 6 + 4 <= width {
            let (x, y) = (x + 3, top + 19);
            let _ = write!(svg, "<text class=\"t\" x=\"{x}\" y=\"{y}\">{text}</text>");
        }
        svg.push('\n');
        start += same;
    }
}

impl Trace for SvgTrace<'_> {
    fn row(&mut self, name: RowName, time_ms: u64, image: &Image) -> io::Result<()> {
        if self.columns.len() > SCANS_MAX {
            let message = format!("a diagram shows at most {SCANS_MAX} scans: ask for fewer");
            return Err(io::Error::other(message));
        }
        let name = match name {
            RowName::Scan(scan) => scan.to_string(),
            RowName::Stop => "stop".to_owned(),
        };
        self.columns.push((name, time_ms));
        for (watched, values) in self.watched.iter().zip(&mut self.values) {
            values.push(match watched.cell {
                Cell::Bit(bit) => i32::from(image.bit(bit)),
                Cell::Word(word) => image.word(word),
            });
        }
        Ok(())
    }
}
