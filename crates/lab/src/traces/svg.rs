//! Draws traces as SVG timing diagrams: a line for each bit, a band for each word, a column for
//! each scan.
//!
//! The text depends only on the traced values, so a test can compare a diagram in a document with
//! the program. A column shows the values at the *end* of its scan: an input's change and its
//! effect are in the same column. With more than [`SCANS_MAX`] scans, a column stands for several
//! scans: `svg_columns` keeps these columns, and `svg_wide` draws them.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::svg_columns::{ColumnScan, WideColumns};
use super::svg_wide::{
    self, ColumnHead, HEAD, HIGH, LOW, NAME_CHAR, NUMBER_CHAR, ROW, STYLE, WIDTH_MAX,
};
use super::trace::{RowName, TracedOperand, ValueTrace, ms_text};
use crate::svg::{SvgArea, SvgWriter};
use rungd_engine::Cell;

/// The maximum number of scans that have a column each (a stop has one more).
pub const SCANS_MAX: usize = 1_000;

const COLUMN: usize = 28;
const COLUMN_MIN: usize = 4;

/// Collects rows, and draws them in [`SvgTrace::finish`].
pub struct SvgTrace<'a> {
    watched: &'a [TracedOperand],
    /// The scan of each column.
    columns: Vec<ColumnScan>,
    values: Vec<Vec<i32>>,
    /// The columns of several scans, if there are too many scans for a column each.
    wide: Option<WideColumns>,
}

/// Positions and sizes in the diagram, px.
struct Measures {
    /// The left edge of the first column, right of the names.
    left: usize,
    column: usize,
    width: usize,
    height: usize,
}

impl Measures {
    fn x(&self, column: usize) -> usize {
        self.left + column * self.column
    }

    /// The middle of `count` columns.
    fn middle(&self, from: usize, count: usize) -> usize {
        self.x(from) + count * self.column / 2
    }
}

