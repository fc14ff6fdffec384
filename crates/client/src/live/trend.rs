//! The values of an operand over the minute: the first one, and each change. Of a Y it is what the
//! output is driven to, by `controller::OutputRules`, and not its bit in memory.

use std::sync::Arc;

use crate::operator::protocol::PresentOutputs;
use rungd_config::controller::OutputState;
use rungd_engine::{BitCell, Cell};
use rungd_history::observe::{CellChanged, Subject};
use rungd_runtime::TapeSection;
use rungd_runtime::exchange::Mode;

/// The most points of a trend. A longer one keeps the lowest and the highest value of each stretch,
/// and that one is not known.
const POINTS_MAX: usize = 4000;
/// Outside RUN no scan moves the end of a trend. So that the last value is seen, the trend goes on
/// for at most this time.
const TAIL_MAX_NS: i64 = 10_000_000_000;

/// The values of an operand.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trend {
    /// The time of the first and the last scan, ns since 1970 (UTC). Outside RUN the end is later.
    pub span_ns: Option<(i64, i64)>,
    /// The first value, and each change.
    pub points: Vec<TrendPoint>,
    /// The times outside RUN, in which no scan gave a value. None of an output.
    pub gaps: Vec<TrendGap>,
}

/// A time outside RUN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrendGap {
    /// The time of the last scan before it, ns since 1970 (UTC).
    pub from_ns: i64,
    /// The time of the first scan after it; `None`: it has not ended.
    pub to_ns: Option<i64>,
    /// The mode in which it begins.
    pub mode: Mode,
}

/// A value from a scan on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrendPoint {
    /// The scan; the first of a process is 1.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The value; `None`: it is not known, because the device of the output is lost.
    pub value: Option<i32>,
}

/// The minute of a trend, or another stretch of sections that follow each other.
#[derive(Clone, Copy)]
pub(super) struct TrendMinute<'a> {
    pub subject: &'a Subject,
    pub sections: &'a [Arc<TapeSection>],
    /// What the controller does at present, and the content of the cell at the last scan.
    pub present: Option<&'a PresentOutputs>,
    pub content: i32,
}

/// A scan of the minute.
#[derive(Clone, Copy)]
struct TrendScan {
    number: u64,
    /// Its time, ns since 1970 (UTC).
    unix_ns: i64,
}

/// The trend of a minute, with as many points as a page draws.
pub(super) fn trend(view: TrendMinute<'_>, cell: Cell) -> Trend {
    let trend = whole_trend(view, cell);
    Trend { points: thinned(trend.points), ..trend }
}

/// The trend of a minute, with all its points.
pub(super) fn whole_trend(view: TrendMinute<'_>, cell: Cell) -> Trend {
    let (subject, sections) = (view.subject, view.sections);
    let last = sections.iter().rev().find_map(|section| {
        let begun = section.begins().last()?;
        let unix_ns = section.start.unix_ns(begun.now_ns);
        Some(TrendScan { number: begun.number, unix_ns })
    });
    let point = |changed: CellChanged| TrendPoint {
        scan: changed.scan,
        unix_ns: changed.unix_ns,
        value: Some(changed.after),
    };
    // What an output is driven to is known outside RUN too.
    let number = subject.output_rules().number(cell);
    let gaps = if number.is_none() { gaps(sections) } else { Vec::new() };
    let points: Vec<TrendPoint> = match number {
        None => subject.changes(sections, &[cell]).into_iter().map(point).collect(),
        Some(number) => {
            let mut points = driven(view, cell);
            points.extend(last.and_then(|at| now(view, number, at, points.last())));
            points
        }
    };
    let end = last.map(|last| match view.present {
        Some(present) if present.on.is_some() => {
            present.unix_ns.clamp(last.unix_ns, last.unix_ns.saturating_add(TAIL_MAX_NS))
        }
        Some(_) | None => last.unix_ns,
    });
    let first = points.first().map(|point| point.unix_ns);
    Trend { span_ns: first.zip(end), points, gaps }
}

