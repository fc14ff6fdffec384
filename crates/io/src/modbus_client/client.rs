//! The driver of a Modbus device: one exchange.
//!
//! An exchange first writes, then feeds the watchdog, then reads, so that the outputs reach the
//! peer as early as possible. It writes again if the watchdog may have run out. One link may reach
//! several units: a unit that refuses or is silent makes the exchange fail as a whole, but the
//! other units still exchange their outputs and inputs. Reads may take long: if outputs or the
//! watchdog cannot wait, the exchange ends in part, and the next exchange continues from there.
//!
//! If the connection ends during an exchange, the exchange continues over a new one in some cases,
//! which `talk` decides. All outputs are then written again, because a peer may drop its outputs
//! when a connection ends.

use std::time::Duration;

use tokio::time::Instant;

use super::link::PeerLink;
use super::outputs::{self, OutputRun};
use super::plan::{self, ReadGroup};
use super::request::{push_read, push_write_multiple, push_write_single};
use super::settings::{self, ModbusTable, Watchdog, WriteFunctions};
use super::talk::{ConnectionLoss, READING, RequestText, UnitTalk};
use super::unit::UnitState;
use crate::device::{Driver, Exchange, ExchangeExtent, ExchangeFailure, ExchangeReason};

/// A Modbus device.
pub struct ModbusClient<L> {
    talk: UnitTalk<L>,
    groups: Vec<ReadGroup>,
    /// The number of the group that is read next; 0 if the next exchange reads all inputs.
    next: usize,
    runs: Vec<OutputRun>,
    writes: WriteFunctions,
    write_every: Option<Duration>,
    /// The time at which all outputs are written even if none has changed.
    all_due: Option<Instant>,
    feeding: Option<WatchdogFeeding>,
    /// Whether a request has failed since the exchange began, in any of its parts.
    has_failed: bool,
}

/// A watchdog, the time of its next feeding, and the counter to write.
struct WatchdogFeeding {
    watchdog: Watchdog,
    due: Option<Instant>,
    counter: u16,
}

impl<L: PeerLink> ModbusClient<L> {
    /// A device that has not exchanged yet.
    pub fn new(settings: &settings::ClientSettings, link: L) -> ModbusClient<L> {
        let groups = plan::reads(&settings.inputs, settings.gap, &settings.habits);
        let runs = outputs::runs(&settings.outputs, &settings.habits);
        let watched = settings.watchdog.map(|watchdog| watchdog.unit);
        let units = groups.iter().map(|group| group.unit).chain(runs.iter().map(|run| run.unit));
        let units = units.chain(watched).collect();
        let every = Duration::from_millis(settings.write_every_ms.into());
        ModbusClient {
            talk: UnitTalk::new(link, units, Duration::from_millis(settings.timeout_ms.into())),
            groups,
            next: 0,
            runs,
            writes: settings.writes,
            write_every: (!every.is_zero()).then_some(every),
            all_due: None,
            feeding: settings.watchdog.map(|watchdog| WatchdogFeeding {
                watchdog,
                due: None,
                counter: 0,
            }),
            has_failed: false,
        }
    }

    /// The way to its peer.
    pub(super) fn link(&self) -> &L {
        &self.talk.link
    }

    /// The way to its peer, to be changed.
    pub(super) fn link_mut(&mut self) -> &mut L {
        &mut self.talk.link
    }

    /// Writes the changed outputs, or all; units without trouble come first.
    async fn write(
        &mut self,
        occasion: ExchangeReason,
        outputs: &[i32],
    ) -> Result<(), ConnectionLoss> {
        let now = self.talk.link.now();
        let is_due = occasion == ExchangeReason::Poll && self.all_due.is_some_and(|due| due <= now);
        let all = occasion == ExchangeReason::Last || is_due;
        let ModbusClient { talk, runs, writes, .. } = self;
        for troubled in [false, true] {
            for run in runs.iter_mut() {
                let unit = talk.unit(run.unit);
                if unit.was_troubled == troubled {
                    run.want(outputs);
                    write_run(talk, run, *writes, all).await?;
                }
            }
        }
        if all || self.all_due.is_none() {
            self.all_due = self.write_every.map(|every| now + every);
        }
        Ok(())
    }

