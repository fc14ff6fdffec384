//! The alarms of `[[watch]]` in the log and in the book of alarms.
//!
//! Part of `log_writer`, on the monitor thread: takes what the recording's thread found. News of a
//! program that is not swapped in yet wait here.

use std::collections::VecDeque;
use std::sync::mpsc::Receiver;

use super::alarm_book::KnownAlarm;
use super::alarm_keeper::BookKeeper;
use super::allowance::{AlarmLines, tell_withheld};
use super::narration::{Narration, one_line};
use super::watches::{WatchMessage, WatchNews};
use rungd_base::duration_text::duration_text;
use rungd_lab::testing::DecidingOperand;
use rungd_runtime::ScanTime;
use rungd_runtime::say::say;

/// The log's side of the watches.
pub(super) struct WatchLog {
    news: Receiver<WatchMessage>,
    /// What is told next, in order.
    waiting: VecDeque<WatchMessage>,
    /// The generation of the running program.
    generation: u32,
    lines: AlarmLines,
    /// By line: since when it does not hold (CLOCK_MONOTONIC, ns).
    since_ns: Vec<u64>,
}

impl WatchLog {
    pub fn new(news: Receiver<WatchMessage>) -> WatchLog {
        let (waiting, lines, since_ns) = (VecDeque::new(), AlarmLines::new(), Vec::new());
        WatchLog { news, waiting, generation: 0, lines, since_ns }
    }

    /// A program is swapped in. Its lines have other numbers.
    pub fn swap(&mut self, generation: u32) {
        (self.generation, self.lines) = (generation, AlarmLines::new());
        self.since_ns.clear();
    }

    /// Logs what has come, and enters it in the book.
    pub fn turn(&mut self, narration: &Narration, book: &mut BookKeeper, now_ns: u64) {
        self.enter(narration, book);
        let belated = self.lines.belated(now_ns);
        tell_broken(&belated, narration);
        tell_withheld(self.lines.due(now_ns));
    }

    /// Logs at the end what was left out.
    pub fn ended(&mut self, narration: &Narration, now_ns: u64) {
        tell_broken(&self.lines.standing(), narration);
        tell_withheld(self.lines.rest(now_ns));
    }

    fn enter(&mut self, narration: &Narration, book: &mut BookKeeper) {
        self.waiting.extend(self.news.try_iter());
        while let Some(message) = self.waiting.pop_front() {
            match message {
                WatchMessage::Changed(news) if news.generation > self.generation => {
                    self.waiting.push_front(WatchMessage::Changed(news));
                    return;
                }
                WatchMessage::Changed(news) if news.generation < self.generation => {}
                WatchMessage::Changed(news) => self.changed(&news, narration, book),
                WatchMessage::Explained { name, scan, why } => book.explain(name, scan, why),
            }
        }
    }

    fn changed(&mut self, news: &WatchNews, narration: &Narration, book: &mut BookKeeper) {
        let Some((number, alarm)) = KnownAlarm::of_watch(&narration.alarms, news.line) else {
            return;
        };
        let WatchNews { line, holds, scan, at_ns, .. } = *news;
        book.edge(number as u32, !holds, ScanTime { scan, at_ns });
        if self.since_ns.len() <= line {
            self.since_ns.resize(line + 1, at_ns);
        }
        let lasted_ns = at_ns.saturating_sub(self.since_ns[line]);
        if !holds {
            self.since_ns[line] = at_ns;
        }
        if !self.lines.change(line as u32, !holds, scan, at_ns) {
            return;
        }
        let (tag, text) = (&alarm.tag, one_line(&alarm.text));
        if holds {
            let (lasted_ms, was) = (lasted_ns / 1_000_000, duration_text(lasted_ns));
            say!(ALARM_OFF, %tag, scan, lasted_ms, "alarm OFF after {was}: {text}");
        } else {
            let values = values(&news.deciding);
            say!(ALARM_ON, %tag, scan, "alarm ON: {text}{values}");
        }
    }
}

/// Logs the watches, by line, that ceased to hold in these scans and still do not.
fn tell_broken(watches: &[(u32, u64)], narration: &Narration) {
    for (line, scan) in watches {
        let Some((_, alarm)) = KnownAlarm::of_watch(&narration.alarms, *line as usize) else {
            continue;
        };
        let (tag, text) = (&alarm.tag, one_line(&alarm.text));
        say!(ALARM_ON, %tag, scan, "alarm ON: {text}");
    }
}

/// The values that broke a line: ` (press is ON, left is OFF)`.
fn values(deciding: &[DecidingOperand]) -> String {
    let one = |DecidingOperand { name, value, .. }: &DecidingOperand| format!("{name} is {value}");
    let all: Vec<String> = deciding.iter().map(one).collect();
    if all.is_empty() { String::new() } else { format!(" ({})", all.join(", ")) }
}