impl<'a> SvgTrace<'a> {
    /// A diagram of these operands.
    pub fn new(watched: &'a [TracedOperand]) -> SvgTrace<'a> {
        let values = vec![Vec::new(); watched.len()];
        SvgTrace { watched, columns: Vec::new(), values, wide: None }
    }

    /// Draws the collected rows.
    ///
    /// # Errors
    /// The error of `out`.
    pub fn finish(&self, mut out: impl Write) -> io::Result<()> {
        if let Some(columns) = &self.wide {
            out.write_all(svg_wide::draw(self.watched, columns).as_bytes())?;
            return out.flush();
        }
        let measures = self.measures();
        let size = [measures.width, measures.height];
        let mut svg = svg_wide::opened(size);
        self.head(&mut svg, &measures);
        for (at, watched) in self.watched.iter().enumerate() {
            let top = HEAD + ROW * at;
            svg_wide::name(&mut svg, watched, top, measures.x(self.columns.len()));
            match watched.cell {
                Cell::Bit(_) | Cell::WordBit(_) => {
                    bit_line(&mut svg, &self.values[at], top, &measures)
                }
                Cell::Word(_) => self.word_bands(&mut svg, at, top, &measures),
            }
        }
        out.write_all(svg.picture(size, STYLE).as_bytes())?;
        out.flush()
    }

    /// Moves the rows to columns of several scans.
    fn widen(&mut self) {
        let mut columns = WideColumns::new(self.watched);
        for (at, head) in self.columns.iter().enumerate() {
            let row: Vec<i32> = self.values.iter().map(|values| values[at]).collect();
            columns.put(*head, &row);
        }
        self.wide = Some(columns);
        (self.columns, self.values) = (Vec::new(), Vec::new());
    }

    /// The measures. Columns are as wide as the widest number, as far as the picture's maximum
    /// width allows.
    fn measures(&self) -> Measures {
        let name = self.watched.iter().map(|w| w.name.chars().count()).max().unwrap_or(0).max(4);
        let words = self.watched.iter().zip(&self.values);
        let words = words.filter(|(w, _)| matches!(w.cell, Cell::Word(_)));
        let texts = words.flat_map(|(w, values)| values.iter().map(|v| w.text(*v).len()));
        let digits = texts.max();
        let times = self.columns.last().map_or(0, |scan| ms_text(scan.time_us).len());
        let widest = digits.unwrap_or(0).max(times) * NUMBER_CHAR + 6;
        let count = self.columns.len().max(1);
        let column = widest.max(COLUMN).min(WIDTH_MAX / count).max(COLUMN_MIN);
        let left = 6 + name * NAME_CHAR + 10;
        Measures {
            left,
            column,
            width: left + column * self.columns.len() + 10,
            height: HEAD + ROW * self.watched.len() + 6,
        }
    }

    /// Scan numbers and times in the middle of their columns, and the grid.
    fn head(&self, svg: &mut SvgWriter, measures: &Measures) {
        let bottom = measures.height;
        let widest = self.columns.last().map_or(0, |scan| ms_text(scan.time_us).len().max(4));
        let every = (widest * NUMBER_CHAR).div_ceil(measures.column);
        let stop = self.columns.iter().position(|scan| scan.name == RowName::Stop);
        if let Some(at) = stop {
            let (x, width) = (measures.x(at), measures.column);
            svg.rect("s", SvgArea { x, y: 0, width, height: bottom });
            svg.end_line();
        }
        svg_wide::head_names(svg);
        for (at, head) in self.columns.iter().enumerate() {
            let near_stop = stop.is_some_and(|stop| at < stop && stop - at < every);
            if head.name != RowName::Stop && (at % every != 0 || near_stop) {
                continue;
            }
            let (x, text_x) = (measures.x(at), measures.middle(at, 1));
            ColumnHead { class: "t", text_x, x, bottom }.draw(svg, *head);
        }
    }

    /// Draws a word: a band for each stretch of equal values, with the value if it fits.
    fn word_bands(&self, svg: &mut SvgWriter, at: usize, top: usize, measures: &Measures) {
        let (watched, values) = (&self.watched[at], &self.values[at]);
        let mut from = 0;
        for same in values.chunk_by(|a, b| a == b) {
            let (x, width) = (measures.x(from), same.len() * measures.column);
            svg.rect("w", SvgArea { x, y: top + HIGH, width, height: LOW - HIGH });
            let text = watched.text(same[0]);
            if text.len() * NUMBER_CHAR + 2 <= width {
                svg.label("v", [measures.middle(from, same.len()), top + 19], &text);
            }
            svg.end_line();
            from += same.len();
        }
    }
}

/// Draws a bit: high and shaded while ON, low while OFF.
fn bit_line(svg: &mut SvgWriter, values: &[i32], top: usize, measures: &Measures) {
    let (left, low) = (measures.left, top + LOW);
    let mut steps = String::new();
    let mut from = 0;
    for same in values.chunk_by(|a, b| a == b) {
        let y = top + if same[0] != 0 { HIGH } else { LOW };
        from += same.len();
        let _ = write!(steps, "V{y}H{}", measures.x(from));
    }
    let first = top + if values.first().is_some_and(|v| *v != 0) { HIGH } else { LOW };
    if values.iter().any(|v| *v != 0) {
        svg.path("f", format_args!("M{left} {low}{steps}V{low}Z"));
    }
    svg.path("l", format_args!("M{left} {first}{steps}"));
    svg.end_line();
}

impl ValueTrace for SvgTrace<'_> {
    fn watched(&self) -> &[TracedOperand] {
        self.watched
    }

    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()> {
        if let Some(columns) = &mut self.wide {
            columns.put(ColumnScan { name, time_us }, values);
            return Ok(());
        }
        self.columns.push(ColumnScan { name, time_us });
        for (value, values) in values.iter().zip(&mut self.values) {
            values.push(*value);
        }
        if self.columns.len() > SCANS_MAX + 1 {
            self.widen();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rungd_engine::{BitCell, WordCell};

    use super::*;

    fn watched(name: &str, cell: Cell) -> TracedOperand {
        TracedOperand { name: name.to_owned(), cell, real: false }
    }

    /// A diagram of a bit and a word. The last column is the stop.
    fn drawn(bit: &[i32], word: &[i32]) -> String {
        let watched =
            [watched("X0", Cell::Bit(BitCell(0))), watched("a<b&c", Cell::Word(WordCell(0)))];
        let column = |scan| ColumnScan { name: RowName::Scan(scan), time_us: 10_000 * scan };
        let mut columns: Vec<ColumnScan> = (0..bit.len() as u64).map(column).collect();
        if let Some(last) = columns.last_mut() {
            last.name = RowName::Stop;
        }
        let values = vec![bit.to_vec(), word.to_vec()];
        let mut out = Vec::new();
        SvgTrace { watched: &watched, columns, values, wide: None }.finish(&mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_bit_is_drawn_as_a_line_and_a_word_as_bands() {
        let svg = drawn(&[0, 1, 1, 0], &[7, 7, -32_768, 0]);
        let (_, body) = svg.split_once("</style>\n").unwrap();
        expect_test::expect![[r##"
            <rect width="258" height="100" fill="#fff"/>
            <rect class="s" x="200" y="0" width="48" height="100"/>
            <text x="6" y="14">scan</text>
            <text x="6" y="28">ms</text>
            <path class="g" d="M56 34V100"/>
            <text class="t" x="80" y="14">0</text>
            <text class="t" x="80" y="28">0</text>
            <path class="g" d="M104 34V100"/>
            <text class="t" x="128" y="14">1</text>
            <text class="t" x="128" y="28">10</text>
            <path class="g" d="M152 34V100"/>
            <text class="t" x="176" y="14">2</text>
            <text class="t" x="176" y="28">20</text>
            <path class="g" d="M200 34V100"/>
            <text class="t" x="224" y="14">stop</text>
            <text class="t" x="224" y="28">30</text>
            <path class="g" d="M6 34H248"/>
            <text x="6" y="53">X0</text>
            <path class="f" d="M56 57V57H104V41H200V57H248V57Z"/>
            <path class="l" d="M56 57V57H104V41H200V57H248"/>
            <path class="g" d="M6 64H248"/>
            <text x="6" y="83">a&lt;b&amp;c</text>
            <rect class="w" x="56" y="71" width="96" height="16"/>
            <text class="v" x="104" y="83">7</text>
            <rect class="w" x="152" y="71" width="48" height="16"/>
            <text class="v" x="176" y="83">-32768</text>
            <rect class="w" x="200" y="71" width="48" height="16"/>
            <text class="v" x="224" y="83">0</text>
            </svg>
        "##]]
        .assert_eq(&body.replace("><", ">\n<"));
    }

    #[test]
    fn a_number_is_shown_where_there_is_room() {
        let steps: Vec<i32> = (0..300).map(|n| 1_000 + n / 20).collect();
        let svg = drawn(&vec![1; 300], &steps);
        assert!(svg.contains(">1014</text>"), "twenty columns hold a number");
        let ramp: Vec<i32> = (0..300).map(|n| 1_000 + n).collect();
        assert!(!drawn(&vec![1; 300], &ramp).contains(">1014</text>"), "one does not");
    }

    #[test]
    fn labels_of_narrow_columns_do_not_overlap() {
        let svg = drawn(&[0; 300], &[0; 300]);
        let labels: Vec<usize> = svg
            .split("y=\"28\">")
            .skip(1)
            .filter_map(|rest| rest.split('<').next().and_then(|time| time.parse().ok()))
            .collect();
        assert_eq!(labels.last(), Some(&2_990));
        assert!(labels.windows(2).all(|pair| pair[1] - pair[0] >= 70), "{labels:?}");
    }

    #[test]
    fn an_empty_trace_gives_a_valid_picture() {
        assert!(drawn(&[], &[]).ends_with("</svg>\n"));
    }
}
