//! Warnings for settings that are valid but seldom intended. They need the settings and the
//! program.
//!
//! Called by `resolve_controller` once it has both. No settings are refused here.

use std::borrow::Cow;
use std::collections::HashMap;

use super::settings::Controller;
use super::written::WrittenController;
use rungd_base::progress::Progress;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRanges, Space};
use rungd_language::resolve::program::{Instruction, Program};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, pair};

/// The longest period without a warning.
const PERIOD_MAX: ScanPeriod = ScanPeriod::of_ms(1000);

/// What to do about a shorter one.
const HELP: &str = "measure what the machine does: docs/running.md, real-time posture; or scan \
                    each millisecond: `{}`";

/// The shortest period without a warning.
const PERIOD_MIN: ScanPeriod = ScanPeriod::of_ms(1);

/// The warnings of this file.
pub(super) fn doubts(
    written: &WrittenController,
    controller: &Controller,
    program: &Program,
    progress: &Progress,
) -> Vec<Finding> {
    let mut findings = held_but_reset(controller, program, progress);
    findings.extend(long_period(written, controller));
    findings.extend(short_period(written, controller));
    findings.extend(cold_for_ever(written, controller));
    findings
}

/// The warning for a long period, for example `10m` instead of `10ms`.
fn long_period(written: &WrittenController, controller: &Controller) -> Option<Finding> {
    if controller.period <= PERIOD_MAX {
        return None;
    }
    let seconds = controller.period.us() as f64 / 1e6;
    let message = format!("scans are {seconds} s apart");
    let finding = Finding::new(Code::LongPeriod, written.scan.period.span, message);
    let finding = finding.label("an input must last longer than this to be seen");
    let period = pair("period = \"10ms\"").possible();
    Some(finding.help(advise("most plants need milliseconds: `{}`", [period])))
}

/// The warning for a period that an ordinary machine does not keep.
fn short_period(written: &WrittenController, controller: &Controller) -> Option<Finding> {
    if controller.period >= PERIOD_MIN || written.scan.in_virtual_time {
        return None;
    }
    let message = format!("a scan every {} asks much of the machine", controller.period);
    let finding = Finding::new(Code::ShortPeriod, written.scan.period.span, message);
    let finding = finding.label("timers still count whole milliseconds");
    let period = pair("period = \"1ms\"").possible();
    Some(finding.help(advise(HELP, [period])))
}

/// The warnings for outputs whose `hold` a termination pass overrides.
fn held_but_reset(controller: &Controller, program: &Program, progress: &Progress) -> Vec<Finding> {
    let mut found = Vec::new();
    if controller.outputs_hold.is_empty() {
        return found;
    }
    let drivers = drivers(program);
    let mut names: HashMap<Address, Cow<'_, str>> = HashMap::new();
    for named in &program.operands {
        names.entry(named.address).or_insert_with(|| named.name());
    }
    let mut outputs = NumberRanges::default();
    for held in &controller.outputs_hold {
        let new = outputs.add(held.numbers(), 0).into_iter();
        for y in progress.during(new.flat_map(|(first, last)| first..=last)) {
            let output = Bit::Space(BitSpace::Y, y);
            let Some(driver) = drivers.get(&output) else { continue };
            let name = driver.mnemonic.spec().name;
            let called = names.get(&Address::Bit(output));
            let called = called.map_or_else(|| output.to_string(), |name| name.to_string());
            let message = format!(
                "`{called}` is in `hold`, but a stop turns OFF every output that `{name}` drives"
            );
            let finding = Finding::new(Code::HeldButReset, driver.span, message)
                .label("OFF at every stop; held only in FAULT")
                .related(held.span, "held here")
                .help(
                    "drive a held output with SET and RST; or list it in `on`; or remove it from \
                     `hold`, then it is OFF",
                );
            found.push(finding);
        }
    }
    found
}

/// The first instruction that drives each bit and that a termination pass overrides.
fn drivers(program: &Program) -> HashMap<Bit, &Instruction> {
    let mut drivers = HashMap::new();
    for (_, one) in program.instructions() {
        let written = one.written_bit();
        if let Some(bit) = written.filter(|_| one.mnemonic.spec().termination.switches_off()) {
            drivers.entry(bit.value).or_insert(one);
        }
    }
    drivers
}

/// The warning for a controller that waits in STOP for a command, but has no socket to receive it.
///
/// There is no warning for a file that only does not name a socket: its place may come from the
/// service or from `RUNGD_SOCKET`, which are not in the file. If there is no socket at run time,
/// the log reports that.
fn cold_for_ever(written: &WrittenController, controller: &Controller) -> Option<Finding> {
    let ranges = &controller.retain;
    let retains = ranges.iter().any(|range| Space::RETAINABLE.contains(&range.space))
        || !controller.retained_stages.is_empty();
    if controller.operator.enabled || controller.retention.runs_cold || !retains {
        return None;
    }
    let (place, range) = (
        written.operator.as_ref()?.span,
        written
            .retain
            .ranges
            .iter()
            .chain(&written.retain.tags)
            .chain(&written.retain.stages)
            .next()?
            .span,
    );
    let message = "a start that finds nothing to restore waits in STOP for `rungd mode run`, and \
                   there is no socket for it";
    let finding = Finding::new(Code::ColdForEver, place, message)
        .label("without an operator's socket")
        .related(range, "retained here");
    Some(
        finding
            .help(
                "write `[retain] cold-start = \"run\"`; or start it the first time with `rungd run \
         --cold-start run FILE`; or enable the socket",
            )
            .fix(FixEdit::Under { table: "retain", pair: "cold-start = \"run\"".to_owned() }),
    )
}
