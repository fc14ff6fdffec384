//! Binds the Modbus server at the start of a controller.
//!
//! Called by the shell, before the first scan: a port that is taken is an error of the start.

use std::time::Duration;

use super::config::ControllerSetup;
use super::failure::StartFailure;
use rungd_io::listening::cannot_listen;
use rungd_io::modbus;
use rungd_io::modbus::settings::ModbusServerSettings;
use rungd_runtime::Generations;
use rungd_runtime::exchange::Port;

/// Binds the server, with the map of the first program.
///
/// # Errors
/// It cannot listen at its address.
pub(super) async fn bind(
    settings: &ModbusServerSettings,
    setup: &ControllerSetup,
    port: &Port,
    patience: Duration,
) -> Result<(modbus::BoundModbusServer, Generations<modbus::ModbusMap>), StartFailure> {
    let listen = settings.listen;
    let limits = |word| setup.symbols.limits(word);
    let maps = Generations::new(modbus::ModbusMap::new(settings, &setup.symbols.layout, limits));
    let bound =
        modbus::BoundModbusServer::bind(settings.clone(), maps.clone(), port.clone(), patience);
    let server = bound.await.map_err(|error| {
        let other = "write another port in `[modbus-server] listen`";
        let about = cannot_listen(listen, &error, other);
        let controller = &setup.controller;
        let context = format!("{controller}: `[modbus-server]` cannot listen at {about}: {error}");
        StartFailure::Environment(anyhow::anyhow!(context))
    })?;
    Ok((server, maps))
}
