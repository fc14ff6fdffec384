//! The controller file: its keys as written, and the settings made from them.
//!
//! [`read`] makes a [`WrittenController`] from the file's text. From that and the program of the
//! ladders, [`resolve_controller`] makes a [`Controller`] for the daemon. Each driver has a folder
//! with its keys, its points and their findings. The settings' types belong to the drivers
//! (`io::NAME::settings`). This module does no I/O: only run time shows whether a port is free or a
//! priority is granted.

pub mod alarms;
mod claims;
pub mod device;
mod doubts;
mod exchanged_operands;
pub mod log;
mod memory;
pub(crate) mod modbus_server;
pub mod operator;
mod outputs;
pub mod panel;
pub(crate) mod realtime;
pub mod record;
mod resolver;
pub mod retain;
mod retain_stages;
mod retain_tags;
mod settings;
pub mod side_ladder;
mod simulated_device;
pub mod simulated_side;
pub mod test_settings;
pub mod user;
pub mod watch;
pub mod web;
mod wired;
pub mod written;

use device::MapNames;
pub use outputs::{OUTPUT_UNKNOWN, OutputRules, OutputState};
use resolver::{AllowedSpaces, SettingsResolver};
pub use settings::Controller;
use side_ladder::SidePrograms;
use simulated_side::WrittenSimulated;
use watch::WrittenWatch;
use written::WrittenController;
pub use written::read;
pub use written::{read_within, shape};

use rungd_base::progress::{Progress, UNASKED};
use rungd_engine::isa::{BitSpace, NumberRanges, Space};
use rungd_language::resolve::program::{Program, Tag};
use rungd_language::resolve::range::Range;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::span::FileId;

/// Resolves a controller file against the program of its ladders. The result can be used only if
/// no finding is an error; otherwise parts may be missing.
pub fn resolve_controller(
    written: &WrittenController,
    program: &Program,
) -> (Controller, Vec<Finding>) {
    let programs = LoadedPrograms { program, sides: &SidePrograms::default() };
    resolve_controller_within(written, programs, &UNASKED)
}

/// The programs of a controller file.
#[derive(Clone, Copy)]
pub(crate) struct LoadedPrograms<'a> {
    /// The program of its ladders.
    pub program: &'a Program,
    /// The ladders beside it.
    pub sides: &'a SidePrograms,
}

/// As [`resolve_controller`], for a load that its caller may end. If the load must end, parts and
/// findings are missing.
pub(crate) fn resolve_controller_within(
    written: &WrittenController,
    LoadedPrograms { program, sides: side_programs }: LoadedPrograms<'_>,
    progress: &Progress,
) -> (Controller, Vec<Finding>) {
    let mut resolver = SettingsResolver { scope: program.scope(), findings: Vec::new(), progress };
    let outputs = [Space::Bit(BitSpace::Y)];
    let wanted = AllowedSpaces { spaces: &outputs, words: "outputs (Y)", code: Code::Controller };
    let outputs_on = resolver.ranges(&written.outputs.on, &wanted);
    let outputs_hold = resolver.ranges(&written.outputs.hold, &wanted);
    let wanted = AllowedSpaces {
        spaces: &Space::RETAINABLE,
        words: "data and structures (C, MC, MI, V, D, R, MHR, MIR, CT, T, N)",
        code: Code::RetainRange,
    };
    let mut retain = resolver.ranges(&written.retain.ranges, &wanted);
    let tags = &written.retain.tags;
    retain.extend(retain_tags::resolve(tags, program, progress, &mut resolver.findings));
    let stages = &written.retain.stages;
    let retained_stages = retain_stages::resolve(stages, program, &mut resolver.findings);
    resolver.held_and_on(&outputs_hold, &outputs_on);
    let period = written.scan.period.value;
    let names = MapNames { scope: resolver.scope, ladders: side_programs, period };
    let devices = device::resolve(&written.devices, names, progress, &mut resolver.findings);
    let (sides, found) = WrittenSimulated::resolve(
        &written.simulated,
        &side_programs.simulated,
        &devices,
        Code::Controller,
    );
    // Only if no device is missing: a device that has a mistake may be the one that is named.
    resolver.findings.extend(found.into_iter().filter(|_| devices.len() == written.devices.len()));
    let mut retained = NumberRanges::default();
    for (at, range) in progress.during(&retain).enumerate() {
        retained.add(range.numbers(), at);
    }
    let groups = program.tags.iter().filter_map(Tag::alarm_group);
    let groups = groups.chain(written.watches.iter().filter_map(WrittenWatch::group)).collect();
    let terms = web::PanelTerms { retained: &retained, period, groups };
    let web = web::resolve(&written.web, &terms, &mut resolver);
    let operator = written.operator.as_ref().map(|operator| operator.settings.clone());
    let realtime = written.realtime.resolve(period, &mut resolver.findings);
    let controller = Controller {
        period,
        watchdog_ms: written.scan.watchdog_ms,
        realtime,
        outputs_on,
        outputs_hold,
        retain,
        retained_stages,
        retention: written.retain.retention.clone(),
        modbus: written
            .modbus_server
            .as_ref()
            .map(|server| resolver.modbus(server, &program.sizes)),
        rules: resolver.rules(&written.rules),
        devices,
        sides,
        operator: operator.unwrap_or_default(),
        record: written.record.clone(),
        web,
        watches: watch::resolve(&written.watches, program, &mut resolver),
        alarms: written.alarms.clone(),
        log: written.log.clone(),
        probation_ms: written.probation_ms,
    };
    resolver.compare(written, &controller, program);
    (controller, resolver.findings)
}

impl Controller {
    /// The settings of a program without a controller file.
    pub fn usual(program: &Program) -> Controller {
        resolve_controller(&written::defaults(FileId(0)), program).0
    }
}

impl SettingsResolver<'_> {
    /// Reports ranges of outputs that are to be held and to be ON.
    fn held_and_on(&mut self, held: &[Range], on: &[Range]) {
        let mut outputs = NumberRanges::default();
        for (at, on) in self.progress.during(on).enumerate() {
            outputs.add(on.numbers(), at);
        }
        for held in self.progress.during(held) {
            if let Some(on) = outputs.first_in(held.numbers()).map(|at| &on[at]) {
                let message = format!("`{held}` is to be held, and `{on}` to be ON");
                let finding = Finding::new(Code::Controller, held.span, message);
                self.findings.push(finding.related(on.span, "ON here").or_omit());
            }
        }
    }

    /// Adds the findings about parts of the file that do not fit each other or the program. Looks
    /// between its steps whether the load must end.
    fn compare(&mut self, written: &WrittenController, controller: &Controller, program: &Program) {
        let progress = self.progress;
        self.findings.extend(doubts::doubts(written, controller, program, progress));
        if progress.is_over() {
            return;
        }
        self.findings.extend(claims::moved_twice(controller));
        self.findings.extend(device::moved_twice(controller));
        // Only if no device is missing: a device that is missing after an error may receive the Y.
        if controller.devices.len() == written.devices.len() && !progress.is_over() {
            self.findings.extend(device::unmapped_outputs(controller, program));
        }
    }
}
