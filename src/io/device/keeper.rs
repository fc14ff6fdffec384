//! Keeps a local device open: the scan exchanges, this opens, and opens again what failed.

use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::sleep;

use super::health::Health;
use super::retry::Retry;
use crate::runtime::exchange::Port;
use crate::runtime::field::{Local, LocalLine};

/// How often the keeper looks whether the scan has let go of its device.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Opens a local device; called where waiting is allowed.
pub trait Opener: Send + Sync + 'static {
    /// Opens it: outputs begin with these values, one a point.
    ///
    /// # Errors
    /// The system refuses.
    fn open(&self, outputs: &[i32]) -> io::Result<Arc<dyn Local>>;
}

/// Keeps one local device open.
pub struct Keeper {
    opener: Arc<dyn Opener>,
    line: LocalLine,
    health: Health,
    port: Port,
    retry: Retry,
}

impl Keeper {
    /// A keeper that has not opened its device yet.
    pub fn new(opener: Arc<dyn Opener>, line: LocalLine, health: Health, port: Port) -> Keeper {
        Keeper { opener, line, health, port, retry: Retry::new() }
    }

    /// Opens the device for the first time: before the first scan, which so sees its inputs.
    pub fn open(&mut self) {
        let first = self.line.safe_values(&self.port.latest());
        match self.opener.open(&first) {
            Ok(device) => self.hand_in(device),
            Err(error) => self.health.trouble(&error.to_string()),
        }
    }

    /// Keeps it open until `stop`; then its outputs are made safe once more.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            let open = self.health.reading().trouble.is_none();
            let wait = if open { LOOK_EVERY } else { self.retry.next() };
            tokio::select! {
                () = &mut stop => break,
                () = sleep(wait) => {}
            }
            if let Some(failure) = self.line.failure() {
                self.health.trouble(&failure.to_string());
            } else if !open {
                self.open_again().await;
            } else {
                self.health.open(self.line.exchanged());
            }
        }
        self.line.rescue().make_safe(&self.port.latest());
    }

    async fn open_again(&mut self) {
        let (opener, first) =
            (Arc::clone(&self.opener), self.line.safe_values(&self.port.latest()));
        match tokio::task::spawn_blocking(move || opener.open(&first)).await {
            Ok(Ok(device)) => self.hand_in(device),
            Ok(Err(error)) => self.health.trouble(&error.to_string()),
            Err(panic) => self.health.trouble(&panic.to_string()),
        }
    }

    fn hand_in(&mut self, device: Arc<dyn Local>) {
        if !self.line.hand_in(device) {
            return self.health.trouble("the scan thread takes no device");
        }
        self.retry.reset();
        self.health.open(self.line.exchanged());
    }
}
