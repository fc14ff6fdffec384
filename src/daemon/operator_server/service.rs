//! Carries out an operator's requests: read, write, force, run, stop, reload.
//!
//! Called by `answer`. Changes go through the port, like those of a driver, and are answered once a
//! complete scan (or a tick) has seen them; `write` makes the writes. Each change is a line in the
//! log: the user, the operand, the values before and after.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use tokio::time::timeout;

use super::known_hold::KnownHolds;
use super::logged_change::{LoggedOperandChange, PreviousState};
use super::memory;
use super::peer::{OperatorPeer, PeerRequest};
use super::refused::{denied, in_words, no_answer};
use super::status::{ProgramView, reason};
use crate::daemon::log;
use crate::daemon::reload::Reloads;
use rungd_base::locked::locked;
use rungd_client::operator::deadline;
use rungd_client::operator::names::OperandNames;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{
    self, BitOrNumber, ChangedOperand, GivenValue, LevelChange, ModeChange, OPERANDS_MAX,
    OperandValues, RefusalKind, RefusedOperand, RequestRefusal, RequestResult, ShownValue,
    WantedMode,
};
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_runtime::command::{CommandDenial, CommandId, ScanCommand, StateBefore};
use rungd_runtime::events::{self, Event, Level};
use rungd_runtime::exchange::{Mode, Port, Snapshot};
use rungd_runtime::say::say;
use rungd_runtime::{Generations, Origin};

/// The greatest number of forces that an answer names.
const FORCES_NAMED_MAX: usize = 8;
/// The note for an output that is forced outside RUN.
const STAYS_SAFE: &str = "only in RUN does the force reach the output: now it has its safe value";
/// The least time limit of a change's wait for the scan that sees it.
const WAIT_LEAST: Duration = Duration::from_secs(10);

/// Answers the requests. Cheap to clone.
#[derive(Clone)]
pub(in super::super) struct OperatorService {
    views: Generations<ProgramView>,
    pub(super) port: Port,
    pub(super) reloads: Arc<Reloads>,
    /// The forced addresses, each with the name by which it was forced. Elements of tags with a
    /// `type` are not in it: a reload may move them, and their forces with them.
    forced: Arc<Mutex<HashMap<Address, String>>>,
    /// The holds of bits by pages.
    pub(super) known_holds: KnownHolds,
}

impl OperatorService {
    pub fn new(
        views: Generations<ProgramView>,
        port: Port,
        reloads: Arc<Reloads>,
    ) -> OperatorService {
        let (forced, known_holds) = (Arc::default(), KnownHolds::default());
        OperatorService { views, port, reloads, forced, known_holds }
    }

    /// The time limit of a change's wait for the scan that sees it.
    pub(super) fn wait(&self) -> Duration {
        self.port.patience().max(WAIT_LEAST)
    }

    /// The latest image, and the names of its program.
    pub(super) fn seen(&self) -> (Arc<Snapshot>, Arc<ProgramView>) {
        self.views.latest(&self.port)
    }

    /// An operand of a request in the latest image: a reload may have replaced the program since
    /// then. `None` if the present program does not have the operand.
    pub(super) fn sight(&self, operand: &Variable) -> Option<OperandInImage> {
        self.sights([operand].into_iter()).pop().flatten()
    }

