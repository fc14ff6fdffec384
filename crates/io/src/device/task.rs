//! One device's task: it exchanges at every `poll` and as soon as an output changes, and connects
//! again after trouble.
//!
//! A panic of the driver does not end the task. It ends the connection, as other trouble does. The
//! log has a line when trouble begins and when it ends. Outputs come from the last published image,
//! which has the safe values in STOP and FAULT. When the process ends, the task writes the safe
//! values once more. It tries until the device has accepted them or the time for the end is over.
//! In the latter case it logs that the device's outputs may be unchanged.

use std::future::{Future, ready};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout, timeout_at};

use super::driver::{Driver, Exchange, ExchangeExtent, ExchangeFailure, ExchangeReason};
use super::health::{DeviceHealth, InputsRead};
use super::retry::Retry;
use crate::caught::caught;
use rungd_base::faults::{self, FaultPoint};
use rungd_runtime::exchange::{Mode, Port, Snapshot, StopReason};
use rungd_runtime::inputs::InputEnd;
use rungd_runtime::monotonic_ns;
use rungd_runtime::wiring::{OutputSource, is_other, last_words, outgoing};

/// The time limit for the safe values at the end; the process waits longer than this.
const END_MAX: Duration = Duration::from_secs(2);
/// The part of [`END_MAX`] for an exchange that is under way when the end comes.
const UNDER_WAY_MAX: Duration = Duration::from_secs(1);
/// The time limit of one attempt to connect at the end. A peer that is just starting loses the
/// first packet of an attempt, and the system repeats that packet late. A new attempt succeeds
/// sooner.
const LAST_CONNECT_MAX: Duration = Duration::from_millis(500);

/// A device: a driver, its channel to the scan, and the sources of its outputs.
pub struct DeviceTask<D> {
    driver: D,
    input_end: InputEnd,
    port: Port,
    outputs: Arc<[OutputSource]>,
    health: DeviceHealth,
    poll: Duration,
    retry: Retry,
    /// The inputs that the exchange under way has read so far.
    inputs: Vec<Option<i32>>,
    values: Vec<i32>,
    /// The outputs of the last call of the driver.
    offered: Vec<i32>,
    connected: bool,
    /// The start time of an exchange that is not complete yet.
    begun: Option<Instant>,
}

/// The parts of a device.
pub struct DeviceParts<D> {
    /// The driver.
    pub driver: D,
    /// Its channel to the scan.
    pub input_end: InputEnd,
    /// The port that supplies the images.
    pub port: Port,
    /// The number of inputs.
    pub inputs: usize,
    /// The sources of the outputs.
    pub outputs: Vec<OutputSource>,
    /// Its condition, which the task updates.
    pub health: DeviceHealth,
    /// The time between exchanges.
    pub poll: Duration,
}

/// Whether a scan is complete, or the process was started in STOP on purpose. Until then no output
/// is written: outputs stay as they were before this process.
fn has_begun(image: &Snapshot) -> bool {
    image.mode != Mode::Stop(StopReason::NotStarted)
}

/// The events that a device waits for.
enum DeviceEvent {
    Poll,
    Change,
    Stop,
}

/// The request to end, remembered once it has come.
struct StopRequest<'a, F> {
    future: Pin<&'a mut F>,
    told: Option<Instant>,
}

impl<F: Future<Output = ()>> StopRequest<'_, F> {
    /// Waits for the request, and returns its time. Once the request has come, returns at once.
    async fn requested(&mut self) -> Instant {
        match self.told {
            Some(told) => told,
            None => {
                self.future.as_mut().await;
                *self.told.insert(Instant::now())
            }
        }
    }
}

