//! Executes commands on the scan thread: those of an operator, and the swap of a program. They are
//! executed between two scans, at a tick, or during a long wait.
//!
//! Called by `scan_loop`, which sends the answers after the effects are published. Like the whole
//! scan thread it allocates, locks and logs nothing.

use super::command::{CommandDenial, CommandOutcome, ScanCommand, StateBefore, WaitingCommand};
use super::exchange::{FaultReason, Mode, StopReason, Tempo};
use super::machine::ScannedMachine;
use super::origin::Origin;
use super::pacing::Clock;
use super::record::RecordEvent;
use super::scanner::{Scanner, TICK_NS_MAX};
use super::swap::{NO_PROGRAM, Package, Swapped};
use rungd_engine::Cell;

impl<M: ScannedMachine, C: Clock> Scanner<M, C> {
    /// Executes the waiting commands in order. A command behind a stop waits until STOP is reached.
    pub(super) fn obey(&mut self, now_ns: u64) {
        while let Some(WaitingCommand { id, generation, command, until_ns }) =
            self.side.orders.next()
        {
            self.machine.comes_from(Origin::Command(id));
            let late = (until_ns < self.clock.boottime_ns()).then_some(CommandDenial::Late);
            let denial = late.or_else(|| self.denies(command));
            let answer = match (denial, self.now(generation, command)) {
                (Some(denial), _) => CommandOutcome::Denied(denial),
                (None, Some(command)) => self.carry_out(command, now_ns),
                (None, None) => CommandOutcome::Denied(CommandDenial::Gone),
            };
            self.side.orders.note(id, answer);
            if command == ScanCommand::Stop && late.is_none() {
                return;
            }
        }
    }

    /// Converts a command from its generation to the present program; `None` if its cell is gone.
    fn now(&self, generation: u32, command: ScanCommand) -> Option<ScanCommand> {
        Some(match command {
            ScanCommand::Force { cell, value } => {
                ScanCommand::Force { cell: self.side.cell(generation, cell)?, value }
            }
            ScanCommand::Release(cell) => ScanCommand::Release(self.side.cell(generation, cell)?),
            ScanCommand::Run
            | ScanCommand::Stop
            | ScanCommand::ReleaseAll
            | ScanCommand::Swap { .. } => command,
        })
    }

    fn denies(&self, command: ScanCommand) -> Option<CommandDenial> {
        match (command, self.mode) {
            (ScanCommand::Swap { resume: true, .. }, _) if self.beat.stop_requested() => {
                Some(CommandDenial::Ending)
            }
            // Not a program: it makes abandoned packages return to the world.
            (ScanCommand::Swap { generation: NO_PROGRAM, .. }, _) => None,
            // After a panic the engine is not called again, and no program continues with memory
            // that the panic left inconsistent.
            (_, Mode::Fault(FaultReason::EnginePanic)) => Some(CommandDenial::EngineBroken),
            (ScanCommand::Stop, Mode::Fault(_)) => Some(CommandDenial::Faulted),
            (ScanCommand::Run, _) if self.beat.stop_requested() => Some(CommandDenial::Ending),
            _ => None,
        }
    }

    fn carry_out(&mut self, command: ScanCommand, now_ns: u64) -> CommandOutcome {
        let mut before = StateBefore { mode: self.mode, value: 0, forced: false };
        match command {
            ScanCommand::Run => self.obey_run(now_ns),
            ScanCommand::Stop => self.obey_stop(),
            ScanCommand::Swap { generation, resume } => {
                let Some(package) = self.swaps.take(generation) else {
                    return CommandOutcome::Denied(CommandDenial::NoProgram);
                };
                self.swap(package, resume, now_ns);
            }
            ScanCommand::Force { cell, value } => {
                before = self.before(cell);
                if !self.forces.add(cell) {
                    return CommandOutcome::Denied(CommandDenial::TooManyForces);
                }
                self.machine.force(cell, value);
                self.show(now_ns);
            }
            ScanCommand::Release(cell) => {
                before = self.before(cell);
                self.forces.remove(cell);
                self.machine.release(cell);
                self.show(now_ns);
            }
            ScanCommand::ReleaseAll => {
                while let Some(cell) = self.forces.list().last().copied() {
                    self.forces.remove(cell);
                    self.machine.release(cell);
                }
                self.show(now_ns);
            }
        }
        CommandOutcome::Done(before)
    }

