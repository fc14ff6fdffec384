//! Draws columns that stand for many scans: a word as a band from its least to its greatest value,
//! a bit that was both ON and OFF as a half tone.
//!
//! Called by `svg` for diagrams that have more scans than columns, and for the parts that both
//! kinds of diagram share. The picture is at most about 1400 px wide.

use std::fmt::Write as _;

use super::svg_columns::{ColumnScan, ColumnSpread, WideColumns, number};
use super::trace::{TracedOperand, ms_text};
use crate::svg::{SvgArea, SvgWriter};
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

/// A white picture of this width and height.
pub(super) fn opened([width, height]: [usize; 2]) -> SvgWriter {
    let text = format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n");
    SvgWriter { text }
}

/// Draws the name of an operand and the line above its row.
pub(super) fn name(svg: &mut SvgWriter, watched: &TracedOperand, top: usize, right: usize) {
    svg.path("g", format_args!("M6 {top}H{right}"));
    svg.label("", [6, top + 19], &watched.name);
    svg.end_line();
}

/// Draws the names of the two lines above the columns.
pub(super) fn head_names(svg: &mut SvgWriter) {
    svg.label("", [6, 14], "scan");
    svg.label("", [6, 28], "ms");
    svg.end_line();
}

/// The line at the left edge of a column, and its scan and time above it.
pub(super) struct ColumnHead {
    /// The class of the texts, and their position.
    pub class: &'static str,
    pub text_x: usize,
    pub x: usize,
    pub bottom: usize,
}

