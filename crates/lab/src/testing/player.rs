//! Plays a scenario on a rig: step by step, scan by scan.
//!
//! `runner` calls it for the verdict; `failure` plays a failed scenario again with a tape and a
//! [`Spectator`] that notes the changes. No text is made here, and no file is read or written.

use super::condition::Condition;
use super::judge::{Judge, JudgedRig};
use super::lowered_suite::LoweredSuite;
use super::operand_access::start;
use super::suite::{ProgramId, Reload, Scenario, TestOperand, TestStep, TestTime};
use crate::rig::{Rig, RigMode, RigSetup};
use rungd_runtime::exchange::Ticket;

const MS_NS: u64 = 1_000_000;

/// The result of a played scenario.
#[derive(Clone, Debug)]
pub(super) struct PlayedScenario {
    /// The number of scans in all processes.
    pub scans: u64,
    /// The virtual time that passed, ns.
    pub virtual_ns: u64,
    /// The failure; `None`: it passed.
    pub failed: Option<FailedStep>,
}

/// A failure as data.
#[derive(Clone, Debug)]
pub(super) struct FailedStep {
    /// The index of the step in the scenario.
    pub step: usize,
    pub why: FailedWhy,
    /// The program that was running.
    pub program: ProgramId,
    /// The number of the last scan of the process, from 1; 0: none.
    pub scan: u64,
    /// The time of that scan, ns since the start of the scenario.
    pub now_ns: u64,
    /// The number of scans in all processes.
    pub scans: u64,
    /// The field devices whose last exchange failed, with the reasons.
    pub troubles: Vec<String>,
}

/// Why a step failed.
#[derive(Clone, Debug)]
pub(super) enum FailedWhy {
    /// The condition of `expect` is false.
    Unmet,
    /// `within`: the condition was false in this number of scans.
    Never(u64),
    /// `hold`: the condition was false at the end of a scan; its number in the step, from 1.
    NotHeld(u64),
    /// A line of `always` was false; its index.
    Always(usize),
    /// The step needs this mode, but the controller is in the other one.
    Mode(RigMode),
    /// `pulse` of a bit that is already ON.
    AlreadyOn(TestOperand),
    /// `unforce` without a force.
    NotForced(TestOperand),
    /// The files of `reload` are refused; the text of the findings.
    Refused(String),
    /// The result is no longer wanted.
    GivenUp,
}

/// Observes memory at the end of every scan, before the passes of a last scan.
pub(super) trait Spectator {
    /// A scan has been executed.
    fn scanned(&mut self, rig: &Rig, judge: &Judge, scans: u64);

    /// The scenario begins: before the first scan.
    fn takes_place(&mut self, _rig: &mut Rig) {}

    /// A new process or a new program begins.
    fn begins(&mut self, _rig: &Rig) {}
}

/// A spectator that notes nothing.
pub(super) struct NoSpectator;

impl Spectator for NoSpectator {
    fn scanned(&mut self, _: &Rig, _: &Judge, _: u64) {}
}

/// A scenario that is being played.
struct Player<'a, 's, S> {
    stage: LoweredSuite<'a>,
    scenario: &'a Scenario,
    rig: Rig,
    program: ProgramId,
    judge: Judge<'a>,
    /// The steps whose conditions have edges.
    edged: Vec<EdgedStep>,
    beats: Vec<PulseTiming<'a>>,
    step: usize,
    scans: u64,
    /// The number of scans since the last start.
    since_start: u64,
    spectator: &'s mut S,
}

/// The values inside the edges of a step's condition, at the end of the last scan and of the scan
/// before.
struct EdgedStep {
    step: usize,
    before: Vec<bool>,
    now: Vec<bool>,
}

/// A pulse, as a step or in the background.
struct PulseTiming<'a> {
    operand: &'a TestOperand,
    on: u64,
    every: u64,
    /// The number of scans since its start.
    passed: u64,
    ticket: Ticket,
}