    /// Feeds the watchdog if it is due and its unit has accepted its outputs. Returns true for the
    /// first feeding, and for a feeding that may have been too late, for example after this process
    /// stood still.
    async fn feed(&mut self) -> Result<bool, ConnectionLoss> {
        let Some(feeding) = &mut self.feeding else { return Ok(false) };
        let Watchdog { unit, register, every_ms } = feeding.watchdog;
        let now = self.talk.link.now();
        let is_due = feeding.due.is_none_or(|due| due <= now);
        if !is_due || self.talk.unit(unit).trouble.is_some() {
            return Ok(false);
        }
        let every = Duration::from_millis(every_ms.into());
        let is_late = feeding.due.is_none_or(|due| due + every < now);
        let counter = feeding.counter.wrapping_add(1);
        self.talk.request.clear();
        match self.writes {
            WriteFunctions::Multiple => {
                push_write_multiple(&mut self.talk.request, false, register, &[counter]);
            }
            WriteFunctions::Single | WriteFunctions::Fitting => {
                push_write_single(&mut self.talk.request, false, register, counter);
            }
        }
        let table = ModbusTable::HoldingRegisters;
        let (verb, first) = ("feeding the watchdog at", register);
        let what = RequestText { verb, unit, table, first, count: 1, is_joined: false };
        if self.talk.ask(&what).await?.is_some() {
            feeding.counter = counter;
            feeding.due = Some(now + every);
            return Ok(is_late);
        }
        Ok(false)
    }

    /// Writes all outputs once more after a watchdog may have run out. Its unit has then dropped
    /// its outputs, and some units accept no outputs until the watchdog is fed. The outputs were
    /// also written before the feeding, because other units return to the last outputs that they
    /// received.
    async fn write_again(&mut self, outputs: &[i32]) -> Result<(), ConnectionLoss> {
        let unit = self.feeding.as_ref().map(|feeding| feeding.watchdog.unit);
        self.runs.iter_mut().filter(|run| Some(run.unit) == unit).for_each(OutputRun::forget);
        self.write(ExchangeReason::Change, outputs).await
    }

    /// Continues reading at the group at which the previous exchange ended. Reads at least one
    /// group: otherwise, urgent writes in each exchange would prevent all reads.
    async fn read(
        &mut self,
        inputs: &mut [Option<i32>],
        is_urgent: &(dyn Fn() -> bool + Send + Sync),
    ) -> Result<ExchangeExtent, ConnectionLoss> {
        while let Some(group) = self.groups.get(self.next) {
            let (&ReadGroup { unit, table, first, count, .. }, is_joined) =
                (group, group.is_joined());
            self.talk.request.clear();
            push_read(&mut self.talk.request, table, first, count);
            let what = RequestText { verb: READING, unit, table, first, count, is_joined };
            match self.talk.ask(&what).await? {
                None => self.talk.unit(unit).leave_unread(),
                Some(data) => {
                    if !group.bring_in(data, inputs) {
                        let trouble = format!("{what}: a number is NaN or infinite");
                        self.talk.unit(unit).unread.get_or_insert(trouble);
                    }
                }
            }
            self.next += 1;
            if self.next < self.groups.len() && (is_urgent() || self.is_feeding_due()) {
                return Ok(ExchangeExtent::Part);
            }
        }
        self.next = 0;
        Ok(ExchangeExtent::Whole)
    }

    fn is_feeding_due(&self) -> bool {
        let due = self.feeding.as_ref().and_then(|feeding| feeding.due);
        due.is_some_and(|due| due <= self.talk.link.now())
    }

    /// Connects again; over the new connection, no output has been written yet.
    async fn connect_anew(&mut self) -> Result<(), ExchangeFailure> {
        self.talk.link.close();
        self.talk.link.connect().await?;
        self.forget();
        Ok(())
    }

