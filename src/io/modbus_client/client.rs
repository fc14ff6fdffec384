//! The driver: what one exchange with a Modbus device is.
//!
//! Writes first, then the watchdog, then reads, so that a peer in trouble has its outputs as soon
//! as can be; and writes again where the watchdog may have run out. Several units may stand behind
//! one link: one that refuses or is silent does not keep the others from their outputs, though the
//! exchange as a whole has failed. A silent one is asked once more soon, then ever less often, and
//! has all its outputs when it is back. Reads may take long: where outputs or the watchdog cannot
//! wait, the exchange ends in part, and the next one goes on from there.

use std::fmt;
use std::time::Duration;

use tokio::time::Instant;

use super::answer::{self, Wrong};
use super::link::{Failure, Link};
use super::outputs::{self, Run};
use super::plan::{self, Group};
use super::request::{push_read, push_write_multiple, push_write_single};
use super::settings::{self, Table, Watchdog, Writes};
use crate::io::device::{Done, Driver, Exchange, Occasion, Retry, Trouble};

/// A Modbus device.
pub struct Client<L> {
    talk: Talk<L>,
    groups: Vec<Group>,
    /// Which of them is read next; at 0 all inputs are read anew.
    next: usize,
    runs: Vec<Run>,
    writes: Writes,
    write_every: Option<Duration>,
    /// When all outputs are due, though none changed.
    all_due: Option<Instant>,
    feeding: Option<Feeding>,
}

/// A watchdog, when it is to be fed next, and with what.
struct Feeding {
    watchdog: Watchdog,
    due: Option<Instant>,
    counter: u16,
}

/// The link, and what is known of the units behind it.
struct Talk<L> {
    link: L,
    units: Vec<Unit>,
    request: Vec<u8>,
    answer: Vec<u8>,
    /// So long is a silent unit left alone at least. Where answers do not say to which question,
    /// a late one must have come, and gone, before the next.
    pause: Duration,
}

struct Unit {
    number: u8,
    /// It was silent, or refused a write: the first such trouble of this exchange, or of the one
    /// before it.
    trouble: Option<String>,
    /// The first reason why inputs of it are missing, since the first group was read.
    unread: Option<String>,
    /// It was silent, or refused a write, in the exchange before this one.
    was_troubled: bool,
    /// Not asked any more in this exchange.
    is_left: bool,
    /// How many times running it was silent.
    absences: u32,
    retry: Retry,
    rests_until: Option<Instant>,
}

/// What is asked, for the log.
struct What {
    verb: &'static str,
    unit: u8,
    table: Table,
    first: u16,
    count: u16,
}

impl<L: Link> Client<L> {
    /// A device that has not exchanged yet.
    pub fn new(settings: &settings::Client, link: L) -> Client<L> {
        let groups = plan::reads(&settings.inputs, settings.gap);
        let runs = outputs::runs(&settings.outputs);
        let watched = settings.watchdog.map(|watchdog| watchdog.unit);
        let units = groups.iter().map(|group| group.unit).chain(runs.iter().map(|run| run.unit));
        let mut units: Vec<u8> = units.chain(watched).collect();
        units.sort_unstable();
        units.dedup();
        let units = units.into_iter().map(Unit::new).collect();
        let every = Duration::from_millis(settings.write_every_ms.into());
        let pause = match L::STARTS_ANEW {
            true => Duration::from_millis(settings.timeout_ms.into()),
            false => Duration::ZERO,
        };
        Client {
            talk: Talk { link, units, request: Vec::new(), answer: Vec::new(), pause },
            groups,
            next: 0,
            runs,
            writes: settings.writes,
            write_every: (!every.is_zero()).then_some(every),
            all_due: None,
            feeding: settings.watchdog.map(|watchdog| Feeding { watchdog, due: None, counter: 0 }),
        }
    }

