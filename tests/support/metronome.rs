//! Measures how much this machine delays an ordinary thread: a control for tests that depend on
//! time.
//!
//! Threads wake every two milliseconds, as a controller does, and note each late wake-up. They do
//! nothing else. If the metronome missed beats, a controller may miss scans too. One thread runs on
//! any processor; besides, each processor has a thread of its own, because a virtual machine can
//! lose one processor for a while and keep the others.
//!
//! A thread with little work is delayed less than a thread with much work. Therefore the kernel's
//! figures are used too: the time for which a thread was ready to run without a processor. A thread
//! that waits for anything else is not ready to run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, Once, PoisonError};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

const BEAT: Duration = Duration::from_millis(2);

/// The shortest delay that is noted.
const LATE_LEAST: Duration = Duration::from_micros(500);

/// A late wake-up.
struct LateBeat {
    at: Instant,
    by: Duration,
    /// Whether its thread stays on one processor.
    is_pinned: bool,
}

static LATE: Mutex<Vec<LateBeat>> = Mutex::new(Vec::new());

/// Starts the metronome, once per process.
pub fn begin() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        spawn(|| beat(false));
        for processor in processors() {
            spawn(move || {
                pin_to(processor);
                beat(true);
            });
        }
    });
}

fn beat(is_pinned: bool) {
    let mut next = Instant::now();
    loop {
        next += BEAT;
        sleep(next.saturating_duration_since(Instant::now()));
        let by = next.elapsed();
        if by >= LATE_LEAST {
            let mut late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
            late.push(LateBeat { at: Instant::now(), by, is_pinned });
        }
        if by >= BEAT {
            next += by;
        }
    }
}

/// The processors that this process may use.
fn processors() -> Vec<usize> {
    // SAFETY: a cpu_set_t is plain bits, and all zero bits are the empty set; 0 is this thread, and
    // the call writes no more than the size.
    let set = unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &mut set);
        set
    };
    // SAFETY: each number is within the set.
    (0..libc::CPU_SETSIZE as usize).filter(|n| unsafe { libc::CPU_ISSET(*n, &set) }).collect()
}

/// Keeps this thread on a processor. If the system refuses that, the thread runs on any processor.
fn pin_to(processor: usize) {
    // SAFETY: as in `processors`, which returned the number.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(processor, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &set);
    }
}

/// The sum of the delays by a whole beat or more within the time `last` before now, of the thread
/// that runs on any processor.
pub fn held_up_within(last: Duration) -> Duration {
    sum_within(last, |beat| !beat.is_pinned && beat.by >= BEAT)
}

/// The sum of all delays within the time `last` before now, over all processors: the most that the
/// machine can have taken from one thread that does nothing else, whichever processors it used.
pub fn taken_within(last: Duration) -> Duration {
    sum_within(last, |beat| beat.is_pinned)
}

fn sum_within(last: Duration, counts: impl Fn(&LateBeat) -> bool) -> Duration {
    let late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    let recent = late.iter().rev().take_while(|beat| beat.at.elapsed() < last);
    recent.filter(|beat| counts(beat)).map(|beat| beat.by).sum()
}

/// The time for which a thread was ready to run without a processor; zero if the kernel does not
/// report it.
fn without_processor(thread: &Path) -> Duration {
    let text = fs::read_to_string(thread.join("schedstat")).unwrap_or_default();
    let ns = text.split(' ').nth(1).and_then(|word| word.parse().ok());
    Duration::from_nanos(ns.unwrap_or_default())
}

/// The delay so far of each thread of a process and of its children.
#[derive(Clone, Default)]
pub struct HeldUp(BTreeMap<u32, Duration>);

impl HeldUp {
    /// Reads the delays of the process and its children.
    pub fn of(pid: u32) -> HeldUp {
        let mut held_up = HeldUp::default();
        held_up.add(pid);
        held_up
    }

    fn add(&mut self, pid: u32) {
        let threads = fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
        for thread in threads.map(|entry| entry.path()) {
            let number = thread.file_name().and_then(|name| name.to_str()?.parse().ok());
            let Some(number) = number else { continue };
            self.0.insert(number, without_processor(&thread));
            let children = fs::read_to_string(thread.join("children")).unwrap_or_default();
            children.split_whitespace().filter_map(|pid| pid.parse().ok()).for_each(|pid| {
                self.add(pid);
            });
        }
    }

    /// The longest delay of a thread since `before`.
    pub fn since(&self, before: &HeldUp) -> Duration {
        let so_far = |thread| before.0.get(thread).copied().unwrap_or_default();
        let times = self.0.iter().map(|(thread, time)| time.saturating_sub(so_far(thread)));
        times.max().unwrap_or_default()
    }
}

/// Measures a wait for an answer of a process, without the times for which the machine delayed the
/// process or the waiting thread.
pub struct Stopwatch {
    begun: Instant,
    pid: u32,
    process: HeldUp,
    own: Duration,
}

impl Stopwatch {
    pub fn start(pid: u32) -> Stopwatch {
        let own = without_processor(Path::new("/proc/thread-self"));
        Stopwatch { begun: Instant::now(), pid, process: HeldUp::of(pid), own }
    }

    pub fn elapsed(&self) -> Duration {
        let own = without_processor(Path::new("/proc/thread-self")).saturating_sub(self.own);
        let process = HeldUp::of(self.pid).since(&self.process);
        self.begun.elapsed().saturating_sub(own + process)
    }
}
