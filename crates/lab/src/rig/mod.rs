//! A controller in virtual time: executes an engine as `rungd run` does, without a clock, a thread,
//! a socket or a file.
//!
//! Called by `testing` for test files, and by `rungd sim CONTROLLER.toml`. The side of the scan of
//! field devices, the tape, the plan of a reload and the content of retentive memory are the same
//! code as in the daemon; this module decides the times at which they act. Field devices of kind
//! `simulated`, and the rules of `[[simulated-device]]`, are stepped as `run` steps them; for all
//! other devices the caller answers. All are connected until they are [lost](Rig::lose_device).
//!
//! A scan has two halves. [`Rig::scan`] ends before the passes of a last scan, so that its caller
//! sees memory at the end of every scan. [`Rig::end_scan`] does the rest.

mod device_ladder;
mod field;
mod mode;
mod process;
mod program;
mod retained;
pub mod simulation;
mod stored_stages;
mod tape;

pub use device_ladder::{DeviceProgram, SimulatedDevice};
pub use mode::{PowerOff, RigMode};
pub use program::RigProgram;
pub(crate) use tape::RigTape;
pub use tape::TapeListener;

use std::sync::Arc;
use std::time::Duration;

use field::{Driven, RigField};
use mode::MS_NS;
use retained::{ImageTime, Retained};
use rungd_engine::isa::{Bit, BitSpace, DeviceId};
use rungd_engine::{Cell, Engine, Image};
use rungd_io::plant::RuleSet;
use rungd_runtime::exchange::{Mode, StopReason, Ticket};
use rungd_runtime::field::InputStep;
use rungd_runtime::{Origin, ScanStart, ScannedMachine, TapeSection, Taped, UnwiredInputs};
use rungd_state::reload::{LoweredProgram, ReloadPlan};

const S_NS: u64 = 1_000_000_000;

/// The settings of a rig.
#[derive(Clone, Debug, Default)]
pub struct RigSetup {
    /// The cells whose memory before the first scan differs from a cold start, with their values.
    /// Bits of retained Stages say what the process finds of them: a Program of which a Stage is
    /// here goes on in those that are ON; one of which none is begins at its initial Stage, or does
    /// not run.
    pub set: Vec<(Cell, i32)>,
    /// The levels of inputs from the first scan on: the number of the X, and ON or OFF.
    pub inputs: Vec<(u32, bool)>,
    /// The memory of devices with a ladder of their own that differs from a cold start.
    pub devices: Vec<(DeviceId, Cell, i32)>,
    /// The local time at the start, as seconds since 1970-01-01 00:00:00 of the local clock.
    pub clock_s: i64,
    /// Whether images of retentive memory are kept, for [`Rig::restart`] and [`Rig::power_cut`].
    pub keeps_images: bool,
    /// Whether all inputs are kept, for [`Rig::sections`].
    pub is_taped: bool,
}

/// A controller in virtual time.
pub struct Rig {
    program: Arc<RigProgram>,
    machine: Taped,
    tape: Option<RigTape>,
    field: RigField,
    rules: RuleSet,
    /// The time of the next step of the rules, ms.
    rules_ms: u64,
    mode: RigMode,
    period_ns: u64,
    /// The time of the next scan; 0 for the first scan.
    next_ns: u64,
    /// The number of complete scans of this process.
    scans: u64,
    /// The levels of the inputs that were ever set, 64 at a time from X0 on.
    levels: Vec<UnwiredInputs>,
    /// Queued writes for the next scan, each with the number of its batch.
    writes: Vec<(Cell, i32, Ticket)>,
    forces: Vec<Cell>,
    /// A local time, and the virtual time at which it was valid.
    clock: (i64, u64),
    /// The time of day of the last scan, since 1970.
    scanned_at: Duration,
    retained: Option<Retained>,
    generation: u32,
}

