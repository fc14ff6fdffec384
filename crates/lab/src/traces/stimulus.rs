//! The stimulus of a simulation: CSV rows with the inputs and queued writes of each scan.
//!
//! The first line is `scan,OP,OP,…` or `time,OP,OP,…`; rows ascend; an empty cell changes nothing.
//! A cell may be in quotes.
//! A time (`0.35s`, `1m30s`) means the first scan at or after it. The value of an input (X) holds
//! from that scan on; the value of any other operand is one queued write in that scan. `rungd sim`
//! passes a [`Lookup`], which returns the kind and range of an operand.

use std::borrow::Cow;
use std::fmt::Display;

use super::csv;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::address_text::{self, AddressError};
use rungd_engine::isa::decimal_comma;
use rungd_engine::isa::real::RealError;
use rungd_engine::isa::{Address, Bit, BitSpace, MemorySizes, Real, Word, duration};
use rungd_engine::{Cell, WordCell};
use rungd_language::lower::Symbols;
use rungd_language::source::atom::{Atom, AtomKind};
use rungd_language::source::finding::Code;
use rungd_language::source::span::Span;

/// One change of an input, or one queued write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StimulusChange {
    /// The state of `Xn` from now on.
    Input(u32, bool),
    /// One queued write of a bit.
    Bit(Cell, bool),
    /// One queued write of a word.
    Word(WordCell, i32),
}

/// The kind of an operand in the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StimulusTarget {
    /// `Xn`.
    Input(u32),
    /// A bit that may be written from outside, perhaps of a word.
    Bit(Cell),
    /// A word that may be written from outside, and its bounds.
    Word(WordCell, (i32, i32)),
    /// A word of a real that may be written from outside, and its bounds.
    Real(WordCell, (Real, Real)),
}

impl StimulusTarget {
    /// The target of an operand, from its address.
    ///
    /// # Errors
    /// The reason why it cannot be written from outside.
    pub fn at(
        address: Address,
        operand: &str,
        symbols: &Symbols,
    ) -> Result<StimulusTarget, String> {
        let layout = &symbols.layout;
        match address {
            Address::Bit(Bit::Space(BitSpace::X, n)) => Ok(StimulusTarget::Input(n)),
            Address::Bit(bit) if bit.writable_from_outside() => {
                if let Some(word) = symbols.limited_word(address) {
                    return Err(format!(
                        "`{operand}` cannot be written alone: a tag of `{word}` has `min` or `max`"
                    ));
                }
                Ok(StimulusTarget::Bit(layout.bit_in(bit)))
            }
            Address::Bit(bit @ Bit::Device(..)) => Ok(StimulusTarget::Bit(layout.bit_in(bit))),
            Address::Word(word) if word.writable() => {
                let (min, max) = symbols.limits(word);
                Ok(StimulusTarget::word(word, layout.word(word), min, max))
            }
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => {
                symbols.cell(address, operand)?;
                Err(format!("`{operand}` is read-only: nothing outside can write it"))
            }
        }
    }

    /// The target of a word. The limits are contents of its cell.
    pub fn word(word: Word, cell: WordCell, min: i32, max: i32) -> StimulusTarget {
        match word.is_real() {
            true => StimulusTarget::Real(cell, (Real::of_cell(min), Real::of_cell(max))),
            false => StimulusTarget::Word(cell, (min, max)),
        }
    }
}

/// Resolves an operand's name; the error is the reason why it cannot be written.
pub(crate) type Lookup<'a> = &'a dyn Fn(&str) -> Result<StimulusTarget, String>;

/// All changes, in order of scans.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stimulus {
    changes: Vec<(u64, StimulusChange)>,
    rows: StimulusRows,
}

/// The scan and line of every row, in order of scans.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StimulusRows(Vec<(u64, usize)>);

/// A mistake in a stimulus, with its line (from 1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StimulusError {
    /// The line.
    pub line: usize,
    /// The mistake, and the correction.
    pub message: String,
}