/// Plays a scenario until it fails or ends.
pub(super) fn play<'a, S: Spectator>(
    stage: LoweredSuite<'a>,
    scenario: &'a Scenario,
    is_taped: bool,
    spectator: &mut S,
) -> (PlayedScenario, JudgedRig<'a>) {
    let setup = setup(scenario, is_taped);
    let rig = Rig::new(&stage.programs[0], &setup);
    let judge = Judge::new(stage.suite, &rig);
    let mut player = Player {
        stage,
        scenario,
        rig,
        program: ProgramId(0),
        judge,
        edged: Vec::new(),
        beats: Vec::new(),
        step: 0,
        scans: 0,
        since_start: 0,
        spectator,
    };
    player.look_at_program(0);
    player.spectator.takes_place(&mut player.rig);
    let failed = player.steps();
    let (scans, virtual_ns) = (player.scans, player.rig.next_ns());
    let Player { rig, judge, .. } = player;
    (PlayedScenario { scans, virtual_ns, failed }, JudgedRig { rig, judge })
}

fn setup(scenario: &Scenario, is_taped: bool) -> RigSetup {
    let keeps_images = scenario
        .steps
        .iter()
        .any(|step| matches!(step.value, TestStep::Restart { .. } | TestStep::PowerCut(_)));
    start(&scenario.set, RigSetup { keeps_images, is_taped, ..RigSetup::default() })
}

/// The condition of a step.
pub(super) fn condition(step: &TestStep) -> Option<&Condition> {
    match step {
        TestStep::Expect(condition)
        | TestStep::Within(_, condition)
        | TestStep::Hold(_, condition) => Some(condition),
        TestStep::Set(..)
        | TestStep::Force(..)
        | TestStep::Unforce(_)
        | TestStep::Pulse { .. }
        | TestStep::Beat { .. }
        | TestStep::Run(_)
        | TestStep::Late(_)
        | TestStep::Stop
        | TestStep::Start
        | TestStep::Restart { .. }
        | TestStep::PowerCut(_)
        | TestStep::Reload(_)
        | TestStep::Lose(_)
        | TestStep::Restore(_)
        | TestStep::Clock(_) => None,
    }
}

