//! One device's task: exchange on time, at once when an output changes, and after trouble again.
//!
//! It outlives everything its driver does: a panic costs the connection, as trouble does. Log
//! lines are edges: trouble begins, trouble ends. Outputs are what the last published image says:
//! in STOP and FAULT the safe values; and when the process ends, the safe values once more.

use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout};
use tracing::{info, warn};

use super::driver::{Driver, Exchange, Occasion, Trouble};
use super::health::Health;
use super::retry::Retry;
use crate::faults::{self, Point};
use crate::io::caught::caught;
use crate::runtime::exchange::{Mode, Port, Snapshot, StopReason};
use crate::runtime::field::{Line, Source, last_words, outgoing};
use crate::runtime::monotonic_ns;

/// How long the last exchange may take: the process ends without it then.
const LAST_MAX: Duration = Duration::from_millis(800);

/// A device: a driver, its line to the scan, and what goes out.
pub struct Device<D> {
    driver: D,
    line: Line,
    port: Port,
    outputs: Vec<Source>,
    health: Health,
    poll: Duration,
    retry: Retry,
    inputs: Vec<i32>,
    values: Vec<i32>,
    /// As the driver was given them last.
    offered: Vec<i32>,
    connected: bool,
    /// Since when exchanges fail.
    troubled: Option<Instant>,
    /// The log knows of it.
    is_told: bool,
}

/// What a device is made of.
pub struct Parts<D> {
    /// How its peer is reached.
    pub driver: D,
    /// Its line to the scan.
    pub line: Line,
    /// Where images come from.
    pub port: Port,
    /// How many points come in.
    pub inputs: usize,
    /// What goes out.
    pub outputs: Vec<Source>,
    /// Where it says how it is.
    pub health: Health,
    /// From exchange to exchange.
    pub poll: Duration,
}

/// Whether a scan is complete, or the start was meant to be in STOP. Until then outputs are as they
/// were before this process.
fn has_begun(image: &Snapshot) -> bool {
    image.mode != Mode::Stop(StopReason::NotStarted)
}

/// What a device waits for.
enum Due {
    Poll,
    Change,
    Stop,
}

impl<D: Driver> Device<D> {
    /// A device that has not connected yet.
    pub fn new(parts: Parts<D>) -> Device<D> {
        let Parts { driver, line, port, inputs, outputs, health, poll } = parts;
        let count = outputs.len();
        Device {
            driver,
            line,
            port,
            outputs,
            health,
            poll,
            retry: Retry::new(),
            inputs: vec![0; inputs],
            values: vec![0; count],
            offered: vec![0; count],
            connected: false,
            troubled: None,
            is_told: false,
        }
    }

    /// Exchanges until `stop`, then writes the safe values once more and lets go of the peer.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            if !self.reach(stop.as_mut()).await || !self.exchange_on(stop.as_mut()).await {
                break;
            }
        }
        let image = self.port.latest();
        if self.connected && has_begun(&image) {
            last_words(&self.outputs, &image, &mut self.values);
            let _ = timeout(LAST_MAX, self.exchange(Occasion::Last)).await;
        }
        self.driver.disconnect();
    }

    /// Connects, however often it takes; false where it is to stop instead.
    async fn reach(&mut self, mut stop: Pin<&mut impl Future<Output = ()>>) -> bool {
        loop {
            let connected = tokio::select! {
                () = &mut stop => return false,
                connected = caught(self.driver.connect()) => connected.unwrap_or_else(bug),
            };
            match connected {
                Ok(()) => {
                    self.connected = true;
                    return true;
                }
                Err(trouble) => self.tell_trouble(&trouble),
            }
            tokio::select! {
                () = &mut stop => return false,
                () = sleep(self.retry.next()) => {}
            }
        }
    }

    /// Exchanges until the connection is lost (true), or it is to stop.
    async fn exchange_on(&mut self, mut stop: Pin<&mut impl Future<Output = ()>>) -> bool {
        let mut poll = interval(self.poll);
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut image = self.port.latest();
        loop {
            let due = tokio::select! {
                biased;
                () = &mut stop => Due::Stop,
                _ = poll.tick() => Due::Poll,
                () = self.port.changed(&image), if !self.outputs.is_empty() => Due::Change,
            };
            image = self.port.latest();
            let occasion = match due {
                Due::Stop => return false,
                Due::Change if !has_begun(&image) || !self.has_changed(&image) => continue,
                Due::Change => Occasion::Change,
                Due::Poll => {
                    outgoing(&self.outputs, &image, &mut self.values);
                    if has_begun(&image) { Occasion::Poll } else { Occasion::First }
                }
            };
            // Not abandoned half-way for a stop: it has its own time limit.
            match self.exchange(occasion).await {
                Ok(()) => {}
                Err(trouble) => {
                    self.tell_trouble(&trouble);
                    if trouble.is_disconnected {
                        self.connected = false;
                        self.driver.disconnect();
                        tokio::select! {
                            () = &mut stop => return false,
                            () = sleep(self.retry.next()) => return true,
                        }
                    }
                }
            }
        }
    }

    fn has_changed(&mut self, image: &Arc<Snapshot>) -> bool {
        outgoing(&self.outputs, image, &mut self.values);
        self.values != self.offered
    }

    async fn exchange(&mut self, occasion: Occasion) -> Result<(), Trouble> {
        let begun = Instant::now();
        let Device { driver, values, inputs, .. } = self;
        let exchange = Exchange { occasion, outputs: values, inputs };
        let call = async {
            faults::point(Point::Device);
            driver.exchange(exchange).await
        };
        let done = caught(call).await.unwrap_or_else(bug);
        // Offered, if not taken: then the driver has it, for the next poll.
        if occasion != Occasion::First {
            self.offered.copy_from_slice(&self.values);
        }
        done?;
        if matches!(occasion, Occasion::Poll | Occasion::First) {
            self.retry.reset();
            self.line.deliver(&self.inputs, monotonic_ns());
            if self.health.good(begun.elapsed()).is_some() {
                self.tell_well();
            }
        }
        Ok(())
    }

    fn tell_trouble(&mut self, trouble: &Trouble) {
        self.line.trouble();
        self.troubled.get_or_insert_with(Instant::now);
        if !self.health.bad(&trouble.reason) {
            return;
        }
        if let Some(withheld) = self.health.may_tell() {
            self.is_told = true;
            let (reading, peer) = (self.health.reading(), self.driver.peer());
            let (device, reason) = (&reading.name, format!("{trouble} ({peer}){withheld}"));
            warn!(event = "device-trouble", %device, %peer, "{device}: {reason}");
        }
    }

    fn tell_well(&mut self) {
        let Some(since) = self.troubled.take() else { return };
        if !std::mem::take(&mut self.is_told) {
            return;
        }
        let (reading, lasted_ms) = (self.health.reading(), since.elapsed().as_millis() as u64);
        let (device, peer) = (&reading.name, &reading.peer);
        let seconds = since.elapsed().as_secs_f64();
        info!(
            event = "device-well",
            %device, %peer, lasted_ms, "{device} exchanges again after {seconds:.1} s of trouble"
        );
    }
}

/// A driver that panicked, whose connection is as it left it.
fn bug() -> Result<(), Trouble> {
    Err(Trouble::disconnected("a bug in its driver, which the line before tells"))
}
