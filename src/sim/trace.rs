//! Traces: one row for each scan, with the values at its end.
//!
//! The CSV form: header `scan,time_ms,` and the operands as requested; bits 0 and 1, words decimal,
//! reals as they are written, time in whole ms. The row after an orderly stop is called `stop`.

use std::io::{self, Write};

use crate::engine::{Cell, Image, Layout};
use crate::isa::Real;

/// A traced operand: its name for the header, and its cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Watched {
    /// Its name for the header.
    pub name: String,
    /// Its cell.
    pub cell: Cell,
    /// Whether the cell holds a real.
    pub real: bool,
}

impl Watched {
    /// The operand at a cell.
    pub fn new(name: &str, cell: Cell, layout: &Layout) -> Watched {
        let real = matches!(cell, Cell::Word(word) if layout.is_real(word));
        Watched { name: name.to_owned(), cell, real }
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

/// Takes the rows of a simulation.
pub trait Trace {
    /// One row.
    ///
    /// # Errors
    /// What the place it writes to gives.
    fn row(&mut self, name: RowName, time_ms: u64, image: &Image) -> io::Result<()>;
}

/// Writes rows as CSV.
pub struct CsvTrace<'a, W: Write> {
    watched: &'a [Watched],
    out: W,
}

impl<'a, W: Write> CsvTrace<'a, W> {
    /// Writes the header.
    ///
    /// # Errors
    /// What the place it writes to gives.
    pub fn new(watched: &'a [Watched], mut out: W) -> io::Result<Self> {
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
    /// What the place it writes to gives.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

impl<W: Write> Trace for CsvTrace<'_, W> {
    fn row(&mut self, name: RowName, time_ms: u64, image: &Image) -> io::Result<()> {
        match name {
            RowName::Scan(scan) => write!(self.out, "{scan},{time_ms}")?,
            RowName::Stop => write!(self.out, "stop,{time_ms}")?,
        }
        for watched in self.watched {
            match watched.cell {
                Cell::Bit(bit) => write!(self.out, ",{}", u8::from(image.bit(bit)))?,
                Cell::Word(word) if watched.real => {
                    write!(self.out, ",{}", Real::of_cell(image.word(word)))?;
                }
                Cell::Word(word) => write!(self.out, ",{}", image.word(word))?,
            }
        }
        writeln!(self.out)
    }
}
