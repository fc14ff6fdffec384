//! The names of the own ladders of field devices, as conditions have them: `tank.level`.
//!
//! Called by `reading` before the conditions of a test file are resolved, and by `proving`: a proof
//! has no plant, so a condition with such a name is not for it.

use std::sync::Arc;

use super::suite::TestProgram;
use rungd_config::controller::device::{Device, DriverSettings};
use rungd_config::controller::side_ladder::operand_of;
use rungd_config::controller::simulated_side::SimulatedSide;
use rungd_engine::Layout;
use rungd_engine::isa::{Address, DeviceId};
use rungd_language::lower::lower;
use rungd_language::resolve::observed::ShownOperand;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::{LookUp, NamedThing};
use rungd_language::source::condition::WrittenCondition;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, possible};
use rungd_language::source::span::{Located, Span};
use rungd_language::source::was;

/// The names of the own ladder of a field device.
pub(super) struct DeviceNames {
    name: String,
    device: DeviceId,
    program: Arc<Program>,
    layout: Layout,
    /// The addresses that the map connects, each with the name of the controller's side.
    connected: Vec<(Address, String)>,
}

/// A name in a condition about which there is no proof: it is memory of a field device.
pub(super) struct OutsideProof {
    /// Its place in the test file.
    pub span: Span,
    /// The cause.
    pub message: String,
    /// The remedy.
    pub help: Help,
}

impl OutsideProof {
    /// The first such name of a condition.
    pub fn of(written: &WrittenCondition, ladders: &[DeviceNames]) -> Option<OutsideProof> {
        let mut names = was::all_names(&written.contact).into_iter();
        names.find_map(|Located { value, span }| {
            let ladder = ladders.iter().find(|ladder| ladder.has(&value))?;
            let span = was::place_of_name(written.text_of(span), span);
            let shown = ladder.shown(&value, span).ok()?;
            let (help, message) = (ladder.controllers_side(&shown), outside(&shown.name));
            Some(OutsideProof { span, message, help })
        })
    }
}

/// Why no proof can be about a name: the cause.
pub(super) fn outside(name: &str) -> String {
    format!("`{name}` is memory of a field device: a proof has none")
}

impl DeviceNames {
    /// The names of all devices with a ladder of their own; `sides`: those of the test file, in
    /// place of those of the controller file.
    pub fn of(ladder: &TestProgram, sides: &[SimulatedSide]) -> Vec<DeviceNames> {
        let controller = &ladder.controller;
        let sides = || sides.iter().chain(&controller.sides);
        let devices = controller.devices.iter().filter_map(|device| {
            let program = if let DriverSettings::Ladder(plant) = &device.driver {
                &plant.program
            } else {
                &sides().find(|side| side.device == device.id)?.program
            };
            let layout = lower(program).1.layout;
            let (name, program) = (device.name.clone(), Arc::clone(program));
            let connected = connected(ladder, device);
            Some(DeviceNames { name, device: device.id, program, layout, connected })
        });
        devices.collect()
    }

    /// What to write in place of memory of the device: the controller's side of its row.
    fn controllers_side(&self, shown: &ShownOperand) -> Help {
        let side = self.connected.iter().find(|(address, _)| *address == shown.address);
        match side {
            Some((_, side)) => advise(
                "name the controller's side of its row of the map: `{}`",
                [possible(side.clone())],
            ),
            None => Help::from(
                "connect it with memory of the controller by a row of the device's map, and name \
                 that",
            ),
        }
    }

    /// Whether a name, or x of `was(x)`, is for this ladder.
    pub fn has(&self, name: &str) -> bool {
        self.operand(name).is_some()
    }

    fn operand<'t>(&self, name: &'t str) -> Option<&'t str> {
        operand_of(was::place_in(name).unwrap_or(name), &self.name)
    }

    /// The bit or word of this ladder with this name, or with that in `was(x)`.
    ///
    /// # Errors
    /// The finding about the name; `span`: the place of the name, without `was`.
    pub fn shown(&self, name: &str, span: Span) -> Result<ShownOperand, Finding> {
        let operand = self.operand(name).unwrap_or_default();
        let device = &self.name;
        match self.program.scope().look_up(operand) {
            Ok(LookUp { thing: NamedThing::Address(address), .. })
                if let Some(cell) = self.layout.cell(address) =>
            {
                let (name, device) = (format!("{device}.{operand}"), self.device);
                Ok(ShownOperand { name, device, address, cell })
            }
            Ok(_) => {
                let message = format!("`{device}.{operand}` is not one bit or word");
                let finding = Finding::new(Code::OperandType, span, message);
                Err(finding.help("name a bit, a word, a member, or an element by a number"))
            }
            Err(mistake) => {
                let at = span.part(device.len() + 1, device.len() + 1 + operand.len());
                let declared =
                    || format!("declare it in the ladder of `{device}`, under [tags]").into();
                let finding = mistake.finding(at).map(|finding| finding.declared_as(declared));
                Err(finding.unwrap_or_else(|| {
                    let message = format!("nothing is called `{operand}`");
                    Finding::new(Code::UnknownName, at, message)
                }))
            }
        }
    }
}

/// The addresses of a plant that the map of its device connects, with the controller's names.
fn connected(ladder: &TestProgram, device: &Device) -> Vec<(Address, String)> {
    let DriverSettings::Ladder(plant) = &device.driver else { return Vec::new() };
    let points = plant.inputs.iter().chain(&plant.outputs).map(|point| point.address);
    let inputs = device.inputs.iter().map(|input| input.address);
    let ours = inputs.chain(device.outputs.iter().map(|output| output.address));
    points.zip(ours.map(|address| ladder.program.names.name(address))).collect()
}
