//! Reads a program, prepares its swap (the plan and the package), and lists the changed settings:
//! those that take effect with the swap, and those that need a restart.
//!
//! Called by `daemon::reload` on a thread where it may take long. Nothing here touches the running
//! program.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use crate::daemon::config::{self, ControllerSetup, LoadWarning, RunningProgram};
use crate::daemon::narration::Narration;
use crate::daemon::systemd::fault_too_late;
use rungd_base::duration_text::{duration_text, period_text};
use rungd_base::progress::Progress;
use rungd_config::controller::device::Device;
use rungd_config::controller::web::WebOperand;
use rungd_engine::Engine;
use rungd_engine::isa::Address;
use rungd_io::modbus::settings::ModbusServerSettings;
use rungd_io::plant::settings::InputRule;
use rungd_language::source::render::Style;
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::{CarriedWatches, Package, PackageParts, SafeState, Taped};
use rungd_state::reload::{self, LoweredProgram, OTHER_DEVICES, OTHER_SIZES, ReloadPlan, WARNING};

/// A program that is ready for its swap.
pub(super) struct ReadyProgram {
    pub running: Arc<RunningProgram>,
    pub plan: ReloadPlan,
    pub package: Box<Package<Taped>>,
}

/// Reads and checks the files; the text of `Err` contains all findings. The files must keep the
/// sizes of memory, the devices and their cells, as in `first`, the first program of the process.
pub(super) fn read(
    path: &Path,
    first: &RunningProgram,
    progress: &Progress,
) -> Result<RunningProgram, String> {
    let style = Style { color: false, deny_warnings: false };
    let loaded = config::load(path, style, progress);
    let (program, setup) = loaded.map_err(config::LoadFailure::text)?;
    let (symbols, needed) = (&setup.symbols, &first.setup.symbols);
    if symbols.names.devices != needed.names.devices {
        return Err(format!("{}: {OTHER_DEVICES}", setup.controller));
    }
    if symbols.layout.sizes() != needed.layout.sizes() {
        return Err(format!("{}: {OTHER_SIZES}", setup.controller));
    }
    let wired = first.setup.devices.iter().flat_map(Device::wired);
    if let Some(why) = reload::misfit(wired, needed, symbols) {
        return Err(format!("{}: {why}", setup.controller));
    }
    Ok(RunningProgram { program, setup })
}

impl ReadyProgram {
    /// Prepares `next` as the successor of `old`.
    pub fn of(
        old: &RunningProgram,
        next: Arc<RunningProgram>,
        generation: u32,
        latest: &Snapshot,
    ) -> ReadyProgram {
        let plan = ReloadPlan::new(side(old), side(&next));
        let mut engine = Engine::new(next.program.clone());
        engine.touch();
        let setup = &next.setup;
        let contents = PackageParts {
            transfer: plan.transfer.clone(),
            generation,
            tempo: setup.pace.tempo,
            asked: plan.asked(),
            watched: setup.watched.clone(),
            carried: carried(&old.setup.narration, &setup.narration),
            bits: setup.memory.bits,
            words: setup.memory.words,
            safe: setup.memory.safe.clone(),
        };
        let machine = Taped::new(engine).with_spares();
        let package = Box::new(Package::new(machine, contents, latest));
        ReadyProgram { running: next, plan, package }
    }
}

