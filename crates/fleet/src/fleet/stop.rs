//! The end of listening: after a given time, or by SIGINT or SIGTERM.
//!
//! A separate thread waits for signals, because the listening thread also prints, and a reader that
//! has paused (`… | less`) holds it up. The first signal requests the end, the second signal ends
//! the process at once. Used by `listen`.

use std::io;
use std::time::Duration;

use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

/// The exit code of a process that a signal has ended is this plus the signal's number, as in
/// shells.
const ENDED_BY: i32 = 128;

/// The conditions that end listening.
pub(super) struct StopSignals {
    asked: watch::Receiver<bool>,
    end: Option<Instant>,
}

impl StopSignals {
    /// From now on, signals end listening. If `lasts` is given, listening also ends after this
    /// time.
    ///
    /// # Errors
    /// The system refuses a thread, or the handling of signals.
    pub fn new(lasts: Option<Duration>) -> io::Result<StopSignals> {
        let runtime = Builder::new_current_thread().enable_io().build()?;
        let both = {
            let _within = runtime.enter();
            [SignalKind::interrupt(), SignalKind::terminate()].map(|kind| (kind, signal(kind)))
        };
        let [(interrupt, interrupted), (terminate, terminated)] = both;
        let signals = [(interrupt, interrupted?), (terminate, terminated?)];
        let (ask, asked) = watch::channel(false);
        let thread = std::thread::Builder::new().name("rungd-signals".to_owned());
        thread.spawn(move || obey(&runtime, signals, &ask))?;
        Ok(StopSignals { asked, end: lasts.map(|lasts| Instant::now() + lasts) })
    }

    /// Whether the end has not come yet.
    pub fn is_going_on(&self) -> bool {
        !*self.asked.borrow() && self.end.is_none_or(|end| Instant::now() < end)
    }

    /// Waits for the end. Returns at once if the end has already come.
    pub async fn wait(&mut self) {
        let end = self.end;
        let over = async {
            match end {
                Some(end) => sleep_until(end).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            _ = self.asked.wait_for(|asked| *asked) => {}
            () = over => {}
        }
    }
}

fn obey(runtime: &Runtime, mut signals: [(SignalKind, Signal); 2], ask: &watch::Sender<bool>) {
    runtime.block_on(async {
        let _ = next(&mut signals).await;
        // The listener may have ended already.
        let _ = ask.send(true);
        let last = next(&mut signals).await;
        std::process::exit(ENDED_BY + last.as_raw_value());
    });
}

/// The next signal.
async fn next([interrupt, terminate]: &mut [(SignalKind, Signal); 2]) -> SignalKind {
    tokio::select! {
        _ = interrupt.1.recv() => interrupt.0,
        _ = terminate.1.recv() => terminate.0,
    }
}
