//! The real-time posture: what the controller file asks of the machine, and what it grants.
//!
//! Part of it belongs to the process (locked memory, the C-state latency held down by an open
//! file), part to the scan thread alone (scheduler, CPU, timer slack): a policy set elsewhere
//! would be inherited by every thread. Whether a refusal matters is the caller's to decide.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};

use super::sys;

/// What is asked for. By default nothing that needs a privilege.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Posture {
    /// SCHED_FIFO at this priority, for the scan thread alone.
    pub priority: Option<u8>,
    /// `mlockall`.
    pub lock_memory: bool,
    /// Hold `/dev/cpu_dma_latency` at 0: no deep sleep of idle CPUs.
    pub cpu_dma_latency: bool,
    /// Keep the scan thread on this CPU.
    pub cpu: Option<u32>,
    /// Whether a refusal refuses the start.
    pub strict: bool,
}

/// One thing that was asked for, and the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grant {
    /// What, in a few words.
    pub what: String,
    /// Why not, if it was refused.
    pub refused: Option<String>,
}

/// What the process holds for as long as it runs.
#[derive(Debug, Default)]
pub struct Held {
    _cpu_dma_latency: Option<File>,
}

const DMA_LATENCY: &str = "/dev/cpu_dma_latency";
/// How much of the scan thread's stack is touched before the first scan.
const PREFAULT_BYTES: usize = 256 * 1024;

impl Posture {
    /// What concerns the process; called once, before threads are started.
    pub fn apply_to_process(&self) -> (Held, Vec<Grant>) {
        let mut grants = Vec::new();
        let mut held = Held::default();
        if self.lock_memory {
            grants.push(grant("memory locked".into(), lock_memory()));
        }
        if self.cpu_dma_latency {
            let file = hold_dma_latency();
            let answer =
                file.as_ref().map(|_| ()).map_err(|e| io::Error::new(e.kind(), e.to_string()));
            grants.push(grant(format!("{DMA_LATENCY} held at 0"), answer));
            held._cpu_dma_latency = file.ok();
        }
        (held, grants)
    }

    /// What concerns the scan thread; called on it. The policy comes last.
    pub fn apply_to_scan_thread(&self) -> Vec<Grant> {
        prefault_stack();
        let mut grants = vec![grant("timer slack 1 ns".into(), sys::set_timer_slack_ns(1))];
        if let Some(cpu) = self.cpu {
            grants.push(grant(format!("CPU {cpu}"), sys::pin_to_cpu(cpu as usize)));
        }
        if let Some(priority) = self.priority {
            let what = format!("SCHED_FIFO priority {priority}");
            grants.push(grant(what, sys::set_fifo(priority)));
        }
        grants
    }
}

fn grant(what: String, answer: io::Result<()>) -> Grant {
    Grant { what, refused: answer.err().map(|e| e.to_string()) }
}

fn lock_memory() -> io::Result<()> {
    if !sys::memory_lock_is_unlimited() {
        // With a limit the call would succeed and a later thread's stack would not.
        return Err(io::Error::other("the limit on locked memory is not infinite (LimitMEMLOCK=)"));
    }
    sys::lock_memory()
}

fn hold_dma_latency() -> io::Result<File> {
    let mut file = OpenOptions::new().write(true).open(DMA_LATENCY)?;
    file.write_all(&0_i32.to_ne_bytes())?;
    Ok(file)
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
    fn by_default_only_the_timer_slack_is_asked_for() {
        let (_held, process) = Posture::default().apply_to_process();
        assert_eq!(process, []);
        let thread = std::thread::spawn(|| Posture::default().apply_to_scan_thread()).join();
        let slack = Grant { what: "timer slack 1 ns".into(), refused: None };
        assert_eq!(thread.unwrap(), [slack]);
    }

    #[test]
    fn a_refusal_says_why() {
        let asked = Posture { cpu: Some(100_000), ..Posture::default() };
        let thread = std::thread::spawn(move || asked.apply_to_scan_thread()).join().unwrap();
        assert!(thread[1].refused.is_some() && thread[1].what == "CPU 100000");
    }
}
