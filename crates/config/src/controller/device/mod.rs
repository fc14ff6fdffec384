//! Field devices, resolved: every row of a map becomes a list of points and a list of addresses of
//! the same length.
//!
//! Called by [`super`] once the names are known. This module resolves the settings that all drivers
//! share: names, directions, addresses and safe values. `wiring` checks that each input has one
//! mover. Only a driver's own folder interprets a text like `coil 0..7`: it receives rows with
//! resolved addresses, and returns the points in the same order.

pub mod driver;
pub mod drivers;
pub mod gpio;
pub(crate) mod keys;
pub mod ladder;
pub mod modbus;
mod scaling;
pub mod settings;
pub mod simulated;
mod wiring;

use driver::{DriverKeys, MapRow, ResolvedRow, ResolvedRows, RowDirection, WrittenDevice};

use std::sync::Arc;

use super::side_ladder::SidePrograms;
use rungd_base::progress::Progress;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceId, Real, Word, WordSpace};
use rungd_language::resolve::names::NAME_MAX;
use rungd_language::resolve::operands::resolve_operands;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::Scope;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::fix::{Fix, FixEdit, Help, advise, pair, possible};
use rungd_language::source::reader::{Constant, Text};

pub use settings::{Device, DriverSettings, OnLoss};
pub(crate) use settings::{DeviceInput, DeviceOutput, SafeValue};
pub(crate) use wiring::moved_twice;
pub(super) use wiring::unmapped_outputs;

/// The most points that a device may have.
pub(crate) const POINTS_MAX: usize = 65_536;
/// The most points that all devices together may have.
const POINTS_OF_ALL_MAX: usize = 1_000_000;

/// The numbers of points that a device, and all devices, may still have.
struct PointsRoom {
    of_device: usize,
    of_all: usize,
    /// Whether the device already has a finding about too many points.
    is_told: bool,
}

impl PointsRoom {
    /// The room for a further device.
    fn begin_device(&mut self) {
        (self.of_device, self.is_told) = (POINTS_MAX, false);
    }

    /// Takes room for the points of a row. If there is too little, nothing is taken, and the device
    /// gets one finding.
    fn take(&mut self, count: u32, row: &Text, findings: &mut Vec<Finding>) -> Option<()> {
        let count = count as usize;
        if count <= self.of_device && count <= self.of_all {
            (self.of_device, self.of_all) = (self.of_device - count, self.of_all - count);
            return Some(());
        }
        if !std::mem::replace(&mut self.is_told, true) {
            let (what, most) = match count > self.of_device {
                true => ("a device has", POINTS_MAX),
                false => ("all devices together have", POINTS_OF_ALL_MAX),
            };
            let message = format!("{what} at most {most} points");
            let finding = Finding::new(Code::Controller, row.span, message);
            findings.push(finding.label("the limit is reached here"));
        }
        None
    }
}

/// Where the names of devices' maps are declared.
#[derive(Clone, Copy)]
pub(super) struct MapNames<'a> {
    /// The names of the controller's ladders.
    pub scope: &'a Scope,
    /// The ladders that are devices.
    pub ladders: &'a SidePrograms,
    /// The scan period of the controller.
    pub period: ScanPeriod,
}

/// Resolves all `[[device]]` tables. If one of the findings is an error, devices may be missing.
pub(super) fn resolve(
    devices: &[WrittenDevice],
    names: MapNames<'_>,
    progress: &Progress,
    findings: &mut Vec<Finding>,
) -> Vec<Device> {
    // A device has the same number as its name had when the ladders were resolved.
    let ladders = names.ladders.devices.iter().map(Option::as_ref);
    let named = progress.during(devices).zip(ladders.chain(std::iter::repeat(None)));
    let named = named.filter_map(|(device, ladder)| {
        Some(NamedDevice { device, name: device.name.as_ref()?, ladder })
    });
    // A name that is too long has a finding where the ladders' names are declared.
    let numbered = named.enumerate().filter(|(_, named)| named.name.text.len() <= NAME_MAX);
    let room = PointsRoom { of_device: POINTS_MAX, of_all: POINTS_OF_ALL_MAX, is_told: false };
    let MapNames { scope, period, .. } = names;
    let mut resolver = DeviceResolver { scope, period, progress, room, findings };
    let resolved = numbered.filter_map(|(at, named)| resolver.one(named, DeviceId(at as u32)));
    let resolved: Vec<Device> = resolved.collect();
    findings.extend(modbus::at_odds(&resolved, devices, progress));
    resolved
}

