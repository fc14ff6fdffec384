//! The alarms of bits in the log and in the book of alarms.
//!
//! Part of `log_writer`, on the monitor thread: gets each change of an alarm's bit. An alarm with a
//! delay follows its bit later, by the times of the scans. The log's lines of alarms are limited
//! (`allowance`), so a bit that toggles every scan does not hide other lines; the book contains all
//! changes. The alarms of `[[watch]]` are in `watch_log`.

use std::collections::HashMap;
use std::sync::Arc;

use super::alarm_keeper::{BookKeeper, SharedBook};
use super::allowance::{AlarmLines, tell_withheld};
use super::narration::{Narration, one_line};
use rungd_base::duration_text::duration_text;
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::say::say;
use rungd_runtime::{AlarmChange, AlarmDelays, ScanTime};

/// The log's side of the alarms of bits.
pub(super) struct BitAlarms {
    lines: AlarmLines,
    pub book: BookKeeper,
    delays: AlarmDelays,
    /// The generation of the running program.
    generation: u32,
    /// Changes are lost: the bits of alarms with delays must be taken from the next image.
    is_lost: bool,
}

impl BitAlarms {
    /// For the first program.
    pub fn new(book: SharedBook, narration: &Narration) -> BitAlarms {
        let delays = AlarmDelays::new(narration.alarms.iter().map(|alarm| alarm.delay()));
        let (lines, book) = (AlarmLines::new(), BookKeeper::new(book));
        BitAlarms { lines, book, delays, generation: 0, is_lost: false }
    }

    /// A bit has changed.
    pub fn bit(&mut self, narration: &Narration, change: AlarmChange) {
        let AlarmChange { number, on, scan, at_ns, .. } = change;
        if self.delays.is_delayed(number) {
            let changes = self.delays.bit(number, on, ScanTime { scan, at_ns });
            return self.tell_all(narration, &changes);
        }
        let due = self.delays.due(at_ns);
        self.tell_all(narration, &due);
        self.tell(narration, &change);
    }

    /// A program is swapped in. Its alarms have other numbers.
    pub fn swap(&mut self, generation: u32, before: &Narration, narration: &Arc<Narration>) {
        let numbers: HashMap<&str, usize> =
            before.alarms.iter().zip(0..).map(|(alarm, at)| (alarm.tag.as_str(), at)).collect();
        let next = narration.alarms.iter().map(|alarm| {
            let before = numbers.get(alarm.tag.as_str()).copied();
            (alarm.delay(), before)
        });
        self.delays = self.delays.carried(next);
        (self.lines, self.generation) = (AlarmLines::new(), generation);
        self.book.swap(generation, narration);
    }

    /// Records of the scan thread are lost.
    pub fn lost(&mut self) {
        self.is_lost = true;
        self.book.lost();
    }

    /// Tells what is due by the time of the latest scan, and enters everything in the book.
    pub fn turn(&mut self, narration: &Narration, latest: &Snapshot, now_ns: u64) {
        if self.is_lost && latest.generation == self.generation {
            self.is_lost = false;
            self.correct(narration, latest);
        }
        let due = self.delays.due(latest.now_ns);
        self.tell_all(narration, &due);
        self.book.turn(latest);
        let belated = self.lines.belated(now_ns);
        log_active(&belated, narration);
        tell_withheld(self.lines.due(now_ns));
    }

    /// Logs at the end what was left out.
    pub fn ended(&mut self, narration: &Narration, now_ns: u64) {
        log_active(&self.lines.standing(), narration);
        tell_withheld(self.lines.rest(now_ns));
    }

    /// Takes the bits of alarms with delays from an image.
    fn correct(&mut self, narration: &Narration, latest: &Snapshot) {
        let time = ScanTime { scan: latest.scans, at_ns: latest.now_ns };
        for (number, alarm) in narration.alarms.iter().enumerate() {
            let bit = alarm.bit().filter(|_| self.delays.is_delayed(number));
            let Some(bit) = bit else { continue };
            let changes = self.delays.bit(number, latest.value(bit) != 0, time);
            self.tell_all(narration, &changes);
        }
    }

    fn tell_all(&mut self, narration: &Narration, changes: &[AlarmChange]) {
        changes.iter().for_each(|change| self.tell(narration, change));
    }

    /// Enters a change of an alarm in the book, and logs it.
    fn tell(&mut self, narration: &Narration, change: &AlarmChange) {
        let AlarmChange { number, on, scan, at_ns, lasted_ns } = *change;
        let Some(alarm) = narration.alarms.get(number) else { return };
        self.book.edge(number as u32, on, ScanTime { scan, at_ns });
        if !self.lines.change(number as u32, on, scan, at_ns) {
            return;
        }
        let (tag, text) = (&alarm.tag, one_line(&alarm.text));
        if on {
            say!(ALARM_ON, %tag, scan, "alarm ON: {text}");
        } else {
            let (lasted_ms, was) = (lasted_ns / 1_000_000, duration_text(lasted_ns));
            say!(ALARM_OFF, %tag, scan, lasted_ms, "alarm OFF after {was}: {text}");
        }
    }
}

/// Logs the alarms, by number, that went ON in these scans and are still ON.
fn log_active(alarms: &[(u32, u64)], narration: &Narration) {
    for (number, scan) in alarms {
        let Some(alarm) = narration.alarms.get(*number as usize) else { continue };
        let (tag, text) = (&alarm.tag, one_line(&alarm.text));
        say!(ALARM_ON, %tag, scan, "alarm ON: {text}");
    }
}