impl Stimulus {
    /// Parses a stimulus by scans.
    ///
    /// # Errors
    /// As [`Stimulus::parse_timed`].
    pub fn parse(text: &str, lookup: Lookup) -> Result<Stimulus, StimulusError> {
        Stimulus::parse_timed(text, ScanPeriod::of_ms(1), lookup)
    }

    /// Parses a stimulus. `period`, that of the scans, is used to convert times to scans.
    ///
    /// # Errors
    /// The first line that has the wrong form, names an operand that cannot be written, or holds a
    /// value beyond its operand's range.
    pub fn parse_timed(
        text: &str,
        period: ScanPeriod,
        lookup: Lookup,
    ) -> Result<Stimulus, StimulusError> {
        let mut lines = text.lines().enumerate().map(|(at, line)| (at + 1, line));
        let header = lines.next().map_or("", |(_, line)| line);
        let header = header.strip_prefix('\u{feff}').unwrap_or(header);
        let (column, targets) =
            parse_header(header, lookup).map_err(|m| StimulusError::new(1, m))?;
        let mut stimulus = Stimulus::default();
        let mut last_scan = None;
        for (line, row) in lines {
            if row.trim().is_empty() {
                continue;
            }
            let fail = |message| StimulusError::new(line, message);
            let cells = csv::cells(row).map_err(fail)?;
            let scan = match column {
                WhenColumn::Scan => parse_scan(&cells[0], last_scan),
                WhenColumn::Time => parse_time(&cells[0], period, last_scan),
            };
            let scan = scan.map_err(fail)?;
            last_scan = Some(scan);
            stimulus.rows.0.push((scan, line));
            stimulus.parse_cells(&cells[1..], scan, &targets).map_err(fail)?;
        }
        Ok(stimulus)
    }

    fn parse_cells(
        &mut self,
        cells: &[Cow<'_, str>],
        scan: u64,
        targets: &[(String, StimulusTarget)],
    ) -> Result<(), String> {
        if cells.len() != targets.len() {
            let is_real = |(_, target): &(_, _)| matches!(target, StimulusTarget::Real(..));
            let has_fraction = cells.len() > targets.len() && targets.iter().any(is_real);
            return Err(format!(
                "the row has {} cells after the first, the header names {} operands{}",
                cells.len(),
                targets.len(),
                if has_fraction {
                    ": in a number with a fraction, write a point, as 12.5"
                } else {
                    ""
                }
            ));
        }
        for (cell, (name, target)) in cells.iter().zip(targets) {
            if !cell.is_empty() {
                self.changes.push((scan, parse_cell(cell, name, *target)?));
            }
        }
        Ok(())
    }

    /// Moves the rows out, for [`StimulusRows::left_out`] after the run. The changes remain.
    pub fn take_rows(&mut self) -> StimulusRows {
        std::mem::take(&mut self.rows)
    }

    /// The changes of one scan. Call it for the scans in order, each time with the same variable
    /// `from`: it holds the index at which the previous call stopped.
    pub fn of_scan<'a>(
        &'a self,
        scan: u64,
        from: &mut usize,
    ) -> impl Iterator<Item = StimulusChange> + 'a {
        let start = *from;
        let count = self.changes[start..].iter().take_while(|(at, _)| *at == scan).count();
        *from += count;
        self.changes[start..start + count].iter().map(|(_, change)| *change)
    }
}

impl StimulusRows {
    /// An error for the first row after the last executed scan. `executed` is the number of scans
    /// that were executed, `planned` the number that the simulation was to have.
    pub fn left_out(&self, executed: u64, planned: u64) -> Option<StimulusError> {
        let at = self.0.partition_point(|(scan, _)| *scan < executed);
        let (scan, line) = *self.0.get(at)?;
        let rows = self.0.len() - at;
        let rows = if rows == 1 { "1 row is".to_owned() } else { format!("{rows} rows are") };
        let why = match executed.checked_sub(1) {
            Some(last) if executed < planned => {
                format!("a STOP instruction ended the simulation after scan {last}")
            }
            Some(_) | None => format!("the simulation has {planned} scans, from 0 on"),
        };
        let message = format!("scan {scan} is not executed: {why} ({rows} left out)");
        Some(StimulusError::new(line, message))
    }
}

