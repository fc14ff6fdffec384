//! Coverage: the parts of a ladder that a run has executed both ways.
//!
//! Executes the calls of a tape on an engine of the whole program and observes them rung by rung:
//! the power of each leg ON and OFF, each contact ON and OFF, each Stage entered and left, each
//! alarm raised and gone. Stages and alarms are followed from step to step, because a scan can
//! enter a Stage and leave it. Called by `testing`, with the tape of scenarios.

use super::answer::{Place, RungName};
use super::glimpse::BitWriters;
use super::leaves::{legs, own_contacts, states};
use super::logic::{Leaves, Logic};
use super::subject::Subject;
use super::walk::{WalkedProgram, Witness, walk};
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace, StageId};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, Image, ScanStep, Slice};
use rungd_language::resolve::program::Contact;

/// The states seen of something that can be OFF and ON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SeenStates {
    /// It was OFF; a Stage or an alarm: OFF after it was ON.
    pub off: bool,
    /// It was ON.
    pub on: bool,
}

/// The states seen of a ladder.
#[derive(Clone, Debug)]
pub struct LadderCoverage {
    /// The rungs and their branches, in file order.
    pub parts: Vec<PartCoverage>,
    /// Each Stage with its Program's name: entered (ON) and left (OFF).
    pub stages: Vec<(String, SeenStates)>,
    /// Each tag with an alarm: raised (ON) and gone (OFF).
    pub alarms: Vec<(String, SeenStates)>,
}

/// The states seen of a rung's legs, or of a branch.
#[derive(Clone, Debug)]
pub struct PartCoverage {
    /// The rung.
    pub rung: RungName,
    /// The place of its first contact or instruction.
    pub place: Place,
    /// Each leg by its key, with its power.
    pub legs: Vec<(&'static str, SeenStates)>,
    /// Its contacts, from left to right.
    pub contacts: Vec<ContactCoverage>,
}

/// The states seen of a contact.
#[derive(Clone, Debug)]
pub struct ContactCoverage {
    /// Its place and text.
    pub place: Place,
    /// Its states.
    pub seen: SeenStates,
}

/// A part of a rung that is observed.
struct WatchedPart {
    /// The rung's own part, if it is a branch.
    outer: Option<usize>,
    legs: Vec<(&'static str, Logic, SeenStates)>,
    contacts: Vec<SeenStates>,
    /// The states of its contacts at their last evaluation.
    now: Vec<bool>,
}

/// A ladder that is executed and observed.
pub struct CoverageRun {
    subject: Subject,
    slice: Slice,
    engine: Engine,
    parts: Vec<WatchedPart>,
    /// The bits of the Stages, then those of the alarms.
    followed: Vec<(Cell, SeenStates)>,
    writers: BitWriters,
}

impl SeenStates {
    /// Notes a state.
    fn see(&mut self, on: bool) {
        match on {
            true => self.on = true,
            false => self.off = true,
        }
    }

    /// Notes a state of a Stage or an alarm. OFF counts only after ON.
    fn follow(&mut self, on: bool) {
        if on || self.on {
            self.see(on);
        }
    }

    /// Whether both were seen.
    pub fn is_whole(self) -> bool {
        self.on && self.off
    }
}

impl CoverageRun {
    /// A run that has seen nothing yet.
    pub fn new(subject: Subject) -> CoverageRun {
        let slice = subject.seen.whole();
        let engine = Engine::new(slice.program.clone());
        let count = subject.sites.parts.len() as u32;
        let parts = (0..count).map(|part| watched(&subject, part)).collect();
        let layout = &subject.symbols.layout;
        let stages = 0..subject.symbols.names.stages.len() as u32;
        let stages = stages.map(|at| Cell::Bit(layout.bit(Bit::Stage(StageId(at)))));
        let bits: Vec<Cell> =
            stages.chain(subject.symbols.alarms.iter().map(|alarm| alarm.bit)).collect();
        CoverageRun {
            writers: BitWriters::new(&subject, &bits),
            followed: bits.into_iter().map(|bit| (bit, SeenStates::default())).collect(),
            parts,
            engine,
            slice,
            subject,
        }
    }

    /// Continues from a state; a state of a different program is ignored.
    pub fn resume(&mut self, state: &EngineState) {
        self.engine.resume(state);
    }

    /// Makes a call.
    pub fn call(&mut self, call: EngineCall) {
        let CoverageRun { subject, slice, engine, parts, followed, writers } = self;
        let mut spotter = ContactCollector { subject, parts, followed, writers };
        walk(WalkedProgram { subject, slice }, engine, call, &mut spotter);
        if matches!(call, EngineCall::Execute | EngineCall::Terminate) {
            for (cell, seen) in followed {
                seen.follow(engine.image().value(*cell) != 0);
            }
        }
    }

