//! The parts of a start that may wait for a disk, and that a signal ends: the places of the
//! sockets, retentive memory and the file of alarms.
//!
//! Called by the shell before the first scan. `start_wait` tells what such a part waits for.

use std::path::Path;

use super::alarm_file::AlarmFile;
use super::config::ControllerSetup;
use super::failure::StartFailure;
use super::operator_server;
use super::retain::{self, RestoredFile, RetainSettings};
use super::signals::ProcessHost;
use super::start_wait::StartPart;
use rungd_engine::Engine;

/// The places of the sockets, and an engine with the file of retentive memory from which it was
/// restored, if there is one; and the file of alarms.
pub(super) struct StartParts {
    pub sockets: Vec<operator_server::SocketClaim>,
    pub engine: Engine,
    pub retained: Option<RestoredFile>,
    pub alarms: AlarmFile,
}

/// Does these parts; `None` if a signal came first. `runs_cold`: the option of the command line.
///
/// # Errors
/// A different process owns a socket's place or the file.
pub(super) fn start_parts(
    host: &mut ProcessHost,
    setup: &ControllerSetup,
    runs_cold: Option<bool>,
    engine: Engine,
) -> Option<Result<StartParts, StartFailure>> {
    // Before the file of retentive memory is made, so that a refused start leaves no file.
    let sockets = match claimed(host, setup)? {
        Ok(sockets) => sockets,
        Err(failure) => return Some(Err(failure)),
    };
    let wanted = setup.retain.clone().map(|wanted| RetainSettings {
        runs_cold: runs_cold.unwrap_or(wanted.runs_cold),
        has_operator: !sockets.is_empty(),
        ..wanted
    });
    let (engine, retained) = match restored(host, wanted, engine)? {
        Ok(restored) => restored,
        Err(failure) => return Some(Err(failure)),
    };
    let place = AlarmFile::place(Path::new(&setup.controller));
    let part = StartPart::Alarms(place.display().to_string());
    let alarms = host.unless_stopped(part, move || AlarmFile::read(place))?;
    Some(Ok(StartParts { sockets, engine, retained, alarms }))
}

/// Claims the places of the sockets; `None` if a signal came first.
fn claimed(
    host: &mut ProcessHost,
    setup: &ControllerSetup,
) -> Option<Result<Vec<operator_server::SocketClaim>, StartFailure>> {
    let (specs, controller) = (setup.operator.clone(), setup.controller.clone());
    let part = StartPart::Sockets(controller.clone());
    host.unless_stopped(part, move || operator_server::claim(&specs, &controller))
}

type RestoredEngine = Result<(Engine, Option<RestoredFile>), StartFailure>;

/// Restores retentive memory, if the controller has any; `None` if a signal came first.
fn restored(
    host: &mut ProcessHost,
    wanted: Option<RetainSettings>,
    mut engine: Engine,
) -> Option<RestoredEngine> {
    let Some(wanted) = wanted else { return Some(Ok((engine, None))) };
    let part = StartPart::Memory(wanted.path.display().to_string());
    host.unless_stopped(part, move || {
        let opened = retain::begin(&wanted, &mut engine)?;
        Ok((engine, Some(opened)))
    })
}