impl StimulusError {
    fn new(line: usize, message: String) -> StimulusError {
        StimulusError { line, message }
    }
}

/// A message about an operand like `N,3,6` in a list of operands separated by commas.
pub fn split_element<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let number = |text: &&str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let mut behind = names.skip_while(|name| !name.eq_ignore_ascii_case("N")).skip(1);
    let counter = behind.next().filter(number)?;
    let element = behind.next().filter(number);
    let written = ["N", counter].into_iter().chain(element).collect::<Vec<_>>().join(",");
    let right = match address_text::parse(&written, &MemorySizes::default()) {
        Ok(address @ (Address::Bit(_) | Address::Word(_))) => address.to_string(),
        Ok(Address::Structure(counter)) => format!("{counter}.ACC"),
        Err(AddressError::BeyondMemory { space, first, last }) => {
            return Some(format!("`{written}` lies beyond memory: {space}{first}..{space}{last}"));
        }
        Err(AddressError::NoBits(_) | AddressError::UnknownBit(_)) => return None,
        Err(AddressError::SensaphoneElement) => {
            return Some(format!(
                "`{written}` has no meaning: a Sensaphone counter has the elements 0 to 6 (the \
                 current value is `N{counter}.ACC`)"
            ));
        }
        Err(
            AddressError::NotAnAddress
            | AddressError::Case(_)
            | AddressError::LeadingZero(_)
            | AddressError::UnknownMember(_)
            | AddressError::UnknownNickname,
        ) => return None,
    };
    Some(format!("commas separate operands here: instead of `{written}` write `{right}`"))
}

/// The meaning of the first column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WhenColumn {
    Scan,
    Time,
}

/// The first column, and the operands.
type StimulusHeader = (WhenColumn, Vec<(String, StimulusTarget)>);

fn parse_header(header: &str, lookup: Lookup) -> Result<StimulusHeader, String> {
    if header.contains(';') {
        return Err("cells are separated by `,`, not by `;`".to_owned());
    }
    let cells = csv::cells(header)?;
    let mut names = cells.iter().map(AsRef::as_ref);
    let column = match names.next() {
        Some("scan") => WhenColumn::Scan,
        Some("time") => WhenColumn::Time,
        Some(_) | None => {
            let message = "the header is `scan,` or `time,` and operands, as `scan,X0,D1`";
            return Err(message.to_owned());
        }
    };
    if let Some(message) = split_element(names.clone()) {
        return Err(message);
    }
    let mut targets: Vec<(String, StimulusTarget)> = Vec::new();
    for name in names {
        let target = lookup(name)?;
        if let Some((other, _)) = targets.iter().find(|(_, t)| *t == target) {
            return Err(format!("`{name}` and `{other}` are the same operand"));
        }
        targets.push((name.to_owned(), target));
    }
    Ok((column, targets))
}

/// The first scan at or after the time of a row.
fn parse_time(text: &str, period: ScanPeriod, last_scan: Option<u64>) -> Result<u64, String> {
    let wrong = || {
        decimal_comma::message(text)
            .unwrap_or_else(|| format!("`{text}` is not a time: write it as 0.35s, 350ms or 1m30s"))
    };
    let time_us = seconds_us(text)
        .or_else(|| duration::parse(text).ok().map(|ms| u64::from(ms.unsigned_abs()) * 1000))
        .ok_or_else(wrong)?;
    let scan = time_us.div_ceil(period.us());
    match last_scan {
        Some(last) if scan < last => {
            Err(format!("{text} comes after a later time: rows ascend by time"))
        }
        Some(last) if scan == last => Err(format!(
            "{text} falls into scan {scan}, which has a row already: one row holds all changes of \
             a scan (of {})",
            period.words()
        )),
        Some(_) | None => Ok(scan),
    }
}