    /// The states seen so far.
    pub fn coverage(&self) -> LadderCoverage {
        let symbols = &self.subject.symbols;
        let parts = (0..).zip(&self.parts).filter_map(|(at, part)| self.part(at, part));
        let (stages, alarms) = self.followed.split_at(symbols.names.stages.len());
        let stages = symbols.names.stages.iter().zip(stages);
        let alarms = symbols.alarms.iter().zip(alarms);
        LadderCoverage {
            parts: parts.collect(),
            stages: stages.map(|(stage, (_, seen))| (stage.whole.clone(), *seen)).collect(),
            alarms: alarms.map(|(alarm, (_, seen))| (alarm.tag.clone(), *seen)).collect(),
        }
    }

    /// The coverage of a part; `None` for a branch without contacts, which has the power of its
    /// rung.
    fn part(&self, at: u32, watched: &WatchedPart) -> Option<PartCoverage> {
        let subject = &self.subject;
        let mut leaves = Leaves::default();
        own_contacts(subject, at).into_iter().for_each(|contact| drop(leaves.add(contact)));
        let contacts = leaves.contacts.iter().zip(&watched.contacts);
        let contacts = contacts.filter(|(contact, _)| !is_constant(contact));
        let contact = |(contact, seen): (&&Contact, &SeenStates)| ContactCoverage {
            place: subject.place(contact.span()),
            seen: *seen,
        };
        let rung = subject.place_of_rung(at);
        let place = subject.place(subject.rung(at).extent);
        let legs: Vec<_> = watched.legs.iter().map(|(name, _, seen)| (*name, *seen)).collect();
        let is_seen = rung.branch.is_none() || !watched.contacts.is_empty();
        is_seen.then(|| PartCoverage {
            rung,
            place,
            legs,
            contacts: contacts.map(contact).collect(),
        })
    }
}

/// Whether a contact is `$On` or `$Off`, or consists of these only.
fn is_constant(contact: &Contact) -> bool {
    match contact {
        Contact::Bit(Bit::Space(BitSpace::St, n), _) => [st::ON, st::OFF].contains(n),
        Contact::Not(inner, _) | Contact::Edge(_, inner, _) => is_constant(inner),
        Contact::All(items, _) | Contact::Any(items, _) => items.iter().all(is_constant),
        Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) | Contact::Computed(..) => {
            false
        }
    }
}

fn watched(subject: &Subject, part: u32) -> WatchedPart {
    let outer = subject.outer(part).map(|outer| outer as usize);
    let leaves = &subject.part(part).leaves;
    let count = (leaves.end - leaves.start) as usize;
    // A leg that consists of constants always has the same power.
    let legs = legs(subject, part).0.into_iter();
    let legs = legs.filter(|leg| !leg.series.iter().all(|contact| is_constant(contact)));
    WatchedPart {
        outer,
        legs: legs.map(|leg| (leg.name.key(), leg.logic, SeenStates::default())).collect(),
        contacts: vec![SeenStates::default(); count],
        now: vec![false; count],
    }
}

/// Collects the states of the contacts of each part, and of the followed bits.
struct ContactCollector<'a> {
    subject: &'a Subject,
    parts: &'a mut [WatchedPart],
    followed: &'a mut [(Cell, SeenStates)],
    writers: &'a BitWriters,
}

impl Witness for ContactCollector<'_> {
    fn part(&mut self, part: u32, _: u32, image: &Image) {
        let at = part as usize;
        let now = states(self.subject, part, image);
        let outer = self.parts[at].outer.map(|outer| self.parts[outer].now.clone());
        let all: Vec<bool> =
            outer.unwrap_or_default().into_iter().chain(now.iter().copied()).collect();
        let watched = &mut self.parts[at];
        for (seen, on) in watched.contacts.iter_mut().zip(&now) {
            seen.see(*on);
        }
        for (_, logic, seen) in &mut watched.legs {
            seen.see(logic.is_on(&|leaf| all.get(leaf).copied().unwrap_or(false)));
        }
        watched.now = now;
    }

    fn before(&mut self, deed: ScanStep, _: u32, image: &Image) {
        self.follow(self.writers.before(deed), image);
    }

    fn after(&mut self, deed: ScanStep, _: u32, image: &Image) {
        self.follow(self.writers.after(deed), image);
    }
}

impl ContactCollector<'_> {
    fn follow(&mut self, places: &[usize], image: &Image) {
        for at in places {
            let (cell, seen) = &mut self.followed[*at];
            seen.follow(image.value(*cell) != 0);
        }
    }
}
