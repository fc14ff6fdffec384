//! `[[watch]]`: judges its lines behind each scan, without the scan thread.
//!
//! Called by `record_thread` with every entry of the tape. An engine of its own executes the
//! recorded calls again, and only those operations that the lines depend on. A line with a delay is
//! told once the delay is over, by the times of scans. What is told goes to `log_writer`, which
//! makes an alarm of it, and to `watch_reasons`, which explains it.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use rungd_config::controller::watch::{WatchSettings, WatchedCondition};
use rungd_engine::{Engine, EngineCall, EngineProgram, EngineState};
use rungd_lab::testing::{DecidingOperand, WatchedLines};
use rungd_language::lower::Symbols;
use rungd_runtime::{AlarmChange, AlarmDelay, AlarmDelays, ScanTime, TapeEntry};

/// The most news that wait for the log. What does not fit is told later, as it then is.
const NEWS_MAX: usize = 4_096;

/// The lines of one program, ready to be judged.
pub(super) struct WatchPlan {
    names: Vec<String>,
    delays: Vec<AlarmDelay>,
    lines: WatchedLines,
    /// The operations that they depend on.
    code: EngineProgram,
}

impl WatchPlan {
    /// The lines of a program; `None`: its controller file watches nothing.
    pub fn new(
        watches: &WatchSettings,
        symbols: &Symbols,
        code: &EngineProgram,
    ) -> Option<WatchPlan> {
        if watches.all.is_empty() {
            return None;
        }
        let lines = WatchedLines::new(watches, symbols);
        let code = code.slice(lines.cells()).program;
        let names = watches.all.iter().map(|watch| watch.name.clone()).collect();
        let delay = |watch: &WatchedCondition| {
            AlarmDelay::of_ms(watch.terms.delay_ms, watch.terms.off_delay_ms)
        };
        let delays = watches.all.iter().map(delay).collect();
        Some(WatchPlan { names, delays, lines, code })
    }
}

/// A line that begins or ceases to hold, after its delay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WatchNews {
    /// The generation of its program.
    pub generation: u32,
    /// Its number.
    pub line: usize,
    pub holds: bool,
    /// The first scan at whose end it is so, and the time of that scan and its delay
    /// (CLOCK_MONOTONIC).
    pub scan: u64,
    pub at_ns: u64,
    /// The scan that is explained: the one of the operands below.
    pub judged_scan: u64,
    /// The operands that decide it; empty if it holds.
    pub deciding: Vec<DecidingOperand>,
}

/// What the log gets.
#[derive(Clone, Debug)]
pub(super) enum WatchMessage {
    Changed(WatchNews),
    /// Why a line did not hold, as text, for the alarm that rose in a scan.
    Explained {
        name: String,
        scan: u64,
        why: Vec<String>,
    },
}

/// The judges of all programs, and the engine of the one that is running.
pub(super) struct WatchRun {
    /// By generation.
    plans: BTreeMap<u32, WatchPlan>,
    running: Option<RunningWatch>,
    news: SyncSender<WatchMessage>,
}

/// The program that is running.
struct RunningWatch {
    generation: u32,
    plan: WatchPlan,
    engine: Engine,
    /// The engine has the memory of the controller.
    is_current: bool,
    /// The number of the present scan, and its time.
    scan: u64,
    at_ns: u64,
    /// The lines that do not hold, by number: those with a delay follow later.
    delays: AlarmDelays,
    /// By line: whether it holds, after its delay, and since when; what the log gets.
    settled: Vec<SettledLine>,
    /// By line: what the log knows.
    told: Vec<bool>,
}

/// What is so of a line after its delay.
#[derive(Clone, Copy, Debug)]
struct SettledLine {
    holds: bool,
    /// The scan of its last change, and the time of that scan and its delay.
    scan: u64,
    at_ns: u64,
}

impl SettledLine {
    /// A line of which nothing is known.
    const NEW: SettledLine = SettledLine { holds: true, scan: 0, at_ns: 0 };
}

/// The two ends of the news.
pub(super) fn watch_news() -> (SyncSender<WatchMessage>, Receiver<WatchMessage>) {
    sync_channel(NEWS_MAX)
}

impl WatchRun {
    /// A run that knows no program yet.
    pub fn new(news: SyncSender<WatchMessage>) -> WatchRun {
        WatchRun { plans: BTreeMap::new(), running: None, news }
    }

    /// Adds the lines of a program, before its first state comes.
    pub fn announce(&mut self, generation: u32, plan: Option<WatchPlan>) {
        self.plans.extend(plan.map(|plan| (generation, plan)));
    }

    /// Takes an entry of the tape, with the state that belongs to it; returns what has ceased to
    /// hold, with the names of the lines.
    pub fn take(
        &mut self,
        entry: TapeEntry,
        state: Option<&EngineState>,
    ) -> Vec<(String, WatchNews)> {
        match entry {
            TapeEntry::State { generation, number, .. } => {
                if let Some(state) = state {
                    self.state(generation, number, state);
                }
            }
            TapeEntry::Number(number) => {
                if let Some(running) = &mut self.running {
                    running.scan = number.wrapping_sub(1);
                }
            }
            TapeEntry::Lost { .. } | TapeEntry::Swap { .. } => {
                if let Some(running) = &mut self.running {
                    running.is_current = false;
                }
            }
            TapeEntry::Call(call) => return self.call(call),
            TapeEntry::Origin(_) | TapeEntry::Mode(_) => {}
        }
        Vec::new()
    }

