//! The controller file: its keys as written, and the settings that they make.
//!
//! [`read`] takes the file's text; [`resolve_controller`] takes what it gave and the program of the
//! ladders, and gives [`Controller`] to the daemon. One folder a driver: its keys, its points, what
//! is found wrong with them. The settings' types are the drivers' own (`io::NAME::settings`). Does
//! no I/O: whether a port is free or a priority is granted shows at run time.

mod claims;
pub mod device;
pub mod modbus_server;
pub mod operator;
pub mod realtime;
pub mod retain;
pub mod written;

use device::Device;
use operator::Operator;
use realtime::Realtime;
use retain::Retention;
use written::{DeviceRule, WrittenController};
pub use written::{read, shape};

use crate::io::modbus::settings::Modbus;
use crate::io::simulated::settings::{Motion, Rule};
use crate::isa::{Address, Bit, BitSpace, WordSpace};
use crate::resolve::program::Program;
use crate::resolve::range::{Range, Space, resolve_range};
use crate::resolve::scope::Scope;
use crate::source::finding::{Code, Finding};
use crate::source::reader::Text;
use crate::source::span::Located;

/// What a controller file asks for, beside its ladders.
#[derive(Clone, Debug)]
pub struct Controller {
    /// Scan period, ms; at least 1.
    pub period_ms: u32,
    /// One scan longer than this is a fault, ms; at least 1.
    pub watchdog_ms: u32,
    /// What is asked of the operating system.
    pub realtime: Realtime,
    /// Outputs that are ON in the safe state: ranges of Y.
    pub outputs_on: Vec<Range>,
    /// Outputs that keep their state: ranges of Y.
    pub outputs_hold: Vec<Range>,
    /// What survives a restart.
    pub retain: Vec<Range>,
    /// How it is kept.
    pub retention: Retention,
    /// The Modbus server, if there is one.
    pub modbus: Option<Modbus>,
    /// Rules by which inputs move; at most one an input.
    pub rules: Vec<Rule>,
    /// Field devices.
    pub devices: Vec<Device>,
    /// The operator's socket.
    pub operator: Operator,
    /// How often statistics are logged, ms; 0: never.
    pub statistics_ms: u32,
    /// How long a reloaded program is on trial, ms; 0: not at all.
    pub probation_ms: u32,
}

/// What may survive a restart: bits and words that only programs and clients write, and
/// structures.
const RETAINABLE: [Space; 10] = [
    Space::Bit(BitSpace::C),
    Space::Bit(BitSpace::Mc),
    Space::Bit(BitSpace::Mi),
    Space::Word(WordSpace::V),
    Space::Word(WordSpace::D),
    Space::Word(WordSpace::Mhr),
    Space::Word(WordSpace::Mir),
    Space::Counter,
    Space::Timer,
    Space::Sensaphone,
];

/// Resolves a controller file against the program of its ladders. Whether it can be used is told
/// by the findings: with an error among them, parts may be missing.
pub fn resolve_controller(
    written: &WrittenController,
    program: &Program,
) -> (Controller, Vec<Finding>) {
    let mut resolver = Resolver { scope: Scope::of(program), findings: Vec::new() };
    let outputs = [Space::Bit(BitSpace::Y)];
    let wanted = Wanted { spaces: &outputs, words: "outputs (Y)", code: Code::Controller };
    let outputs_on = resolver.ranges(&written.outputs_on, &wanted);
    let outputs_hold = resolver.ranges(&written.outputs_hold, &wanted);
    let wanted = Wanted {
        spaces: &RETAINABLE,
        words: "data and structures (C, MC, MI, V, D, MHR, MIR, CT, T, N)",
        code: Code::RetainRange,
    };
    let retain = resolver.ranges(&written.retain.ranges, &wanted);
    let interval = &written.retain.interval_ms;
    let retention = Retention {
        interval_ms: resolver.at_least_one("interval", interval),
        ..retain::resolve(&written.retain, &mut resolver.findings)
    };
    for held in &outputs_hold {
        if let Some(on) = outputs_on.iter().find(|on| on.overlaps(held)) {
            let message = format!("`{held}` is to be held, and `{on}` to be ON");
            let finding = Finding::new(Code::Controller, held.span, message);
            resolver.findings.push(finding.related(on.span, "ON here"));
        }
    }
    let operator = written.operator.as_ref();
    let operator = operator.map(|table| operator::resolve(table, &mut resolver.findings));
    let scan = &written.scan;
    let controller = Controller {
        period_ms: resolver.at_least_one("period", &scan.period_ms),
        watchdog_ms: resolver.at_least_one("watchdog", &scan.watchdog_ms),
        realtime: written.realtime.clone(),
        outputs_on,
        outputs_hold,
        retain,
        retention,
        modbus: written
            .modbus_server
            .as_ref()
            .map(|server| resolver.modbus(server, &program.sizes)),
        rules: resolver.rules(&written.rules),
        devices: device::resolve(&written.devices, &resolver.scope, &mut resolver.findings),
        operator: operator.unwrap_or_default(),
        statistics_ms: written.log.statistics_ms.unsigned_abs(),
        probation_ms: written.probation_ms.unsigned_abs(),
    };
    resolver.findings.extend(claims::moved_twice(&controller));
    resolver.findings.extend(device::moved_twice(&controller));
    if controller.devices.len() == written.devices.len() {
        // Else a Y may go out by the device that is missing.
        resolver.findings.extend(device::unmapped_outputs(&controller, program));
    }
    (controller, resolver.findings)
}

