//! The values of one operand over hours, in steps of a second: the least, the greatest and the last
//! value of each, or why there is none.
//!
//! Used by `trend_store`, which fills it from the live view and from the scan log, and by `api`,
//! which draws points from it. Pure. What is kept is bounded by [`TREND_MAX_NS`].

use std::collections::BTreeMap;

use rungd_client::live::{PastGap, PastPiece, TagValue};

/// The longest trend: 8 h.
pub(super) const TREND_MAX_NS: i64 = 8 * 3_600 * SECOND_NS;
pub(super) const SECOND_NS: i64 = 1_000_000_000;
/// The steps that are filled at once.
const CHUNK_STEPS: usize = 15;
/// The time of these steps.
pub(super) const CHUNK_NS: i64 = CHUNK_STEPS as i64 * SECOND_NS;

/// Why a step has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EmptyStep {
    /// The mode, in which no scan gives one.
    Mode(&'static str),
    /// Nothing is recorded.
    NotRecorded,
    /// The scan log has not been read so far.
    NotRead,
}

impl EmptyStep {
    /// A few words for people.
    pub fn words(self) -> &'static str {
        match self {
            EmptyStep::Mode(mode) => mode,
            EmptyStep::NotRecorded => "not recorded",
            EmptyStep::NotRead => "is being read",
        }
    }
}

/// A second of a trend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TrendStep {
    /// Values.
    Values(StepValues),
    /// The output's device is lost.
    Unknown,
    /// No value.
    Empty(EmptyStep),
}

/// The values of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepValues {
    pub least: f64,
    pub greatest: f64,
    pub last: f64,
}

impl StepValues {
    fn of(value: f64) -> StepValues {
        StepValues { least: value, greatest: value, last: value }
    }

    fn and(self, next: StepValues) -> StepValues {
        let (least, greatest) = (self.least.min(next.least), self.greatest.max(next.greatest));
        StepValues { least, greatest, last: next.last }
    }
}

impl TrendStep {
    /// Both steps as one: a value counts more than none.
    pub fn and(self, next: TrendStep) -> TrendStep {
        match (self, next) {
            (TrendStep::Values(one), TrendStep::Values(other)) => TrendStep::Values(one.and(other)),
            (TrendStep::Values(values), _) | (_, TrendStep::Values(values)) => {
                TrendStep::Values(values)
            }
            (TrendStep::Unknown, _) | (_, TrendStep::Unknown) => TrendStep::Unknown,
            (TrendStep::Empty(_), TrendStep::Empty(why)) => TrendStep::Empty(why),
        }
    }
}

/// The trend of an operand.
#[derive(Debug, Default)]
pub(super) struct TrendLine {
    /// Whether the operand is a bit.
    pub is_bit: bool,
    /// Filled steps, by the number of their chunk.
    chunks: BTreeMap<i64, [TrendStep; CHUNK_STEPS]>,
    /// The steps behind the last whole chunk, and the first of them.
    newest: (i64, Vec<TrendStep>),
}

impl TrendLine {
    /// Fills the chunks that lie between two times as a whole.
    pub fn fill(&mut self, piece: &PastPiece, from_ns: i64, to_ns: i64) {
        let first = from_ns.div_euclid(CHUNK_NS) + i64::from(from_ns.rem_euclid(CHUNK_NS) > 0);
        let end = to_ns.div_euclid(CHUNK_NS);
        let count = usize::try_from(end - first).unwrap_or(0).min(MAX_CHUNKS);
        if count == 0 {
            return;
        }
        let steps = steps(piece, first * CHUNK_NS, count * CHUNK_STEPS);
        for (number, steps) in (first..).zip(steps.chunks_exact(CHUNK_STEPS)) {
            let mut chunk = [TrendStep::Empty(EmptyStep::NotRecorded); CHUNK_STEPS];
            chunk.copy_from_slice(steps);
            self.chunks.insert(number, chunk);
        }
        self.is_bit |= piece.values.iter().any(|at| matches!(at.value, Some(TagValue::Bit(_))));
    }

    /// Takes what is behind the last whole chunk before a time. What lies before `begin_ns`, where
    /// the piece begins, is not read so far.
    pub fn continue_with(&mut self, piece: &PastPiece, begin_ns: i64, to_ns: i64) {
        let first = to_ns.div_euclid(CHUNK_NS) * CHUNK_STEPS as i64;
        let first = first.max(begin_ns.div_euclid(SECOND_NS));
        let count = usize::try_from(to_ns.div_euclid(SECOND_NS) + 1 - first).unwrap_or(0);
        let count = count.min(CHUNK_STEPS);
        self.newest = (first, steps(piece, first * SECOND_NS, count));
    }

    /// Forgets what is older than the longest trend.
    pub fn forget(&mut self, now_ns: i64) {
        self.chunks = self.chunks.split_off(&(now_ns - TREND_MAX_NS).div_euclid(CHUNK_NS));
    }

