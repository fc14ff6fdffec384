//! The signals that stop a controller, or have it read its files anew; heard from the first.
//!
//! A [`Host`] is made first of all, so that no signal finds the process without an answer. What
//! may take long before the first scan, reading files, is done on a thread of its own meanwhile.

use std::io;
use std::panic::resume_unwind;

use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::task::{spawn_blocking, yield_now};

use crate::say::say;

/// The stack of the thread that loads, as large as a main thread's.
const LOAD_STACK_BYTES: usize = 8 << 20;

/// The process as a host of a controller: tokio, and the signals.
pub struct Host {
    pub(super) tokio: Runtime,
    pub(super) signals: Signals,
}

pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
    /// Not heard where whoever started us wants it ignored, as nohup does.
    hangup: Option<Signal>,
}

impl Host {
    /// From now on signals are heard.
    ///
    /// # Errors
    /// The machine gives no descriptors.
    pub fn new() -> io::Result<Host> {
        let mut builder = Builder::new_current_thread();
        builder.thread_name("rungd-load").thread_stack_size(LOAD_STACK_BYTES);
        let tokio = builder.enable_all().build()?;
        let signals = {
            let _inside = tokio.enter();
            Signals::new()?
        };
        Ok(Host { tokio, signals })
    }

    /// Does what comes before the first scan; `None` if a signal came first. The work then goes
    /// on unheard until the process ends.
    pub fn unless_stopped<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        let Host { tokio, signals } = self;
        tokio.block_on(async {
            tokio::select! {
                name = signals.stop() => {
                    say!(
                        SIGNAL,
                        signal = name,
                        "{name}: ending; the ladder was still being loaded, nothing was scanned"
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

    /// Waits for nothing that still goes on.
    pub fn end(self) {
        self.tokio.shutdown_background();
    }
}

/// What a signal means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Told {
    /// An orderly stop, by the signal of this name.
    Stop(&'static str),
    /// Read the files anew: SIGHUP.
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

    /// The next one.
    pub async fn next(&mut self) -> Told {
        let Signals { terminate, interrupt, hangup } = self;
        let hung_up = async {
            match hangup {
                Some(hangup) => hangup.recv().await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            _ = terminate.recv() => Told::Stop("SIGTERM"),
            _ = interrupt.recv() => Told::Stop("SIGINT"),
            _ = hung_up => Told::Reload,
        }
    }

    /// The name of the next one that stops. A reload that is asked for meanwhile waits.
    pub async fn stop(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }

    /// One that stops and has come already.
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

/// Whether `/proc/self/status` says that SIGHUP, the first signal, is ignored.
fn ignores_hangup(status: &str) -> bool {
    let line = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}

/// Ends when drivers must end: once `stopped` says so.
pub(super) fn told(stopped: &watch::Receiver<bool>) -> impl Future<Output = ()> + use<> {
    let mut stopped = stopped.clone();
    async move {
        let _ = stopped.wait_for(|stop| *stop).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hangup_that_is_ignored_stays_so() {
        assert!(ignores_hangup("Name:\trungd\nSigIgn:\t0000000000001001\nSigCgt:\t0\n"));
        assert!(!ignores_hangup("Name:\trungd\nSigIgn:\t0000000000001000\nSigCgt:\t1\n"));
        assert!(!ignores_hangup(""));
    }
}
