//! A driver's part in the controller file: its keys in `[[device]]` and in the map's rows, the
//! notation of its points, and the settings made from both.
//!
//! Each driver's folder implements [`DriverKeys`]; `drivers` has a row for each driver. `keys` and
//! [`super`] have the keys and rules that all drivers share.

use std::fmt::Debug;
use std::sync::Arc;

use super::settings::{DriverSettings, OnLoss};
use crate::controller::side_ladder::{WrittenSideLadder, operand_of};
use rungd_base::progress::Progress;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::Address;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Fix, possible};
use rungd_language::source::reader::{Constant, Table, Text};
use rungd_language::source::span::{Located, Span};

/// The time between exchanges if `poll` is not given, ms.
const POLL_MS: u32 = 20;

/// One `[[device]]`.
#[derive(Debug)]
pub struct WrittenDevice {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `driver`, if a driver has this name, with the driver's keys.
    pub driver: Option<Box<dyn DriverKeys>>,
    /// `poll`, ms: the time between exchanges.
    pub poll: Option<Located<u32>>,
    /// `on-loss`: the values of its inputs after a loss.
    pub on_loss: OnLoss,
    /// `loss-after`, ms: the age of the last good exchange at which the device is lost.
    pub loss_after: Option<Located<u32>>,
    /// `map`, in file order, then the rows of the device's parts.
    pub map: Vec<MapRow>,
    /// Whether `map` is a single table. The reader has already reported that.
    pub map_is_table: bool,
}

impl WrittenDevice {
    /// The ladder that is the device, with the texts of the map that may be its addresses.
    pub fn side_ladder(&self) -> Option<WrittenSideLadder> {
        let side = self.driver.as_deref()?.side_ladder()?;
        let name = self.name.as_ref()?;
        let texts = self.map.iter().flat_map(|row| [&row.from, &row.to]).flatten();
        let addresses = texts.filter_map(|text| operand_of(&text.text, &name.text));
        Some(WrittenSideLadder {
            addresses: addresses.map(str::to_owned).collect(),
            ..side.clone()
        })
    }

    /// The time between exchanges, ms.
    pub fn poll_ms(&self) -> u32 {
        self.poll.as_ref().map_or(POLL_MS, |poll| poll.value)
    }

    /// The age of the last good exchange at which the device is lost, ms.
    pub fn loss_after_ms(&self) -> u32 {
        let usual_ms = || self.poll_ms().saturating_mul(3).max(1000);
        self.loss_after.as_ref().map_or_else(usual_ms, |age| age.value)
    }
}

/// One row of a map: consecutive points, and the memory that belongs to them.
#[derive(Clone, Debug)]
pub struct MapRow {
    /// The place of its table.
    pub span: Span,
    /// `from`: the source of the values.
    pub from: Option<Text>,
    /// `to`: the destination of the values.
    pub to: Option<Text>,
    /// `safe`: the value outside RUN of an output that is not a Y.
    pub safe: Option<Located<Constant>>,
    /// `hold`: an output that is not a Y keeps its value outside RUN.
    pub hold: Option<Located<bool>>,
    /// The direction of a row that stands for a part's own key, as `run` of a plant's part; `None`
    /// for a row of `map`.
    pub of_part: Option<RowDirection>,
}

