//! The log of a running controller: turns records from the scan thread into log lines.
//!
//! It runs on the monitor thread and receives the time as an argument. It repeats the reason of a
//! STOP or FAULT every minute while the mode lasts. `bit_alarms` has the lines of alarms. Nothing
//! here blocks: `log_queue` writes to standard error.

use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Arc, Mutex};

use super::alarm_book::{AlarmBook, KnownAlarm};
use super::alarm_keeper::SharedBook;
use super::bit_alarms::BitAlarms;
use super::log_queue::lines_dropped;
use super::narration::{BlockNews, LogFacts, Narration, WordNews, reason, us};
use super::posture;
use super::told_statistics::{BeatState, tell_heartbeat};
use super::watch_log::WatchLog;
use super::watches::{WatchMessage, watch_news};
use rungd_base::duration_text::{duration_text, period_text};
use rungd_engine::isa::Real;
use rungd_engine::{MathEvent, Mishap};
use rungd_io::device::DeviceHealth;
use rungd_language::resolve::value_texts::{ValueTexts, with_text};
use rungd_runtime::exchange::{FaultReason, Mode, Snapshot, StopReason};
use rungd_runtime::say::say;
use rungd_runtime::{
    AlarmChange, DeviceEdge, Generations, Observer, RecordEvent, ScanRecord, Statistics,
};

/// The machine's load, if it may be the reason of a fault.
fn load_at(fault: FaultReason) -> String {
    let load = match fault {
        FaultReason::ScanTooLong { .. }
        | FaultReason::ScanNeverEnds
        | FaultReason::ScanNeverBegins => posture::load(),
        FaultReason::EnginePanic | FaultReason::ScanThreadGone => None,
    };
    load.map_or(String::new(), |load| format!(" ({load})"))
}

/// The observer that logs the scan thread's records.
pub(super) struct LogWriter {
    narrations: Generations<Narration>,
    /// The names of the running program.
    narration: Arc<Narration>,
    facts: LogFacts,
    /// The field devices, by number. Each has a flag: whether the device's last change has been
    /// logged.
    devices: Vec<(DeviceHealth, bool)>,
    /// The mode in the last snapshot.
    mode: Mode,
    /// The number of complete scans in the last snapshot.
    scans: u64,
    /// The number of forced bits and words in the last snapshot.
    forces: usize,
    /// The time of the last heartbeat.
    beat_ns: Option<u64>,
    standing: Option<LastingMode>,
    /// The monitor has declared the current scan a fault, and this has been logged.
    tripped: bool,
    alarms: BitAlarms,
    watches: WatchLog,
}

/// Where alarms go to and come from.
pub(super) struct AlarmEnds {
    /// The book of alarms.
    pub book: SharedBook,
    /// What the recording's thread finds.
    watches: Receiver<WatchMessage>,
}

impl AlarmEnds {
    /// A book of the first program's alarms, and the end for the recording's thread.
    pub fn new(alarms: &[KnownAlarm]) -> (AlarmEnds, SyncSender<WatchMessage>) {
        let (news, watches) = watch_news();
        (AlarmEnds { book: Arc::new(Mutex::new(AlarmBook::new(alarms))), watches }, news)
    }
}

/// A STOP or FAULT that lasts.
struct LastingMode {
    /// The name of the mode.
    name: &'static str,
    since_ns: u64,
    told_ns: u64,
}

impl LogWriter {
    pub fn new(
        narrations: Generations<Narration>,
        facts: LogFacts,
        devices: Vec<DeviceHealth>,
        alarms: AlarmEnds,
    ) -> Self {
        let narration = narrations.of_generation(0);
        let AlarmEnds { book, watches } = alarms;
        let (standing, mode) = (None, Mode::Stop(StopReason::NotStarted));
        let alarms = BitAlarms::new(book, &narration);
        LogWriter {
            narrations,
            narration,
            facts,
            devices: devices.into_iter().map(|health| (health, true)).collect(),
            mode,
            scans: 0,
            forces: 0,
            beat_ns: None,
            standing,
            tripped: false,
            alarms,
            watches: WatchLog::new(watches),
        }
    }