/// The present state of an output, if the log does not have it: its device is lost since the last
/// scan, or a scan hangs.
fn now(
    view: TrendMinute<'_>,
    number: u32,
    at: TrendScan,
    last: Option<&TrendPoint>,
) -> Option<TrendPoint> {
    let value = match view.present?.output(number) {
        OutputState::AsMemory => Some(view.content),
        OutputState::Safe(on) => Some(on.into()),
        OutputState::Unknown(_) => None,
    };
    (last.map(|last| last.value) != Some(value)).then_some(TrendPoint {
        scan: at.number,
        unix_ns: at.unix_ns,
        value,
    })
}

/// What an output was driven to, by its bit, the mode and the `.Ok` of its devices.
fn driven(view: TrendMinute<'_>, cell: Cell) -> Vec<TrendPoint> {
    let rules = view.subject.output_rules();
    let devices = rules.devices(cell);
    let cells: Vec<Cell> =
        std::iter::once(cell).chain(devices.iter().map(|ok| Cell::Bit(*ok))).collect();
    let mut modes = modes(view.sections).into_iter().peekable();
    let mut mode = Mode::Run;
    let mut values = vec![0; cells.len()];
    let mut points: Vec<TrendPoint> = Vec::new();
    let mut add = |at: (i64, u64), mode: Mode, values: &[i32]| {
        let ok = |ok: BitCell| {
            cells.iter().zip(values).any(|cell_and_value| cell_and_value == (&Cell::Bit(ok), &1))
        };
        let is_lost = rules.is_lost(cell, ok);
        let value = (!is_lost).then(|| rules.driven(cell, mode, values[0]));
        if points.last().is_none_or(|last| last.value != value) {
            points.push(TrendPoint { scan: at.1, unix_ns: at.0, value });
        }
    };
    let changes = view.subject.changes(view.sections, &cells);
    for (number, change) in changes.iter().enumerate() {
        let at = (change.unix_ns, change.scan);
        while let Some((changed_at, next)) = modes.next_if(|(changed_at, _)| *changed_at < at) {
            mode = next;
            add(changed_at, mode, &values);
        }
        while let Some((_, next)) =
            modes.next_if(|(changed_at, next)| *changed_at == at && *next == Mode::Run)
        {
            mode = next;
        }
        if let Some(place) = cells.iter().position(|cell| *cell == change.cell) {
            values[place] = change.after;
        }
        // The changes of one scan count together. Those of the passes of a STOP are not driven: the
        // mode follows, with the safe values.
        let group = |change: &CellChanged| (change.unix_ns, change.scan, change.in_passes);
        let ends = changes.get(number + 1).is_none_or(|next| group(next) != group(change));
        if ends && !(change.in_passes && mode == Mode::Run) {
            add(at, mode, &values);
        }
    }
    for (changed_at, next) in modes {
        mode = next;
        add(changed_at, mode, &values);
    }
    points
}

/// The times outside RUN.
fn gaps(sections: &[Arc<TapeSection>]) -> Vec<TrendGap> {
    let mut gaps: Vec<TrendGap> = Vec::new();
    for ((unix_ns, _), mode) in modes(sections) {
        let open = gaps.last_mut().filter(|gap| gap.to_ns.is_none());
        match (open, mode) {
            (Some(gap), Mode::Run) => gap.to_ns = Some(unix_ns),
            (Some(_), Mode::Stop(_) | Mode::Fault(_)) | (None, Mode::Run) => {}
            (None, Mode::Stop(_) | Mode::Fault(_)) => {
                gaps.push(TrendGap { from_ns: unix_ns, to_ns: None, mode });
            }
        }
    }
    gaps
}