impl ColumnHead {
    pub fn draw(&self, svg: &mut SvgWriter, scan: ColumnScan) {
        let ColumnHead { class, text_x, x, bottom } = self;
        svg.path("g", format_args!("M{x} {HEAD}V{bottom}"));
        svg.label(class, [*text_x, 14], &scan.name.to_string());
        svg.label(class, [*text_x, 28], &ms_text(scan.time_us));
        svg.end_line();
    }
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
pub(super) fn draw(watched: &[TracedOperand], columns: &WideColumns) -> String {
    let names = watched.iter().map(|w| w.name.chars().count()).max().unwrap_or(0).max(4);
    let ends = watched.iter().enumerate().filter(|(_, w)| matches!(w.cell, Cell::Word(_)));
    let ends = ends.map(|(at, w)| {
        let ColumnSpread { least, greatest } = columns.whole(at);
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
    let size = [measures.right() + ends + 14, measures.height + FOOT];
    let mut svg = opened(size);
    head(&mut svg, columns, &measures);
    for (at, watched) in watched.iter().enumerate() {
        let top = HEAD + ROW * at;
        name(&mut svg, watched, top, measures.right());
        match watched.cell {
            Cell::Bit(_) | Cell::WordBit(_) => bit(&mut svg, &columns.spreads[at], top, &measures),
            Cell::Word(_) => {
                let (whole, spreads) = (columns.whole(at), &columns.spreads[at][..]);
                word(&mut svg, &WordBand { watched, whole, spreads }, top, &measures);
            }
        }
    }
    let scans = if columns.scans == 1 { "scan" } else { "scans" };
    let explanation = format!(
        "each column is {} {scans}; darker: ON and OFF within a column; a band is from the least \
         to the greatest value",
        columns.scans
    );
    svg.label("n", [6, measures.height + 12], &explanation);
    svg.end_line();
    svg.picture(size, &format!("{STYLE}{WIDE_STYLE}"))
}

/// Draws scan numbers, times and the grid.
fn head(svg: &mut SvgWriter, columns: &WideColumns, measures: &WideMeasures) {
    let bottom = measures.height;
    let widths = columns
        .heads
        .iter()
        .map(|scan| scan.name.to_string().len().max(ms_text(scan.time_us).len()));
    let widest = (widths.max().unwrap_or(0) + 2) * NUMBER_CHAR;
    let every = widest.max(100).div_ceil(measures.column);
    head_names(svg);
    for (at, head) in columns.heads.iter().enumerate().step_by(every) {
        let x = measures.x(at);
        ColumnHead { class: "n", text_x: x, x, bottom }.draw(svg, *head);
    }
}

/// Draws a bit: high and shaded while ON, low while OFF, dark in columns with both.
fn bit(svg: &mut SvgWriter, spreads: &[ColumnSpread], top: usize, measures: &WideMeasures) {
    let (high, low) = (top + HIGH, top + LOW);
    let (mut line, mut on, mut both) = (String::new(), String::new(), String::new());
    let (mut from, mut continues) = (0, false);
    for same in spreads.chunk_by(|a, b| a == b) {
        let (left, right) = (measures.x(from), measures.x(from + same.len()));
        from += same.len();
        let area = |path: &mut String| {
            let _ = write!(path, "M{left} {low}V{high}H{right}V{low}Z");
        };
        let is_both = same[0].least != same[0].greatest;
        if is_both {
            area(&mut both);
        } else {
            let y = if same[0].least != 0 { high } else { low };
            let _ = match continues {
                true => write!(line, "V{y}H{right}"),
                false => write!(line, "M{left} {y}H{right}"),
            };
            if same[0].least != 0 {
                area(&mut on);
            }
        }
        continues = !is_both;
    }
    for (class, path) in [("f", on), ("b", both), ("l", line)] {
        if !path.is_empty() {
            svg.path(class, path);
        }
    }
    svg.end_line();
}

/// A word to draw.
struct WordBand<'a> {
    watched: &'a TracedOperand,
    /// Its least and greatest value in all columns.
    whole: ColumnSpread,
    /// Its values in each column.
    spreads: &'a [ColumnSpread],
}

/// Draws a word: a band from the least to the greatest value of each column, with both ends of its
/// scale on the right. A word that never changes is a band with its value.
fn word(svg: &mut SvgWriter, band: &WordBand, top: usize, measures: &WideMeasures) {
    let WordBand { watched, whole, spreads } = *band;
    let (least, greatest) = (watched.text(whole.least), watched.text(whole.greatest));
    let (left, right, low) = (measures.left, measures.right(), top + LOW);
    if whole.least == whole.greatest {
        let (width, height) = (right - left, LOW - HIGH);
        svg.rect("w", SvgArea { x: left, y: top + HIGH, width, height });
        svg.label("v", [(left + right) / 2, top + 19], &least);
        return svg.end_line();
    }
    let (mut upper, mut lower) = (String::new(), Vec::new());
    let mut from = 0;
    for same in spreads.chunk_by(|a, b| a == b) {
        let [y_least, y_greatest] = [same[0].least, same[0].greatest]
            .map(|content| low - height(content, whole, watched.real));
        let _ = write!(upper, "V{y_greatest}H{}", measures.x(from + same.len()));
        lower.push((measures.x(from), y_least));
        from += same.len();
    }
    let lower: String = lower.iter().rev().map(|(x, y)| format!("V{y}H{x}")).collect();
    svg.path("w", format_args!("M{left} {low}{upper}{lower}Z"));
    svg.label("e", [right + 4, top + HIGH + 5], &greatest);
    svg.label("e", [right + 4, low + 2], &least);
    svg.end_line();
}

/// The height of a value above the lower edge, px: 0 to the height of the band.
fn height(content: i32, whole: ColumnSpread, real: bool) -> usize {
    let [value, least, greatest] =
        [content, whole.least, whole.greatest].map(|cell| number(cell, real));
    let part = (value - least) / (greatest - least);
    // Between 0 and 1. If both ends are equal, it is a NaN, which becomes 0 as an integer.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let px = (part * (LOW - HIGH) as f64).round() as usize;
    px.min(LOW - HIGH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traces::trace::RowName;
    use rungd_engine::{BitCell, WordCell};

    fn drawn(rows: u64, value: impl Fn(u64) -> [i32; 3]) -> String {
        let named = |name: &str, cell| TracedOperand { name: name.to_owned(), cell, real: false };
        let watched = [
            named("X0", Cell::Bit(BitCell(0))),
            named("level", Cell::Word(WordCell(0))),
            named("size", Cell::Word(WordCell(1))),
        ];
        let mut columns = WideColumns::new(&watched);
        (0..rows).for_each(|row| {
            let scan = ColumnScan { name: RowName::Scan(row), time_us: row * 10_000 };
            columns.put(scan, &value(row));
        });
        draw(&watched, &columns)
    }

    #[test]
    fn a_column_shows_every_value_of_its_scans() {
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
    fn a_picture_stays_small_for_any_number_of_scans() {
        let svg = drawn(3_000_000, |row| {
            let noise = (row.wrapping_mul(2_654_435_761) >> 7) as i32;
            [noise & 1, noise, 0]
        });
        assert!(svg.len() < 40_000, "{}", svg.len());
        assert!(svg.ends_with("</svg>\n"));
    }
}