impl<D: Driver> DeviceTask<D> {
    /// A device that has not connected yet.
    pub fn new(parts: DeviceParts<D>) -> DeviceTask<D> {
        let DeviceParts { driver, input_end, port, inputs, outputs, health, poll } = parts;
        let count = outputs.len();
        DeviceTask {
            driver,
            input_end,
            port,
            outputs: outputs.into(),
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

    /// Exchanges until `stop`, then writes the safe values once more and disconnects.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let future = pin!(stop);
        let mut stop = StopRequest { future, told: None };
        loop {
            if !self.reach(&mut stop).await || !self.exchange_on(&mut stop).await {
                break;
            }
        }
        let deadline = stop.requested().await + END_MAX;
        if has_begun(&self.port.latest())
            && !self.outputs.is_empty()
            && timeout_at(deadline, self.last(&mut stop)).await.is_err()
        {
            self.health.tell_unsafe(END_MAX);
        }
        self.driver.disconnect();
    }

    /// Tries to write the safe values until they are written.
    async fn last(&mut self, stop: &mut StopRequest<'_, impl Future<Output = ()>>) {
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
        stop: &mut StopRequest<'_, impl Future<Output = ()>>,
    ) -> Result<(), ExchangeFailure> {
        if !self.connected {
            let connect = caught(self.driver.connect());
            match timeout(LAST_CONNECT_MAX, connect).await {
                Ok(connected) => connected.unwrap_or_else(|| Err(bug()))?,
                Err(_) => {
                    return Err(ExchangeFailure::disconnected(no_connection(LAST_CONNECT_MAX)));
                }
            }
            self.connected = true;
        }
        self.exchange(ExchangeReason::Last, image, stop).await.map(|_| ())
    }

    /// Tries to connect until it succeeds; false if `stop` comes first.
    async fn reach(&mut self, stop: &mut StopRequest<'_, impl Future<Output = ()>>) -> bool {
        loop {
            let connected = tokio::select! {
                _ = stop.requested() => return false,
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
                _ = stop.requested() => return false,
                () = sleep(self.retry.next()) => {}
            }
        }
    }

    /// Exchanges until the connection is lost (true) or `stop` comes (false).
    async fn exchange_on(&mut self, stop: &mut StopRequest<'_, impl Future<Output = ()>>) -> bool {
        let mut poll = interval(self.poll);
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut is_part = false;
        loop {
            let due = tokio::select! {
                biased;
                _ = stop.requested() => DeviceEvent::Stop,
                () = ready(()), if is_part => DeviceEvent::Poll,
                _ = poll.tick() => DeviceEvent::Poll,
                _ = self.other_outputs(), if !self.outputs.is_empty() => DeviceEvent::Change,
            };
            let image = self.port.latest();
            let occasion = match due {
                DeviceEvent::Stop => return false,
                // A newer image may have the outputs that the driver knows.
                DeviceEvent::Change if !is_to_offer(&self.outputs, &image, &self.offered) => {
                    continue;
                }
                DeviceEvent::Change => ExchangeReason::Change,
                DeviceEvent::Poll if has_begun(&image) => ExchangeReason::Poll,
                DeviceEvent::Poll => ExchangeReason::First,
            };
            outgoing(&self.outputs, &image, &mut self.values);
            let done = self.exchange(occasion, &image, stop).await;
            is_part = done == Ok(ExchangeExtent::Part);
            if let Err(trouble) = done {
                self.fail(&trouble);
                if !self.connected {
                    tokio::select! {
                        _ = stop.requested() => return false,
                        () = sleep(self.retry.next()) => return true,
                    }
                }
            }
        }
    }

    /// Ends with an image whose outputs the driver does not know yet.
    fn other_outputs(&self) -> impl Future<Output = Arc<Snapshot>> + use<D> {
        let (outputs, offered) = (Arc::clone(&self.outputs), self.offered.clone());
        self.port.shows(move |image| is_to_offer(&outputs, image, &offered))
    }

    async fn exchange(
        &mut self,
        occasion: ExchangeReason,
        image: &Arc<Snapshot>,
        stop: &mut StopRequest<'_, impl Future<Output = ()>>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        if self.begun.is_none() {
            self.inputs.fill(None);
        }
        let begun = *self.begun.get_or_insert_with(Instant::now);
        let done = self.call(occasion, image, stop).await;
        // Also if the exchange failed: the driver writes these outputs at the next poll.
        if occasion != ExchangeReason::First {
            self.offered.copy_from_slice(&self.values);
            if done == Ok(ExchangeExtent::Whole) {
                self.health.accepted(&self.values);
            }
        }
        if done != Ok(ExchangeExtent::Part) {
            self.judge(occasion, begun, done.is_ok());
        }
        done
    }

