//! A plant that is a ladder, as a field device: its outputs are inputs of the controller, and the
//! other way round.
//!
//! [`LadderPlant`] is pure: it takes the time and the controller's outputs, and returns the
//! controller's inputs. The rig steps it in virtual time; [`RunningLadder`] makes it a driver, and
//! steps it up to the present time at each exchange. `docs/ladder-plant.md` describes it.

mod machine;
pub mod settings;

use std::sync::Arc;
use std::time::Instant;

pub use machine::{LadderMachine, LadderProgram};

use super::device::{Driver, Exchange, ExchangeExtent, ExchangeFailure};
use super::scaling::Scaling;
use rungd_engine::isa::{Address, Bit, BitSpace, Real};
use rungd_engine::{Cell, Engine};
use rungd_runtime::ScannedMachine;
use settings::{LadderPoint, LadderSettings};

/// The longest time that a plant under `rungd run` catches up with, ns. If the process stood still
/// for longer, the rest of that time does not pass for the plant.
const CATCH_UP_NS: u64 = 1_000_000_000;

/// A plant with its memory.
pub struct LadderPlant {
    machine: LadderMachine,
    inputs: Vec<PlantInput>,
    outputs: Vec<PlantOutput>,
    /// The last outputs of the controller, in the plant's numbers.
    given: Vec<i32>,
}

/// A bit or word of the plant that is an input of the controller.
struct PlantInput {
    cell: Cell,
    is_real: bool,
    scaling: Scaling,
}

/// A bit or word of the plant that is an output of the controller.
struct PlantOutput {
    target: OutputTarget,
    scaling: Scaling,
}

enum OutputTarget {
    /// The number of an X.
    Input(u32),
    Bit(Cell),
    Real(Cell),
    /// A word of whole numbers, with its limits.
    Word {
        cell: Cell,
        min: i32,
        max: i32,
    },
}

/// The plant's ladder has stopped itself: the plant stands still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

impl LadderPlant {
    /// A plant after a cold start; `program`: its ladder, lowered.
    pub fn new(settings: &LadderSettings, program: &Arc<LadderProgram>) -> LadderPlant {
        let inputs = settings.inputs.iter().filter_map(|point| PlantInput::of(point, program));
        let outputs = settings.outputs.iter().filter_map(|point| PlantOutput::of(point, program));
        LadderPlant {
            machine: LadderMachine::new(program),
            inputs: inputs.collect(),
            outputs: outputs.collect(),
            given: vec![0; settings.outputs.len()],
        }
    }

    /// Moves the plant to a time, which never goes back: its scans before that time see the
    /// previous outputs of the controller, a scan at that time and later ones see `outputs`. Both
    /// slices have one value of the controller's memory per point of the device.
    ///
    /// # Errors
    /// The plant's ladder has stopped itself; `inputs` has the last values.
    pub fn step(
        &mut self,
        now_ns: u64,
        outputs: &[i32],
        inputs: &mut [Option<i32>],
    ) -> Result<(), Stopped> {
        if let Some(before_ns) = now_ns.checked_sub(1) {
            self.scan_up_to(before_ns);
        }
        for ((given, output), value) in self.given.iter_mut().zip(&self.outputs).zip(outputs) {
            *given = output.of_plant(*value);
        }
        self.scan_up_to(now_ns);
        let image = self.machine.image();
        for (value, input) in inputs.iter_mut().zip(&self.inputs) {
            *value = Some(input.of_controller(image.value(input.cell)));
        }
        if self.machine.is_stopped() { Err(Stopped) } else { Ok(()) }
    }

    /// Moves the plant to a time, while the controller cannot reach it.
    pub fn scan_up_to(&mut self, now_ns: u64) {
        let LadderPlant { machine, outputs, given, .. } = self;
        machine.scan_up_to(now_ns, |engine| {
            outputs.iter().zip(&*given).for_each(|(output, value)| output.write(engine, *value));
        });
    }

    /// The plant's memory.
    pub fn machine(&mut self) -> &mut LadderMachine {
        &mut self.machine
    }

