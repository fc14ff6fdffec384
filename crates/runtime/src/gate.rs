//! What the scan thread and the ports share without locks: inputs, the gate for batches, the tempo.
//!
//! Each flag has one writer: `running` the scan thread, `stuck` the monitor. One order matters: who
//! sees that the scan thread is no longer stuck also sees in which mode it came back. All other
//! values stand for themselves; batches, images and commands go through rings and locks. `loom/`
//! executes this file in every order of its accesses.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

/// The shared atomics.
pub(super) struct ScanGate {
    /// Inputs, 64 to a word.
    inputs: Box<[AtomicU64]>,
    input_count: u32,
    /// The controller is in RUN.
    running: AtomicBool,
    /// The monitor has reported the scan thread as stuck, and has seen no sign of life since.
    stuck: AtomicBool,
    /// The writes of all batches that no scan has taken.
    waiting_writes: AtomicUsize,
    /// The current [`Tempo`], in ns.
    period_ns: AtomicU64,
    watchdog_ns: AtomicU64,
}

/// Up to 64 inputs in a row, the lowest bit is that of the first input.
pub(super) struct InputWord {
    /// The number of the first input.
    pub first: u32,
    /// 1 for each input that exists.
    pub present: u64,
    /// Their values.
    pub values: u64,
}

/// The period of scans and the time limit of a scan. A reload may change both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tempo {
    /// The time from scan to scan.
    pub period_ns: u64,
    /// A scan longer than this is a fault.
    pub watchdog_ns: u64,
}

impl Tempo {
    /// The time of this many periods and of one scan of the greatest permitted duration.
    pub fn patience(self, periods: u64) -> Duration {
        let periods_ns = self.period_ns.saturating_mul(periods);
        Duration::from_nanos(periods_ns.saturating_add(self.watchdog_ns))
    }
}

impl ScanGate {
    /// A closed gate, and as many inputs, all OFF.
    pub fn new(inputs: u32) -> ScanGate {
        ScanGate {
            inputs: (0..inputs.div_ceil(64)).map(|_| AtomicU64::new(0)).collect(),
            input_count: inputs,
            running: AtomicBool::new(false),
            stuck: AtomicBool::new(false),
            waiting_writes: AtomicUsize::new(0),
            period_ns: AtomicU64::new(0),
            watchdog_ns: AtomicU64::new(0),
        }
    }

    /// Sets an input. An X that does not exist is ignored.
    pub fn set_input(&self, x: u32, on: bool) {
        if x >= self.input_count {
            return;
        }
        let word = &self.inputs[x as usize / 64];
        let bit = 1_u64 << (x % 64);
        if on {
            word.fetch_or(bit, Ordering::Relaxed);
        } else {
            word.fetch_and(!bit, Ordering::Relaxed);
        }
    }

    /// All inputs with their latest values.
    pub fn inputs(&self) -> impl Iterator<Item = InputWord> + '_ {
        (0_u32..).step_by(64).zip(&self.inputs).map(|(first, word)| InputWord {
            first,
            present: u64::MAX >> (64 - (self.input_count - first).min(64)),
            values: word.load(Ordering::Relaxed),
        })
    }

    /// Whether batches are taken.
    pub fn is_open(&self) -> bool {
        // In this order: after a fault, the mode is read behind the sign of life.
        !self.is_stuck() && self.running.load(Ordering::Relaxed)
    }

    /// The scan thread enters RUN, or leaves it.
    pub fn set_running(&self, running: bool) {
        self.running.store(running, Ordering::Relaxed);
    }

    /// Whether the scan thread is stuck or has ended.
    pub fn is_stuck(&self) -> bool {
        self.stuck.load(Ordering::Acquire)
    }

    /// The monitor has found that the scan thread is stuck.
    pub fn set_stuck(&self) {
        self.stuck.store(true, Ordering::Relaxed);
    }

    /// The monitor has got a sign of life of the scan thread. Returns whether it was stuck.
    pub fn hear(&self) -> bool {
        self.stuck.swap(false, Ordering::Release)
    }

    /// Whether so many writes may wait beside those that do, `max` in all; then they count. Called
    /// under the lock of the queue of batches, before the batch is put into it.
    pub fn reserve(&self, writes: usize, max: usize) -> bool {
        // The count grows only under that lock, and shrinks when a scan takes a batch.
        let has_room = self.waiting_writes.load(Ordering::Relaxed) + writes <= max;
        if has_room {
            self.waiting_writes.fetch_add(writes, Ordering::Relaxed);
        }
        has_room
    }

    /// A scan has taken so many writes from the queue.
    pub fn release(&self, writes: usize) {
        self.waiting_writes.fetch_sub(writes, Ordering::Relaxed);
    }

    /// The current tempo. Its two times may be from before and after a reload.
    pub fn tempo(&self) -> Tempo {
        Tempo {
            period_ns: self.period_ns.load(Ordering::Relaxed),
            watchdog_ns: self.watchdog_ns.load(Ordering::Relaxed),
        }
    }

    /// Sets the tempo. Called by the scan thread, and once before that thread exists.
    pub fn set_tempo(&self, tempo: Tempo) {
        self.period_ns.store(tempo.period_ns, Ordering::Relaxed);
        self.watchdog_ns.store(tempo.watchdog_ns, Ordering::Relaxed);
    }
}