    /// Writes what changed, or all; units that had no trouble come first.
    async fn write(&mut self, occasion: Occasion, outputs: &[i32]) -> Result<(), Trouble> {
        let now = Instant::now();
        let is_due = occasion == Occasion::Poll && self.all_due.is_some_and(|due| due <= now);
        let all = occasion == Occasion::Last || is_due;
        let Client { talk, runs, writes, .. } = self;
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

    /// Feeds the watchdog where it is due, and its unit took its outputs. True where that may
    /// have been too late for it, as after this process stood still; and the first time.
    async fn feed(&mut self) -> Result<bool, Trouble> {
        let Some(feeding) = &mut self.feeding else { return Ok(false) };
        let Watchdog { unit, register, every_ms } = feeding.watchdog;
        let now = Instant::now();
        let is_due = feeding.due.is_none_or(|due| due <= now);
        if !is_due || self.talk.unit(unit).trouble.is_some() {
            return Ok(false);
        }
        let every = Duration::from_millis(every_ms.into());
        let is_late = feeding.due.is_none_or(|due| due + every < now);
        let counter = feeding.counter.wrapping_add(1);
        self.talk.request.clear();
        match self.writes {
            Writes::Multiple => {
                push_write_multiple(&mut self.talk.request, false, register, &[counter]);
            }
            _ => push_write_single(&mut self.talk.request, false, register, counter),
        }
        let table = Table::HoldingRegisters;
        let what = What { verb: "feeding the watchdog at", unit, table, first: register, count: 1 };
        if self.talk.ask(&what).await?.is_some() {
            feeding.counter = counter;
            feeding.due = Some(now + every);
            return Ok(is_late);
        }
        Ok(false)
    }

    /// All outputs once more, behind a watchdog that may have run out: its unit has dropped them
    /// then, and some take none until they are fed. They were written before it was fed too, since
    /// others go back to what they were given last.
    async fn write_again(&mut self, outputs: &[i32]) -> Result<(), Trouble> {
        let unit = self.feeding.as_ref().map(|feeding| feeding.watchdog.unit);
        self.runs.iter_mut().filter(|run| Some(run.unit) == unit).for_each(Run::forget);
        self.write(Occasion::Change, outputs).await
    }

    /// Reads on from where the exchange before this one ended; at least a group, or groups whose
    /// order comes round every time would never be read.
    async fn read(
        &mut self,
        inputs: &mut [i32],
        is_urgent: &(dyn Fn() -> bool + Send + Sync),
    ) -> Result<Done, Trouble> {
        while let Some(group) = self.groups.get(self.next) {
            let Group { unit, table, first, count, .. } = *group;
            self.talk.request.clear();
            push_read(&mut self.talk.request, table, (first, count));
            let what = What { verb: READING, unit, table, first, count };
            match self.talk.ask(&what).await? {
                None => self.talk.unit(unit).leave_unread(),
                Some(data) => {
                    if !group.bring_in(data, inputs) {
                        let trouble = format!("{what}: an f32 is no number");
                        self.talk.unit(unit).unread.get_or_insert(trouble);
                    }
                }
            }
            self.next += 1;
            if self.next < self.groups.len() && (is_urgent() || self.is_feeding_due()) {
                return Ok(Done::Part);
            }
        }
        self.next = 0;
        Ok(Done::Whole)
    }

    fn is_feeding_due(&self) -> bool {
        let due = self.feeding.as_ref().and_then(|feeding| feeding.due);
        due.is_some_and(|due| due <= Instant::now())
    }

    /// What the exchange comes to: the first unit's trouble.
    fn verdict(&mut self, done: Done, occasion: Occasion) -> Result<Done, Trouble> {
        for run in &mut self.runs {
            // It may have been without power.
            if self.talk.unit(run.unit).is_left {
                run.forget();
            }
        }
        let has_read = matches!(occasion, Occasion::Poll | Occasion::First) && done == Done::Whole;
        let unread = |unit: &Unit| unit.unread.clone().filter(|_| has_read);
        let trouble = |unit: &Unit| unit.trouble.clone().or_else(|| unread(unit));
        match self.talk.units.iter().find_map(trouble) {
            Some(reason) => Err(Trouble::kept(reason)),
            None => Ok(done),
        }
    }
}

/// What a question is called that asks for inputs.
const READING: &str = "reading";

async fn write_run<L: Link>(
    talk: &mut Talk<L>,
    run: &mut Run,
    writes: Writes,
    all: bool,
) -> Result<(), Trouble> {
    let Some(part) = run.due(all) else { return Ok(()) };
    let (first, count) = (run.first, run.count());
    let what = What { verb: "writing", unit: run.unit, table: run.table, first, count };
    for number in 0..run.requests(part, writes) {
        talk.request.clear();
        run.push_request(&mut talk.request, part, writes, number);
        let done = talk.ask(&what).await;
        if !matches!(done, Ok(Some(_))) {
            // The peer may have it or not.
            run.forget();
            return done.map(|_| ());
        }
    }
    run.written(part);
    Ok(())
}

impl<L: Link> Driver for Client<L> {
    async fn connect(&mut self) -> Result<(), Trouble> {
        self.talk.link.connect().await?;
        self.runs.iter_mut().for_each(Run::forget);
        self.talk.units.iter_mut().for_each(Unit::begin_anew);
        (self.all_due, self.next) = (None, 0);
        if let Some(feeding) = &mut self.feeding {
            feeding.due = None;
        }
        Ok(())
    }