    /// The plant's memory, to be read.
    pub fn machine_now(&self) -> &LadderMachine {
        &self.machine
    }

    /// The part of the time up to `now_ns` that it would have to catch up with beyond
    /// [`CATCH_UP_NS`], ns.
    fn standstill_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.machine.next_ns()).saturating_sub(CATCH_UP_NS)
    }
}

/// Whether an address is a word of reals.
fn is_real(address: Address) -> bool {
    matches!(address, Address::Word(word) if word.is_real())
}

impl PlantInput {
    fn of(point: &LadderPoint, program: &LadderProgram) -> Option<PlantInput> {
        let LadderPoint { address, scaling } = *point;
        let cell = program.symbols.layout.cell(address)?;
        Some(PlantInput { cell, is_real: is_real(address), scaling })
    }

    /// The content of the controller's memory for a value of the plant.
    fn of_controller(&self, value: i32) -> i32 {
        match self.cell {
            Cell::Word(_) if self.is_real => {
                self.scaling.of_real(Real::of_cell(value).number().into())
            }
            Cell::Word(_) => self.scaling.of_integer(value.into()),
            Cell::Bit(_) | Cell::WordBit(_) => value,
        }
    }
}

impl PlantOutput {
    fn of(point: &LadderPoint, program: &LadderProgram) -> Option<PlantOutput> {
        let LadderPoint { address, scaling } = *point;
        let cell = program.symbols.layout.cell(address)?;
        let target = match address {
            Address::Bit(Bit::Space(BitSpace::X, n)) => OutputTarget::Input(n),
            Address::Word(_) if is_real(address) => OutputTarget::Real(cell),
            Address::Word(word) => {
                let (min, max) = program.symbols.limits(word);
                OutputTarget::Word { cell, min, max }
            }
            Address::Bit(_) | Address::Structure(_) => OutputTarget::Bit(cell),
        };
        Some(PlantOutput { target, scaling })
    }

    /// The plant's value for a content of the controller's memory.
    fn of_plant(&self, content: i32) -> i32 {
        match self.target {
            OutputTarget::Input(_) | OutputTarget::Bit(_) => content,
            OutputTarget::Real(_) => Real::stored(self.scaling.to_real(content)).real.cell(),
            OutputTarget::Word { min, max, .. } => {
                self.scaling.to_integer(content).clamp(min.into(), max.into()) as i32
            }
        }
    }

    fn write(&self, engine: &mut Engine, value: i32) {
        match self.target {
            OutputTarget::Input(x) => ScannedMachine::set_input(engine, x, value != 0),
            OutputTarget::Bit(cell)
            | OutputTarget::Real(cell)
            | OutputTarget::Word { cell, .. } => {
                ScannedMachine::write(engine, cell, value);
            }
        }
    }
}

/// A plant that runs by the machine's clock.
pub struct RunningLadder {
    plant: LadderPlant,
    /// The time of its first exchange.
    started: Option<Instant>,
    /// The time since then that the plant leaves out, ns.
    left_out_ns: u64,
}

impl RunningLadder {
    /// A plant after a cold start.
    pub fn new(settings: &LadderSettings) -> RunningLadder {
        let plant = LadderPlant::new(settings, &settings.lowered());
        RunningLadder { plant, started: None, left_out_ns: 0 }
    }
}

impl Driver for RunningLadder {
    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        Ok(())
    }

    async fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        let elapsed = self.started.get_or_insert_with(Instant::now).elapsed();
        let now_ns = (elapsed.as_nanos() as u64).saturating_sub(self.left_out_ns);
        let standstill_ns = self.plant.standstill_ns(now_ns);
        self.left_out_ns += standstill_ns;
        match self.plant.step(now_ns - standstill_ns, exchange.outputs, exchange.inputs) {
            Ok(()) => Ok(ExchangeExtent::Whole),
            Err(Stopped) => Err(ExchangeFailure::kept(STOPPED)),
        }
    }

    fn disconnect(&mut self) {}
}

/// The trouble of a plant whose ladder has stopped itself.
pub const STOPPED: &str = "the plant's ladder has stopped itself";