impl Rig {
    /// A rig after a cold start, in RUN, before the first scan.
    pub fn new(program: &Arc<RigProgram>, setup: &RigSetup) -> Rig {
        let mut engine = Engine::new(program.code.clone());
        stored_stages::store_stages(&mut engine, &setup.set);
        let (mut machine, tape) = match setup.is_taped {
            true => {
                let (machine, tape) = RigTape::of(engine);
                (machine, Some(tape))
            }
            false => (Taped::new(engine), None),
        };
        machine.comes_from(Origin::Batch(Ticket(0)));
        let stored = |cell: &Cell| stored_stages::is_of_stages(&program.code, *cell);
        let set = setup.set.iter().filter(|(cell, _)| !stored(cell));
        set.clone().for_each(|(cell, value)| machine.write(*cell, *value));
        let retained = setup.keeps_images.then(|| Retained::new(program, 0));
        let mut rig = Rig {
            field: RigField::new(program),
            rules: RuleSet::new(&program.controller.rules),
            rules_ms: 0,
            machine,
            tape,
            mode: RigMode::Run,
            period_ns: program.period_ns(),
            next_ns: 0,
            scans: 0,
            levels: Vec::new(),
            writes: Vec::new(),
            forces: Vec::new(),
            clock: (setup.clock_s, 0),
            scanned_at: Duration::ZERO,
            retained,
            generation: 0,
            program: Arc::clone(program),
        };
        setup.inputs.iter().for_each(|(x, on)| rig.set_input(*x, *on));
        for (cell, value) in set {
            rig.field.set_cell(*cell, *value, 0);
        }
        for (device, cell, value) in &setup.devices {
            rig.field.write_device(*device, *cell, *value, None);
        }
        rig.start();
        rig.settle();
        rig
    }

    /// The program that runs.
    pub fn program(&self) -> &Arc<RigProgram> {
        &self.program
    }

    /// Memory.
    pub fn image(&self) -> &Image {
        self.machine.engine().image()
    }

    /// The mode.
    pub fn mode(&self) -> RigMode {
        self.mode
    }

    /// The scan period, ns.
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// The time of the next scan, ns since the start of the scenario.
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// The number of complete scans since the process started.
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// The first half of a scan, in RUN: steps 1 to 7. Returns true if it is the last scan.
    pub fn scan(&mut self) -> bool {
        let now_ns = self.next_ns;
        self.settle_images();
        self.move_world(now_ns);
        let start = ScanStart {
            number: self.scans + 1,
            now_ns,
            times: Default::default(),
            local_s: self.local_s(),
        };
        self.scanned_at = self.time_of_day();
        let Rig { machine, field, levels, writes, scans, .. } = self;
        machine.begin_scan(&start);
        for inputs in levels.iter() {
            machine.set_inputs(inputs.not_moved(field.moved()));
        }
        field.bring_in(machine, InputStep { scan: *scans, now_ns });
        for (cell, value, ticket) in writes.drain(..) {
            machine.comes_from(Origin::Batch(ticket));
            machine.write(cell, value);
        }
        machine.execute()
    }

    /// The second half of a scan: the passes after the last one, outputs, the tape. After the last
    /// scan the mode is STOP.
    pub fn end_scan(&mut self, is_last: bool) {
        if is_last {
            self.machine.terminate();
            self.enter(RigMode::Stop);
        }
        self.scans += 1;
        self.drive(self.next_ns);
        let scanned_at = self.scanned_at;
        if is_last && let Some(retained) = &mut self.retained {
            let end = ImageTime { ns: self.next_ns, is_final: true, scanned_at };
            retained.keep(self.machine.engine().image(), end);
        }
        self.settle();
        self.next_ns += self.period_ns;
    }

    /// Lets one period pass in STOP: field devices and the clock continue.
    pub fn tick(&mut self) {
        self.settle_images();
        self.move_world(self.next_ns);
        self.next_ns += self.period_ns;
    }

    /// Lets the next scan come this number of periods after it was due. Field devices and the clock
    /// go on.
    pub fn delay(&mut self, periods: u32) {
        self.next_ns = self.next_ns.saturating_add(u64::from(periods) * self.period_ns);
    }

    /// Makes the next scan the last one.
    pub fn request_stop(&mut self) {
        self.machine.request_stop();
    }

    /// STOP → RUN, with memory unchanged.
    pub fn start(&mut self) {
        self.machine.start(self.next_ns);
        self.enter(RigMode::Run);
    }

    fn enter(&mut self, mode: RigMode) {
        self.mode = mode;
        self.machine.enters(match mode {
            RigMode::Run => Mode::Run,
            RigMode::Stop => Mode::Stop(StopReason::Operator),
        });
    }

