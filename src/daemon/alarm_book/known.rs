//! The alarms of a program, as the book and the log know them: those of bits, and the watches.

use rungd_config::controller::alarms::AlarmSettings;
use rungd_config::controller::watch::WatchSettings;
use rungd_engine::Cell;
use rungd_language::lower;
use rungd_language::resolve::alarm_terms::AlarmTerms;
use rungd_language::resolve::priority::Priority;
use rungd_runtime::AlarmDelay;

/// An alarm of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct KnownAlarm {
    /// The name of its tag or watch.
    pub tag: String,
    pub text: String,
    pub terms: AlarmTerms,
    pub of: AlarmSource,
    /// Whether operators may shelve it.
    pub may_be_shelved: bool,
}

/// What an alarm is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) enum AlarmSource {
    /// A bit that is ON.
    Bit(Cell),
    /// A line of `[[watch]]` that does not hold, as it is written.
    Watch(String),
}

impl KnownAlarm {
    /// The alarms of a program: those of its bits, in the scan thread's numbering, then its
    /// watches.
    pub fn all(alarms: &[lower::Alarm], watches: &WatchSettings) -> Vec<KnownAlarm> {
        let may_be_shelved = |priority: Priority| priority != Priority::Critical;
        let bits = alarms.iter().map(|alarm| KnownAlarm {
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            terms: alarm.terms.clone(),
            of: AlarmSource::Bit(alarm.bit),
            may_be_shelved: may_be_shelved(alarm.terms.priority),
        });
        let watches = watches.all.iter().map(|watch| KnownAlarm {
            tag: watch.name.clone(),
            text: watch.text.clone(),
            terms: watch.terms.clone(),
            of: AlarmSource::Watch(watch.always.clone()),
            may_be_shelved: may_be_shelved(watch.terms.priority),
        });
        bits.chain(watches).collect()
    }

    /// These alarms and the watches, by the settings of the controller file.
    pub fn joined(
        bits: Vec<KnownAlarm>,
        watches: &WatchSettings,
        settings: &AlarmSettings,
    ) -> Vec<KnownAlarm> {
        let mut all = [bits, KnownAlarm::all(&[], watches)].concat();
        all.iter_mut().for_each(|alarm| alarm.may_be_shelved |= settings.shelves_critical);
        all
    }

    /// Among the alarms of a program: that of a line that is watched, with its number.
    pub fn of_watch(all: &[KnownAlarm], line: usize) -> Option<(usize, &KnownAlarm)> {
        all.iter().enumerate().filter(|(_, alarm)| alarm.line().is_some()).nth(line)
    }

    /// Its bit; a watch has none.
    pub fn bit(&self) -> Option<Cell> {
        if let AlarmSource::Bit(bit) = self.of { Some(bit) } else { None }
    }

    /// Whether it follows a change of its bit to this state later than at once.
    pub(super) fn waits(&self, on: bool) -> bool {
        let ms = if on { self.terms.delay_ms } else { self.terms.off_delay_ms };
        ms > 0
    }

    /// Its delays.
    pub fn delay(&self) -> AlarmDelay {
        AlarmDelay::of_ms(self.terms.delay_ms, self.terms.off_delay_ms)
    }

    /// The line that is watched.
    pub fn line(&self) -> Option<&str> {
        if let AlarmSource::Watch(line) = &self.of { Some(line) } else { None }
    }
}
