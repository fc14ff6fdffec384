//! `[[watch]]`: judges its lines behind each scan, without the scan thread.
//!
//! Called by `record_thread` with every entry of the tape. An engine of its own executes the
//! recorded calls again, and only those operations that the lines depend on. What changes goes to
//! `log_writer`, which makes an alarm of it, and to `watch_reasons`, which explains it.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use rungd_config::controller::watch::WatchSettings;
use rungd_engine::{Engine, EngineCall, EngineProgram, EngineState};
use rungd_lab::testing::{DecidingOperand, WatchedLines};
use rungd_language::lower::Symbols;
use rungd_runtime::TapeEntry;

/// The most news that wait for the log. What does not fit is told later, as it then is.
const NEWS_MAX: usize = 4_096;

/// The lines of one program, ready to be judged.
pub(super) struct WatchPlan {
    names: Vec<String>,
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
        Some(WatchPlan { names, lines, code })
    }
}

/// A line that begins or ceases to hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WatchNews {
    /// The generation of its program.
    pub generation: u32,
    /// Its number.
    pub line: usize,
    pub holds: bool,
    /// The scan at whose end it is so, and the time of that scan (CLOCK_MONOTONIC).
    pub scan: u64,
    pub at_ns: u64,
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
    /// By line: what the log knows.
    told: Vec<bool>,
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
                let told = vec![true; plan.names.len()];
                let (is_current, scan, at_ns) = (false, 0, 0);
                let mut next =
                    RunningWatch { generation, plan, engine, is_current, scan, at_ns, told };
                next.continues(before.as_ref());
                next
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
    /// Lines of the same name hold what they held in the program before.
    fn continues(&mut self, before: Option<&RunningWatch>) {
        let Some(before) = before else { return };
        let held: Vec<bool> = before.plan.lines.holding().collect();
        let known: BTreeMap<&String, (bool, bool)> = before
            .plan
            .names
            .iter()
            .zip(held.into_iter().zip(before.told.iter().copied()))
            .collect();
        let of = |name| known.get(name).copied().unwrap_or((true, true));
        let (held, told): (Vec<bool>, Vec<bool>) = self.plan.names.iter().map(of).unzip();
        self.plan.lines.continues(held.into_iter());
        self.told = told;
    }

    /// A scan has ended, but for its passes: tells what is not told yet.
    fn judge(&mut self, news: &SyncSender<WatchMessage>) -> Vec<(String, WatchNews)> {
        let RunningWatch { generation, plan, engine, scan, at_ns, told, .. } = self;
        let (generation, scan, at_ns) = (*generation, *scan, *at_ns);
        let lines = &mut plan.lines;
        lines.scanned(engine.image());
        let mut broken = Vec::new();
        for (line, (told, holds)) in told.iter_mut().zip(lines.holding()).enumerate() {
            if *told == holds {
                continue;
            }
            let deciding = match holds {
                true => Vec::new(),
                false => lines.deciding(line, engine.image()),
            };
            let changed = WatchNews { generation, line, holds, scan, at_ns, deciding };
            if news.try_send(WatchMessage::Changed(changed.clone())).is_err() {
                break;
            }
            *told = holds;
            if !holds {
                broken.push((plan.names[line].clone(), changed));
            }
        }
        broken
    }
}
