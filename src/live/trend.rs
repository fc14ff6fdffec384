//! The values of an operand, scan by scan: where they change.

use std::sync::Arc;

use crate::engine::{Cell, Engine, EngineCall};
use crate::observe::Subject;
use crate::runtime::{TapeEntry, TapeSection, numbered_calls};

/// The most points of a trend: then the lowest and highest value of each stretch are kept.
const POINTS_MAX: usize = 4000;

/// The values of an operand.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trend {
    /// The time of the first and the last scan, ns since 1970 (UTC).
    pub span_ns: Option<(i64, i64)>,
    /// The first value, and each change.
    pub points: Vec<TrendPoint>,
}

/// A value from a scan on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrendPoint {
    /// The time of the scan, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Its number.
    pub scan: u64,
    /// The content of the cell.
    pub value: i32,
}

/// Executes the part of the program that can affect a cell.
pub(super) fn trend(subject: &Subject, sections: &[Arc<TapeSection>], cell: Cell) -> Trend {
    let mut engine = Engine::new(subject.code_for(cell));
    let mut trend = Trend::default();
    for section in sections {
        if !engine.resume(&section.state) {
            continue;
        }
        let begins = numbered_calls(&section.entries, section.start.number);
        let mut numbers = begins.filter(|of| of.call == EngineCall::Execute).peekable();
        for (at, entry) in section.entries.iter().enumerate() {
            let TapeEntry::Call(call) = entry else { continue };
            engine.apply(*call);
            if let Some(scan) = numbers.next_if(|of| of.entry == at) {
                let unix_ns = section.start.unix_offset_ns.saturating_add_unsigned(scan.now_ns);
                let value = content(&engine, cell);
                trend.add(TrendPoint { unix_ns, scan: scan.number, value });
            }
        }
    }
    trend.thin();
    trend
}

fn content(engine: &Engine, cell: Cell) -> i32 {
    match cell {
        Cell::Bit(bit) => i32::from(engine.image().bit(bit)),
        Cell::Word(word) => engine.image().words().get(word.0 as usize).copied().unwrap_or(0),
    }
}

impl Trend {
    fn add(&mut self, point: TrendPoint) {
        let first = self.span_ns.map_or(point.unix_ns, |(first, _)| first);
        self.span_ns = Some((first, point.unix_ns));
        if self.points.last().is_none_or(|last| last.value != point.value) {
            self.points.push(point);
        }
    }

    /// Of each stretch the lowest and the highest value stay, in their order.
    fn thin(&mut self) {
        if self.points.len() <= POINTS_MAX {
            return;
        }
        let stretch = self.points.len().div_ceil(POINTS_MAX / 2);
        let ends = |points: &[TrendPoint]| {
            let lowest = points.iter().min_by_key(|point| point.value).copied();
            let highest = points.iter().max_by_key(|point| point.value).copied();
            let mut both: Vec<TrendPoint> = lowest.into_iter().chain(highest).collect();
            both.sort_by_key(|point| point.scan);
            both.dedup();
            both
        };
        self.points = self.points.chunks(stretch).flat_map(ends).collect();
    }
}
