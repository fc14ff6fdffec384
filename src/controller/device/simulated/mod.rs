//! A simulated plant, resolved: its parts, the points they have, and what drives each command.
//!
//! Called by [`super`] with the rows of the map; `io::plant` makes a model of it. Points are
//! numbered through the plant: a part's commands first, then what it tells, in the order of
//! `points`; behind those of the parts, one for each fault.
//!
//! ```toml
//! # passes: what stands at a motor's contactor, and its answer
//! [[device]]
//! name = "plant"
//! driver = "simulated"
//! part = [{ name = "pump", kind = "motor", after = "60ms" }]
//! map = [{ from = "Y0", to = "pump.run" }, { from = "pump.running", to = "X0" }]
//! # fails without the first row: nothing drives `pump.run`
//! ```

pub mod keys;
mod parts;
mod points;
mod wires;

use super::{Row, keys as written};
use crate::io::plant::settings::{Fault, Part, PartSettings, Plant};
use crate::source::finding::{Code, Finding};

/// A point as written, for a help.
pub(super) const EXAMPLE: &str = "belt.eye";

/// A plant takes a step at least so often.
const POLL_MS_MAX: i32 = 1000;

/// Whether a text reads as a point of a plant: two names with a dot between, the second one small.
pub(super) fn is_point(_device: &written::Device, text: &str) -> bool {
    text.split_once('.').is_some_and(|(part, point)| {
        points::is_name(part) && points::is_name(point) && point.starts_with(char::is_lowercase)
    })
}

pub(super) fn resolve(
    device: &written::Device,
    rows: &[Row<'_>],
    findings: &mut Vec<Finding>,
) -> Option<Plant> {
    let (keys, before) = (&device.simulated, findings.len());
    if keys.parts.is_empty() {
        let finding = Finding::new(Code::Controller, device.span, "a plant without parts");
        let help = "add one: `part = [{ name = \"pump\", kind = \"motor\" }]`";
        findings.push(finding.help(help));
    }
    if let Some(poll) = device.poll_ms.as_ref().filter(|poll| poll.value > POLL_MS_MAX) {
        let message = "a plant takes a step at least every second";
        let finding = Finding::new(Code::OutOfRange, poll.span, message);
        findings.push(finding.help("write `poll = \"20ms\"`"));
    }
    let kinds: Vec<Option<PartSettings>> =
        keys.parts.iter().map(|part| parts::resolve(part, findings)).collect();
    let points = points::Points::new(keys, findings);
    let commands = wires::commands(keys, rows, &points, findings);
    let inputs = wires::inputs(rows, &points, findings);
    let faults: Vec<Option<Fault>> =
        keys.faults.iter().map(|fault| wires::fault(fault, &points, findings)).collect();
    if findings.len() > before {
        return None;
    }
    let parts = kinds.into_iter().zip(&points.firsts);
    Some(Plant {
        seed: keys.seed.as_ref().map_or(1, |seed| seed.value.unsigned_abs()),
        parts: parts
            .map(|(kind, first)| Some(Part { first: *first, kind: kind? }))
            .collect::<Option<Vec<_>>>()?,
        faults: faults.into_iter().collect::<Option<Vec<_>>>()?,
        commands,
        points: points.all.len(),
        inputs: inputs?,
        outputs: wires::outgoing(rows).count(),
    })
}
