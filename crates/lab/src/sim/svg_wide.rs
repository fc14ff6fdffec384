//! Draws columns that stand for many scans: a word as a band from its least to its greatest value,
//! a bit that was both ON and OFF as a half tone.
//!
//! Called by `svg` for diagrams that have more scans than columns, and for the parts that both
//! kinds of diagram share. The picture is at most about 1400 px wide.

use std::fmt::Write as _;

use super::svg_columns::{ColumnSpread, WideColumns, number};
use super::trace::{Watched, ms_text};
use rungd_engine::Cell;

pub(super) const WIDTH_MAX: usize = 1_200;
pub(super) const ROW: usize = 30;
pub(super) const HEAD: usize = 34;
/// The upper and the lower edge of a line or band, measured from the top of its row.
pub(super) const HIGH: usize = 7;
pub(super) const LOW: usize = 23;
/// The width of a character, px, rounded up: in names, and in numbers.
pub(super) const NAME_CHAR: usize = 8;
pub(super) const NUMBER_CHAR: usize = 7;
/// The height of the explanation below the diagram.
const FOOT: usize = 22;

pub(super) const STYLE: &str = "text{font:12px monospace;fill:#222}.t,.v{font-size:10.5px;\
    text-anchor:middle}.t{fill:#666}.v{fill:#123}.l{fill:none;stroke:#08774f;stroke-width:2}\
    .f{fill:#08774f;fill-opacity:.14}.w{fill:#eaf1fa;stroke:#4a6f9c}.g{stroke:#e6e6e6}\
    .s{fill:#fff4dc}";

/// The styles that only a diagram of many scans needs.
const WIDE_STYLE: &str = ".b{fill:#08774f;fill-opacity:.5}.e{font-size:9px;fill:#4a6f9c}\
    .n{font-size:10.5px;fill:#666}";

/// The beginning of a picture of this width and height.
pub(super) fn opened(style: &str, (width, height): (usize, usize)) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<style>{style}</style>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    )
}

/// Draws the name of an operand and the line above its row.
pub(super) fn name(svg: &mut String, watched: &Watched, top: usize, right: usize) {
    let name = watched.name.replace('&', "&amp;").replace('<', "&lt;");
    let _ = writeln!(
        svg,
        "<path class=\"g\" d=\"M6 {top}H{right}\"/><text x=\"6\" y=\"{}\">{name}</text>",
        top + 19
    );
}

/// The positions of columns, px.
struct WideMeasures {
    left: usize,
    column: usize,
    count: usize,
    height: usize,
}

impl WideMeasures {
    fn x(&self, column: usize) -> usize {
        self.left + column * self.column
    }

    fn right(&self) -> usize {
        self.x(self.count)
    }
}

/// The text of a diagram.
pub(super) fn draw(watched: &[Watched], columns: &WideColumns) -> String {
    let names = watched.iter().map(|w| w.name.chars().count()).max().unwrap_or(0).max(4);
    let ends = watched.iter().enumerate().filter(|(_, w)| matches!(w.cell, Cell::Word(_)));
    let ends = ends.map(|(at, w)| {
        let (least, greatest) = columns.whole(at);
        w.text(least).len().max(w.text(greatest).len())
    });
    let ends = ends.max().unwrap_or(0) * NUMBER_CHAR;
    let count = columns.heads.len();
    let measures = WideMeasures {
        left: 6 + names * NAME_CHAR + 10,
        column: (WIDTH_MAX / count.max(1)).max(1),
        count,
        height: HEAD + ROW * watched.len() + 6,
    };
    let size = (measures.right() + ends + 14, measures.height + FOOT);
    let mut svg = opened(&format!("{STYLE}{WIDE_STYLE}"), size);
    head(&mut svg, columns, &measures);
    for (at, watched) in watched.iter().enumerate() {
        let top = HEAD + ROW * at;
        name(&mut svg, watched, top, measures.right());
        match watched.cell {
            Cell::Bit(_) => bit(&mut svg, &columns.spreads[at], top, &measures),
            Cell::Word(_) => word(&mut svg, (watched, at, columns), top, &measures),
        }
    }
    let scans = if columns.scans == 1 { "scan" } else { "scans" };
    let _ = writeln!(
        svg,
        "<text class=\"n\" x=\"6\" y=\"{}\">each column is {} {scans}; darker: ON and OFF within a \
         column; a band is from the least to the greatest value</text>\n</svg>",
        measures.height + 12,
        columns.scans
    );
    svg
}