/// A device that has a name.
struct NamedDevice<'a> {
    device: &'a WrittenDevice,
    name: &'a Text,
    /// The ladder that is the device.
    ladder: Option<&'a Arc<Program>>,
}

/// Resolves devices one after the other.
struct DeviceResolver<'a> {
    scope: &'a Scope,
    period: ScanPeriod,
    progress: &'a Progress,
    room: PointsRoom,
    findings: &'a mut Vec<Finding>,
}

impl DeviceResolver<'_> {
    fn one(&mut self, named: NamedDevice<'_>, id: DeviceId) -> Option<Device> {
        let NamedDevice { device, name, ladder } = named;
        self.room.begin_device();
        let driver = device.driver.as_deref()?;
        let before = self.findings.len();
        let rows: Vec<ResolvedRow<'_>> = self
            .progress
            .during(&device.map)
            .enumerate()
            .filter_map(|(at, written)| self.row(device, at, written))
            .collect();
        if device.map.is_empty() && !device.map_is_table {
            let message = format!("device `{}` has no map, so it exchanges nothing", name.text);
            let help = "add rows: `map = [{ from = \"…\", to = \"X0\" }]`";
            let row = format!("{{ from = \"{}\", to = \"X0\" }}", driver.example(&name.text));
            let map = pair(format!("map = [{row}]")).possible();
            let finding = Finding::new(Code::Controller, device.span, message);
            self.findings.push(finding.help(help).fix(map));
        }
        let findings = &mut *self.findings;
        findings.extend(too_early_loss(device));
        let of_driver =
            ResolvedRows { all: &rows, progress: self.progress, ladder, period: self.period };
        let settings = driver.resolve(device, of_driver, findings);
        let outputs = outputs(&rows, findings);
        let inputs = inputs(&rows, findings);
        if findings.len() > before
            && findings[before..].iter().any(|found| found.severity() == Severity::Error)
        {
            return None;
        }
        let (poll_ms, loss_after_ms) = (device.poll_ms(), device.loss_after_ms());
        let (span, on_loss, driver) = (name.span, device.on_loss, settings?);
        let name = name.text.clone();
        Some(Device { id, name, span, poll_ms, on_loss, loss_after_ms, inputs, outputs, driver })
    }

    /// A row of a map. `at`: its number.
    fn row<'r>(
        &mut self,
        device: &'r WrittenDevice,
        at: usize,
        written: &'r MapRow,
    ) -> Option<ResolvedRow<'r>> {
        let (scope, findings) = (self.scope, &mut *self.findings);
        let (from, to) = (written.from.as_ref()?, written.to.as_ref()?);
        let driver = device.driver.as_deref()?;
        let name = device.name.as_ref()?.text.as_str();
        let are_points = match written.of_part {
            Some(direction) => (direction == RowDirection::In, direction == RowDirection::Out),
            None => [from, to].map(|text| driver.is_point(&text.text, name)).into(),
        };
        let (direction, points, text) = match are_points {
            (true, false) => (RowDirection::In, from, to),
            (false, true) => (RowDirection::Out, to, from),
            (both, _) => {
                let is_memory = |text: &Text| resolve_operands(scope, text).is_ok();
                let mut texts = [from, to].into_iter().filter(|text| !both && !is_memory(text));
                if let Some(finding) = texts.find_map(|text| driver.other_notation(text)) {
                    findings.push(finding);
                    return None;
                }
                let message = if both {
                    "both `from` and `to` are points of the device"
                } else {
                    "neither `from` nor `to` is a point of the device"
                };
                let point = driver.example(name);
                let rows = [
                    format!("{{ from = \"{point}\", to = \"X0\" }}"),
                    format!("{{ from = \"Y0\", to = \"{point}\" }}"),
                ];
                let help = advise("an input: `{}`; an output: `{}`", rows.map(possible));
                findings.push(Finding::new(Code::Controller, written.span, message).help(help));
                return None;
            }
        };
        let addresses: Vec<Address> = match resolve_operands(scope, text) {
            Ok(operands) => {
                self.room.take(operands.count, text, findings)?;
                operands.addresses().collect()
            }
            Err(finding) => {
                findings.push(finding);
                return None;
            }
        };
        if let Some(finding) = wrong_way(direction, &addresses, text) {
            findings.push(finding);
            return None;
        }
        Some(ResolvedRow { at, written, direction, points, addresses, text })
    }
}