/// A driver's keys in one `[[device]]`, and their meaning.
pub trait DriverKeys: Debug {
    /// Reads the keys of the next row of the map.
    fn read_row(&mut self, row: &mut Table<'_>);

    /// Reads the keys of the device.
    fn read(&mut self, table: &mut Table<'_>);

    /// Rows for the keys of the device's parts that name memory; they follow those of `map`.
    fn rows_of_parts(&mut self) -> Vec<MapRow> {
        Vec::new()
    }

    /// Whether a text is in the notation of the points of a device with this name. This decides a
    /// row's direction.
    fn is_point(&self, text: &str, device: &str) -> bool;

    /// The finding for points in the notation of a manual or of another program; `None` if the text
    /// is in none that the driver knows.
    fn other_notation(&self, _text: &Text) -> Option<Finding> {
        None
    }

    /// An example of a point of a device with this name as written, for a help.
    fn example(&self, device: &str) -> String;

    /// The settings, with the points of all rows in their order; a wrong key or point becomes a
    /// finding.
    fn resolve(
        &self,
        device: &WrittenDevice,
        rows: ResolvedRows<'_>,
        findings: &mut Vec<Finding>,
    ) -> Option<DriverSettings>;

    /// The ladder that is the device, to be loaded before its map is resolved.
    fn side_ladder(&self) -> Option<&WrittenSideLadder> {
        None
    }

    /// Whether it exchanges every `poll`, beside the scan.
    fn is_polled(&self) -> bool {
        true
    }

    /// The place of an output that the map has no row for (a watchdog's register).
    fn other_output(&self) -> Option<Span> {
        None
    }
}

/// The points that an editor offers for the map of a device.
pub enum OfferedPoints {
    /// The beginnings of their texts.
    Beginnings(fn() -> Vec<PointBeginning>),
    /// The points of the parts that the device has in its file.
    OfParts,
    /// The tags of the ladder that the device is.
    OfLadder,
}

/// The beginning of the text of a point.
pub struct PointBeginning {
    /// The text, as `holding `.
    pub text: String,
    /// What such a point is.
    pub about: String,
    /// Whether an output can be mapped there.
    pub is_written: bool,
}

/// The direction of a row's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowDirection {
    /// From the device to memory.
    In,
    /// From memory to the device.
    Out,
}

/// A row of a map, with resolved addresses.
pub struct ResolvedRow<'a> {
    /// Its number in the map, with which the driver finds the row's keys.
    pub at: usize,
    /// The row as written.
    pub written: &'a MapRow,
    /// The direction of its values.
    pub direction: RowDirection,
    /// The points, in the driver's notation.
    pub points: &'a Text,
    /// One address per point, in the order of the points.
    pub addresses: Vec<Address>,
    /// The addresses as written.
    pub text: &'a Text,
}

/// The resolved rows of a device, and what else the load knows about it.
#[derive(Clone, Copy)]
pub struct ResolvedRows<'a> {
    /// The rows, in file order. Rows with a mistake are left out.
    pub all: &'a [ResolvedRow<'a>],
    /// The progress of the load.
    pub progress: &'a Progress,
    /// The scan period of the controller.
    pub period: ScanPeriod,
    /// The ladder that is the device, if it is one that was loaded.
    pub ladder: Option<&'a Arc<Program>>,
}

impl<'a> ResolvedRows<'a> {
    /// The rows, until the load must end.
    pub fn each(self) -> impl Iterator<Item = &'a ResolvedRow<'a>> {
        self.progress.during(self.all)
    }
}

impl ResolvedRow<'_> {
    /// A finding at the row's points.
    pub fn find(&self, message: String) -> Finding {
        Finding::new(Code::Controller, self.points.span, message)
    }

    /// The fix that names the address of the same number in another block of memory.
    pub fn placed_in(&self, block: &str) -> Fix {
        let number = self.text.text.trim_start_matches(|c: char| !c.is_ascii_digit());
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        let number = if is_number { number } else { "0" };
        possible(format!("{block}{number}")).at(self.text.span)
    }

    /// The fix that names only its first addresses; `None` if it has not as many.
    pub fn of_count(&self, count: usize) -> Option<Fix> {
        let (first, last) = (self.addresses.first()?, self.addresses.get(count.checked_sub(1)?)?);
        let text = if count == 1 { first.to_string() } else { format!("{first}..{last}") };
        Some(possible(text).at(self.text.span))
    }

    /// Whether its addresses are words of reals.
    pub fn is_real(&self) -> bool {
        matches!(self.addresses.first(), Some(Address::Word(word)) if word.is_real())
    }

    /// Whether its addresses are words of whole numbers with 32 bits.
    pub fn has_words_of_32_bits(&self) -> bool {
        let is_wide = |address: &Address| match address {
            Address::Word(word) => !word.is_real() && word.range() == (i32::MIN, i32::MAX),
            Address::Bit(_) | Address::Structure(_) => false,
        };
        self.addresses.iter().all(is_wide)
    }

    /// Whether its addresses are words.
    pub fn is_words(&self) -> bool {
        matches!(self.addresses.first(), Some(Address::Word(_)))
    }
}