/// What ranges may be of.
pub(super) struct Wanted<'a> {
    pub spaces: &'a [Space],
    pub words: &'static str,
    pub code: Code,
}

/// What resolving needs, and what it finds.
pub(super) struct Resolver {
    pub scope: Scope,
    pub findings: Vec<Finding>,
}

impl Resolver {
    fn ranges(&mut self, texts: &[Text], wanted: &Wanted<'_>) -> Vec<Range> {
        texts.iter().filter_map(|text| self.range(text, wanted)).collect()
    }

    pub(super) fn range(&mut self, text: &Text, wanted: &Wanted<'_>) -> Option<Range> {
        let range = match resolve_range(&self.scope, text) {
            Ok(range) => range,
            Err(finding) => {
                self.findings.push(finding);
                return None;
            }
        };
        if !wanted.spaces.contains(&range.space) {
            let message = format!("`{range}`: only {} can stand here", wanted.words);
            self.findings.push(Finding::new(wanted.code, text.span, message));
            return None;
        }
        Some(range)
    }

    pub(super) fn at_least_one(&mut self, key: &str, ms: &Located<i32>) -> u32 {
        if ms.value < 1 {
            let message = format!("`{key}` is at least 1ms");
            let finding = Finding::new(Code::OutOfRange, ms.span, message);
            self.findings.push(finding.help(format!("write `{key} = \"10ms\"`")));
        }
        ms.value.max(1).unsigned_abs()
    }

    fn rules(&mut self, rules: &[DeviceRule]) -> Vec<Rule> {
        let mut devices: Vec<Rule> = Vec::new();
        for rule in rules {
            let Some(device) = self.rule(rule) else { continue };
            if let Some(other) = devices.iter().find(|other| other.input == device.input) {
                let message = format!("a second rule for `X{}`", device.input);
                let finding = Finding::new(Code::Controller, rule.span, message);
                self.findings.push(finding.related(other.span, "the first one"));
                continue;
            }
            devices.push(device);
        }
        devices
    }

    fn rule(&mut self, rule: &DeviceRule) -> Option<Rule> {
        let input = self.bit(rule.input.as_ref());
        let while_on = self.bit(rule.while_on.as_ref());
        let motion = self.motion(rule);
        let Bit::Space(BitSpace::X, input) = input? else {
            let span = rule.input.as_ref().map_or(rule.span, |input| input.span);
            let finding = Finding::new(Code::Controller, span, "a simulated device moves an input");
            self.findings.push(finding.help("name an X bit, or a tag of one"));
            return None;
        };
        Some(Rule { input, motion: motion?, while_on, invert: rule.invert, span: rule.span })
    }

    fn motion(&mut self, rule: &DeviceRule) -> Option<Motion> {
        let bit = self.bit(rule.follows.as_ref());
        let pulse_keys = [&rule.pulse_ms, &rule.every_ms, &rule.offset_ms];
        let follow_keys = [&rule.after_ms, &rule.release_ms];
        let given = |keys: &[&Option<Located<i32>>]| keys.iter().find_map(|k| k.as_ref()).cloned();
        let stray = match (&rule.follows, given(&pulse_keys), given(&follow_keys)) {
            (Some(_), Some(pulse), _) => Some(pulse),
            (None, Some(_), Some(follow)) => Some(follow),
            _ => None,
        };
        let help =
            "either `pulse` and `every` (and `offset`), or `follows` (and `after`, `release`)";
        if let Some(stray) = stray {
            let message = "a device pulses or follows, not both";
            self.findings.push(Finding::new(Code::Controller, stray.span, message).help(help));
            return None;
        }
        let ms = |value: &Option<Located<i32>>| value.as_ref().map(|ms| ms.value.unsigned_abs());
        if rule.follows.is_some() {
            let after_ms = ms(&rule.after_ms).unwrap_or(0);
            let release_ms = ms(&rule.release_ms).unwrap_or(after_ms);
            return Some(Motion::Follow { bit: bit?, after_ms, release_ms });
        }
        let (Some(width_ms), Some(every_ms)) = (ms(&rule.pulse_ms), ms(&rule.every_ms)) else {
            let message = "a rule that does not say how the input moves";
            self.findings.push(Finding::new(Code::MissingKey, rule.span, message).help(help));
            return None;
        };
        if width_ms == 0 || width_ms >= every_ms {
            let span = rule.pulse_ms.as_ref().map_or(rule.span, |pulse| pulse.span);
            let message = "a pulse is longer than nothing and shorter than `every`";
            self.findings.push(Finding::new(Code::Controller, span, message));
            return None;
        }
        let offset_ms = ms(&rule.offset_ms).unwrap_or(0);
        Some(Motion::Pulse { width_ms, every_ms, offset_ms })
    }

    fn bit(&mut self, name: Option<&Text>) -> Option<Bit> {
        let name = name?;
        let message = match self.scope.address(&name.text) {
            Ok(Address::Bit(bit)) => return Some(bit),
            Ok(_) => format!("`{}` is not a bit", name.text),
            Err(message) => message,
        };
        self.findings.push(Finding::new(Code::Controller, name.span, message));
        None
    }
}