/// Draws scan numbers, times and the grid.
fn head(svg: &mut String, columns: &WideColumns, measures: &WideMeasures) {
    let bottom = measures.height;
    let widths =
        columns.heads.iter().map(|(name, us)| name.to_string().len().max(ms_text(*us).len()));
    let widest = (widths.max().unwrap_or(0) + 2) * NUMBER_CHAR;
    let every = widest.max(100).div_ceil(measures.column);
    let _ = writeln!(svg, "<text x=\"6\" y=\"14\">scan</text><text x=\"6\" y=\"28\">ms</text>");
    for (at, (name, time_us)) in columns.heads.iter().enumerate().step_by(every) {
        let (x, scan, time_ms) = (measures.x(at), name, ms_text(*time_us));
        let _ = writeln!(
            svg,
            "<path class=\"g\" d=\"M{x} {HEAD}V{bottom}\"/>\
             <text class=\"n\" x=\"{x}\" y=\"14\">{scan}</text>\
             <text class=\"n\" x=\"{x}\" y=\"28\">{time_ms}</text>"
        );
    }
}

/// Draws a bit: high and shaded while ON, low while OFF, dark in columns with both.
fn bit(svg: &mut String, spreads: &[ColumnSpread], top: usize, measures: &WideMeasures) {
    let (high, low) = (top + HIGH, top + LOW);
    let (mut line, mut on, mut both) = (String::new(), String::new(), String::new());
    let (mut from, mut goes_on) = (0, false);
    for same in spreads.chunk_by(|a, b| a == b) {
        let (left, right) = (measures.x(from), measures.x(from + same.len()));
        from += same.len();
        let area = |path: &mut String| {
            let _ = write!(path, "M{left} {low}V{high}H{right}V{low}Z");
        };
        let is_both = same[0].0 != same[0].1;
        if is_both {
            area(&mut both);
        } else {
            let y = if same[0].0 != 0 { high } else { low };
            let _ = match goes_on {
                true => write!(line, "V{y}H{right}"),
                false => write!(line, "M{left} {y}H{right}"),
            };
            if same[0].0 != 0 {
                area(&mut on);
            }
        }
        goes_on = !is_both;
    }
    for (class, path) in [("f", on), ("b", both), ("l", line)] {
        if !path.is_empty() {
            let _ = write!(svg, "<path class=\"{class}\" d=\"{path}\"/>");
        }
    }
    svg.push('\n');
}

/// Draws a word: a band from the least to the greatest value of each column, with both ends of its
/// scale on the right. A word that never changes is a band with its value.
fn word(
    svg: &mut String,
    (watched, at, columns): (&Watched, usize, &WideColumns),
    top: usize,
    measures: &WideMeasures,
) {
    let whole = columns.whole(at);
    let (least, greatest) = (watched.text(whole.0), watched.text(whole.1));
    let (left, right, low) = (measures.left, measures.right(), top + LOW);
    if whole.0 == whole.1 {
        let (width, height, middle) = (right - left, LOW - HIGH, (left + right) / 2);
        let (high, base) = (top + HIGH, top + 19);
        let _ = writeln!(
            svg,
            "<rect class=\"w\" x=\"{left}\" y=\"{high}\" width=\"{width}\" height=\"{height}\"/>\
             <text class=\"v\" x=\"{middle}\" y=\"{base}\">{least}</text>"
        );
        return;
    }
    let (mut upper, mut lower) = (String::new(), Vec::new());
    let mut from = 0;
    for same in columns.spreads[at].chunk_by(|a, b| a == b) {
        let [y_least, y_greatest] =
            [same[0].0, same[0].1].map(|content| low - height(content, whole, watched.real));
        let _ = write!(upper, "V{y_greatest}H{}", measures.x(from + same.len()));
        lower.push((measures.x(from), y_least));
        from += same.len();
    }
    let _ = write!(svg, "<path class=\"w\" d=\"M{left} {low}{upper}");
    for (x, y) in lower.iter().rev() {
        let _ = write!(svg, "V{y}H{x}");
    }
    let (x, high, base) = (right + 4, top + HIGH + 5, low + 2);
    let _ = writeln!(
        svg,
        "Z\"/><text class=\"e\" x=\"{x}\" y=\"{high}\">{greatest}</text>\
         <text class=\"e\" x=\"{x}\" y=\"{base}\">{least}</text>"
    );
}