    fn forget(&mut self) {
        self.runs.iter_mut().for_each(OutputRun::forget);
        self.all_due = None;
        if let Some(feeding) = &mut self.feeding {
            feeding.due = None;
        }
    }

    async fn try_exchange(
        &mut self,
        exchange: &mut Exchange<'_>,
    ) -> Result<ExchangeExtent, ConnectionLoss> {
        let Exchange { occasion, outputs, inputs, is_urgent } = exchange;
        if *occasion != ExchangeReason::First {
            self.write(*occasion, outputs).await?;
        }
        if *occasion == ExchangeReason::Poll && self.feed().await? {
            self.write_again(outputs).await?;
        }
        match occasion {
            ExchangeReason::First | ExchangeReason::Poll => self.read(inputs, *is_urgent).await,
            ExchangeReason::Change | ExchangeReason::Last => Ok(ExchangeExtent::Whole),
        }
    }

    /// The result of the exchange, from the trouble of all units.
    fn verdict(
        &mut self,
        done: ExchangeExtent,
        occasion: ExchangeReason,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        for run in &mut self.runs {
            // The unit may have been without power, and have lost its outputs.
            if self.talk.unit(run.unit).is_left {
                run.forget();
            }
        }
        self.has_failed |= self.talk.units.iter().any(UnitState::has_failed);
        if done == ExchangeExtent::Part {
            // The rest of the exchange follows at once, and reports the trouble of the whole
            // exchange.
            return Ok(done);
        }
        let is_repeated = !std::mem::take(&mut self.has_failed);
        let has_read = matches!(occasion, ExchangeReason::Poll | ExchangeReason::First);
        let unread = |unit: &UnitState| unit.unread.clone().filter(|_| has_read);
        let trouble = |unit: &UnitState| unit.trouble.clone().or_else(|| unread(unit));
        let mut troubles = self.talk.units.iter().filter_map(trouble);
        let Some(mut reason) = troubles.next() else { return Ok(done) };
        match troubles.count() {
            0 => {}
            1 => reason.push_str("; another unit is in trouble, too"),
            others => reason.push_str(&format!("; {others} other units are in trouble, too")),
        }
        Err(ExchangeFailure { reason, is_disconnected: self.talk.is_dead(), is_repeated })
    }
}

async fn write_run<L: PeerLink>(
    talk: &mut UnitTalk<L>,
    run: &mut OutputRun,
    writes: WriteFunctions,
    all: bool,
) -> Result<(), ConnectionLoss> {
    let Some(part) = run.due(all) else { return Ok(()) };
    let (first, count) = (run.first, run.count());
    let (unit, table, is_joined) = (run.unit, run.table, part.count() > 1);
    let what = RequestText { verb: "writing", unit, table, first, count, is_joined };
    for number in 0..run.requests(part, writes) {
        talk.request.clear();
        run.push_request(&mut talk.request, part, writes, number);
        let done = talk.ask(&what).await;
        if !matches!(done, Ok(Some(_))) {
            // The peer may or may not have received the write.
            run.forget();
            return done.map(|_| ());
        }
    }
    run.written(part);
    Ok(())
}

impl<L: PeerLink> Driver for ModbusClient<L> {
    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        self.talk.link.connect().await?;
        self.talk.units.iter_mut().for_each(UnitState::begin_anew);
        (self.next, self.has_failed) = (0, false);
        self.forget();
        Ok(())
    }

    async fn exchange(
        &mut self,
        mut exchange: Exchange<'_>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        let (occasion, now, is_anew) = (exchange.occasion, self.talk.link.now(), self.next == 0);
        self.talk.begin(|unit| unit.begin(occasion, now, is_anew));
        loop {
            match self.try_exchange(&mut exchange).await {
                Ok(done) => return self.verdict(done, occasion),
                Err(ConnectionLoss::Off(trouble)) => return Err(trouble),
                Err(ConnectionLoss::Anew(trouble)) => {
                    self.connect_anew().await.map_err(|_| trouble)?
                }
            }
        }
    }

    fn disconnect(&mut self) {
        self.talk.link.close();
    }
}