    fn mode(&mut self, mode: Mode, scan: u64) {
        let why = reason(mode);
        if mode == Mode::Run {
            self.tripped = false;
        }
        match mode {
            Mode::Run => {
                say!(
                    MODE_RUN,
                    scan,
                    "RUN: scanning every {}",
                    period_text(self.narration.tempo.period_ns)
                )
            }
            Mode::Stop(reason) if reason.waits_for_operator() => {
                let again = self.facts.leaves_stop(reason, scan);
                say!(
                    MODE_STOP at Warn,
                    scan, "STOP: {why}; outputs are at their safe values; {again}"
                );
            }
            Mode::Stop(_) => {
                say!(MODE_STOP, scan, "STOP: {why}; outputs are at their safe values")
            }
            // The overlong scan has ended: this is no new fault.
            Mode::Fault(FaultReason::ScanTooLong { scan_us }) if self.tripped => {
                say!(
                    FAULT_SCAN_ENDED,
                    scan,
                    scan_us,
                    "the scan of this fault has ended; it is not complete"
                );
            }
            // The scan thread has come back: this is no new fault.
            Mode::Fault(FaultReason::ScanNeverBegins) if self.tripped => {
                say!(
                    FAULT_THREAD_BACK,
                    scan,
                    "the scan thread of this fault has come back; it does not scan"
                );
            }
            Mode::Fault(fault) => self.fault(fault, Some(scan)),
        }
    }

    fn fault(&self, fault: FaultReason, scan: Option<u64>) {
        let watchdog = duration_text(self.narration.tempo.watchdog_ns);
        // The monitor declares a fault without the number of the scan.
        let complete = scan.unwrap_or(self.scans);
        say!(
            MODE_FAULT,
            scan,
            %watchdog,
            "FAULT: {fault}; outputs are at their safe values; {}{}. {}",
            self.narration.remedy(fault, &self.facts, complete),
            load_at(fault),
            self.facts.black_box(complete, self.narration.tempo.period_ns)
        );
    }

    fn bit(&mut self, watch: u32, on: bool, after_ns: u64, record: &ScanRecord) {
        let Some(news) = self.narration.bit(watch) else { return };
        let (tag, scan) = (&news.tag, record.scan);
        let lasted_ms = after_ns / 1_000_000;
        match (news.alarm, on) {
            (Some(number), _) => {
                let (at_ns, lasted_ns) = (record.at_ns, after_ns);
                let change = AlarmChange { number, on, scan, at_ns, lasted_ns };
                self.alarms.bit(&self.narration, change);
            }
            (None, true) => {
                let state = with_text("ON", text_of(news.texts.as_deref(), 1));
                say!(TAG_ON, %tag, scan, "{tag} is {state}");
            }
            (None, false) => {
                let state = with_text("OFF", text_of(news.texts.as_deref(), 0));
                say!(TAG_OFF, %tag, scan, lasted_ms, "{tag} is {state}");
            }
        }
    }

    fn device(&mut self, device: u32, edge: DeviceEdge, scan: u64) {
        let Some((health, is_told)) = self.devices.get_mut(device as usize) else { return };
        let withheld = match edge {
            DeviceEdge::Present | DeviceEdge::Back { .. } if !*is_told => return,
            DeviceEdge::Present | DeviceEdge::Back { .. } => String::new(),
            DeviceEdge::Absent | DeviceEdge::Lost => match health.may_tell() {
                Some(withheld) => withheld,
                None => {
                    *is_told = false;
                    return;
                }
            },
        };
        *is_told = true;
        let reading = health.condition();
        let (device, peer) = (&reading.name, &reading.peer);
        let why = reading.trouble.map_or(String::new(), |reason| format!(": {reason}")) + &withheld;
        let (part, absent) = match reading.is_in_part {
            true => (" in part", " has answered in part only"),
            false => ("", " has not answered"),
        };
        match edge {
            DeviceEdge::Present => {
                say!(DEVICE_PRESENT, %device, %peer, scan, "{device} exchanges");
            }
            DeviceEdge::Absent => say!(
                DEVICE_ABSENT,
                %device, %peer, scan, "{device}{absent} since the start{why}"
            ),
            DeviceEdge::Lost => {
                say!(DEVICE_LOST, %device, %peer, scan, "{device} is lost{part}{why}");
            }
            DeviceEdge::Back { lost_ns, scans } => say!(
                DEVICE_BACK,
                %device,
                %peer,
                scan,
                lost_ms = lost_ns / 1_000_000,
                scans,
                "{device} is back; it was lost for {}, {scans} scans",
                duration_text(lost_ns)
            ),
        }
    }

