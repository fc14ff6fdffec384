//! The operands that the user watches, each with its last values: a few dozen operands with a few
//! hundred samples each.
//!
//! `state` keeps it, `update` edits it, `rows` shows it.

use std::collections::VecDeque;

pub use rungd_client::operator::protocol::{BitOrNumber, ShownValue};

/// The most operands.
pub(super) const WATCHED_MAX: usize = 64;

/// The most samples of an operand: more than the widest trend shows.
const SAMPLES_MAX: usize = 240;

/// Bars of eight heights.
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The watched operands, in the order in which they were added.
#[derive(Clone, Debug, Default)]
pub(super) struct WatchList {
    pub rows: Vec<WatchRow>,
}

/// A watched operand.
#[derive(Clone, Debug)]
pub(super) struct WatchRow {
    /// The operand, as it is requested.
    pub operand: String,
    /// Its value at the last look.
    pub shown: Option<ShownValue>,
    /// Whether the running program does not have the operand.
    pub is_unknown: bool,
    /// Its last values.
    pub trend: WatchTrend,
}

/// The last values of an operand, the newest last; `None`: the controller did not answer, or the
/// state of an output is not known.
#[derive(Clone, Debug, Default)]
pub(super) struct WatchTrend {
    samples: VecDeque<Option<f64>>,
}

impl WatchList {
    /// Adds the operands that are not in the list yet. Returns false if there is no room for all.
    pub fn add(&mut self, values: Vec<ShownValue>) -> bool {
        for shown in values {
            if self.rows.iter().any(|row| row.operand == shown.operand) {
                continue;
            }
            if self.rows.len() == WATCHED_MAX {
                return false;
            }
            self.rows.push(WatchRow::of(shown.operand.clone()));
            self.rows.last_mut().iter_mut().for_each(|row| row.shown = Some(shown.clone()));
        }
        true
    }

    /// Takes the values of a look.
    pub fn take(&mut self, values: &[ShownValue], unknown: &[String]) {
        for row in &mut self.rows {
            row.is_unknown = unknown.contains(&row.operand);
            row.shown = values.iter().find(|value| value.operand == row.operand).cloned();
            row.trend.push(row.shown.as_ref().and_then(ShownValue::present).map(number));
        }
    }

    /// Notes that the controller did not answer.
    pub fn miss(&mut self) {
        self.rows.iter_mut().for_each(|row| row.trend.push(None));
    }
}

impl WatchRow {
    fn of(operand: String) -> WatchRow {
        WatchRow { operand, shown: None, is_unknown: false, trend: WatchTrend::default() }
    }
}

impl WatchTrend {
    fn push(&mut self, sample: Option<f64>) {
        if self.samples.len() == SAMPLES_MAX {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// The last samples as bars, scaled between the least and the greatest sample.
    pub fn line(&self, width: usize) -> String {
        let skipped = self.samples.len().saturating_sub(width);
        let shown = || self.samples.iter().skip(skipped);
        let least = shown().flatten().copied().fold(f64::INFINITY, f64::min);
        let greatest = shown().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let bar = |sample: &Option<f64>| match sample {
            None => ' ',
            Some(sample) if greatest <= least => BARS[if *sample == 0.0 { 0 } else { 3 }],
            // Halves the values first, since their difference may overflow.
            Some(sample) => {
                let share = (sample / 2.0 - least / 2.0) / (greatest / 2.0 - least / 2.0);
                BARS[((share * 7.0).round() as usize).min(7)]
            }
        };
        shown().map(bar).collect()
    }
}

/// A value as a sample. A value that is not finite counts as 0.
fn number(value: BitOrNumber) -> f64 {
    let number = match value {
        BitOrNumber::Bit(bit) => f64::from(u8::from(bit)),
        BitOrNumber::Word(word) => f64::from(word),
        BitOrNumber::Real(real) => real.to_string().parse().unwrap_or(0.0),
    };
    if number.is_finite() { number } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(operand: &str, value: BitOrNumber) -> ShownValue {
        let (tag, address) = (None, operand.to_owned());
        ShownValue {
            operand: operand.to_owned(),
            tag,
            address,
            value,
            unit: None,
            text: None,
            forced: false,
            driven: None,
            unknown: None,
        }
    }

    fn trend(samples: &[Option<f64>]) -> WatchTrend {
        let mut trend = WatchTrend::default();
        samples.iter().for_each(|sample| trend.push(*sample));
        trend
    }

    #[test]
    fn a_trend_is_scaled_to_its_values() {
        let bits = trend(&[Some(0.0), Some(1.0), None, Some(1.0)]);
        assert_eq!((bits.line(10).as_str(), bits.line(2).as_str()), ("▁█ █", " ▄"));
        assert_eq!(trend(&[Some(-5.0), Some(0.0), Some(5.0)]).line(9), "▁▅█");
        assert_eq!(trend(&[Some(f64::MIN), Some(f64::MAX)]).line(9), "▁█");
        assert_eq!(trend(&[]).line(9), "");
    }

    #[test]
    fn the_watch_list_and_its_trends_are_limited() {
        let mut list = WatchList::default();
        let values: Vec<_> =
            (0..100).map(|n| shown(&format!("D{n}"), BitOrNumber::Word(n))).collect();
        assert!(!list.add(values.clone()));
        assert_eq!(list.rows.len(), WATCHED_MAX);
        for _ in 0..1000 {
            list.take(&values, &[]);
            list.miss();
        }
        assert!(list.rows.iter().all(|row| row.trend.samples.len() == SAMPLES_MAX));
    }
}
