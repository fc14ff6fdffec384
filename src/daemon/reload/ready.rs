//! A program made ready for its swap: plan, package, and what of the controller file must wait.
//!
//! Done on a thread that may take its time. Nothing here touches what runs.

use std::path::Path;
use std::sync::Arc;

use super::Running;
use crate::daemon::config::{self, Setup};
use crate::daemon::narration::Narration;
use crate::engine::Engine;
use crate::reload::{Plan, Side};
use crate::runtime::exchange::Snapshot;
use crate::runtime::{Carried, Contents, Package};
use crate::source::render::Style;

/// A program, ready to be handed in.
pub(super) struct Ready {
    pub running: Arc<Running>,
    pub plan: Plan,
    pub package: Box<Package<Engine>>,
    /// What of the controller file needs a restart.
    pub restart: Vec<String>,
}

impl Ready {
    /// What the files say now; the text of `Err` has all findings.
    pub fn of_files(
        started: &Running,
        old: &Running,
        generation: u32,
        latest: &Snapshot,
    ) -> Result<Ready, String> {
        let style = Style { color: false, deny_warnings: false };
        let path = Path::new(&old.setup.controller);
        let loaded = config::load(path, style).map_err(|failure| format!("{failure:#}"))?;
        let (program, setup) = loaded?;
        if old.setup.symbols.devices != setup.symbols.devices {
            return Err(format!(
                "{}: its devices are others than the running ones, or in another order: they need \
                 a restart, and nothing is reloaded until then",
                setup.controller
            ));
        }
        let (before, now) = (old.setup.symbols.layout.sizes(), setup.symbols.layout.sizes());
        if before != now {
            return Err(format!(
                "{}: `[memory]` says other sizes than the running program has: they need a \
                 restart, and nothing is reloaded until then",
                setup.controller
            ));
        }
        let restart = needs_restart(&started.setup, &setup);
        let next = Arc::new(Running { program, setup });
        Ok(Ready { restart, ..Ready::of(old, next, generation, latest) })
    }

    /// A program that is there already.
    pub fn of(old: &Running, next: Arc<Running>, generation: u32, latest: &Snapshot) -> Ready {
        let plan = Plan::new(side(old), side(&next));
        let mut engine = Engine::new(next.program.clone());
        engine.touch();
        let setup = &next.setup;
        let contents = Contents {
            transfer: plan.transfer.clone(),
            generation,
            watched: setup.watched.clone(),
            carried: carried(&old.setup.narration, &setup.narration),
            bits: setup.memory.bits,
            words: setup.memory.words,
            safe: setup.memory.safe.clone(),
        };
        let package = Box::new(Package::new(engine, contents, latest));
        Ready { running: next, plan, package, restart: Vec::new() }
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
fn needs_restart(old: &Setup, new: &Setup) -> Vec<String> {
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
        ("`[[device]]`", old.devices_differ(new)),
        ("the first `[[simulated-device]]`", old.rules.is_empty() && !new.rules.is_empty()),
    ];
    let named = differs.into_iter().filter(|(_, differs)| *differs);
    named.map(|(name, _)| name.to_owned()).collect()
}
