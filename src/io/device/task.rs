//! One device's task: exchange on time, at once when an output changes, and after trouble again.
//!
//! It outlives everything its driver does: a panic costs the connection, as trouble does. Log
//! lines are edges: trouble begins, trouble ends. Outputs are what the last published image says:
//! in STOP and FAULT the safe values. When the process ends, the safe values are written once more:
//! a device that cannot be reached, or does not take them, is tried until they are written or the
//! time for the end is over, and then the log says that its outputs may be as they were.

use std::future::{Future, ready};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout, timeout_at};

use super::driver::{Done, Driver, Exchange, Occasion, Trouble};
use super::health::Health;
use super::retry::Retry;
use crate::faults::{self, Point};
use crate::io::caught::caught;
use crate::runtime::exchange::{Mode, Port, Snapshot, StopReason};
use crate::runtime::inputs::InputEnd;
use crate::runtime::monotonic_ns;
use crate::runtime::wiring::{Source, last_words, outgoing};

/// How long the end may take: less than the process waits for it.
const END_MAX: Duration = Duration::from_secs(2);
/// How much of that an exchange may take that is under way then.
const UNDER_WAY_MAX: Duration = Duration::from_secs(1);
/// How long one attempt to connect may take then. A peer that is starting loses the first packet of
/// an attempt, and the system repeats it late: a new attempt is heard sooner.
const LAST_CONNECT_MAX: Duration = Duration::from_millis(500);

/// A device: a driver, its line to the scan, and what goes out.
pub struct Device<D> {
    driver: D,
    input_end: InputEnd,
    port: Port,
    outputs: Vec<Source>,
    health: Health,
    poll: Duration,
    retry: Retry,
    /// As far as the exchange under way has read them.
    inputs: Vec<Option<i32>>,
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
    pub input_end: InputEnd,
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
        let Parts { driver, input_end, port, inputs, outputs, health, poll } = parts;
        let count = outputs.len();
        Device {
            driver,
            input_end,
            port,
            outputs,
            health,
            poll,
            retry: Retry::new(),
            inputs: vec![None; inputs],
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
        if has_begun(&self.port.latest())
            && !self.outputs.is_empty()
            && timeout_at(deadline, self.last(&mut stop)).await.is_err()
        {
            self.health.tell_unsafe(END_MAX);
        }
        self.driver.disconnect();
    }

    /// Tries to write the safe values until they are written.
    async fn last(&mut self, stop: &mut Stop<'_, impl Future<Output = ()>>) {
        let image = self.port.latest();
        let mut retry = Retry::at_the_end();
        last_words(&self.outputs, &image, &mut self.values);
        while let Err(trouble) = self.try_last(&image, stop).await {
            self.fail(&trouble);
            sleep(retry.next()).await;
        }
    }

    async fn try_last(
        &mut self,
        image: &Arc<Snapshot>,
        stop: &mut Stop<'_, impl Future<Output = ()>>,
    ) -> Result<(), Trouble> {
        if !self.connected {
            let connect = caught(self.driver.connect());
            match timeout(LAST_CONNECT_MAX, connect).await {
                Ok(connected) => connected.unwrap_or_else(|| Err(bug()))?,
                Err(_) => return Err(Trouble::disconnected(no_connection(LAST_CONNECT_MAX))),
            }
            self.connected = true;
        }
        self.exchange(Occasion::Last, image, stop).await.map(|_| ())
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
                Err(trouble) => self.fail(&trouble),
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
        if self.begun.is_none() {
            self.inputs.fill(None);
        }
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
            Err(_) => Err(Trouble::disconnected("the exchange under way did not end in time")),
        }
    }

    /// An exchange is over.
    fn judge(&mut self, occasion: Occasion, begun: Instant, is_good: bool) {
        self.begun = None;
        if is_good && matches!(occasion, Occasion::Poll | Occasion::First) {
            let now_ns = monotonic_ns();
            self.retry.reset();
            self.input_end.deliver(&self.inputs, now_ns);
            self.input_end.well(now_ns);
            self.health.good(begun.elapsed());
        }
    }

    /// An exchange, or an attempt to connect, has failed. What was read over a connection that
    /// stays is handed on: it is as good as ever. What was read over one that is lost is not: a
    /// device that is lost again and again would have inputs that come and go.
    fn fail(&mut self, trouble: &Trouble) {
        self.input_end.trouble();
        if trouble.is_disconnected {
            self.health.trouble(&trouble.reason);
            if std::mem::take(&mut self.connected) {
                self.driver.disconnect();
            }
            return;
        }
        self.retry.reset();
        self.input_end.deliver(&self.inputs, monotonic_ns());
        match self.inputs.iter().flatten().count() {
            0 => self.health.trouble(&trouble.reason),
            read => self.health.trouble_in_part(&trouble.reason, (read, self.inputs.len())),
        }
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

fn no_connection(within: Duration) -> String {
    format!("no connection: none in {} ms", within.as_millis())
}

/// A driver that panicked, whose connection is as it left it.
fn bug() -> Trouble {
    Trouble::disconnected("a bug in its driver, which the line before tells")
}