    /// As [`OperatorService::sight`], for several operands in the same image.
    pub(super) fn sights<'o>(
        &self,
        operands: impl Iterator<Item = &'o Variable>,
    ) -> Vec<Option<OperandInImage>> {
        let (latest, view) = self.seen();
        let outputs = view.sight(&latest);
        let sight = |operand| {
            let operand = view.names.again(operand)?;
            let now = outputs.shown(&operand);
            let (latest, view) = (Arc::clone(&latest), Arc::clone(&view));
            Some(OperandInImage { latest, view, operand, now })
        };
        operands.map(sight).collect()
    }

    /// The names of the running program.
    pub(super) fn names(&self) -> Arc<OperandNames> {
        Arc::clone(&self.seen().1.names)
    }

    pub(super) fn status(&self) -> protocol::ControllerStatus {
        let (latest, view) = self.seen();
        let sight = view.sight(&latest);
        let forces = self.forces(&latest, &view.names);
        let forces = forces.iter().map(|(operand, _)| sight.shown(operand)).collect();
        let outputs = view.names.held_otherwise(&latest, &|n| sight.is_unknown(n));
        let outputs = outputs.iter().map(|output| sight.shown(output)).collect();
        view.about.status(&latest, forces, outputs)
    }

    pub(super) fn present(&self) -> protocol::PresentOutputs {
        let (latest, view) = self.seen();
        view.sight(&latest).present()
    }

    /// The forced operands with their current names, each with the name by which it was forced.
    fn forces(&self, latest: &Snapshot, names: &OperandNames) -> Vec<(Variable, String)> {
        let known = self.forced();
        let forced = latest.forces.list().iter().filter_map(|cell| names.at(*cell));
        let name = |operand: &Variable| match known.get(&operand.what) {
            Some(name) if !names.is_placed(operand.what) => name.clone(),
            _ => operand.operand.clone(),
        };
        forced.map(|operand| (operand.clone(), name(&operand))).collect()
    }

    fn forced(&self) -> MutexGuard<'_, HashMap<Address, String>> {
        locked(&self.forced)
    }

    /// The values of operands. A refused operand refuses the request, or gets its own answer.
    pub(super) async fn read(
        &self,
        operands: &[String],
        each: bool,
    ) -> RequestResult<OperandValues> {
        let (latest, view) = self.seen();
        let (mut found, mut refused) = (Vec::new(), Vec::new());
        for (at, text) in operands.iter().enumerate() {
            let fits = |more: &Vec<Variable>| found.len() + more.len() <= OPERANDS_MAX;
            let more = view
                .names
                .find(text)
                .and_then(|more| if fits(&more) { Ok(more) } else { Err(too_many()) });
            match more {
                Ok(more) => found.extend(more),
                Err(_) if each && at >= OPERANDS_MAX => return Err(too_many()),
                Err(refusal) if each => {
                    refused.push(RefusedOperand { operand: text.clone(), refusal });
                    // A refusal may have compared many names: other clients are served first.
                    tokio::task::yield_now().await;
                }
                Err(refusal) => return Err(refusal),
            }
        }
        Ok(OperandValues { refused, ..view.sight(&latest).values(&found) })
    }

    /// Logs a command that the scan thread has carried out: `did`. Returns the operand after it.
    ///
    /// # Errors
    /// A reload has removed the operand since then.
    fn changed(
        &self,
        told: LoggedOperandChange<'_>,
        event: &Event,
        did: &str,
    ) -> RequestResult<OperandInImage> {
        let Some(sight) = self.sight(told.operand()) else {
            told.log_removed(event, did);
            return Err(denied(CommandDenial::Gone));
        };
        told.log(event, did, sight.shown().value);
        Ok(sight)
    }

    pub(super) async fn force(
        &self,
        asker: &PeerRequest,
        text: &str,
        given: &GivenValue,
    ) -> RequestResult<ChangedOperand> {
        let (latest, view) = self.seen();
        let operand = view.names.find_one(text)?;
        operand.may_force()?;
        let value = view.names.number(&operand, given)?;
        let force = ScanCommand::Force { cell: operand.cell, value };
        let id = self.hand_in(asker, latest.generation, force)?;
        // The name is stored first: the status may show the force before the answer arrives.
        if !view.names.is_placed(operand.what) {
            self.forced().insert(operand.what, operand.operand.clone());
        }
        let was = PreviousState::found(&operand, self.carried_out(id).await?);
        let forced = operand.held(value);
        let did = format!("forced {operand} to {}", operand.say_value(forced));
        let told = LoggedOperandChange::new(&asker.peer, &operand, was);
        let sight = self.changed(told, &events::OPERATOR_FORCE, &did)?;
        let is_output = matches!(operand.what, Address::Bit(Bit::Space(BitSpace::Y, _)));
        let stays_safe = is_output && sight.latest.mode != Mode::Run;
        Ok(ChangedOperand { note: stays_safe.then(|| STAYS_SAFE.to_owned()), ..sight.change(was) })
    }

    pub(super) async fn unforce(
        &self,
        asker: &PeerRequest,
        text: &str,
    ) -> RequestResult<ChangedOperand> {
        let (latest, view) = self.seen();
        let operand = view.names.find_one(text).map_err(|unknown| {
            let message = format!("{}; {}", unknown.message, self.forced_now(text.trim()));
            RequestRefusal { message, ..unknown }
        })?;
        let before = self
            .carried_out(self.hand_in(
                asker,
                latest.generation,
                ScanCommand::Release(operand.cell),
            )?)
            .await?;
        let was = PreviousState::found(&operand, before);
        if was.forced {
            self.forced().remove(&operand.what);
            let did = format!("ended the force of {operand}");
            let told = LoggedOperandChange::new(&asker.peer, &operand, was);
            let sight = self.changed(told, &events::OPERATOR_UNFORCE, &did)?;
            return Ok(sight.change(was));
        }
        let sight = self.sight(&operand).ok_or_else(|| denied(CommandDenial::Gone))?;
        let note = Some(format!("it was not forced; {}", self.forced_now(text.trim())));
        Ok(ChangedOperand { note, ..sight.change(was) })
    }

    /// The operands that can be unforced instead. Since the force, a reload may have changed the
    /// operand's name, or given the name to a different operand.
    fn forced_now(&self, text: &str) -> String {
        let (latest, view) = self.seen();
        let forces = self.forces(&latest, &view.names);
        if let Some((Variable { address, .. }, _)) = forces.iter().find(|(_, name)| name == text) {
            return format!(
                "{address} is forced; it was called `{text}` when it was forced: `rungd unforce \
                 {address}` ends the force"
            );
        }
        let named = forces.iter().take(FORCES_NAMED_MAX);
        let named = named.map(|(operand, _)| operand.seen(&latest).to_string()).collect::<Vec<_>>();
        match forces.len() {
            0 => "nothing is forced".to_owned(),
            count if count > FORCES_NAMED_MAX => format!(
                "{count} are forced, among them {}: `rungd status` shows all, `rungd unforce \
                 --all` ends all",
                named.join(", ")
            ),
            _ => format!("forced now: {} (`rungd unforce --all` ends all)", named.join(", ")),
        }
    }

    pub(super) async fn unforce_all(&self, asker: &PeerRequest) -> RequestResult<OperandValues> {
        let (before, view) = self.seen();
        let forces = self.forces(&before, &view.names);
        self.carried_out(self.hand_in(asker, before.generation, ScanCommand::ReleaseAll)?).await?;
        let (latest, view) = self.seen();
        let mut released = Vec::new();
        for (operand, _) in &forces {
            self.forced().remove(&operand.what);
            let told =
                LoggedOperandChange::new(&asker.peer, operand, PreviousState::of(operand, &before));
            let did = format!("ended the force of {operand}");
            match view.names.again(operand) {
                Some(now) => {
                    told.log(&events::OPERATOR_UNFORCE, &did, now.seen(&latest).value);
                    released.push(now);
                }
                None => told.log_removed(&events::OPERATOR_UNFORCE, &did),
            }
        }
        Ok(view.sight(&latest).values(&released))
    }

    pub(super) async fn mode(
        &self,
        asker: &PeerRequest,
        to: WantedMode,
    ) -> RequestResult<ModeChange> {
        let peer = &asker.peer;
        let latest = self.port.latest();
        let since_ns = latest.since_ns;
        let command = if to == WantedMode::Run { ScanCommand::Run } else { ScanCommand::Stop };
        let before = self.carried_out(self.hand_in(asker, latest.generation, command)?).await?.mode;
        let there = match to {
            WantedMode::Run => before == Mode::Run,
            WantedMode::Stop => matches!(before, Mode::Stop(_)),
        };
        if !there {
            // The scan thread has obeyed; the new mode shows with its first scan or passes.
            let entered = self.port.shows(move |latest| latest.since_ns != since_ns);
            timeout(self.wait(), entered).await.map_err(|_| no_answer())?;
            if to == WantedMode::Run {
                self.first_scan_stays().await;
            }
        }
        let after = self.port.latest().mode;
        let (was, is) = (in_words(before), in_words(after));
        if there {
            say!(
                OPERATOR_MODE at Debug,
                who = %peer,
                pid = peer.pid,
                "operator's mode command: the mode is {is} already"
            );
        } else {
            say!(
                OPERATOR_MODE,
                who = %peer.name,
                uid = peer.uid,
                pid = peer.pid,
                before = %before.name(),
                after = %after.name(),
                "{peer} asked for {}: the mode was {was}, and is {is}",
                to.name()
            );
        }
        let (before, after) = (before.name().to_owned(), after.name().to_owned());
        let reason = reason(self.port.latest().mode);
        Ok(ModeChange { before, after, reason, kept: None, not_kept: None })
    }

    /// A stop is answered once its last image is durable.
    pub(super) async fn durable(
        &self,
        change: ModeChange,
        to: WantedMode,
        no_wait: bool,
    ) -> ModeChange {
        if no_wait || to != WantedMode::Stop || !matches!(self.port.latest().mode, Mode::Stop(_)) {
            return change;
        }
        match memory::last_image(self.seen().1.about.retention()).await {
            Ok(kept) => ModeChange { kept, ..change },
            Err(why) => ModeChange { not_kept: Some(why), ..change },
        }
    }

    /// If the first scan requested a stop at once: waits for the mode after this stop.
    async fn first_scan_stays(&self) {
        let ends = |latest: &Snapshot| latest.mode == Mode::Run && latest.ending;
        let ended = self.port.shows(move |latest| !ends(latest));
        // With a long period the last scan may still be to come: then the answer says RUN.
        let _ = timeout(WAIT_LEAST, ended).await;
    }

    /// Hands in a command whose cells belong to the program of this generation.
    fn hand_in(
        &self,
        asker: &PeerRequest,
        generation: u32,
        command: ScanCommand,
    ) -> RequestResult<CommandId> {
        let until_ns = self.until_ns(asker);
        let id = self.port.command_until(until_ns, generation, command).map_err(denied)?;
        self.port.sign(Origin::Command(id), asker.peer.to_string());
        Ok(id)
    }

    /// The moment after which a change is not begun: at the client's deadline, and when the service
    /// itself stops waiting.
    pub(super) fn until_ns(&self, asker: &PeerRequest) -> u64 {
        asker.until_ns.min(deadline::now_ns().saturating_add(self.wait().as_nanos() as u64))
    }

    async fn carried_out(&self, id: CommandId) -> RequestResult<StateBefore> {
        let answered = timeout(self.wait(), self.port.answered(id)).await;
        answered.map_err(|_| no_answer())?.map_err(denied)
    }
}