    async fn exchange(&mut self, exchange: Exchange<'_>) -> Result<Done, Trouble> {
        let Exchange { occasion, outputs, inputs, is_urgent } = exchange;
        let now = Instant::now();
        let is_anew = self.next == 0;
        self.talk.units.iter_mut().for_each(|unit| unit.begin(occasion, now, is_anew));
        if occasion != Occasion::First {
            self.write(occasion, outputs).await?;
        }
        if occasion == Occasion::Poll && self.feed().await? {
            self.write_again(outputs).await?;
        }
        let done = match occasion {
            Occasion::First | Occasion::Poll => self.read(inputs, is_urgent).await?,
            Occasion::Change | Occasion::Last => Done::Whole,
        };
        self.verdict(done, occasion)
    }

    fn disconnect(&mut self) {
        self.talk.link.close();
    }
}

impl<L: Link> Talk<L> {
    fn unit(&mut self, number: u8) -> &mut Unit {
        let at = self.units.binary_search_by_key(&number, |unit| unit.number);
        &mut self.units[at.expect("every unit of the plan is listed")]
    }

    /// Puts the request to its unit: the data of the answer, or nothing where the unit is in
    /// trouble, which it notes.
    ///
    /// # Errors
    /// The link is of no use any more.
    async fn ask(&mut self, what: &What) -> Result<Option<&[u8]>, Trouble> {
        if self.unit(what.unit).is_left {
            return Ok(None);
        }
        let Talk { link, request, answer, pause, .. } = self;
        let pause = *pause;
        match link.ask(what.unit, request, answer).await {
            Err(Failure::Broken(reason)) => {
                return Err(Trouble::disconnected(format!("{what}: {reason}")));
            }
            Err(Failure::Silent(reason)) => {
                self.unit(what.unit).miss(format!("{what}: {reason}"), pause);
                return Ok(None);
            }
            // Asked further: a read shows whether it is there.
            Err(Failure::Doubtful(reason)) => {
                self.unit(what.unit).trouble.get_or_insert(format!("{what}: {reason}"));
                return Ok(None);
            }
            Ok(()) => {}
        }
        match answer::check(&self.request, &self.answer).map(|data| data.len()) {
            Ok(length) => {
                self.unit(what.unit).found();
                let from = self.answer.len() - length;
                Ok(Some(&self.answer[from..]))
            }
            Err(wrong) if wrong.is_absence() => {
                self.unit(what.unit).miss(format!("{what}: {wrong}"), Duration::ZERO);
                Ok(None)
            }
            Err(wrong @ Wrong::Exception(_)) => {
                self.unit(what.unit).found();
                let unit = self.unit(what.unit);
                // One that refuses a read takes its outputs all the same.
                let noted = if what.verb == READING { &mut unit.unread } else { &mut unit.trouble };
                noted.get_or_insert(format!("{what}: {wrong}"));
                Ok(None)
            }
            // It may have been to an earlier question, and the right one on its way.
            Err(wrong) if L::STARTS_ANEW => {
                self.unit(what.unit).miss(format!("{what}: {wrong}"), pause);
                Ok(None)
            }
            Err(wrong) => Err(Trouble::disconnected(format!("{what}: {wrong}"))),
        }
    }
}

impl Unit {
    fn new(number: u8) -> Unit {
        Unit {
            number,
            trouble: None,
            unread: None,
            was_troubled: false,
            is_left: false,
            absences: 0,
            retry: Retry::new(),
            rests_until: None,
        }
    }

    fn begin_anew(&mut self) {
        *self = Unit::new(self.number);
    }

    /// Before an exchange: a unit in trouble is asked when inputs are due, not at every change.
    /// `is_anew`: inputs are read from the first on.
    fn begin(&mut self, occasion: Occasion, now: Instant, is_anew: bool) {
        self.was_troubled = self.trouble.is_some();
        self.is_left = match occasion {
            Occasion::Change => self.was_troubled,
            Occasion::First | Occasion::Poll => self.rests_until.is_some_and(|until| now < until),
            Occasion::Last => false,
        };
        if !self.is_left {
            self.trouble = None;
        }
        if is_anew {
            self.unread = None;
        }
    }

    /// Inputs of it were not read.
    fn leave_unread(&mut self) {
        if self.unread.is_none() {
            self.unread.clone_from(&self.trouble);
        }
    }

    /// It did not answer.
    fn miss(&mut self, trouble: String, pause: Duration) {
        self.trouble.get_or_insert(trouble);
        self.is_left = true;
        self.absences += 1;
        let wait = if self.absences > 1 { self.retry.next() } else { Duration::ZERO };
        self.rests_until = Some(Instant::now() + wait.max(pause));
    }

    /// It answered.
    fn found(&mut self) {
        if self.absences > 0 {
            self.absences = 0;
            self.retry.reset();
            self.rests_until = None;
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let What { verb, unit, table, first, count } = *self;
        write!(f, "{verb} {} {first}", table.name())?;
        if count > 1 {
            write!(f, "..{}", u32::from(first) + u32::from(count) - 1)?;
        }
        write!(f, " of unit {unit}")
    }
}