    /// The newest stretch of chunks between two times that is not filled, of at most so many
    /// chunks: from when to when.
    pub fn missing(&self, from_ns: i64, to_ns: i64, chunks_max: i64) -> Option<(i64, i64)> {
        let (first, end) = (from_ns.div_euclid(CHUNK_NS), to_ns.div_euclid(CHUNK_NS));
        let last = (first..end).rev().find(|number| !self.chunks.contains_key(number))?;
        let begin = (first.max(last + 1 - chunks_max)..=last).rev();
        let begin = begin.take_while(|number| !self.chunks.contains_key(number)).last()?;
        Some((begin * CHUNK_NS, (last + 1) * CHUNK_NS))
    }

    /// The steps from a time on, each of so many seconds.
    pub fn steps(&self, from_ns: i64, seconds: i64, count: usize) -> Vec<TrendStep> {
        let step = |at: usize| {
            let begin = from_ns.div_euclid(SECOND_NS) + at as i64 * seconds;
            let all = (begin..begin + seconds).map(|second| self.second(second));
            all.reduce(TrendStep::and).unwrap_or(TrendStep::Empty(EmptyStep::NotRead))
        };
        (0..count).map(step).collect()
    }

    fn second(&self, second: i64) -> TrendStep {
        let (first, newest) = &self.newest;
        let newest = usize::try_from(second - first).ok().and_then(|at| newest.get(at));
        if let Some(step) = newest {
            return *step;
        }
        let chunk = self.chunks.get(&second.div_euclid(CHUNK_STEPS as i64));
        let at = second.rem_euclid(CHUNK_STEPS as i64) as usize;
        chunk.map_or(TrendStep::Empty(EmptyStep::NotRead), |chunk| chunk[at])
    }
}

/// The most chunks that are filled at once.
const MAX_CHUNKS: usize = (TREND_MAX_NS / CHUNK_NS) as usize + 1;

/// The seconds of a piece from a time on.
pub(super) fn steps(piece: &PastPiece, from_ns: i64, count: usize) -> Vec<TrendStep> {
    let mut steps = vec![TrendStep::Empty(EmptyStep::NotRecorded); count];
    let end_ns = from_ns + count as i64 * SECOND_NS;
    let ends = piece.values.iter().skip(1).map(|next| next.unix_ns);
    let ends = ends.chain(std::iter::once(end_ns));
    for (value, end_ns) in piece.values.iter().zip(ends) {
        for stretch in without_gaps(value.unix_ns, end_ns.max(value.unix_ns), &piece.gaps) {
            let found = match value.value {
                Some(value) => TrendStep::Values(StepValues::of(number(value))),
                None => TrendStep::Unknown,
            };
            for at in places(stretch, from_ns, count) {
                steps[at] = match (steps[at], found) {
                    (TrendStep::Values(known), TrendStep::Values(next)) => {
                        TrendStep::Values(known.and(next))
                    }
                    (TrendStep::Values(known), _) => TrendStep::Values(known),
                    (TrendStep::Unknown | TrendStep::Empty(_), found) => found,
                };
            }
        }
    }
    for gap in &piece.gaps {
        let why = gap.mode.map_or(EmptyStep::NotRecorded, EmptyStep::Mode);
        let stretch = Stretch { from_ns: gap.from_ns, to_ns: gap.to_ns };
        for at in places(stretch, from_ns, count) {
            if let TrendStep::Empty(_) = steps[at] {
                steps[at] = TrendStep::Empty(why);
            }
        }
    }
    steps
}

/// A time from one moment to another.
#[derive(Clone, Copy)]
struct Stretch {
    from_ns: i64,
    to_ns: i64,
}

/// The parts of a time that no gap covers. A moment without a length is a part too.
fn without_gaps(from_ns: i64, to_ns: i64, gaps: &[PastGap]) -> Vec<Stretch> {
    let (mut parts, mut begin_ns) = (Vec::new(), from_ns);
    let first = gaps.partition_point(|gap| gap.to_ns <= from_ns);
    for gap in gaps[first..].iter().take_while(|gap| gap.from_ns < to_ns) {
        if gap.from_ns > begin_ns {
            parts.push(Stretch { from_ns: begin_ns, to_ns: gap.from_ns });
        }
        begin_ns = begin_ns.max(gap.to_ns);
    }
    // A value that changes again within the same scan has no length.
    if begin_ns < to_ns || begin_ns == from_ns {
        parts.push(Stretch { from_ns: begin_ns, to_ns });
    }
    parts
}

/// The places of the steps that a stretch touches.
fn places(stretch: Stretch, from_ns: i64, count: usize) -> std::ops::Range<usize> {
    let place = |ns: i64| (ns - from_ns).div_euclid(SECOND_NS).clamp(0, count as i64) as usize;
    let Stretch { from_ns: begin_ns, to_ns } = stretch;
    if to_ns < from_ns || begin_ns >= from_ns + count as i64 * SECOND_NS {
        return 0..0;
    }
    let end = place(to_ns.max(begin_ns + 1) - 1) + 1;
    place(begin_ns)..end.min(count)
}

