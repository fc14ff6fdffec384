//! The signals that stop a controller or reload its files.
//!
//! `run` makes a [`ProcessHost`] before anything else, so that the process answers signals from the
//! first moment. Reading the files may take long: a separate thread reads them, while the host
//! waits for signals, and tells what it waits for.

use std::io;
use std::panic::resume_unwind;
use std::time::Duration;

use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::task::{spawn_blocking, yield_now};

use super::start_wait::{StartPart, StartWatch};
use rungd_runtime::say::say;

/// The stack of the loading thread: the same size as a main thread's.
const LOAD_STACK_BYTES: usize = 8 << 20;

/// A controller's process: tokio's runtime, the signals, and what the start waits for.
pub struct ProcessHost {
    pub(super) tokio: Runtime,
    pub(super) signals: Signals,
    pub(super) start: StartWatch,
}

pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
    /// `None` if the parent process set SIGHUP to be ignored, as nohup does.
    hangup: Option<Signal>,
}

impl ProcessHost {
    /// Installs the signal handlers. A start that waits says so every `repeat`.
    ///
    /// # Errors
    /// The system has no free descriptors, or cannot start a thread.
    pub fn new(repeat: Duration) -> io::Result<ProcessHost> {
        let mut builder = Builder::new_current_thread();
        builder.thread_name("rungd-load").thread_stack_size(LOAD_STACK_BYTES);
        let tokio = builder.enable_all().build()?;
        let signals = {
            let _inside = tokio.enter();
            Signals::new()?
        };
        Ok(ProcessHost { tokio, signals, start: StartWatch::begin(repeat)? })
    }

    /// Does a part of the start that answers no signals.
    pub fn during<T>(&self, part: StartPart, work: impl FnOnce() -> T) -> T {
        self.start.during(part, work)
    }

    /// Does a part of the start; `None` if a signal came first. Then the work continues until the
    /// process ends, and its result is dropped.
    pub fn unless_stopped<T: Send + 'static>(
        &mut self,
        part: StartPart,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        let ProcessHost { tokio, signals, start } = self;
        let _begun = start.enter(part.clone());
        tokio.block_on(async {
            tokio::select! {
                name = signals.stop() => {
                    let interrupted = part.interrupted();
                    say!(
                        SIGNAL,
                        signal = name,
                        "{name}: ending; {interrupted}, nothing was scanned"
                    );
                    None
                }
                done = spawn_blocking(work) => match done {
                    Ok(done) => Some(done),
                    Err(bug) => resume_unwind(bug.into_panic()),
                },
            }
        })
    }

    /// Ends tokio's runtime, and waits for none of its threads.
    pub fn end(self) {
        self.tokio.shutdown_background();
    }
}

/// The meaning of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalOrder {
    /// An orderly stop, requested by the signal of this name.
    Stop(&'static str),
    /// SIGHUP: read the files again.
    Reload,
}

impl Signals {
    fn new() -> io::Result<Signals> {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let hangup = (!ignores_hangup(&status)).then(|| signal(SignalKind::hangup()));
        Ok(Signals {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
            hangup: hangup.transpose()?,
        })
    }

    /// The next signal.
    pub async fn next(&mut self) -> SignalOrder {
        let Signals { terminate, interrupt, hangup } = self;
        let hung_up = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            _ = terminate.recv() => SignalOrder::Stop("SIGTERM"),
            _ = interrupt.recv() => SignalOrder::Stop("SIGINT"),
            _ = hung_up => SignalOrder::Reload,
        }
    }

    /// Waits for the next signal that requests a stop, and returns its name. A SIGHUP in the
    /// meantime stays pending.
    pub async fn stop(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }

    /// Does the work. If a signal requests a stop before the end of the work, returns the signal's
    /// name.
    pub async fn before(&mut self, work: impl Future<Output = ()>) -> Option<&'static str> {
        tokio::select! {
            biased;
            name = self.stop() => return Some(name),
            () = work => {}
        }
        self.waiting().await
    }

    async fn waiting(&mut self) -> Option<&'static str> {
        yield_now().await;
        tokio::select! {
            biased;
            name = self.stop() => Some(name),
            () = std::future::ready(()) => None,
        }
    }
}

/// Whether `/proc/self/status` shows SIGHUP, which is signal 1, as ignored.
fn ignores_hangup(status: &str) -> bool {
    let line = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}

/// Waits until the drivers must end: until `stopped` is true.
pub(super) fn when_stopped(stopped: &watch::Receiver<bool>) -> impl Future<Output = ()> + use<> {
    let mut stopped = stopped.clone();
    async move {
        let _ = stopped.wait_for(|stop| *stop).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inherited_ignored_hangup_is_recognized() {
        assert!(ignores_hangup("Name:\trungd\nSigIgn:\t0000000000001001\nSigCgt:\t0\n"));
        assert!(!ignores_hangup("Name:\trungd\nSigIgn:\t0000000000001000\nSigCgt:\t1\n"));
        assert!(!ignores_hangup(""));
    }
}
