//! A program made ready for its swap: plan, package, and what of the controller file must wait.
//!
//! Done on a thread that may take its time. Nothing here touches what runs.

use std::path::Path;
use std::sync::Arc;

use super::Running;
use crate::daemon::config::{self, Setup};
use crate::daemon::narration::Narration;
use crate::engine::Engine;
use crate::isa::MemorySizes;
use crate::reload::{Plan, Side};
use crate::runtime::exchange::Snapshot;
use crate::runtime::{Carried, Contents, Package};
use crate::source::render::Style;

/// A program, ready to be handed in.
pub(super) struct Ready {
    pub running: Arc<Running>,
    pub plan: Plan,
    pub package: Box<Package<Engine>>,
}

/// What the files say now; the text of `Err` has all findings.
pub(super) fn read(path: &Path, sizes: &MemorySizes) -> Result<Running, String> {
    let style = Style { color: false, deny_warnings: false };
    let loaded = config::load(path, style).map_err(|failure| format!("{failure:#}"))?;
    let (program, setup) = loaded?;
    if setup.symbols.layout.sizes() != sizes {
        return Err(format!(
            "{}: `[memory]` says other sizes than the running program has: they need a restart, \
             and nothing is reloaded until then",
            setup.controller
        ));
    }
    Ok(Running { program, setup })
}

impl Ready {
    /// A program behind another one.
    pub fn of(old: &Running, next: Arc<Running>, generation: u32, latest: &Snapshot) -> Ready {
        let plan = Plan::new(side(old), side(&next));
        let mut engine = Engine::new(next.program.clone());
        engine.touch();
        let setup = &next.setup;
        let contents = Contents {
            transfer: plan.transfer.clone(),
            generation,
            asked: plan.asked(),
            watched: setup.watched.clone(),
            carried: carried(&old.setup.narration, &setup.narration),
            bits: setup.memory.bits,
            words: setup.memory.words,
            safe: setup.memory.safe.clone(),
        };
        let package = Box::new(Package::new(engine, contents, latest));
        Ready { running: next, plan, package }
    }
}

fn side(of: &Running) -> Side<'_> {
    Side { program: &of.program, symbols: &of.setup.symbols }
}

/// Alarms and logged tags go on by their tags.
fn carried(old: &Narration, new: &Narration) -> Carried {
    let place = |of: &[String], name: &String| {
        of.iter().position(|other| other == name).map(|at| at as u32)
    };
    let ((old_bits, old_words), (bits, words)) = (old.watched_names(), new.watched_names());
    Carried {
        bits: bits.iter().map(|name| place(&old_bits, name)).collect(),
        words: words.iter().map(|name| place(&old_words, name)).collect(),
    }
}

/// What the controller file says otherwise than at the start, and a reload does not apply.
pub(super) fn needs_restart(old: &Setup, new: &Setup) -> Vec<String> {
    let pace = |of: &Setup| (of.pace.period_ns, of.pace.watchdog_ns);
    let retain = |of: &Setup| {
        let wanted = of.retain.as_ref()?;
        Some((wanted.path.clone(), wanted.interval, wanted.runs_cold, wanted.budget))
    };
    let modbus = |of: &Setup| {
        let server = of.modbus.as_ref()?;
        let times = (server.frame_timeout_ms, server.idle_timeout_ms);
        Some((server.listen, server.connections, times))
    };
    let differs = [
        ("`[scan]` period and watchdog", pace(old) != pace(new)),
        ("`[log] statistics`", old.pace.statistics_every_ns != new.pace.statistics_every_ns),
        ("`[realtime]`", old.posture != new.posture),
        ("`[retain]` but for its ranges, or whether there is one", retain(old) != retain(new)),
        ("`[operator]`", old.operator != new.operator),
        (
            "`[modbus-server]` listen, connections and timeouts, or whether there is one",
            modbus(old) != modbus(new),
        ),
        ("the first `[[simulated-device]]`", old.rules.is_empty() && !new.rules.is_empty()),
    ];
    let named = differs.into_iter().filter(|(_, differs)| *differs);
    named.map(|(name, _)| name.to_owned()).collect()
}