/// A value as a number.
fn number(value: TagValue) -> f64 {
    match value {
        TagValue::Bit(on) => f64::from(u8::from(on)),
        TagValue::Integer(value) => f64::from(value),
        TagValue::Real(value) => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_client::live::TimedValue;

    const FROM_NS: i64 = 1_000 * CHUNK_NS;

    fn at(seconds: f64) -> i64 {
        FROM_NS + (seconds * 1e9) as i64
    }

    fn piece(values: &[(f64, i32)], gaps: &[(f64, f64)]) -> PastPiece {
        let value = |(seconds, value): &(f64, i32)| TimedValue {
            unix_ns: at(*seconds),
            value: Some(TagValue::Integer(*value)),
        };
        let gap =
            |(from, to): &(f64, f64)| PastGap { from_ns: at(*from), to_ns: at(*to), mode: None };
        let (values, gaps) = (values.iter().map(value), gaps.iter().map(gap));
        PastPiece { values: values.collect(), gaps: gaps.collect() }
    }

    /// Steps as text: `1..5>3` goes from 1 to 5 and ends with 3, `-` has no value.
    fn text(steps: &[TrendStep]) -> String {
        let one = |step: &TrendStep| match step {
            TrendStep::Values(StepValues { least, greatest, last }) if least == greatest => {
                last.to_string()
            }
            TrendStep::Values(StepValues { least, greatest, last }) => {
                format!("{least}..{greatest}>{last}")
            }
            TrendStep::Unknown => "?".to_owned(),
            TrendStep::Empty(why) => why.words().replace(' ', "-"),
        };
        steps.iter().map(one).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_step_has_the_least_the_greatest_and_the_last_value_of_its_second() {
        let piece = piece(&[(0.0, 3), (1.2, 9), (1.4, 1), (1.9, 4)], &[]);
        assert_eq!(text(&steps(&piece, FROM_NS, 4)), "3 1..9>4 4 4");
    }

    #[test]
    fn a_time_that_is_not_recorded_has_no_value_and_a_value_counts_more_than_none() {
        let piece = piece(&[(0.0, 3), (4.5, 7)], &[(1.5, 4.5)]);
        assert_eq!(text(&steps(&piece, FROM_NS, 6)), "3 3 not-recorded not-recorded 7 7");
        let early = super::tests::piece(&[(2.5, 1)], &[]);
        assert_eq!(text(&steps(&early, FROM_NS, 4)), "not-recorded not-recorded 1 1");
    }

    #[test]
    fn a_fault_is_named() {
        let mut piece = piece(&[(0.0, 3)], &[(1.0, 3.0)]);
        piece.gaps[0].mode = Some("FAULT");
        assert_eq!(text(&steps(&piece, FROM_NS, 4)), "3 FAULT FAULT 3");
    }

    #[test]
    fn what_the_live_view_does_not_have_after_a_restart_is_being_read_and_not_unrecorded() {
        let mut line = TrendLine::default();
        let piece = piece(&[(4.2, 5)], &[]);
        line.continue_with(&piece, at(4.2), at(6.5));
        let read = "is-being-read";
        assert_eq!(
            text(&line.steps(FROM_NS + 2 * SECOND_NS, 1, 6)),
            format!("{read} {read} 5 5 5 {read}")
        );
        line.continue_with(&piece, at(-60.0), at(6.5));
        assert_eq!(text(&line.steps(FROM_NS + 3 * SECOND_NS, 1, 2)), "not-recorded 5");
    }

    #[test]
    fn whole_chunks_are_filled_and_the_newest_missing_stretch_is_asked_for_first() {
        let mut line = TrendLine::default();
        let end_ns = FROM_NS + 10 * CHUNK_NS;
        assert_eq!(line.missing(FROM_NS, end_ns, 4), Some((FROM_NS + 6 * CHUNK_NS, end_ns)));
        // From the middle of a chunk: only those that are whole.
        let piece = piece(&[(0.0, 5)], &[]);
        line.fill(&piece, FROM_NS + 6 * CHUNK_NS - 1, end_ns + 1);
        let missing = line.missing(FROM_NS, end_ns, 4);
        assert_eq!(missing, Some((FROM_NS + 2 * CHUNK_NS, FROM_NS + 6 * CHUNK_NS)));
        line.fill(&piece, FROM_NS, FROM_NS + 2 * CHUNK_NS);
        line.fill(&piece, FROM_NS + 3 * CHUNK_NS, FROM_NS + 6 * CHUNK_NS);
        let missing = line.missing(FROM_NS, end_ns, 4);
        assert_eq!(missing, Some((FROM_NS + 2 * CHUNK_NS, FROM_NS + 3 * CHUNK_NS)));
        let steps = line.steps(FROM_NS + CHUNK_NS, 15, 3);
        assert_eq!(text(&steps), "5 is-being-read 5");
        line.forget(end_ns + TREND_MAX_NS);
        assert_eq!(line.missing(FROM_NS, end_ns, 100), Some((FROM_NS, end_ns)));
    }
}
