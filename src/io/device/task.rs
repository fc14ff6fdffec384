//! One device's task: exchange on time, at once when an output changes, and after trouble again.
//!
//! It outlives everything its driver does: a panic costs the connection, as trouble does. Log
//! lines are edges: trouble begins, trouble ends. Outputs are what the last published image says:
//! in STOP and FAULT the safe values; and when the process ends, the safe values once more, for
//! which a device that is not connected, or loses its connection then, is connected once more.

use std::future::{Future, ready};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout_at};

use super::driver::{Done, Driver, Exchange, Occasion, Trouble};
use super::health::Health;
use super::retry::Retry;
use crate::faults::{self, Point};
use crate::io::caught::caught;
use crate::runtime::exchange::{Mode, Port, Snapshot, StopReason};
use crate::runtime::field::{Line, Source, last_words, outgoing};
use crate::runtime::monotonic_ns;

/// How long the end may take: less than the process waits for it.
const END_MAX: Duration = Duration::from_secs(2);
/// How much of that an exchange may take that is under way then.
const UNDER_WAY_MAX: Duration = Duration::from_secs(1);
/// So many times the last exchange is tried.
const LAST_TRIES: usize = 2;

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
    /// When the exchange began that goes on after a part of it.
    begun: Option<Instant>,
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

/// The end, once it has come.
struct Stop<'a, F> {
    future: Pin<&'a mut F>,
    told: Option<Instant>,
}