/// The changed settings of the controller file that take effect with the swap, one per line.
pub(super) fn settings(
    started: &ControllerSetup,
    old: &ControllerSetup,
    new: &ControllerSetup,
) -> Vec<String> {
    let (was, is) = (old.pace.tempo, new.pace.tempo);
    let elements =
        |setup: &ControllerSetup| setup.retain.as_ref().map_or(0, |wanted| wanted.plan.elements());
    let kept = if started.retain.is_some() { (elements(old), elements(new)) } else { (0, 0) };
    let said = [
        ("scan period", period_text(was.period_ns), period_text(is.period_ns)),
        ("scan watchdog", duration_text(was.watchdog_ns), duration_text(is.watchdog_ns)),
        ("retained elements", kept.0.to_string(), kept.1.to_string()),
        (
            "probation",
            duration_text(nanoseconds(old.probation)),
            duration_text(nanoseconds(new.probation)),
        ),
    ];
    let differ = said.into_iter().filter(|(_, was, is)| was != is);
    let mut lines: Vec<_> = differ.map(|(what, was, is)| format!("{what} {was} → {is}")).collect();
    let ranges =
        |setup: &ControllerSetup| setup.retain.as_ref().map_or(String::new(), |r| r.plan.ranges());
    if started.retain.is_some() && ranges(old) != ranges(new) {
        let say = |setup: &ControllerSetup| Some(ranges(setup)).filter(|said| !said.is_empty());
        let (was, is) = (say(old), say(new));
        let (was, is) = (was.as_deref().unwrap_or("none"), is.as_deref().unwrap_or("none"));
        lines.push(format!("retained ranges {was} → {is}"));
    }
    lines.extend(safe_values(&old.memory.safe, &new.memory.safe));
    lines.extend(pages(old, new));
    if let (Some(was), Some(is)) = (&old.modbus, &new.modbus) {
        lines.extend(modbus(was, is));
    }
    let is_like = |(was, is): (&InputRule, &InputRule)| was.is_like(is);
    let mut rules = old.rules.iter().zip(&new.rules);
    if old.rules.len() != new.rules.len() || !rules.all(is_like) {
        lines.push("the rules of `[[simulated-device]]`: changed".to_owned());
    }
    if !old.watches.is_like(&new.watches) {
        lines.push("the lines of `[[watch]]`: changed".to_owned());
    }
    if old.alarms != new.alarms {
        let word = |setup: &ControllerSetup| setup.alarms.shelves_critical;
        lines.push(format!("`[alarms] shelve-critical` {} → {}", word(old), word(new)));
    }
    lines.extend(old.log.changes(&new.log));
    lines.extend(warnings(&old.warnings, new));
    if was.watchdog_ns != is.watchdog_ns {
        let late = fault_too_late(is.watchdog_ns, sd_notify::watchdog_enabled());
        lines.extend(late.map(|sentence| format!("{WARNING}{sentence}")));
    }
    lines
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// The operands that pages may write from now on, and those that they may not write any more.
fn pages(old: &ControllerSetup, new: &ControllerSetup) -> Vec<String> {
    let listed = |setup: &ControllerSetup| -> Vec<Address> {
        setup.pages.write.iter().map(|operand| operand.address).collect()
    };
    let (was, is) = (&listed(old), &listed(new));
    let lacking = |from: &[Address], operands: &[Address], setup: &ControllerSetup| {
        let names = from.iter().filter(|address| !operands.contains(address));
        names.map(|address| setup.symbols.names.say(*address)).collect::<Vec<_>>()
    };
    let mut lines = Vec::new();
    for (names, what) in
        [(lacking(is, was, new), "may write"), (lacking(was, is, old), "may not write any more:")]
    {
        let more = names.len().saturating_sub(NAMES_MAX);
        let shown = names[..names.len() - more].join(", ");
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        if !names.is_empty() {
            lines.push(format!("`[web] write`: pages {what} {shown}{more}"));
        }
    }
    let other = |operand: &&WebOperand| {
        let before = old.pages.needed(operand.address);
        before.is_some_and(|role| role != operand.role)
    };
    lines.extend(new.pages.write.iter().filter(other).take(NAMES_MAX).map(|operand| {
        format!("`[web] write`: {} is for the role `{}`", operand.name, operand.role.word())
    }));
    lines.extend(
        new.pages.users.changes(&old.pages.users).into_iter().take(NAMES_MAX).map(
            |(user, was, is)| format!("the role of user {user}: {} → {}", was.word(), is.word()),
        ),
    );
    lines
}

/// The parts of `[modbus-server]` that change with the swap.
fn modbus(was: &ModbusServerSettings, is: &ModbusServerSettings) -> Vec<String> {
    let (old, new) = (&was.entries, &is.entries);
    let entries = old.len() != new.len()
        || !old.iter().zip(new).all(|(was, is)| was.is_like(is))
        || was.standard_map != is.standard_map;
    let (old, new) = (&was.lists, &is.lists);
    let lists = old.len() != new.len() || !old.iter().zip(new).all(|(was, is)| was.is_like(is));
    let copies = was.inputs != is.inputs || was.outputs != is.outputs;
    let parts = [
        ("the map", entries),
        ("the write lists", lists),
        ("`inputs` and `outputs`", copies),
        ("the units", was.units != is.units),
    ];
    let changed = parts.into_iter().filter(|(_, differs)| *differs);
    changed.map(|(part, _)| format!("{part} of `[modbus-server]`: changed")).collect()
}

/// The maximum number of operands in a line of a report.
const NAMES_MAX: usize = 10;

/// The maximum number of warnings of the check in a report.
const WARNINGS_MAX: usize = 20;

/// The warnings of the check that the running program does not have.
fn warnings(old: &[LoadWarning], new: &ControllerSetup) -> Vec<String> {
    let mut known: HashMap<&str, usize> = HashMap::new();
    old.iter().for_each(|warning| *known.entry(&warning.text).or_default() += 1);
    let mut is_new = |warning: &&LoadWarning| match known.get_mut(warning.text.as_str()) {
        Some(left) if *left > 0 => {
            *left -= 1;
            false
        }
        Some(_) | None => true,
    };
    let fresh: Vec<&LoadWarning> = new.warnings.iter().filter(|warning| is_new(warning)).collect();
    let line = |warning: &&LoadWarning| {
        let file = new.files.get(warning.span.file.0 as usize);
        let place = file.map_or_else(String::new, |file| {
            let before = file.text.as_bytes().iter().take(warning.span.start as usize);
            let line = before.filter(|byte| **byte == b'\n').count() + 1;
            format!("{}:{line}: ", file.name)
        });
        format!("{WARNING}{place}{}", warning.text)
    };
    let mut lines: Vec<String> = fresh.iter().take(WARNINGS_MAX).map(line).collect();
    let more = fresh.len().saturating_sub(WARNINGS_MAX);
    if more > 0 {
        lines.push(format!("{WARNING}and {more} more warnings: `rungd check` shows them"));
    }
    lines
}

/// The outputs whose safe value changed: one line for each run of neighbouring outputs with the
/// same change.
fn safe_values(old: &[SafeState], new: &[SafeState]) -> Vec<String> {
    let mut runs: Vec<(usize, usize, (SafeState, SafeState))> = Vec::new();
    for (y, values) in old.iter().copied().zip(new.iter().copied()).enumerate() {
        match runs.last_mut() {
            _ if values.0 == values.1 => {}
            Some((_, last, same)) if *last + 1 == y && *same == values => *last = y,
            _ => runs.push((y, y, values)),
        }
    }
    let say = |safe: SafeState| match safe {
        SafeState::Off => "OFF",
        SafeState::On => "ON",
        SafeState::Hold => "held",
    };
    let line = |(first, last, (was, is)): (usize, usize, (SafeState, SafeState))| {
        let which =
            if first == last { format!("Y{y}", y = first) } else { format!("Y{first}..Y{last}") };
        format!("{which} outside RUN {} → {}", say(was), say(is))
    };
    runs.into_iter().map(line).collect()
}

fn side(running: &RunningProgram) -> LoweredProgram<'_> {
    LoweredProgram { program: &running.program, symbols: &running.setup.symbols }
}