/// Whether a map can move an address.
fn is_movable(address: &Address) -> bool {
    use BitSpace::{C, Mc, Mi, X};
    use WordSpace::{D, Mhr, Mir, R, V};
    match address {
        Address::Bit(Bit::Space(space, _)) => matches!(space, X | C | Mc | Mi),
        Address::Word(Word::Space(space, _)) => matches!(space, V | D | R | Mhr | Mir),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
    }
}

/// The finding for an address that a device cannot move.
fn wrong_way(direction: RowDirection, addresses: &[Address], text: &Text) -> Option<Finding> {
    if direction == RowDirection::Out || addresses.iter().all(is_movable) {
        return None;
    }
    let message = format!("`{}` cannot be moved by a device", text.text);
    let help = "a device moves only X, C, MC, MI, V, D, R, MHR and MIR";
    let number = text.text.trim_matches(|c: char| !c.is_ascii_digit());
    let block = if matches!(addresses.first(), Some(Address::Word(_))) { "D" } else { "C" };
    let moved = possible(format!("{block}{number}"));
    Some(Finding::new(Code::Controller, text.span, message).help(help).fix(moved).or_omit())
}

fn inputs(rows: &[ResolvedRow<'_>], findings: &mut Vec<Finding>) -> Vec<DeviceInput> {
    let rows = || rows.iter().filter(|row| row.direction == RowDirection::In);
    for row in rows() {
        if let Some(safe) = &row.written.safe {
            let message = "an input has no safe value";
            let help = "the device's `on-loss` sets its value when the device is lost";
            let finding = Finding::new(Code::Controller, safe.span, message).help(help);
            findings.push(finding.fix(FixEdit::Delete));
        }
    }
    let row = |row: &ResolvedRow<'_>| {
        let (span, is_of_part) = (row.text.span, row.written.of_part.is_some());
        row.addresses
            .iter()
            .map(|address| DeviceInput { address: *address, span, is_of_part })
            .collect::<Vec<_>>()
    };
    rows().flat_map(row).collect()
}

fn outputs(rows: &[ResolvedRow<'_>], findings: &mut Vec<Finding>) -> Vec<DeviceOutput> {
    let mut outputs = Vec::new();
    findings.extend(rows.iter().filter_map(misplaced_hold));
    for row in rows.iter().filter(|row| row.direction == RowDirection::Out) {
        for address in &row.addresses {
            let safe = safe_value(row, *address, findings);
            let (span, is_of_part) = (row.text.span, row.written.of_part.is_some());
            outputs.push(DeviceOutput { address: *address, safe, span, is_of_part });
        }
    }
    outputs
}

/// The finding for a `hold` that has no effect.
fn misplaced_hold(row: &ResolvedRow<'_>) -> Option<Finding> {
    let hold = row.written.hold.as_ref().filter(|hold| hold.value)?;
    let is_y = |address: &Address| matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)));
    let (message, help) = match row.direction {
        RowDirection::In => (
            "an input has no safe value".to_owned(),
            Help::from("the device's `on-loss` sets its value when the device is lost")
                .with(FixEdit::Delete),
        ),
        RowDirection::Out if row.addresses.iter().any(is_y) => (
            format!("the safe value of `{}` is set in `[outputs]`", row.text.text),
            advise("write it in `[outputs]`: `{}`", [in_outputs("hold = [\"Y1\"]")]),
        ),
        RowDirection::Out if row.written.safe.is_some() => (
            "`hold` and `safe` in one row".to_owned(),
            Help::from("write one of the two: `hold` keeps its value, `safe` gives one")
                .with(possible(FixEdit::Delete)),
        ),
        RowDirection::Out => return None,
    };
    Some(Finding::new(Code::Controller, hold.span, message).help(help))
}