    /// Sets the level of an input, from the next scan on.
    pub fn set_input(&mut self, x: u32, on: bool) {
        self.field.set(x, i32::from(on), self.next_ns);
        put_level(&mut self.levels, x, on);
    }

    /// Adds a queued write to the next scan. `ticket`: the number of its origin in
    /// [`Rig::sections`].
    pub fn write(&mut self, cell: Cell, value: i32, ticket: Ticket) {
        if !self.field.set_cell(cell, value, self.next_ns) {
            self.writes.push((cell, value, ticket));
        }
    }

    /// Writes a bit or word of the memory of a device that has a ladder of its own.
    pub fn write_device(&mut self, device: DeviceId, cell: Cell, value: i32) {
        self.field.write_device(device, cell, value, Some(self.next_ns));
    }

    /// Forces a bit or word of a device that has a ladder of its own.
    pub fn force_device(&mut self, device: DeviceId, cell: Cell, value: i32) {
        if let Some(machine) = self.field.machine(device, Some(self.next_ns)) {
            machine.force(cell, value);
        }
    }

    /// Ends a force of a device that has a ladder of its own; returns false if there is none.
    pub fn release_device(&mut self, device: DeviceId, cell: Cell) -> bool {
        let machine = self.field.machine(device, Some(self.next_ns));
        machine.is_some_and(|machine| machine.release(cell))
    }

    /// A bit or word of the memory of a device that has a ladder of its own; 0 if it has none.
    pub fn device_value(&self, device: DeviceId, cell: Cell) -> i32 {
        self.field.device_value(device, cell)
    }

    /// The field devices whose last exchange failed, each with the reason:
    /// `drive1: reading input 4 of unit 1: exception 2 (illegal data address)`.
    pub fn troubles(&self) -> Vec<String> {
        let devices = &self.program.controller.devices;
        let told = self.field.troubles();
        told.map(|(at, trouble)| format!("{}: {trouble}", devices[at].name)).collect()
    }

    /// Forces a bit or word.
    pub fn force(&mut self, cell: Cell, value: i32, ticket: Ticket) {
        self.machine.comes_from(Origin::Batch(ticket));
        self.machine.force(cell, value);
        if !self.forces.contains(&cell) {
            self.forces.push(cell);
        }
    }

    /// Ends a force; returns false if there is none.
    pub fn release(&mut self, cell: Cell, ticket: Ticket) -> bool {
        let Some(at) = self.forces.iter().position(|forced| *forced == cell) else { return false };
        self.forces.remove(at);
        self.machine.comes_from(Origin::Batch(ticket));
        self.machine.release(cell);
        true
    }

    /// From now on the field device cannot be reached.
    pub fn lose_device(&mut self, device: DeviceId) {
        self.field.lose(device);
    }

    /// From now on the field device can be reached.
    pub fn restore_device(&mut self, device: DeviceId) {
        self.field.restore(device, self.next_ns);
    }

    /// Sets the local time of the next scan.
    pub fn set_clock(&mut self, clock_s: i64) {
        self.clock = (clock_s, self.next_ns);
    }

    /// Local time at the next scan.
    pub fn local_s(&self) -> i64 {
        let (clock_s, since_ns) = self.clock;
        let passed_s = (self.next_ns - since_ns) / S_NS;
        clock_s.saturating_add(i64::try_from(passed_s).unwrap_or(i64::MAX))
    }

    /// The time of day at the next scan, since 1970; 0 before 1970.
    fn time_of_day(&self) -> Duration {
        let (_, since_ns) = self.clock;
        let part_ns = (self.next_ns - since_ns) % S_NS;
        let whole_s = u64::try_from(self.local_s()).unwrap_or(0);
        Duration::from_secs(whole_s) + Duration::from_nanos(part_ns)
    }