/// Pairs the watched alarms and tags of both programs by the tags' names.
fn carried(old: &Narration, new: &Narration) -> CarriedWatches {
    let places = |old: Vec<String>, new: Vec<String>| -> Vec<Option<u32>> {
        let mut first: HashMap<String, u32> = HashMap::new();
        for (at, name) in (0..).zip(old) {
            first.entry(name).or_insert(at);
        }
        new.iter().map(|name| first.get(name).copied()).collect()
    };
    let ((old_bits, old_words), (bits, words)) = (old.watched_names(), new.watched_names());
    CarriedWatches { bits: places(old_bits, bits), words: places(old_words, words) }
}

/// The settings that differ from those of the start, and that a reload does not apply.
pub(super) fn needs_restart(old: &ControllerSetup, new: &ControllerSetup) -> Vec<String> {
    let retain = |setup: &ControllerSetup| {
        let wanted = setup.retain.as_ref()?;
        Some((wanted.path.clone(), wanted.interval, wanted.runs_cold, wanted.budget))
    };
    // If `[retain]` is gone, the line about the ranges reports it.
    let retain_differs = new.retain.is_some() && retain(old) != retain(new);
    let modbus = |setup: &ControllerSetup| {
        let server = setup.modbus.as_ref()?;
        let times = (server.frame_timeout_ms, server.idle_timeout_ms);
        Some((server.listen, server.connections, times))
    };
    let differs = [
        ("`[log] statistics`", old.pace.statistics_every_ns != new.pace.statistics_every_ns),
        ("`[realtime]`", old.posture != new.posture),
        ("`[retain]` except its ranges, or the first `[retain]`", retain_differs),
        ("`[operator]`", old.operator != new.operator),
        ("`[record]`", old.record != new.record),
        (
            "`[modbus-server]` listen, connections and timeouts, or its presence",
            modbus(old) != modbus(new),
        ),
        ("`[[device]]`", old.devices_differ(new)),
        ("the first `[[simulated-device]]`", old.rules.is_empty() && !new.rules.is_empty()),
    ];
    let named = differs.into_iter().filter(|(_, differs)| *differs);
    named.map(|(name, _)| name.to_owned()).collect()
}
