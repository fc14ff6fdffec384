//! `[[simulated]]`: the own side of a Modbus device, a ladder whose memory is the device's
//! registers, for tests and simulations.
//!
//! Read and resolved here, for controller files and for test files. `rungd run` exchanges with the
//! real device.

use std::collections::HashMap;
use std::sync::Arc;

use super::device::settings::{Device, DriverSettings};
use super::side_ladder::WrittenSideLadder;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::DeviceId;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::one_of;
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Span;

/// `[[simulated]]`: the own side of a Modbus device.
#[derive(Clone, Debug)]
pub struct WrittenSimulated {
    /// `device`.
    pub device: Option<Text>,
    /// Its ladder.
    pub side: WrittenSideLadder,
}

/// The own side of a Modbus device, resolved: a ladder whose memory is the device's registers.
#[derive(Clone, Debug)]
pub struct SimulatedSide {
    /// The device.
    pub device: DeviceId,
    /// The ladder.
    pub program: Arc<Program>,
    /// Its scan period.
    pub period: ScanPeriod,
}

impl WrittenSimulated {
    /// Its scan period.
    pub fn period(&self) -> ScanPeriod {
        self.side.period.unwrap_or(ScanPeriod::DEFAULT)
    }
}

impl WrittenSimulated {
    /// The own sides of Modbus devices, and the findings about these tables. `programs`: the
    /// ladders of the tables; `code`: of the findings.
    pub fn resolve(
        written: &[WrittenSimulated],
        programs: &[Option<Arc<Program>>],
        devices: &[Device],
        code: Code,
    ) -> (Vec<SimulatedSide>, Vec<Finding>) {
        let (mut sides, mut findings) = (Vec::new(), Vec::new());
        let mut seen: HashMap<&str, Span> = HashMap::new();
        for (at, simulated) in written.iter().enumerate() {
            let Some(name) = &simulated.device else { continue };
            if let Some(first) = seen.insert(&name.text, name.span) {
                let message = format!("device `{}` has a ladder already", name.text);
                let finding = Finding::new(Code::DuplicateName, name.span, message);
                let finding = finding.related(first, "the other one");
                findings.push(finding.help("name all its ladder files in one `[[simulated]]`"));
                continue;
            }
            match modbus_device(name, devices, code) {
                Ok(device) => {
                    let program = programs.get(at).cloned().flatten();
                    sides.extend(program.map(|program| SimulatedSide {
                        device,
                        program,
                        period: simulated.period(),
                    }));
                }
                Err(finding) => findings.push(finding),
            }
        }
        (sides, findings)
    }
}

fn modbus_device(name: &Text, devices: &[Device], code: Code) -> Result<DeviceId, Finding> {
    let found = devices.iter().find(|device| device.name == name.text);
    let is_modbus = |device: &&Device| matches!(device.driver, DriverSettings::Modbus(_));
    if let Some(device) = found.filter(is_modbus) {
        return Ok(device.id);
    }
    let message = match found {
        Some(_) => format!("device `{}` has no registers: it is not on Modbus", name.text),
        None => format!("no device of the controller file is called `{}`", name.text),
    };
    let finding = Finding::new(code, name.span, message);
    let names: Vec<&str> =
        devices.iter().filter(is_modbus).map(|device| device.name.as_str()).collect();
    Err(match names.as_slice() {
        [] => finding.help("only a Modbus device of a controller file has registers").or_omit(),
        names => finding.help(one_of("its Modbus devices are", names.iter().copied())),
    })
}

/// Reads all `[[simulated]]` tables of a controller file or of a test file.
pub fn read_in(root: &mut Table<'_>) -> Vec<WrittenSimulated> {
    let explained = key(
        "simulated",
        "The own side of a Modbus device, as a ladder, for `rungd test` and `rungd sim`.",
    );
    root.tables(explained, "a device's own side").into_iter().map(read_one).collect()
}

fn read_one(mut table: Table<'_>) -> WrittenSimulated {
    table.require("device", "\"drive1\"");
    table.require("ladder", "[\"drive.toml\"]");
    let device = table.string(
        key("device", "The field device of the controller, by its name.").holds(Slot::Device),
    );
    let ladder = key(
        "ladder",
        "The ladder files of the device, relative to this file. Its holding register 0 is MHR1 \
         there, its input register 0 MIR1, its coil 0 MC1, its discrete input 0 MI1.",
    )
    .holds(Slot::DeviceLadder);
    let period = key("period", "The time between two scans of this ladder; 10ms if not given.");
    let side = WrittenSideLadder::read(&mut table, ladder, period);
    table.finish();
    WrittenSimulated { device, side }
}
