//! Keeps a local device open: the scan exchanges; the keeper opens the device, and opens it again
//! after a failure.

use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::{sleep, timeout};

use super::health::DeviceHealth;
use super::retry::Retry;
use rungd_runtime::exchange::{Mode, Port, StopReason};
use rungd_runtime::local::{Local, LocalEnd};

/// The time limit for the safe values at the end; the process waits longer than this.
const END_MAX: Duration = Duration::from_secs(2);
/// The interval at which the keeper checks whether the scan has released the device.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Opens a local device. Called on threads that may block.
pub trait Opener: Send + Sync + 'static {
    /// Opens the device; its outputs begin with these values, one per point.
    ///
    /// # Errors
    /// The system refuses to open it.
    fn open(&self, outputs: &[i32]) -> io::Result<Arc<dyn Local>>;
}

/// Keeps one local device open.
pub struct DeviceKeeper {
    opener: Arc<dyn Opener>,
    end: LocalEnd,
    health: DeviceHealth,
    port: Port,
    retry: Retry,
}

impl DeviceKeeper {
    /// A keeper that has not opened its device yet.
    pub fn new(
        opener: Arc<dyn Opener>,
        end: LocalEnd,
        health: DeviceHealth,
        port: Port,
    ) -> DeviceKeeper {
        DeviceKeeper { opener, end, health, port, retry: Retry::new() }
    }

    /// Opens the device for the first time, before the first scan, so that this scan sees its
    /// inputs.
    pub fn open(&mut self) {
        let first = self.end.safe_values(&self.port.latest());
        match self.opener.open(&first) {
            Ok(device) => self.hand_in(device),
            Err(error) => self.health.trouble(&error.to_string()),
        }
    }

    /// Keeps the device open until `stop`; then writes the safe values once more.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            let open = self.health.condition().trouble.is_none();
            let wait = if open { LOOK_EVERY } else { self.retry.next() };
            tokio::select! {
                () = &mut stop => break,
                () = sleep(wait) => {}
            }
            if let Some(failure) = self.end.failure() {
                self.health.trouble(&failure.to_string());
            } else if !open {
                self.open_again().await;
            } else {
                self.health.open(self.end.exchanged());
            }
        }
        if self.end.has_outputs() && timeout(END_MAX, self.last()).await.is_err() {
            self.health.tell_unsafe(END_MAX);
        }
    }

    /// Tries to write the safe values until they are written.
    async fn last(&mut self) {
        let mut retry = Retry::at_the_end();
        while let Err(error) = self.try_last().await {
            self.health.trouble(&error.to_string());
            sleep(retry.next()).await;
        }
    }

    /// Writes the safe values to the open device, or opens the device with them. Runs on a thread
    /// of its own, so a chip that hangs does not delay the ends of the other tasks.
    async fn try_last(&mut self) -> io::Result<()> {
        let (image, rescue) = (self.port.latest(), self.end.rescue());
        let (opener, first) = (Arc::clone(&self.opener), self.end.safe_values(&image));
        let has_begun = image.mode != Mode::Stop(StopReason::NotStarted);
        let try_once = move || match rescue.make_safe(&image) {
            Some(written) => written.map_err(io::Error::from_raw_os_error),
            None if has_begun => opener.open(&first).map(drop),
            None => Ok(()),
        };
        tokio::task::spawn_blocking(try_once).await.unwrap_or_else(|bug| Err(io::Error::other(bug)))
    }

    async fn open_again(&mut self) {
        let (opener, first) = (Arc::clone(&self.opener), self.end.safe_values(&self.port.latest()));
        match tokio::task::spawn_blocking(move || opener.open(&first)).await {
            Ok(Ok(device)) => self.hand_in(device),
            Ok(Err(error)) => self.health.trouble(&error.to_string()),
            Err(panic) => self.health.trouble(&panic.to_string()),
        }
    }

    fn hand_in(&mut self, device: Arc<dyn Local>) {
        if !self.end.hand_in(device) {
            return self.health.trouble("the scan thread takes no device");
        }
        self.retry.reset();
        self.health.open(self.end.exchanged());
    }
}