    fn overruns(&self, scan: u64, overruns: &ReportedOverruns) {
        let ReportedOverruns { count, skipped, scan_ns_max, late_ns_max } = *overruns;
        let (period, scan_us_max, late_us_max) =
            (period_text(self.narration.tempo.period_ns), us(scan_ns_max), us(late_ns_max));
        // The cause of a long scan may be the ladder or a busy machine. This line cannot
        // distinguish them; the mean of the scan times in the statistics can.
        let cause = if scan_ns_max >= self.narration.tempo.period_ns {
            "a scan took longer than the period"
        } else {
            "the machine woke the scan thread too late"
        };
        let what = match count {
            1 => "overrun: a scan was".to_owned(),
            _ => format!("overruns: {count} more scans were"),
        };
        say!(
            OVERRUN,
            scan,
            skipped,
            scan_us_max,
            late_us_max,
            %period,
            "{what} not over at the next grid point: {cause}"
        );
    }

    /// Logs the heartbeat while nothing is scanned. In RUN, the statistics are the heartbeat.
    fn beat(&mut self, latest: &Snapshot, now_ns: u64) {
        let since_ns = *self.beat_ns.get_or_insert(now_ns);
        let due = self.facts.heartbeat_ns.is_some_and(|every_ns| now_ns >= since_ns + every_ns);
        if due && latest.mode != Mode::Run {
            self.beat_ns = Some(now_ns);
            let (mode, scans, forces) = (latest.mode.name(), latest.scans, self.forces);
            let log_lost = lines_dropped();
            say!(HEARTBEAT, mode, forces, log_lost, scans, "nothing is scanned in {mode}");
        }
    }

    /// Repeats the reason of a STOP or FAULT every minute.
    fn stand(&mut self, mode: Mode, now_ns: u64) {
        let lasting = match mode {
            Mode::Fault(_) => Some(mode),
            Mode::Stop(reason) if reason.waits_for_operator() => Some(mode),
            Mode::Run | Mode::Stop(_) => None,
        };
        let Some(mode) = lasting else {
            self.standing = None;
            return;
        };
        let standing = match &mut self.standing {
            Some(standing) if standing.name == mode.name() => standing,
            other => {
                let name = mode.name();
                *other = Some(LastingMode { name, since_ns: now_ns, told_ns: now_ns });
                return;
            }
        };
        if now_ns < standing.told_ns + self.facts.repeat_ns {
            return;
        }
        standing.told_ns = now_ns;
        let (lasts, why) = (duration_text(now_ns - standing.since_ns), reason(mode));
        match mode {
            Mode::Fault(reason) => {
                let again = self.facts.remedy(reason, self.scans);
                say!(MODE_STILL at Error, "still in FAULT after {lasts}: {why}; {again}");
            }
            Mode::Run => {}
            Mode::Stop(reason) => {
                let again = self.facts.leaves_stop(reason, self.scans);
                say!(MODE_STILL, "still in STOP after {lasts}: {why}; {again}");
            }
        }
    }
}

/// The overruns of one line.
struct ReportedOverruns {
    count: u32,
    skipped: u64,
    /// The longest scan.
    scan_ns_max: u64,
    /// The latest start of a scan.
    late_ns_max: u64,
}