/// An operand in the latest image, by the names of that image's program.
pub(super) struct OperandInImage {
    latest: Arc<Snapshot>,
    view: Arc<ProgramView>,
    operand: Variable,
    now: ShownValue,
}

impl OperandInImage {
    pub(super) fn shown(&self) -> ShownValue {
        self.now.clone()
    }

    pub(super) fn change(&self, was: PreviousState) -> ChangedOperand {
        let before_text = self.operand.value_text(was.value).map(str::to_owned);
        ChangedOperand {
            before: was.value,
            before_text,
            was_forced: was.forced,
            now: self.shown(),
            taken: false,
            note: None,
        }
    }

    /// Whether the ladder took the written ON as a command: a program that turns the bit OFF, and
    /// drives it by no coil, has turned it OFF.
    pub(super) fn is_taken(&self, written: BitOrNumber, before: &Snapshot) -> bool {
        written == BitOrNumber::Bit(true)
            && self.shown().value == BitOrNumber::Bit(false)
            && self.latest.generation == before.generation
            && self.view.names.may_take(self.operand.what)
    }

    /// A warning if the written value will be overwritten or already is: by a driver, the ladder or
    /// a reload. `before`: the image before the write.
    pub(super) fn note(&self, written: BitOrNumber, before: &Snapshot) -> Option<String> {
        let (name, now) = (&self.operand.operand, self.shown().value);
        if let Some(driver) = self.view.about.driver_of(self.operand.what) {
            return Some(format!(
                "{driver} moves `{name}` and will write it again: to hold it, `rungd force {name} \
                 {written}`"
            ));
        }
        if now == written {
            return None;
        }
        Some(if self.is_taken(written, before) {
            format!("taken: it became {written}, and the ladder has turned it {now} again")
        } else if self.latest.generation == before.generation {
            format!(
                "it became {written}, but the same scan overwrote it: `rungd why {name}` names \
                 the rung"
            )
        } else {
            format!("it became {written}; meanwhile the program was reloaded, and now it is {now}")
        })
    }
}

pub(super) fn log_level(peer: &OperatorPeer, level: Level) -> LevelChange {
    let before = log::level();
    if before != level {
        let [was, is] = [before, level].map(Level::name);
        // The level is info for a moment, so that this line is always written.
        log::set_level(Level::Info);
        say!(
            OPERATOR_LOG_LEVEL,
            who = %peer.name,
            uid = peer.uid,
            pid = peer.pid,
            before = %was,
            after = %is,
            "{peer} set the log's level to {is}, was {was}"
        );
        log::set_level(level);
    }
    LevelChange { before, after: level }
}

fn too_many() -> RequestRefusal {
    let message = format!("one request reads at most {OPERANDS_MAX} operands");
    RequestRefusal::new(RefusalKind::BadRequest, message)
}
