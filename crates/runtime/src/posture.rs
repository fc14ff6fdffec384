//! The real-time posture: the requests of the controller file, and the machine's answers.
//!
//! Part of it belongs to the process (locked memory, the wake-up latency of idle CPUs held down by
//! an open file), part to the scan thread alone (scheduler, CPUs, timer slack): a policy set
//! elsewhere would be inherited by every thread. The caller decides whether a refusal matters.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};

use super::sys;

/// The requested posture. The default needs no privilege.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Posture {
    /// The scheduling of the scan thread, and of no other thread.
    pub policy: Policy,
    /// `mlockall`.
    pub lock_memory: bool,
    /// Hold `/dev/cpu_dma_latency` at this number of microseconds, so that idle CPUs do not sleep
    /// deeper.
    pub cpu_latency_us: Option<i32>,
    /// Keep the scan thread on these CPUs; none: wherever the process may run.
    pub cpus: Vec<u32>,
    /// The scan thread is awake for this time before each scan, µs; it needs no permission.
    pub spin_us: u32,
    /// Whether a refused request prevents the start.
    pub strict: bool,
}

/// The scheduling policy of a thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// The default of the system.
    #[default]
    Other,
    /// SCHED_FIFO at a priority of 1 to 99.
    Fifo(u8),
    /// SCHED_RR at a priority of 1 to 99.
    RoundRobin(u8),
}

/// A request, and the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grant {
    /// The request in a few words.
    pub what: String,
    /// The reason, if it was refused.
    pub refused: Option<NotGranted>,
}

/// The reason why something was not granted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotGranted {
    /// The machine's answer.
    pub why: String,
    /// How it can be granted.
    pub remedy: String,
}

/// The resources that the process holds for as long as it runs.
#[derive(Debug, Default)]
pub struct HeldResources {
    _cpu_latency: Option<File>,
}

const DMA_LATENCY: &str = "/dev/cpu_dma_latency";
/// The size of the part of the scan thread's stack that is touched before the first scan.
const PREFAULT_BYTES: usize = 256 * 1024;

impl Posture {
    /// The process's part; called once, before threads are started.
    pub(crate) fn apply_to_process(&self) -> (HeldResources, Vec<Grant>) {
        let mut grants = Vec::new();
        let mut held = HeldResources::default();
        if self.lock_memory {
            let remedy = || "LimitMEMLOCK=infinity in the unit, `ulimit -l unlimited` in a shell";
            grants.push(grant("memory locked".into(), lock_memory(), remedy));
        }
        if let Some(latency_us) = self.cpu_latency_us {
            let what = format!("CPU latency of {latency_us} us");
            let (file, answer) = match hold_latency(latency_us) {
                Ok(file) => (Some(file), Ok(())),
                Err(error) => (None, Err(error)),
            };
            grants.push(grant(what, answer, latency_remedy));
            held._cpu_latency = file;
        }
        (held, grants)
    }

    /// The scan thread's part; called on this thread. The policy comes last.
    pub(crate) fn apply_to_scan_thread(&self) -> Vec<Grant> {
        prefault_stack();
        let slack = sys::set_timer_slack_ns(1);
        let mut grants = vec![grant("timer slack 1 ns".into(), slack, || "nothing known")];
        if self.spin_us > 0 {
            let what = format!("awake {} us before each scan", self.spin_us);
            grants.push(Grant { what, refused: None });
        }
        if !self.cpus.is_empty() {
            let remedy = || {
                "CPUs that exist (`nproc --all`), and that the unit's CPUAffinity= and \
                 AllowedCPUs= allow"
            };
            grants.push(grant(cpus(&self.cpus), sys::pin_to_cpus(&self.cpus), remedy));
        }
        let (name, priority, set) = match self.policy {
            Policy::Other => return grants,
            Policy::Fifo(priority) => ("SCHED_FIFO", priority, sys::set_fifo(priority)),
            Policy::RoundRobin(priority) => ("SCHED_RR", priority, sys::set_round_robin(priority)),
        };
        let remedy =
            || format!("LimitRTPRIO={priority} in the unit, `ulimit -r {priority}` in a shell");
        grants.push(grant(format!("{name} priority {priority}"), set, remedy));
        grants
    }
}

fn grant<R: Into<String>>(
    what: String,
    answer: io::Result<()>,
    remedy: impl FnOnce() -> R,
) -> Grant {
    let refusal = |error: io::Error| NotGranted { why: error.to_string(), remedy: remedy().into() };
    Grant { what, refused: answer.err().map(refusal) }
}

fn cpus(numbers: &[u32]) -> String {
    let list: Vec<String> = numbers.iter().map(u32::to_string).collect();
    format!("CPU {}", list.join(" "))
}

fn lock_memory() -> io::Result<()> {
    if !sys::memory_lock_is_unlimited() {
        // With a limit this call would succeed, but a later thread's stack would not get its
        // memory.
        return Err(io::Error::other("the limit on locked memory is not infinite"));
    }
    sys::limit_arenas();
    sys::lock_memory()
}

fn hold_latency(latency_us: i32) -> io::Result<File> {
    let mut file = OpenOptions::new().write(true).open(DMA_LATENCY)?;
    file.write_all(&latency_us.to_ne_bytes())?;
    Ok(file)
}

fn latency_remedy() -> String {
    format!("write access to {DMA_LATENCY} for the service's user (the package's tmpfiles entry)")
}

#[inline(never)]
fn prefault_stack() {
    let pages = [0_u8; PREFAULT_BYTES];
    std::hint::black_box(&pages);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_timer_slack_is_requested_by_default() {
        let (_held, process) = Posture::default().apply_to_process();
        assert_eq!(process, []);
        let thread = std::thread::spawn(|| Posture::default().apply_to_scan_thread()).join();
        let slack = Grant { what: "timer slack 1 ns".into(), refused: None };
        assert_eq!(thread.unwrap(), [slack]);
    }

    #[test]
    fn a_refusal_has_a_reason_and_a_remedy() {
        let asked = Posture { cpus: vec![0, 1000], ..Posture::default() };
        let thread = std::thread::spawn(move || asked.apply_to_scan_thread()).join().unwrap();
        assert_eq!(thread[1].what, "CPU 0 1000");
        let refusal = thread[1].refused.as_ref().expect("there is no CPU 1000");
        assert!(refusal.why.contains("1000") && refusal.remedy.contains("nproc"), "{refusal:?}");
    }
}