/// The height of a value above the lower edge, px: 0 to the height of the band.
fn height(content: i32, (least, greatest): ColumnSpread, real: bool) -> usize {
    let [value, least, greatest] = [content, least, greatest].map(|cell| number(cell, real));
    let part = (value - least) / (greatest - least);
    // Between 0 and 1. If both ends are equal, it is a NaN, which becomes 0 as an integer.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let px = (part * (LOW - HIGH) as f64).round() as usize;
    px.min(LOW - HIGH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::trace::RowName;
    use rungd_engine::{BitCell, WordCell};

    fn drawn(rows: u64, value: impl Fn(u64) -> [i32; 3]) -> String {
        let named = |name: &str, cell| Watched { name: name.to_owned(), cell, real: false };
        let watched = [
            named("X0", Cell::Bit(BitCell(0))),
            named("level", Cell::Word(WordCell(0))),
            named("size", Cell::Word(WordCell(1))),
        ];
        let mut columns = WideColumns::new(&watched);
        (0..rows).for_each(|row| columns.put((RowName::Scan(row), row * 10_000), &value(row)));
        draw(&watched, &columns)
    }

    #[test]
    fn a_column_shows_all_that_was_in_it() {
        // A column is 1024 scans.
        let svg = drawn(1 << 20, |row| {
            let bit = match row >> 10 {
                0..256 => 0,
                256..512 => (row & 1) as i32,
                _ => 1,
            };
            [bit, (row >> 12) as i32 - 100, 7]
        });
        let (_, body) = svg.split_once("</style>\n").unwrap();
        let body = body.replace("><", ">\n<");
        let shown: Vec<&str> = body.lines().filter(|line| !line.contains("class=\"n\"")).collect();
        let kept = |class: &str| {
            let class = format!("class=\"{class}\"");
            shown.iter().filter(|line| line.contains(&class)).copied().collect::<Vec<_>>()
        };
        assert_eq!(kept("b"), ["<path class=\"b\" d=\"M312 57V41H568V57Z\"/>"]);
        assert_eq!(kept("f"), ["<path class=\"f\" d=\"M568 57V41H1080V57Z\"/>"]);
        assert_eq!(kept("l"), ["<path class=\"l\" d=\"M56 57H312M568 41H1080\"/>"]);
        assert_eq!(kept("e").len(), 2);
        assert!(kept("e")[0].ends_with(">155</text>") && kept("e")[1].ends_with(">-100</text>"));
        assert_eq!(kept("v"), ["<text class=\"v\" x=\"568\" y=\"113\">7</text>"]);
        assert!(svg.contains(">each column is 1024 scans; "));
        assert!(svg.len() < 20_000, "{}", svg.len());
    }

    #[test]
    fn a_picture_stays_small_however_much_it_shows() {
        let svg = drawn(3_000_000, |row| {
            let noise = (row.wrapping_mul(2_654_435_761) >> 7) as i32;
            [noise & 1, noise, 0]
        });
        assert!(svg.len() < 40_000, "{}", svg.len());
        assert!(svg.ends_with("</svg>\n"));
    }
}