impl<'a, S: Spectator> Player<'a, '_, S> {
    fn steps(&mut self) -> Option<FailedStep> {
        let scenario = self.scenario;
        for (at, step) in scenario.steps.iter().enumerate() {
            self.step = at;
            let ticket = Ticket(at as u64 + 1);
            if let Err(why) = self.step(&step.value, ticket) {
                return Some(self.failed(why));
            }
        }
        None
    }

    fn failed(&self, why: FailedWhy) -> FailedStep {
        FailedStep {
            step: self.step,
            why,
            program: self.program,
            scan: self.rig.scans(),
            now_ns: self.rig.next_ns().saturating_sub(self.rig.period_ns()),
            scans: self.scans,
            troubles: self.rig.troubles(),
        }
    }

    fn step(&mut self, step: &'a TestStep, ticket: Ticket) -> Result<(), FailedWhy> {
        match step {
            TestStep::Set(operand, value) => self.set(operand, *value, ticket),
            TestStep::Force(operand, value) => {
                operand.force(&mut self.rig, *value, ticket);
                Ok(())
            }
            TestStep::Unforce(operand) => match operand.release(&mut self.rig, ticket) {
                true => Ok(()),
                false => Err(FailedWhy::NotForced(operand.clone())),
            },
            TestStep::Pulse { operand, on, every, times } => {
                let (on, every) = (self.scans_of(*on), self.scans_of(*every));
                self.pulse(PulseTiming { operand, on, every, passed: 0, ticket }, *times)
            }
            TestStep::Beat { operand, on, every } => {
                let (on, every) = (self.scans_of(*on), self.scans_of(*every));
                self.beats.retain(|beat| beat.operand != operand);
                self.beats.push(PulseTiming { operand, on, every, passed: 0, ticket });
                Ok(())
            }
            TestStep::Run(time) => self.run(self.scans_of(*time)),
            TestStep::Late(periods) => self.delay(*periods),
            TestStep::Expect(condition) => self.expect(condition),
            TestStep::Within(time, condition) => self.within(self.scans_of(*time), condition),
            TestStep::Hold(time, condition) => self.hold(self.scans_of(*time), condition),
            TestStep::Stop => {
                self.needs(RigMode::Run)?;
                self.stop()
            }
            TestStep::Start => {
                self.needs(RigMode::Stop)?;
                self.rig.start();
                self.begins_run();
                Ok(())
            }
            TestStep::Restart { down_ms } => {
                if self.rig.mode() == RigMode::Run {
                    self.stop()?;
                }
                self.rig.restart(*down_ms);
                self.begins_process();
                Ok(())
            }
            TestStep::PowerCut(off) => {
                self.rig.power_cut(*off);
                self.begins_process();
                Ok(())
            }
            TestStep::Reload(Reload::To(program)) => {
                self.reload(*program);
                Ok(())
            }
            TestStep::Reload(Reload::Refused(text)) => Err(FailedWhy::Refused(text.clone())),
            TestStep::Lose(device) => {
                self.rig.lose_device(*device);
                Ok(())
            }
            TestStep::Restore(device) => {
                self.rig.restore_device(*device);
                Ok(())
            }
            TestStep::Clock(clock_s) => {
                self.rig.set_clock(*clock_s);
                Ok(())
            }
        }
    }

    /// The number of scans of a time: rounded up, at least one.
    fn scans_of(&self, time: TestTime) -> u64 {
        match time {
            TestTime::Ms(ms) => (u64::from(ms) * MS_NS).div_ceil(self.rig.period_ns()).max(1),
            TestTime::Scans(scans) => scans.max(1),
        }
    }

    fn needs(&self, mode: RigMode) -> Result<(), FailedWhy> {
        if self.rig.mode() == mode { Ok(()) } else { Err(FailedWhy::Mode(mode)) }
    }

    fn set(&mut self, operand: &TestOperand, value: i32, ticket: Ticket) -> Result<(), FailedWhy> {
        self.beats.retain(|beat| beat.operand != operand);
        if operand.is_queued() {
            self.needs(RigMode::Run)?;
        }
        operand.give(&mut self.rig, value, ticket);
        Ok(())
    }

    fn pulse(&mut self, beat: PulseTiming<'a>, times: u32) -> Result<(), FailedWhy> {
        let PulseTiming { operand, on, every, ticket, .. } = beat;
        self.needs(RigMode::Run)?;
        if operand.cell.is_bit() && operand.value(&self.rig) != 0 {
            return Err(FailedWhy::AlreadyOn(operand.clone()));
        }
        for _ in 0..times {
            self.set(operand, 1, ticket)?;
            self.run(on)?;
            self.set(operand, 0, ticket)?;
            self.run(every.saturating_sub(on))?;
        }
        Ok(())
    }

    fn run(&mut self, scans: u64) -> Result<(), FailedWhy> {
        for _ in 0..scans {
            if self.stage.is_given_up() {
                return Err(FailedWhy::GivenUp);
            }
            match self.rig.mode() {
                RigMode::Run => self.scan()?,
                RigMode::Stop => {
                    self.beat();
                    self.rig.tick();
                }
            }
        }
        Ok(())
    }

    fn delay(&mut self, periods: u32) -> Result<(), FailedWhy> {
        self.needs(RigMode::Run)?;
        self.rig.delay(periods);
        Ok(())
    }

    fn expect(&mut self, condition: &Condition) -> Result<(), FailedWhy> {
        let edged = self.edged.iter().find(|edged| edged.step == self.step);
        let mut edges = edged.map_or_else(Vec::new, |edged| edged.before.clone());
        self.judge.look(&self.rig);
        match condition.is_true(self.judge.image(&self.rig), &mut edges) {
            true => Ok(()),
            false => Err(FailedWhy::Unmet),
        }
    }

    fn within(&mut self, scans: u64, condition: &Condition) -> Result<(), FailedWhy> {
        for _ in 0..scans {
            self.needs(RigMode::Run)?;
            self.scan()?;
            if self.expect(condition).is_ok() {
                return Ok(());
            }
        }
        Err(FailedWhy::Never(scans))
    }

    fn hold(&mut self, scans: u64, condition: &Condition) -> Result<(), FailedWhy> {
        for at in 1..=scans {
            self.needs(RigMode::Run)?;
            self.scan()?;
            if self.expect(condition).is_err() {
                return Err(FailedWhy::NotHeld(at));
            }
        }
        Ok(())
    }

    /// Stops the controller: executes the last scan.
    fn stop(&mut self) -> Result<(), FailedWhy> {
        self.rig.request_stop();
        self.scan()
    }

    /// Executes one scan, and checks `always` at its end.
    fn scan(&mut self) -> Result<(), FailedWhy> {
        if self.stage.is_given_up() {
            return Err(FailedWhy::GivenUp);
        }
        self.beat();
        let is_last = self.rig.scan();
        self.scans += 1;
        self.since_start += 1;
        self.judge.scanned(&self.rig);
        self.spectator.scanned(&self.rig, &self.judge, self.scans);
        let image = self.judge.image(&self.rig);
        let steps = &self.scenario.steps;
        for edged in &mut self.edged {
            edged.before.copy_from_slice(&edged.now);
            if let Some(condition) = condition(&steps[edged.step].value) {
                condition.is_true(image, &mut edged.now);
            }
        }
        let broken = self.judge.broken_line(&self.rig);
        self.rig.end_scan(is_last);
        broken.map_or(Ok(()), |at| Err(FailedWhy::Always(at)))
    }

    /// Steps the pulses in the background, before a scan or a tick.
    fn beat(&mut self) {
        let runs = self.rig.mode() == RigMode::Run;
        let mut beats = std::mem::take(&mut self.beats);
        for beat in &mut beats {
            let phase = beat.passed % beat.every.max(1);
            beat.passed += 1;
            let value = match phase {
                0 => 1,
                phase if phase == beat.on => 0,
                _ => continue,
            };
            if runs || !beat.operand.is_queued() {
                beat.operand.give(&mut self.rig, value, beat.ticket);
            }
        }
        self.beats = beats;
    }

    fn reload(&mut self, program: ProgramId) {
        self.rig.reload(&self.stage.programs[program.0]);
        self.program = program;
        // The edges start with the values at the end of the last scan, in the new cells.
        self.judge.reload(program, &self.rig, self.since_start > 0);
        self.look_at_program(self.step + 1);
        if self.since_start > 0 {
            let image = self.judge.image(&self.rig);
            for edged in &mut self.edged {
                if let Some(condition) = condition(&self.scenario.steps[edged.step].value) {
                    condition.is_true(image, &mut edged.now);
                }
            }
        }
        self.spectator.begins(&self.rig);
    }

    fn begins_process(&mut self) {
        self.begins_run();
        self.spectator.begins(&self.rig);
        self.note_steps();
    }

    /// Resets the edges: before the first scan after a start, all values inside them are OFF.
    fn begins_run(&mut self) {
        self.since_start = 0;
        self.judge.begins_run(&self.rig);
        for edged in &mut self.edged {
            edged.before.fill(false);
            edged.now.fill(false);
        }
    }

    /// Sets up the edges of the conditions of the steps from `first` until the next reload, in the
    /// current program.
    fn look_at_program(&mut self, first: usize) {
        self.edged.clear();
        for (at, step) in self.scenario.steps.iter().enumerate().skip(first) {
            if matches!(step.value, TestStep::Reload(_)) {
                break;
            }
            if let Some(edged) =
                condition(&step.value).filter(|step_condition| step_condition.edges > 0)
            {
                let edges = vec![false; edged.edges];
                self.edged.push(EdgedStep { step: at, before: edges.clone(), now: edges });
            }
        }
        self.note_steps();
    }

    /// Passes the texts of the steps to the rig, for `why`.
    fn note_steps(&mut self) {
        self.rig.note(Ticket(0), "`set` of the test");
        let text = &self.stage.suite.file.text;
        for (at, step) in self.scenario.steps.iter().enumerate() {
            let place = step.span.start as usize..step.span.end as usize;
            let said = match step.span == self.scenario.span {
                true => "the random run".to_owned(),
                false => format!("the step `{}`", text.get(place).unwrap_or_default()),
            };
            self.rig.note(Ticket(at as u64 + 1), &said);
        }
    }
}
