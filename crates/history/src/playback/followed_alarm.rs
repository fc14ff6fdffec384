//! The alarms of a recorded program: those of its bits, and the lines of its `[[watch]]`.
//!
//! Used by `alarm_follower` and the two that follow alarms with it. The lines are judged by
//! whoever can judge conditions (`lab`), which this crate does not know: a [`LineJudge`].

use rungd_config::controller::watch::{WatchSettings, WatchedCondition};
use rungd_engine::{Cell, EngineCall, Image};
use rungd_language::lower::{Alarm, Symbols};
use rungd_language::resolve::alarm_terms::AlarmTerms;

/// Judges the lines of `[[watch]]` of a program, on its memory scan by scan.
pub trait LineJudge {
    /// The cells of the program that the lines depend on.
    fn cells(&self) -> &[Cell];

    /// Takes memory after a call.
    fn called(&mut self, call: EngineCall, image: &Image);

    /// The scans up to this memory were not seen.
    fn joins(&mut self, image: &Image);

    /// Whether a line held at the end of the last scan.
    fn holds(&self, line: usize) -> bool;
}

/// Makes the judge of a program.
pub type MakeJudge = fn(&WatchSettings, &Symbols) -> Box<dyn LineJudge>;

/// An alarm of a recorded program.
#[derive(Clone, Debug)]
pub(super) struct FollowedAlarm {
    /// The name of its tag or line.
    pub tag: String,
    pub text: String,
    pub terms: AlarmTerms,
    pub source: FollowedSource,
}

/// What an alarm follows.
#[derive(Clone, Copy, Debug)]
pub(super) enum FollowedSource {
    /// A bit that is ON.
    Bit(Cell),
    /// A line that does not hold, by number.
    Line(usize),
}

impl FollowedAlarm {
    /// The alarms of a program's bits, in its order.
    pub fn of_bits(symbols: &Symbols) -> Vec<FollowedAlarm> {
        let alarm = |alarm: &Alarm| FollowedAlarm {
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            terms: alarm.terms.clone(),
            source: FollowedSource::Bit(alarm.bit),
        };
        symbols.alarms.iter().map(alarm).collect()
    }

    /// The alarms of lines.
    pub fn of_lines(watches: &WatchSettings) -> impl Iterator<Item = FollowedAlarm> {
        let alarm = |(line, watch): (usize, &WatchedCondition)| FollowedAlarm {
            tag: watch.name.clone(),
            text: watch.text.clone(),
            terms: watch.terms.clone(),
            source: FollowedSource::Line(line),
        };
        watches.all.iter().enumerate().map(alarm)
    }

    /// The greatest delay of some alarms, ns.
    pub fn delay_max_ns(alarms: &[FollowedAlarm]) -> i64 {
        let ms = alarms.iter().map(|alarm| alarm.terms.delay_ms.max(alarm.terms.off_delay_ms));
        i64::from(ms.max().unwrap_or(0)).saturating_mul(1_000_000)
    }
}
