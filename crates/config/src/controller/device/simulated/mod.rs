//! A simulated plant, resolved: its parts, their points, and the driver of each command.
//!
//! Called by [`super`] with the rows of the map; `io::plant` makes a model of it. The points of the
//! whole plant have consecutive numbers: for each part, first its commands, then its outputs, in
//! the order of `points`. After the points of all parts, there is one point for each fault.
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
//!
//! A part's own keys can name memory instead of rows: `run = "Y0"`, and `to = "X0"` for its `out`.
//! They become rows too, which are not of the map.

pub mod keys;
mod parts;
mod points;
mod wires;

pub use points::{OfferedPoint, points_of};

use keys::{PlantKeys, WrittenPart};

use super::driver::{DriverKeys, MapRow, ResolvedRows, RowDirection, WrittenDevice};
use super::scaling::ScalingKeys;
use super::settings::DriverSettings;
use rungd_io::plant::settings::{FaultSettings, PartSettings, PlantPart, PlantSettings};
use rungd_io::scaling::Scaling;
use rungd_language::source::atom::{is_name, is_plant_point};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{advise, pair};
use rungd_language::source::reader::{Table, Text};

/// The longest time between two steps of a plant, ms.
const POLL_MS_MAX: u32 = 1000;

impl DriverKeys for PlantKeys {
    fn read_row(&mut self, row: &mut Table<'_>) {
        self.rows.push(ScalingKeys::read(row));
    }

    fn read(&mut self, table: &mut Table<'_>) {
        self.read_device(table);
    }

    fn rows_of_parts(&mut self) -> Vec<MapRow> {
        let rows: Vec<MapRow> = self.parts.iter_mut().flat_map(rows_of_part).collect();
        self.rows.resize_with(self.rows.len() + rows.len(), ScalingKeys::default);
        rows
    }

    fn is_point(&self, text: &str, _device: &str) -> bool {
        is_plant_point(text)
    }

    fn example(&self, _device: &str) -> String {
        "belt.eye".to_owned()
    }

    fn resolve(
        &self,
        device: &WrittenDevice,
        rows: ResolvedRows<'_>,
        findings: &mut Vec<Finding>,
    ) -> Option<DriverSettings> {
        plant(self, device, rows, findings).map(DriverSettings::Simulated)
    }
}

/// Takes the keys of a part that name memory, and returns a row for each.
fn rows_of_part(part: &mut WrittenPart) -> Vec<MapRow> {
    let Some(name) = part.name.as_ref().filter(|name| is_name(&name.text)) else {
        return Vec::new();
    };
    let point = |point: &str, memory: &Text| Text {
        text: format!("{}.{point}", name.text),
        span: memory.span,
        exact: false,
    };
    let row = |from: Text, to: Text, direction| MapRow {
        span: from.span,
        from: Some(from),
        to: Some(to),
        safe: None,
        hold: None,
        of_part: Some(direction),
    };
    let is_memory = |from: &[Text]| matches!(from, [memory] if !is_plant_point(&memory.text));
    let driven = part.driven.extract_if(.., |(_, from)| is_memory(from));
    let driven = driven.flat_map(|(command, from)| from.into_iter().map(move |m| (command, m)));
    let mut rows: Vec<MapRow> = driven
        .map(|(command, memory)| {
            let command = point(command, &memory);
            row(memory, command, RowDirection::Out)
        })
        .collect();
    rows.extend(part.to.take().map(|memory| {
        let out = point("out", &memory);
        row(out, memory, RowDirection::In)
    }));
    rows
}

fn plant(
    keys: &PlantKeys,
    device: &WrittenDevice,
    rows: ResolvedRows<'_>,
    findings: &mut Vec<Finding>,
) -> Option<PlantSettings> {
    let (before, progress) = (findings.len(), rows.progress);
    if keys.parts.is_empty() {
        let finding = Finding::new(Code::Controller, device.span, "a plant without parts");
        let part = pair("part = [{ name = \"pump\", kind = \"motor\" }]").possible();
        findings.push(finding.help(advise("add one: `{}`", [part])));
    }
    if let Some(poll) = device.poll.as_ref().filter(|poll| poll.value > POLL_MS_MAX) {
        let message = "`poll` of a plant is at most 1s";
        let finding = Finding::new(Code::OutOfRange, poll.span, message);
        findings.push(finding.propose(pair("poll = \"20ms\"")));
    }
    let kinds: Vec<Option<PartSettings>> =
        progress.during(&keys.parts).map(|part| parts::resolve(part, findings)).collect();
    let points = points::PlantPoints::new(keys, findings);
    let (commands, undriven) = wires::commands(keys, rows, &points, findings);
    if rows.all.len() == device.map.len() {
        // If a row was left out, it may be the row that drives the command.
        findings.extend(undriven);
    }
    let inputs = wires::inputs(rows, &points, findings);
    let scaling = scaling(keys, rows, findings);
    let faults = progress.during(&keys.faults);
    let faults: Vec<Option<FaultSettings>> =
        faults.map(|fault| wires::fault(fault, &points, findings)).collect();
    if findings.len() > before {
        return None;
    }
    let parts = kinds.into_iter().zip(&points.firsts);
    Some(PlantSettings {
        seed: keys.seed.as_ref().map_or(1, |seed| seed.value.unsigned_abs()),
        parts: parts
            .map(|(kind, first)| Some(PlantPart { first: *first, kind: kind? }))
            .collect::<Option<Vec<_>>>()?,
        faults: faults.into_iter().collect::<Option<Vec<_>>>()?,
        commands,
        points: points.all.len(),
        inputs: inputs?,
        outputs: wires::outgoing(rows).count(),
        input_scaling: wires::incoming(rows).map(|row| scaling[row.at]).collect(),
        output_scaling: wires::outgoing(rows).map(|row| scaling[row.at]).collect(),
    })
}

/// The scaling of each row, by its number in the map.
fn scaling(keys: &PlantKeys, rows: ResolvedRows<'_>, findings: &mut Vec<Finding>) -> Vec<Scaling> {
    let mut found = vec![Scaling::none(false); keys.rows.len()];
    for row in rows.each() {
        let keys = &keys.rows[row.at];
        if row.is_words() {
            found[row.at] = keys.resolve(row.is_real(), findings);
        } else {
            keys.refuse(findings);
        }
    }
    found
}