impl Observer for LogWriter {
    fn record(&mut self, record: &ScanRecord) {
        let scan = record.scan;
        match record.what {
            RecordEvent::Mode(mode) => self.mode(mode, scan),
            RecordEvent::Block(event) => {
                let Some(told) = self.narration.block_event(event) else { return };
                let BlockNews { event, kind, name, what, news } = told;
                if news {
                    say!(*event at Info, block = name, scan, "{kind} {name} {what}");
                } else {
                    say!(*event at Debug, block = name, scan, "{kind} {name} {what}");
                }
            }
            RecordEvent::Swapped { generation, swap_ns } => {
                // Alarms are identified by their numbers, and the new program has different
                // numbers.
                self.ended(record.at_ns);
                let before = Arc::clone(&self.narration);
                self.narration = self.narrations.of_generation(generation);
                self.alarms.swap(generation, &before, &self.narration);
                self.watches.swap(generation);
                let swap_us = us(swap_ns);
                say!(PROGRAM_SWAPPED, scan, swap_us, "the programs are swapped");
            }
            RecordEvent::Device { device, edge } => self.device(device, edge, scan),
            RecordEvent::Math(MathEvent { math, mishaps }) => {
                let rung = self.narration.math(math);
                let bits: Vec<_> = mishaps.each().map(Mishap::nickname).collect();
                let bits = bits.join(" ");
                say!(MATH_MISHAP, rung, bits, scan, "{rung} set {bits}");
            }
            RecordEvent::EventsLost(events) => {
                say!(
                    EVENTS_LOST,
                    scan,
                    events,
                    "{events} events of blocks in this scan are lost: more happened than can be \
                     handed over"
                );
            }
            RecordEvent::Bit { watch, on, after_ns } => self.bit(watch, on, after_ns, record),
            RecordEvent::Word { watch, from, to } => {
                let Some(WordNews { tag, real, texts }) = self.narration.word(watch) else {
                    return;
                };
                if *real {
                    let [from, to] = [from, to].map(Real::of_cell);
                    say!(TAG_VALUE, %tag, scan, %from, %to, "{tag} is {to}, was {from}");
                } else {
                    let said = |value| with_text(value, text_of(texts.as_deref(), value));
                    let (was, is) = (said(from), said(to));
                    say!(TAG_VALUE, %tag, scan, from, to, "{tag} is {is}, was {was}");
                }
            }
            RecordEvent::Overruns { count, skipped, scan_ns_max, late_ns_max } => {
                let overruns = ReportedOverruns { count, skipped, scan_ns_max, late_ns_max };
                self.overruns(scan, &overruns);
            }
        }
    }

    fn statistics(&mut self, statistics: &Statistics) {
        self.beat_ns = None;
        let period_ns = self.narration.tempo.period_ns;
        let forces = self.forces;
        tell_heartbeat(statistics, &BeatState { mode: self.mode.name(), forces, period_ns });
    }

    fn dropped(&mut self, records: u64) {
        self.alarms.lost();
        say!(
            RECORDS_DROPPED,
            records,
            "{records} records of the scan thread are lost: more happened than can be handed over"
        );
    }

    fn tripped(&mut self, fault: FaultReason, _now_ns: u64) {
        self.tripped = true;
        self.fault(fault, None);
    }

    fn turn(&mut self, latest: &Snapshot, now_ns: u64) {
        self.watches.turn(&self.narration, &mut self.alarms.book, now_ns);
        self.alarms.turn(&self.narration, latest, now_ns);
        self.scans = latest.scans;
        self.stand(latest.mode, now_ns);
        (self.mode, self.forces) = (latest.mode, latest.forces.list().len());
        self.beat(latest, now_ns);
    }

    fn ended(&mut self, now_ns: u64) {
        self.alarms.ended(&self.narration, now_ns);
        self.watches.ended(&self.narration, now_ns);
        self.facts.over.notify_one();
    }
}

/// The text of a value, if its tag gives one.
fn text_of(texts: Option<&ValueTexts>, value: i32) -> Option<&str> {
    texts?.text(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::retain::NothingKept;

    const SECOND_NS: u64 = 1_000_000_000;

    fn writer() -> LogWriter {
        let program = rungd_language::resolve::program::Program::default();
        let (_, symbols) = rungd_language::lower::lower(&program);
        let (narration, _) = Narration::new(&program, &symbols);
        let facts = LogFacts {
            repeat_ns: 60 * SECOND_NS,
            heartbeat_ns: None,
            has_operator: true,
            record: None,
            nothing_kept: NothingKept::default(),
            priority: Arc::default(),
            over: Arc::default(),
        };
        let alarms = AlarmEnds::new(&[]).0;
        LogWriter::new(Generations::new(narration), facts, Vec::new(), alarms)
    }

    #[test]
    fn the_reason_of_stop_or_fault_is_repeated_every_minute() {
        let mut writer = writer();
        let fault = Mode::Fault(FaultReason::EnginePanic);
        let told: Vec<u64> = (0..200)
            .filter(|second| {
                let before = writer.standing.as_ref().map(|standing| standing.told_ns);
                writer.stand(fault, second * SECOND_NS);
                before.is_some() && before != writer.standing.as_ref().map(|s| s.told_ns)
            })
            .collect();
        assert_eq!(told, [60, 120, 180]);
        writer.stand(Mode::Run, 200 * SECOND_NS);
        assert!(writer.standing.is_none());
        writer.stand(Mode::Stop(StopReason::Signal), 300 * SECOND_NS);
        assert!(writer.standing.is_none(), "the process is about to end");
    }
}