/// The modes of the sections, each with its time and scan, in order. RUN begins with its first
/// scan; every other mode begins right after a scan.
fn modes(sections: &[Arc<TapeSection>]) -> Vec<((i64, u64), Mode)> {
    let mut all: Vec<((i64, u64), Mode)> = Vec::new();
    for section in sections {
        let (start, before) = (section.start, section.start.number.saturating_sub(1));
        if all.last().is_none_or(|(_, mode)| *mode != start.mode) {
            all.push(((start.unix_ns(section.begin_ns()), before), start.mode));
        }
        let mut runs = false;
        for step in section.steps() {
            let at = (start.unix_ns(step.now_ns), step.number);
            if step.begins_scan() && std::mem::take(&mut runs) {
                all.push((at, Mode::Run));
            }
            match step.entry.mode() {
                Some(Mode::Run) => runs = true,
                Some(mode) => all.push((at, mode)),
                None => {}
            }
        }
    }
    all
}

/// Keeps of each stretch the lowest and the highest value, and the first that is not known, in
/// their order. The contents of cells sort as the values do, of reals too, which are never a NaN.
fn thinned(points: Vec<TrendPoint>) -> Vec<TrendPoint> {
    if points.len() <= POINTS_MAX {
        return points;
    }
    let stretch = points.len().div_ceil(POINTS_MAX / 3);
    let ends = |points: &[TrendPoint]| {
        let known = || points.iter().filter(|point| point.value.is_some());
        let lowest = known().min_by_key(|point| point.value);
        let highest = known().max_by_key(|point| point.value);
        let unknown = points.iter().find(|point| point.value.is_none());
        let kept = [lowest, highest, unknown].into_iter().flatten().copied();
        let mut kept: Vec<TrendPoint> = kept.collect();
        kept.sort_by_key(|point| point.scan);
        kept.dedup();
        kept
    };
    points.chunks(stretch).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::isa::Real;

    fn points(contents: &[Option<i32>]) -> Vec<TrendPoint> {
        let point = |(scan, value): (u64, &Option<i32>)| TrendPoint {
            scan,
            unix_ns: scan as i64,
            value: *value,
        };
        (0..).zip(contents).map(point).collect()
    }

    /// What is kept of the first stretch of a trend that has these contents again and again.
    fn kept(contents: &[Option<i32>]) -> Vec<Option<i32>> {
        let many: Vec<_> = contents.iter().copied().cycle().take(3 * POINTS_MAX).collect();
        let kept = thinned(points(&many));
        assert!(kept.len() <= POINTS_MAX, "{}", kept.len());
        assert!(kept.is_sorted_by_key(|point| point.scan));
        let stretch = many.len().div_ceil(POINTS_MAX / 3) as u64;
        kept.iter().take_while(|point| point.scan < stretch).map(|point| point.value).collect()
    }

    fn reals(values: &[f64]) -> Vec<Option<i32>> {
        values.iter().map(|value| Some(Real::stored(*value).real.cell())).collect()
    }

    #[test]
    fn a_short_trend_keeps_every_point() {
        let all = points(&[Some(1), None, Some(1), Some(0)]);
        assert_eq!(thinned(all.clone()), all);
    }

    #[test]
    fn a_long_trend_keeps_the_lowest_and_the_highest_value_and_that_one_is_not_known() {
        let contents = [-7, 3, 9, 4, 5, 0].map(Some);
        let contents = [&contents[..], &[None, Some(1), None]].concat();
        assert_eq!(kept(&contents), [Some(-7), Some(9), None]);
    }

    #[test]
    fn a_long_trend_of_reals_keeps_the_lowest_and_the_highest_one() {
        let values = reals(&[-1.0, -2.5, 3.0, 0.5, -0.5, 2.0, -0.0, -1e-40, 1e-40]);
        assert_eq!(kept(&values), reals(&[-2.5, 3.0]));
        let small = reals(&[0.0, -0.0, -1e-40, 1e-40, f64::MIN_POSITIVE]);
        assert_eq!(kept(&small)[..2], reals(&[-1e-40, 1e-40]));
        // Neither is ever stored.
        let never = reals(&[-0.0, f64::INFINITY]);
        assert_eq!(never, reals(&[0.0, f64::from(f32::MAX)]));
    }
}
