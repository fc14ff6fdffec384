//! Traces: one row for each scan, with the values at its end.
//!
//! `rig::simulation` passes rows as images, through [`Trace`]. A replay may have two images, so it
//! passes rows as values, through [`ValueTrace`]. Every form of a trace accepts both. The CSV form:
//! the header is `scan,time_ms,` and the operands as requested; bits are 0 and 1, words are
//! decimal, reals have the form of the ladder, and the time is in ms, with a fraction if it is not
//! whole. The row after an orderly stop is called `stop`.

use std::fmt;
use std::io::{self, Write};

use rungd_engine::isa::Real;
use rungd_engine::{Cell, Image, Layout};

/// A traced operand: its name for the header, and its cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracedOperand {
    /// Its name for the header.
    pub name: String,
    /// Its cell.
    pub cell: Cell,
    /// Whether the cell holds a real.
    pub real: bool,
}

impl TracedOperand {
    /// The operand at a cell.
    pub fn new(name: &str, cell: Cell, layout: &Layout) -> TracedOperand {
        let real = matches!(cell, Cell::Word(word) if layout.is_real(word));
        TracedOperand { name: name.to_owned(), cell, real }
    }

    /// The cell's content in an image.
    pub fn value(&self, image: &Image) -> i32 {
        image.value(self.cell)
    }

    /// The text of the cell's content.
    pub(super) fn text(&self, content: i32) -> String {
        if self.real { Real::of_cell(content).to_string() } else { content.to_string() }
    }
}

/// The name of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowName {
    /// The end of a scan.
    Scan(u64),
    /// Memory after the termination passes of an orderly stop.
    Stop,
}

impl fmt::Display for RowName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RowName::Scan(scan) => scan.fmt(f),
            RowName::Stop => f.write_str("stop"),
        }
    }
}

/// Accepts the rows of a simulation.
pub trait Trace {
    /// Adds one row; the time is in µs.
    ///
    /// # Errors
    /// The error of the output.
    fn row(&mut self, name: RowName, time_us: u64, image: &Image) -> io::Result<()>;
}

/// Accepts rows as values.
pub trait ValueTrace {
    /// The traced operands.
    fn watched(&self) -> &[TracedOperand];

    /// Adds one row with a value for each operand; the time is in µs.
    ///
    /// # Errors
    /// The error of the output.
    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()>;
}

impl<T: ValueTrace> Trace for T {
    fn row(&mut self, name: RowName, time_us: u64, image: &Image) -> io::Result<()> {
        let values: Vec<i32> = self.watched().iter().map(|w| w.value(image)).collect();
        self.values(name, time_us, &values)
    }
}

/// Passes on only the first row, `stop`, and rows in which a value differs from the row before.
pub struct ChangesOnly<T> {
    trace: T,
    last: Option<Vec<i32>>,
}

impl<T: ValueTrace> ChangesOnly<T> {
    /// Passes rows on to this trace.
    pub fn new(trace: T) -> ChangesOnly<T> {
        ChangesOnly { trace, last: None }
    }

    /// The trace.
    pub fn into_inner(self) -> T {
        self.trace
    }
}

impl<T: ValueTrace> ValueTrace for ChangesOnly<T> {
    fn watched(&self) -> &[TracedOperand] {
        self.trace.watched()
    }

    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()> {
        if self.last.as_deref() == Some(values) && name != RowName::Stop {
            return Ok(());
        }
        let last = self.last.get_or_insert_default();
        last.clear();
        last.extend_from_slice(values);
        self.trace.values(name, time_us, values)
    }
}

/// A time in ms, with a fraction if it is not whole: `20`, `20.5`.
pub(super) fn ms_text(time_us: u64) -> String {
    let (ms, us) = (time_us / 1000, time_us % 1000);
    if us == 0 {
        return ms.to_string();
    }
    format!("{ms}.{us:03}").trim_end_matches('0').to_owned()
}

/// Writes rows as CSV.
pub struct CsvTrace<'a, W: Write> {
    watched: &'a [TracedOperand],
    out: W,
}

impl<'a, W: Write> CsvTrace<'a, W> {
    /// Writes the header.
    ///
    /// # Errors
    /// The error of the output.
    pub fn new(watched: &'a [TracedOperand], mut out: W) -> io::Result<Self> {
        write!(out, "scan,time_ms")?;
        for watched in watched {
            write!(out, ",{}", watched.name)?;
        }
        writeln!(out)?;
        Ok(CsvTrace { watched, out })
    }

    /// Flushes and returns the writer.
    ///
    /// # Errors
    /// The error of the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

impl<W: Write> ValueTrace for CsvTrace<'_, W> {
    fn watched(&self) -> &[TracedOperand] {
        self.watched
    }

    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()> {
        write!(self.out, "{name},{}", ms_text(time_us))?;
        for (watched, value) in self.watched.iter().zip(values) {
            match watched.real {
                true => write!(self.out, ",{}", Real::of_cell(*value))?,
                false => write!(self.out, ",{value}")?,
            }
        }
        writeln!(self.out)
    }
}