    /// Swaps the program between two scans, as a reload does. Field devices stay.
    pub fn reload(&mut self, program: &Arc<RigProgram>) {
        let side =
            |rig_program: &RigProgram| (rig_program.code.clone(), Arc::clone(&rig_program.symbols));
        let ((old_code, old_symbols), (code, symbols)) = (side(&self.program), side(program));
        let plan = ReloadPlan::new(
            LoweredProgram { program: &old_code, symbols: &old_symbols },
            LoweredProgram { program: &code, symbols: &symbols },
        );
        let mut engine = Engine::new(code);
        engine.touch();
        let mut old = std::mem::replace(&mut self.machine, Taped::new(engine).with_spares());
        let running = self.mode == RigMode::Run;
        self.machine.adopt(&mut old, &plan.transfer, running, &self.forces);
        self.forces = self.forces.iter().filter_map(|cell| plan.transfer.cell(*cell)).collect();
        let writes = std::mem::take(&mut self.writes).into_iter();
        let write = |(cell, value, ticket)| Some((plan.transfer.cell(cell)?, value, ticket));
        self.writes = writes.filter_map(write).collect();
        self.generation += 1;
        self.machine.swapped(self.generation);
        self.rules = self.rules.going_on(&program.controller.rules);
        self.field.adopt(program);
        self.period_ns = program.period_ns();
        if let Some(retained) = &mut self.retained {
            retained.adopt(program);
        }
        self.program = Arc::clone(program);
        self.settle();
    }

    /// All inputs since the process started, if the rig is taped.
    pub fn sections(&self) -> Vec<Arc<TapeSection>> {
        self.tape.as_ref().map_or_else(Vec::new, RigTape::sections)
    }

    /// Whether all inputs are kept.
    pub fn is_taped(&self) -> bool {
        self.tape.is_some()
    }

    /// Passes the tape to a listener from now on, instead of keeping it. Works only if the rig is
    /// taped.
    pub fn listen(&mut self, listener: Box<dyn TapeListener>) {
        if let Some(tape) = &mut self.tape {
            tape.listen(&self.program, listener);
        }
    }

    /// Names an origin for people.
    pub fn note(&mut self, ticket: Ticket, who: &str) {
        if let Some(tape) = &mut self.tape {
            tape.note(Origin::Batch(ticket), who);
        }
    }

    /// Steps field devices and rules up to the time of a scan, so that the scan reads their inputs.
    fn move_world(&mut self, now_ns: u64) {
        self.step_rules(now_ns / MS_NS);
        let driven = Driven::of(&self.machine, &self.program, self.mode, self.scans);
        self.field.poll(now_ns, driven);
    }

    /// Passes changed outputs to field devices.
    fn drive(&mut self, now_ns: u64) {
        let driven = Driven::of(&self.machine, &self.program, self.mode, self.scans);
        self.field.drive(now_ns, driven);
    }

    /// Steps the rules of `[[simulated-device]]` once for each millisecond.
    fn step_rules(&mut self, now_ms: u64) {
        let Rig { rules, rules_ms, machine, program, mode, levels, scans, .. } = self;
        if program.controller.rules.is_empty() {
            *rules_ms = now_ms + 1;
            return;
        }
        let driven = Driven::of(machine, program, *mode, *scans);
        let read = |bit| {
            if let Bit::Space(BitSpace::Y, n) = bit {
                return driven.output(n);
            }
            driven.image.bit(program.symbols.layout.bit(bit))
        };
        while *rules_ms <= now_ms {
            let moved = rules.step(*rules_ms, read).into_iter();
            moved.for_each(|(x, on)| put_level(levels, x, on));
            *rules_ms += 1;
        }
    }

    /// Keeps the images of retentive memory that are due before the next scan.
    fn settle_images(&mut self) {
        if self.scans == 0 {
            return;
        }
        let is_final = self.mode == RigMode::Stop;
        if let Some(retained) = &mut self.retained {
            let next = ImageTime { ns: self.next_ns, is_final, scanned_at: self.scanned_at };
            retained.settle(self.machine.engine().image(), next);
        }
    }

    fn settle(&mut self) {
        if let Some(tape) = &mut self.tape {
            self.machine.settle();
            tape.drain(&self.program);
        }
    }
}

/// Sets the level of an input, by its X.
fn put_level(levels: &mut Vec<UnwiredInputs>, x: u32, on: bool) {
    let at = x as usize / 64;
    while levels.len() <= at {
        levels.push(UnwiredInputs::from_first(64 * levels.len() as u32));
    }
    levels[at].give(x, on);
}
