//! Minimum, maximum and average of the intervals of a processed read (OPC 10000-13).
//!
//! Called by `history` with the values of the whole span, in the order of the log.

use opcua::types::{DataValue, NodeId, ObjectId, StatusCode, Variant};

use crate::pages::PastValue;
use crate::values::{stamped, time};

/// The most intervals of a processed read.
const INTERVALS_MAX: i64 = 10_000;

/// A part of the time, ns since 1970 (UTC), without its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PastInterval {
    /// Its begin.
    pub start_ns: i64,
    /// Its end.
    pub end_ns: i64,
}

impl PastInterval {
    /// Its intervals of this length, ms; 0: it is one interval. `None`: it is empty, or they are
    /// too many.
    pub fn divided(self, length_ms: f64) -> Option<Vec<PastInterval>> {
        let PastInterval { start_ns, end_ns } = self;
        let whole_ns = end_ns.saturating_sub(start_ns);
        // A NaN becomes 0, and what is too large the largest number.
        let length_ns = match (length_ms * 1e6) as i64 {
            length @ 1.. => length,
            _ => whole_ns,
        };
        if start_ns >= end_ns || whole_ns / length_ns >= INTERVALS_MAX {
            return None;
        }
        let mut intervals = Vec::new();
        let mut start = start_ns;
        while start < end_ns {
            let end = start.saturating_add(length_ns).min(end_ns);
            intervals.push(PastInterval { start_ns: start, end_ns: end });
            start = end;
        }
        Some(intervals)
    }
}

/// What is made of the values of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aggregate {
    /// The least value.
    Minimum,
    /// The greatest value.
    Maximum,
    /// The mean over time: a value holds until the next.
    Average,
}

impl Aggregate {
    /// The aggregate of an id.
    pub fn of(id: &NodeId) -> Option<Aggregate> {
        let is = |known: ObjectId| *id == known;
        if is(ObjectId::AggregateFunction_Minimum) {
            Some(Aggregate::Minimum)
        } else if is(ObjectId::AggregateFunction_Maximum) {
            Some(Aggregate::Maximum)
        } else if is(ObjectId::AggregateFunction_Average)
            || is(ObjectId::AggregateFunction_TimeAverage)
        {
            Some(Aggregate::Average)
        } else {
            None
        }
    }

    /// The value of an interval; without a number in it, "no data".
    pub fn value(self, values: &[PastValue], interval: PastInterval) -> DataValue {
        let PastInterval { start_ns, end_ns } = interval;
        let pieces = pieces(values, interval);
        let numbers = pieces.iter().map(|(number, _)| *number);
        let result = match self {
            Aggregate::Minimum => numbers.reduce(f64::min),
            Aggregate::Maximum => numbers.reduce(f64::max),
            Aggregate::Average => {
                let time: f64 = pieces.iter().map(|(_, ns)| *ns as f64).sum();
                let sum: f64 = pieces.iter().map(|(number, ns)| number * *ns as f64).sum();
                (time > 0.0).then(|| sum / time)
            }
        };
        debug_assert!(start_ns < end_ns);
        match result {
            Some(number) => stamped(Variant::from(number), StatusCode::Good, time(start_ns)),
            None => stamped(Variant::Empty, StatusCode::BadNoData, time(start_ns)),
        }
    }
}

/// The numbers of an interval, each with the time for which it holds in it, ns.
fn pieces(
    values: &[PastValue],
    PastInterval { start_ns, end_ns }: PastInterval,
) -> Vec<(f64, i64)> {
    let first = values.partition_point(|value| value.unix_ns <= start_ns).saturating_sub(1);
    let mut pieces = Vec::new();
    for (at, value) in values.iter().enumerate().skip(first) {
        if value.unix_ns >= end_ns {
            break;
        }
        let until = values.get(at + 1).map_or(end_ns, |next| next.unix_ns);
        let lasted = until.min(end_ns).saturating_sub(value.unix_ns.max(start_ns));
        let is_inside = until > start_ns;
        if let (true, true, Some(number)) =
            (is_inside, value.status.is_good(), number(&value.value))
        {
            pieces.push((number, lasted));
        }
    }
    pieces
}

/// A value as a number; `None`: an array.
// A tag's value is of few of the standard's types.
#[allow(clippy::wildcard_enum_match_arm)]
fn number(value: &Variant) -> Option<f64> {
    match value {
        Variant::Boolean(on) => Some(f64::from(u8::from(*on))),
        Variant::UInt16(value) => Some(f64::from(*value)),
        Variant::Int16(value) => Some(f64::from(*value)),
        Variant::Int32(value) => Some(f64::from(*value)),
        Variant::Float(value) => Some(f64::from(*value)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn past(unix_ns: i64, number: f32) -> PastValue {
        PastValue { unix_ns, value: Variant::Float(number), status: StatusCode::Good }
    }

    #[test]
    fn a_value_holds_until_the_next_in_an_average() {
        let values = [past(-5, 2.0), past(10, 4.0), past(30, 100.0)];
        let answer = |aggregate: Aggregate, start_ns, end_ns| {
            aggregate.value(&values, PastInterval { start_ns, end_ns })
        };
        let of = |aggregate, start, end| answer(aggregate, start, end).value.expect("a value");
        // 10 ns of 2 and 10 ns of 4.
        assert_eq!(of(Aggregate::Average, 0, 20), Variant::from(3.0));
        assert_eq!(of(Aggregate::Minimum, 0, 20), Variant::from(2.0));
        assert_eq!(of(Aggregate::Maximum, 0, 20), Variant::from(4.0));
        assert_eq!(of(Aggregate::Maximum, 0, 31), Variant::from(100.0));
        assert_eq!(of(Aggregate::Minimum, 30, 40), Variant::from(100.0));
        let before = answer(Aggregate::Average, -100, -50);
        assert_eq!(before.status, Some(StatusCode::BadNoData));
    }

    #[test]
    fn a_span_is_divided_into_intervals_up_to_the_end_of_time() {
        let divided = |start_ns, end_ns, ms| PastInterval { start_ns, end_ns }.divided(ms);
        let parts = divided(0, 2_500_000, 1.0).expect("three");
        assert_eq!(parts.len(), 3);
        assert_eq!(parts[2], PastInterval { start_ns: 2_000_000, end_ns: 2_500_000 });
        assert_eq!(divided(5, 9, 0.0).expect("one"), [PastInterval { start_ns: 5, end_ns: 9 }]);
        for none in [divided(9, 9, 1.0), divided(9, 5, 1.0), divided(0, i64::MAX, 1.0)] {
            assert_eq!(none, None);
        }
        for ms in [f64::NAN, f64::INFINITY, f64::MAX, 2e9, -1.0] {
            for start in [i64::MIN, 0, i64::MAX - 1] {
                let parts = divided(start, i64::MAX, ms).expect("few");
                assert!(parts.len() < 10_000 && parts.last().expect("one").end_ns == i64::MAX);
            }
        }
    }
}