    /// Continues with the new program; the package takes the old one away.
    fn swap(&mut self, mut package: Box<Package<M>>, resume: bool, now_ns: u64) {
        let begin_ns = self.clock.now_ns();
        // A fault of the last scan before STOP: somebody wanted STOP, so nothing is scanned again.
        let wants_run = resume && self.stopping.is_none();
        let faulted = matches!(self.mode, Mode::Fault(_)) && wants_run;
        if self.mode == Mode::Run && self.scans == 0 {
            // The blocks that started are not reported yet, and have the old program's numbers.
            self.tell_events(now_ns);
        }
        let running = self.mode == Mode::Run || faulted;
        package.note(&self.machine);
        std::mem::swap(&mut self.machine, &mut package.machine);
        let Package { machine: old, transfer, watches, carried, fresh, safe, generation, .. } =
            &mut *package;
        self.machine.adopt(old, transfer, running, self.forces.list());
        self.forces.renumber(|cell| transfer.cell(cell));
        watches.carry(&self.watches, carried, self.machine.image().words, now_ns);
        std::mem::swap(&mut self.watches, watches);
        std::mem::swap(&mut self.side.fresh, fresh);
        self.field.exchange_safe(safe, !running);
        let generation = *generation;
        self.side.adopt(generation, &mut transfer.renumbered);
        self.set_tempo(package.tempo);
        let swap_ns = self.clock.now_ns().saturating_sub(begin_ns);
        package.swapped = Some(Swapped { took_ns: swap_ns, mode: self.mode });
        self.machine.swapped(generation);
        self.journal.push(self.scans, now_ns, RecordEvent::Swapped { generation, swap_ns });
        self.swaps.give_back(package);
        if faulted {
            self.enter_run(now_ns);
        }
        match self.mode {
            Mode::Run => {
                let (side, facts, image) = self.shown(now_ns);
                side.publish_beginning(facts, image);
            }
            Mode::Stop(_) | Mode::Fault(_) => self.unpublished = true,
        }
    }

    /// Sets the tempo. Deadlines stay absolute: the next deadline stays, the new period follows it.
    fn set_tempo(&mut self, tempo: Tempo) {
        self.pace.tempo = tempo;
        self.side.set_tempo(tempo);
        let scans = self.mode == Mode::Run;
        self.grid.change(if scans { tempo.period_ns } else { tempo.period_ns.min(TICK_NS_MAX) });
    }

    /// Begins RUN. At a fault no pass ran, so first all that executed is terminated: no timer
    /// counts the time in FAULT, and no block runs without being started.
    fn obey_run(&mut self, now_ns: u64) {
        if self.mode == Mode::Run {
            return;
        }
        if let Mode::Fault(_) = self.mode
            && let Err(fault) = self.terminate(now_ns)
        {
            return self.fail(fault, now_ns);
        }
        self.run();
    }

    fn obey_stop(&mut self) {
        if self.mode == Mode::Run && self.stopping.is_none() {
            self.stopping = Some(StopReason::Operator);
            self.machine.request_stop();
        }
    }

    /// The state before a command for a bit or word.
    fn before(&self, cell: Cell) -> StateBefore {
        let value = self.machine.image().value(cell);
        StateBefore { mode: self.mode, value, forced: self.forces.has(cell) }
    }

    /// Sends the answers, unless the image with their effects is still to be published.
    pub(super) fn give(&mut self) {
        if !self.unpublished {
            self.side.orders.give();
        }
    }

    /// Makes this scan or the next tick publish an image.
    fn show(&mut self, now_ns: u64) {
        self.unpublished = true;
        if let Mode::Stop(_) = self.mode {
            self.tell_changes(now_ns);
        }
    }
}