    /// The memory of a program at this place of the tape. `number`: that of the next scan.
    fn state(&mut self, generation: u32, number: u64, state: &EngineState) {
        if self.running.as_ref().is_none_or(|running| running.generation != generation) {
            let before = self.running.take();
            self.plans.retain(|announced, _| *announced >= generation);
            self.running = self.plans.remove(&generation).map(|plan| {
                let engine = Engine::new(plan.code.clone());
                RunningWatch::new(generation, plan, engine, before.as_ref())
            });
        }
        let Some(running) = &mut self.running else { return };
        let is_gap = !running.is_current;
        running.scan = number.wrapping_sub(1);
        running.is_current = running.engine.resume(state);
        if is_gap && running.is_current {
            running.plan.lines.joins(running.engine.image());
        }
    }

    fn call(&mut self, call: EngineCall) -> Vec<(String, WatchNews)> {
        let Some(running) = self.running.as_mut().filter(|running| running.is_current) else {
            return Vec::new();
        };
        running.engine.apply(call);
        match call {
            EngineCall::Start { .. } => running.plan.lines.begins_run(running.engine.image()),
            EngineCall::Begin { now_ns, .. } => {
                running.scan = running.scan.wrapping_add(1);
                running.at_ns = now_ns;
            }
            EngineCall::Execute => return running.judge(&self.news),
            EngineCall::RequestStop
            | EngineCall::Write(..)
            | EngineCall::Terminate
            | EngineCall::Force(..)
            | EngineCall::Release(_) => {}
        }
        Vec::new()
    }
}

impl RunningWatch {
    /// A program begins. Lines of the same name go on as in the program before.
    fn new(
        generation: u32,
        plan: WatchPlan,
        engine: Engine,
        before: Option<&RunningWatch>,
    ) -> RunningWatch {
        let known: BTreeMap<&String, usize> =
            before.iter().flat_map(|before| before.plan.names.iter().zip(0..)).collect();
        let numbers: Vec<Option<usize>> =
            plan.names.iter().map(|name| known.get(name).copied()).collect();
        let none = AlarmDelays::default();
        let delays = before.map_or(&none, |before| &before.delays);
        let delays = delays.carried(plan.delays.iter().copied().zip(numbers.iter().copied()));
        let count = numbers.len();
        let mut next = RunningWatch {
            generation,
            plan,
            engine,
            is_current: false,
            scan: 0,
            at_ns: 0,
            delays,
            settled: vec![SettledLine::NEW; count],
            told: vec![true; count],
        };
        let Some(before) = before else { return next };
        let held: Vec<bool> = before.plan.lines.holding().collect();
        let held = numbers.iter().map(|number| number.is_none_or(|number| held[number]));
        next.plan.lines.continues(held);
        for (line, number) in numbers.iter().enumerate() {
            let Some(number) = *number else { continue };
            (next.settled[line], next.told[line]) = (before.settled[number], before.told[number]);
        }
        next
    }

    /// A scan has ended, but for its passes: tells what is not told yet.
    fn judge(&mut self, news: &SyncSender<WatchMessage>) -> Vec<(String, WatchNews)> {
        let RunningWatch { plan, engine, delays, scan, at_ns, .. } = self;
        plan.lines.scanned(engine.image());
        let time = ScanTime { scan: *scan, at_ns: *at_ns };
        let mut changes = delays.due(time.at_ns);
        for (line, holds) in plan.lines.holding().enumerate() {
            changes.extend(delays.bit(line, !holds, time));
        }
        let mut broken = Vec::new();
        for AlarmChange { number, on, scan, at_ns, .. } in changes {
            self.settled[number] = SettledLine { holds: !on, scan, at_ns };
            broken.extend(self.tell(number, news));
        }
        // What had no room before.
        for line in 0..self.told.len() {
            broken.extend(self.tell(line, news));
        }
        broken
    }

    /// Tells what is so of a line, unless the log knows it. Returns it, with the name of the line,
    /// if the line does not hold.
    fn tell(
        &mut self,
        line: usize,
        news: &SyncSender<WatchMessage>,
    ) -> Option<(String, WatchNews)> {
        let SettledLine { holds, scan, at_ns } = self.settled[line];
        if self.told[line] == holds {
            return None;
        }
        let (generation, judged_scan) = (self.generation, self.scan);
        let deciding = match holds {
            true => Vec::new(),
            false => self.plan.lines.deciding(line, self.engine.image()),
        };
        let changed = WatchNews { generation, line, holds, scan, at_ns, judged_scan, deciding };
        news.try_send(WatchMessage::Changed(changed.clone())).ok()?;
        self.told[line] = holds;
        (!holds).then(|| (self.plan.names[line].clone(), changed))
    }
}
