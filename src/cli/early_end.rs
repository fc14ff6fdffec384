//! The early end of a command that computes for long: Ctrl+C or its time. What is done by then is
//! reported.
//!
//! `mutate` and `prove` ask whether to go on.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use signal_hook::consts::SIGINT;

use rungd_engine::isa::duration;

/// Reads a time of the command line: `90s`, `5m`.
pub(super) fn time(text: &str) -> Result<Duration, String> {
    match duration::parse(text).map(|ms| Duration::from_millis(ms.unsigned_abs().into())) {
        Ok(time) if !time.is_zero() => Ok(time),
        Ok(_) | Err(_) => Err("write a time above 0, as `90s` or `5m`".to_owned()),
    }
}

/// What ends the command early: Ctrl+C, or its time. A second Ctrl+C ends it at once.
pub(super) struct EarlyEnd {
    /// Set when the command must end.
    pub is_over: Arc<AtomicBool>,
}

impl EarlyEnd {
    /// Listens for Ctrl+C, and for the end of the time.
    ///
    /// # Errors
    /// The system has no signals.
    pub fn of(time: Option<Duration>) -> Result<EarlyEnd> {
        let is_over = Arc::new(AtomicBool::new(false));
        let listen = || {
            let ends = Arc::clone(&is_over);
            signal_hook::flag::register_conditional_default(SIGINT, ends)?;
            signal_hook::flag::register(SIGINT, Arc::clone(&is_over))
        };
        listen().context("cannot listen for Ctrl+C")?;
        if let Some(time) = time {
            let is_over = Arc::clone(&is_over);
            // Ends with the process.
            std::thread::spawn(move || {
                std::thread::sleep(time);
                is_over.store(true, Ordering::Relaxed);
            });
        }
        Ok(EarlyEnd { is_over })
    }
}