/// A pair in `[outputs]`, instead of the key at the place of the finding.
fn in_outputs(pair: &str) -> Fix {
    Fix::from(FixEdit::Under { table: "outputs", pair: pair.to_owned() })
}

fn safe_value(row: &ResolvedRow<'_>, address: Address, findings: &mut Vec<Finding>) -> SafeValue {
    let is_output = matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)));
    let (min, max) = match address {
        Address::Word(word) => word.range(),
        Address::Bit(_) | Address::Structure(_) => (0, 1),
    };
    let Some(safe) = &row.written.safe else {
        let is_held = row.written.hold.as_ref().is_some_and(|hold| hold.value);
        return match (is_output, is_held || row.written.of_part.is_some()) {
            (true, _) => SafeValue::AsOutput,
            (false, true) => SafeValue::Hold,
            (false, false) => SafeValue::Value(0),
        };
    };
    let mut refuse = |message: String, help: Help| {
        // Only one finding per row, which is then the last.
        if findings.last().is_none_or(|finding| finding.span != safe.span) {
            findings.push(Finding::new(Code::Controller, safe.span, message).help(help));
        }
        SafeValue::Value(0)
    };
    if is_output {
        let help = advise(
            "write it in `[outputs]`: `{}`, `hold = [\"Y1\"]`; else it is OFF",
            [in_outputs("on = [\"Y0\"]")],
        );
        return refuse(format!("the safe value of `{address}` is set in `[outputs]`"), help);
    }
    let holds_reals = matches!(address, Address::Word(word) if word.is_real());
    let value = match safe.value {
        Constant::Integer(value) | Constant::Duration(value) if holds_reals => {
            Real::nearest(value).cell()
        }
        Constant::Integer(value) | Constant::Duration(value) => value,
        Constant::Real(value) if holds_reals => value.cell(),
        Constant::Real(real) => {
            return refuse(
                format!("`{address}` holds whole numbers"),
                Help::from("an R word holds reals").with(format!("{:.0}", real.number())),
            );
        }
        Constant::Bit(on) => i32::from(on),
    };
    if !(min..=max).contains(&value) {
        let nearest = value.clamp(min, max).to_string();
        let help = Help::from("take one of these").with(nearest);
        return refuse(format!("`{address}` holds {min} to {max}"), help);
    }
    SafeValue::Value(value)
}

/// The finding for a device that would be lost between two exchanges.
fn too_early_loss(device: &WrittenDevice) -> Option<Finding> {
    let (poll_ms, loss_after) = (device.poll_ms(), device.loss_after.as_ref()?);
    let is_polled = device.driver.as_deref().is_some_and(DriverKeys::is_polled);
    if !is_polled || loss_after.value > poll_ms {
        return None;
    }
    let message = format!("lost after {} ms, and polled every {poll_ms} ms", loss_after.value);
    let finding = Finding::new(Code::Controller, loss_after.span, message)
        .label("it would be lost between any two exchanges")
        .help("`loss-after` must be longer than `poll`: start with three times `poll`");
    Some(finding.fix(pair(format!("loss-after = \"{}ms\"", i64::from(poll_ms) * 3))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_total_number_of_points_of_all_devices_is_limited() {
        let mut room =
            PointsRoom { of_device: POINTS_MAX, of_all: POINTS_OF_ALL_MAX, is_told: false };
        let mut findings = Vec::new();
        let row = Text::default();
        let mut devices = 0;
        while findings.is_empty() {
            room.begin_device();
            devices += 1;
            let rows = [60_000, 5_536, 1].map(|count| room.take(count, &row, &mut findings));
            assert!(rows[0].is_none() || rows[2].is_none(), "a device has at most 65,536");
            if rows[0].is_some() {
                let message = findings.pop().map(|finding| finding.message);
                assert_eq!(message.as_deref(), Some("a device has at most 65536 points"));
            }
        }
        assert_eq!((devices, findings.len()), (16, 1), "one finding for a device");
        assert_eq!(findings[0].message, "all devices together have at most 1000000 points");
    }
}