/// Seconds with a fraction, in µs: `0.35s`.
fn seconds_us(text: &str) -> Option<u64> {
    let (whole, fraction) = text.strip_suffix('s')?.split_once('.')?;
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || fraction.is_empty() || fraction.len() > 6 || !digits(fraction) {
        return None;
    }
    let whole: u64 = whole.parse::<u32>().ok()?.into();
    let parts: u64 = format!("{fraction:0<6}").parse().ok()?;
    Some(whole * 1_000_000 + parts)
}

fn parse_scan(text: &str, last_scan: Option<u64>) -> Result<u64, String> {
    let scan: u64 =
        text.parse().map_err(|_| format!("`{text}` is not a scan: a number from 0 is wanted"))?;
    match last_scan {
        Some(last) if scan < last => {
            Err(format!("scan {scan} comes after scan {last}: rows ascend by scan"))
        }
        Some(last) if scan == last => {
            Err(format!("scan {scan} has a row already: one row holds all changes of a scan"))
        }
        _ => Ok(scan),
    }
}

/// A whole number in a cell: decimal, hexadecimal or a duration, as in a ladder.
fn whole(text: &str, name: &str) -> Result<i64, String> {
    if let Ok(value) = text.parse() {
        return Ok(value);
    }
    let wanted = || format!("`{name}` is a word: it takes a whole number, as 12, 0x1F or 1m30s");
    match Atom::parse(text, Span::default()).map(|atom| atom.kind) {
        Ok(AtomKind::Integer(n) | AtomKind::Duration(n)) => Ok(n.into()),
        Ok(AtomKind::Name(_) | AtomKind::Real(_)) => Err(format!("{}, not `{text}`", wanted())),
        Err(finding) => Err(match (finding.code, finding.help_text()) {
            (Code::OutOfRange, Some(help)) => format!("{}; {help}", finding.message),
            (_, Some(help)) if help.starts_with("write `") && !help.contains("`, ") => {
                format!("{}, not `{text}`: {help}", wanted())
            }
            (..) => format!("{}, not `{text}`", wanted()),
        }),
    }
}

fn parse_cell(text: &str, name: &str, target: StimulusTarget) -> Result<StimulusChange, String> {
    let bit = || match text {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => Err(format!("`{name}` is a bit: it takes 0 or 1, not `{text}`")),
    };
    match target {
        StimulusTarget::Input(n) => Ok(StimulusChange::Input(n, bit()?)),
        StimulusTarget::Bit(cell) => Ok(StimulusChange::Bit(cell, bit()?)),
        StimulusTarget::Word(cell, (min, max)) => {
            let value = whole(text, name)?;
            if value < i64::from(min) || value > i64::from(max) {
                return Err(format!("`{name}` takes {min} to {max}, not {value}"));
            }
            Ok(StimulusChange::Word(cell, value as i32))
        }
        StimulusTarget::Real(cell, (min, max)) => {
            let integer = |text: &str| text.parse().map(Real::nearest).ok();
            let beyond =
                |given: &dyn Display| format!("`{name}` takes {min} to {max}, not {given}");
            let value = match text.parse() {
                Ok(real) => Some(real),
                Err(RealError::Beyond) => return Err(beyond(&text)),
                Err(RealError::Form) => integer(text),
            };
            let Some(value) = value else {
                return Err(decimal_comma::message(text).unwrap_or_else(|| {
                    format!("`{name}` is a real: it takes a number as 12.5, not `{text}`")
                }));
            };
            if !(min..=max).contains(&value) {
                return Err(beyond(&value));
            }
            Ok(StimulusChange::Word(cell, value.cell()))
        }
    }
}

#[cfg(test)]
#[path = "stimulus_tests.rs"]
mod tests;