    /// Calls the driver's exchange. If the process is to end meanwhile, the exchange becomes urgent
    /// and has a short time left; it is not abandoned at once.
    async fn call(
        &mut self,
        occasion: ExchangeReason,
        image: &Arc<Snapshot>,
        stop: &mut StopRequest<'_, impl Future<Output = ()>>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        let DeviceTask { driver, port, outputs, values, inputs, .. } = self;
        let (ending, values) = (AtomicBool::new(false), &values[..]);
        let is_urgent =
            || ending.load(Ordering::Relaxed) || is_to_write(port, image, outputs, values);
        let exchange = Exchange { occasion, outputs: values, inputs, is_urgent: &is_urgent };
        let mut call = pin!(caught(async {
            faults::point(FaultPoint::Device);
            driver.exchange(exchange).await
        }));
        let done = tokio::select! {
            biased;
            done = &mut call => Ok(done),
            told = stop.requested() => {
                ending.store(true, Ordering::Relaxed);
                let limit = if occasion == ExchangeReason::Last { END_MAX } else { UNDER_WAY_MAX };
                timeout_at(told + limit, call).await
            }
        };
        match done {
            Ok(done) => done.unwrap_or_else(|| Err(bug())),
            Err(_) => {
                Err(ExchangeFailure::disconnected("the exchange under way did not end in time"))
            }
        }
    }

    /// Ends an exchange. If it was good, delivers its inputs.
    fn judge(&mut self, occasion: ExchangeReason, begun: Instant, is_good: bool) {
        self.begun = None;
        if is_good && matches!(occasion, ExchangeReason::Poll | ExchangeReason::First) {
            let now_ns = monotonic_ns();
            self.retry.reset();
            self.input_end.deliver(&self.inputs, now_ns);
            self.input_end.well(now_ns);
            self.health.good(begun.elapsed());
        }
    }

    /// Handles a failed exchange or attempt to connect. If the connection stays, the inputs that
    /// were read are valid and are delivered. If the connection is lost, they are dropped:
    /// otherwise, the inputs of a device that loses its connection again and again would switch
    /// between fresh and stale.
    fn fail(&mut self, trouble: &ExchangeFailure) {
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
        let inputs =
            InputsRead { read: self.inputs.iter().flatten().count(), all: self.inputs.len() };
        match (trouble.is_repeated, inputs.read) {
            (true, _) => self.health.trouble_repeated(&trouble.reason, inputs),
            (false, 0) => self.health.trouble(&trouble.reason),
            (false, _) => self.health.trouble_in_part(&trouble.reason, inputs),
        }
    }
}

/// Whether an image has other outputs than those that were offered to the driver.
fn is_to_offer(sources: &[OutputSource], image: &Snapshot, offered: &[i32]) -> bool {
    has_begun(image) && is_other(sources, image, offered)
}

/// Whether the latest outputs differ from `given`, the outputs that an exchange took from the image
/// `seen`.
fn is_to_write(port: &Port, seen: &Arc<Snapshot>, sources: &[OutputSource], given: &[i32]) -> bool {
    let image = port.latest();
    if sources.is_empty() || Arc::ptr_eq(&image, seen) || !has_begun(&image) {
        return false;
    }
    is_other(sources, &image, given) || !has_begun(seen)
}

fn no_connection(within: Duration) -> String {
    format!("no connection: none in {} ms", within.as_millis())
}

/// The trouble of a driver that panicked; its connection is in an unknown state.
fn bug() -> ExchangeFailure {
    ExchangeFailure::disconnected("a bug in its driver (see the line before)")
}