impl<F: Future<Output = ()>> Stop<'_, F> {
    /// Ends when it has come, and at once from then on.
    async fn told(&mut self) -> Instant {
        match self.told {
            Some(told) => told,
            None => {
                self.future.as_mut().await;
                *self.told.insert(Instant::now())
            }
        }
    }
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
            begun: None,
        }
    }

    /// Exchanges until `stop`, then writes the safe values once more and lets go of the peer.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let future = pin!(stop);
        let mut stop = Stop { future, told: None };
        loop {
            if !self.reach(&mut stop).await || !self.exchange_on(&mut stop).await {
                break;
            }
        }
        let deadline = stop.told().await + END_MAX;
        if has_begun(&self.port.latest()) {
            let _ = timeout_at(deadline, self.last(&mut stop)).await;
        }
        self.driver.disconnect();
    }

    /// Writes the safe values. A device in trouble is tried once more, since it may be well again,
    /// and so is one that does not take them: the second time on a connection that is new.
    async fn last(&mut self, stop: &mut Stop<'_, impl Future<Output = ()>>) {
        let image = self.port.latest();
        for _ in 0..LAST_TRIES {
            if !self.connected {
                match caught(self.driver.connect()).await.unwrap_or_else(|| Err(bug())) {
                    Ok(()) => self.connected = true,
                    Err(trouble) => return self.tell_trouble(&trouble),
                }
            }
            last_words(&self.outputs, &image, &mut self.values);
            match self.exchange(Occasion::Last, &image, stop).await {
                Ok(_) => return,
                Err(trouble) => self.fail(&trouble),
            }
        }
    }

    /// Connects, however often it takes; false where it is to stop instead.
    async fn reach(&mut self, stop: &mut Stop<'_, impl Future<Output = ()>>) -> bool {
        loop {
            let connected = tokio::select! {
                _ = stop.told() => return false,
                connected = caught(self.driver.connect()) => {
                    connected.unwrap_or_else(|| Err(bug()))
                }
            };
            match connected {
                Ok(()) => {
                    self.connected = true;
                    return true;
                }
                Err(trouble) => self.tell_trouble(&trouble),
            }
            tokio::select! {
                _ = stop.told() => return false,
                () = sleep(self.retry.next()) => {}
            }
        }
    }

    /// Exchanges until the connection is lost (true), or it is to stop.
    async fn exchange_on(&mut self, stop: &mut Stop<'_, impl Future<Output = ()>>) -> bool {
        let mut poll = interval(self.poll);
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut image = self.port.latest();
        let mut is_part = false;
        loop {
            let due = tokio::select! {
                biased;
                _ = stop.told() => Due::Stop,
                () = ready(()), if is_part => Due::Poll,
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
            let done = self.exchange(occasion, &image, stop).await;
            is_part = done == Ok(Done::Part);
            if let Err(trouble) = done {
                self.fail(&trouble);
                if !self.connected {
                    tokio::select! {
                        _ = stop.told() => return false,
                        () = sleep(self.retry.next()) => return true,
                    }
                }
            }
        }
    }

    fn has_changed(&mut self, image: &Arc<Snapshot>) -> bool {
        outgoing(&self.outputs, image, &mut self.values);
        self.values != self.offered
    }

    async fn exchange(
        &mut self,
        occasion: Occasion,
        image: &Arc<Snapshot>,
        stop: &mut Stop<'_, impl Future<Output = ()>>,
    ) -> Result<Done, Trouble> {
        let begun = *self.begun.get_or_insert_with(Instant::now);
        let done = self.call(occasion, image, stop).await;
        // Offered, if not taken: then the driver has it, for the next poll.
        if occasion != Occasion::First {
            self.offered.copy_from_slice(&self.values);
        }
        if done != Ok(Done::Part) {
            self.judge(occasion, begun, done.is_ok());
        }
        done
    }

    /// Has the driver exchange. It is not abandoned half-way for an end that comes, but told of it;
    /// then its time is short.
    async fn call(
        &mut self,
        occasion: Occasion,
        image: &Arc<Snapshot>,
        stop: &mut Stop<'_, impl Future<Output = ()>>,
    ) -> Result<Done, Trouble> {
        let Device { driver, port, outputs, values, inputs, .. } = self;
        let (ending, values) = (AtomicBool::new(false), &values[..]);
        let is_urgent =
            || ending.load(Ordering::Relaxed) || is_to_write(port, image, (outputs, values));
        let exchange = Exchange { occasion, outputs: values, inputs, is_urgent: &is_urgent };
        let mut call = pin!(caught(async {
            faults::point(Point::Device);
            driver.exchange(exchange).await
        }));
        let done = tokio::select! {
            biased;
            done = &mut call => Ok(done),
            told = stop.told() => {
                ending.store(true, Ordering::Relaxed);
                let limit = if occasion == Occasion::Last { END_MAX } else { UNDER_WAY_MAX };
                timeout_at(told + limit, call).await
            }
        };
        match done {
            Ok(done) => done.unwrap_or_else(|| Err(bug())),
            Err(_) => Err(Trouble::disconnected("an exchange was under way at the end for long")),
        }
    }

    /// An exchange is over.
    fn judge(&mut self, occasion: Occasion, begun: Instant, is_good: bool) {
        self.begun = None;
        if is_good && matches!(occasion, Occasion::Poll | Occasion::First) {
            self.retry.reset();
            self.line.deliver(&self.inputs, monotonic_ns());
            self.health.good(begun.elapsed());
        }
    }

    /// An exchange, or the last one, has failed.
    fn fail(&mut self, trouble: &Trouble) {
        self.tell_trouble(trouble);
        if trouble.is_disconnected {
            self.connected = false;
            self.driver.disconnect();
        }
    }

    fn tell_trouble(&mut self, trouble: &Trouble) {
        self.line.trouble();
        self.health.trouble(&trouble.reason);
    }
}

/// Whether other outputs are to be written than those that an exchange was given, of this image.
fn is_to_write(port: &Port, seen: &Arc<Snapshot>, (sources, given): (&[Source], &[i32])) -> bool {
    let image = port.latest();
    if sources.is_empty() || Arc::ptr_eq(&image, seen) || !has_begun(&image) {
        return false;
    }
    let mut values = vec![0; given.len()];
    outgoing(sources, &image, &mut values);
    values != given || !has_begun(seen)
}

/// A driver that panicked, whose connection is as it left it.
fn bug() -> Trouble {
    Trouble::disconnected("a bug in its driver, which the line before tells")
}
