//! What stands at the outputs at present: values in the latest image, and which outputs hang on a
//! device that is lost.
//!
//! Made by `status::ProgramView` for each request; every value of an answer goes through it. What
//! is driven stands in the image (`Snapshot::outputs`), what a device has accepted in its
//! [`DeviceHealth`].

use std::collections::HashMap;

use crate::daemon::narration;
use rungd_base::wall_clock;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{OperandValues, PresentOutputs, ShownValue, UnknownOutput};
use rungd_io::device::DeviceHealth;
use rungd_runtime::exchange::{Mode, Snapshot};
use rungd_runtime::wiring::{OutputSource, Wiring};

/// The outputs of a device: for each its number, and its place among the points of the device.
pub(super) struct DeviceOutputs {
    stale: rungd_engine::BitCell,
    places: Vec<(u32, usize)>,
}

impl DeviceOutputs {
    /// The outputs of a device, by its wiring.
    pub fn of(wiring: &Wiring) -> DeviceOutputs {
        let place = |(at, source): (usize, &OutputSource)| match *source {
            OutputSource::Output(y) => Some((y, at)),
            OutputSource::Cell(..) => None,
        };
        let places = wiring.outputs.iter().enumerate().filter_map(place).collect();
        DeviceOutputs { stale: wiring.stale, places }
    }
}

/// The latest image, and the outputs whose devices are lost.
pub(super) struct OutputSight<'a> {
    image: &'a Snapshot,
    unknown: HashMap<u32, UnknownOutput>,
}

impl<'a> OutputSight<'a> {
    /// The sight of an image. `devices`: the condition of each device, with its outputs.
    pub fn new<'d>(
        image: &'a Snapshot,
        devices: impl Iterator<Item = (&'d DeviceHealth, &'d DeviceOutputs)>,
    ) -> OutputSight<'a> {
        let mut unknown = HashMap::new();
        for (health, outputs) in devices.filter(|(_, outputs)| !outputs.places.is_empty()) {
            // Outside RUN no scan measures the age of the last exchange.
            let is_stale = image.mode == Mode::Run && image.bit(outputs.stale);
            let Some(lost) = health.lost_outputs(is_stale) else { continue };
            for (y, at) in &outputs.places {
                let last = lost.accepted.get(*at).map(|value| *value != 0);
                unknown.insert(*y, UnknownOutput { device: lost.device.clone(), last });
            }
        }
        OutputSight { image, unknown }
    }

    /// Whether the device of an output is lost.
    pub fn is_unknown(&self, number: u32) -> bool {
        self.unknown.contains_key(&number)
    }

    /// An operand with its value.
    pub fn shown(&self, operand: &Variable) -> ShownValue {
        let unknown = operand.output().and_then(|n| self.unknown.get(&n).cloned());
        ShownValue { unknown, ..operand.seen(self.image) }
    }

    /// Some operands with their values.
    pub fn values(&self, operands: &[Variable]) -> OperandValues {
        OperandValues {
            mode: self.image.mode.name().to_owned(),
            scans: self.image.scans,
            values: operands.iter().map(|operand| self.shown(operand)).collect(),
            refused: Vec::new(),
        }
    }

    /// The mode and the outputs.
    pub fn present(self) -> PresentOutputs {
        let OutputSight { image, unknown } = self;
        let driven = (0..).zip(&*image.outputs).filter(|(_, on)| **on != 0).map(|(n, _)| n);
        let on = (image.mode != Mode::Run).then(|| driven.collect());
        let mut unknown: Vec<(u32, UnknownOutput)> = unknown.into_iter().collect();
        unknown.sort_by_key(|(number, _)| *number);
        let reason = (image.mode != Mode::Run).then(|| narration::reason(image.mode));
        let mode = image.mode.name().to_owned();
        PresentOutputs { mode, reason, unix_ns: wall_clock::now_ns(), on, unknown }
    }
}
