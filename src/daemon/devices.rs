//! Starts the field devices: makes drivers from the controller file's settings, and connects them
//! to the scan.
//!
//! This is the only module of the daemon that refers to every driver. The task of a device is in
//! `io::device`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::task::JoinSet;
use tokio::time::sleep;

use super::config::ControllerSetup;
use rungd_config::controller::device::{Device, DriverSettings as Settings};
use rungd_io::caught::caught;
use rungd_io::device;
use rungd_io::device::{DeviceHealth, DeviceKeeper, DeviceParts, Driver, Opener};
use rungd_io::gpio::{GpioOpener, KernelChips};
use rungd_io::ladder::RunningLadder;
use rungd_io::modbus_client::settings::{self as modbus, LinkSettings};
use rungd_io::modbus_client::{ModbusClient, RtuLines, TcpConnection};
use rungd_io::plant::RunningPlant;
use rungd_runtime::exchange::Port;
use rungd_runtime::field::DeviceEnds;
use rungd_runtime::say::say;
use rungd_runtime::wiring::Wiring;

/// Makes the health of each device, in order of their numbers.
pub(super) fn healths(devices: &[Device]) -> Vec<DeviceHealth> {
    let health = |device: &Device| {
        let (driver, peer) = match &device.driver {
            Settings::Modbus(client) => modbus(client),
            Settings::Gpio(lines) => ("gpio", lines.chip.to_string()),
            Settings::Simulated(_) => ("simulated", "this process".to_owned()),
            Settings::Ladder(_) => ("ladder", "this process".to_owned()),
        };
        DeviceHealth::new(&device.name, driver, peer)
    };
    devices.iter().map(health).collect()
}

fn modbus(client: &modbus::ClientSettings) -> (&'static str, String) {
    match &client.link {
        LinkSettings::Tcp(tcp) => ("modbus-tcp", tcp.peer.address.to_string()),
        LinkSettings::Rtu(line) => ("modbus-rtu", line.port.name()),
    }
}

/// The longest time that the first scan waits for the inputs of a device.
const INPUTS_MAX: Duration = Duration::from_secs(5);
/// The interval at which the start checks whether the inputs have arrived.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// Waits until every device has exchanged, so that the first scan sees the inputs. Otherwise an
/// input that is ON would be a rising edge in the second scan. The wait for a device is limited by
/// its `loss-after` and by [`INPUTS_MAX`].
pub(super) fn inputs(
    devices: &[Device],
    healths: &[DeviceHealth],
) -> impl Future<Output = ()> + use<> {
    let awaited = |device: &Device| {
        let patience = Duration::from_millis(device.loss_after_ms.into()).min(INPUTS_MAX);
        (patience, healths[device.id.0 as usize].clone())
    };
    let awaited: Vec<_> = devices.iter().map(awaited).collect();
    async move {
        let begun = Instant::now();
        let is_late = |patience: &Duration| begun.elapsed() > *patience;
        while !awaited.iter().all(|(patience, at)| at.has_exchanged() || is_late(patience)) {
            sleep(LOOK_EVERY).await;
        }
    }
}

/// The parts from which the devices' tasks are started.
pub(super) struct DeviceStarter<'a> {
    pub setup: &'a ControllerSetup,
    pub port: &'a Port,
    pub healths: &'a [DeviceHealth],
    pub stop: tokio::sync::watch::Receiver<bool>,
}

/// A device, with the cells that it is wired to.
#[derive(Clone, Copy)]
struct DeviceWiring<'a> {
    device: &'a Device,
    wiring: &'a Wiring,
}

impl DeviceStarter<'_> {
    /// Starts a task for each device.
    pub fn start(&self, ends: Vec<DeviceEnds>, tasks: &mut JoinSet<()>) {
        let devices = self.setup.devices.iter().zip(&self.setup.field);
        let mut lines = RtuLines::default();
        for ((device, wiring), ends) in devices.zip(ends) {
            let (name, points) = (&device.name, device.inputs.len() + device.outputs.len());
            say!(DEVICE, device = %name, points, "device {name}: {points} points");
            self.start_device(DeviceWiring { device, wiring }, ends, &mut lines, tasks);
        }
    }

    fn start_device(
        &self,
        wired: DeviceWiring,
        ends: DeviceEnds,
        lines: &mut RtuLines,
        tasks: &mut JoinSet<()>,
    ) {
        let device = wired.device;
        let ms = |ms: u32| Duration::from_millis(ms.into());
        match &device.driver {
            Settings::Modbus(client) => match &client.link {
                LinkSettings::Tcp(tcp) => {
                    let link = TcpConnection::new(*tcp, client.habits, ms(client.timeout_ms));
                    self.beside(ModbusClient::new(client, link), wired, ends, tasks);
                }
                LinkSettings::Rtu(line) => {
                    let link = lines.link(line, client.habits, ms(client.timeout_ms));
                    self.beside(ModbusClient::new(client, link), wired, ends, tasks);
                }
            },
            Settings::Simulated(plant) => {
                self.beside(RunningPlant::new(plant), wired, ends, tasks);
            }
            Settings::Ladder(plant) => {
                self.beside(RunningLadder::new(plant), wired, ends, tasks);
            }
            Settings::Gpio(lines) => {
                self.within(Arc::new(GpioOpener::new(lines, KernelChips)), device, ends, tasks);
            }
        }
    }

    /// Starts a device that exchanges beside the scan.
    fn beside<D: Driver>(
        &self,
        driver: D,
        DeviceWiring { device, wiring }: DeviceWiring,
        ends: DeviceEnds,
        tasks: &mut JoinSet<()>,
    ) {
        let parts = DeviceParts {
            driver,
            input_end: ends.inputs,
            port: self.port.clone(),
            inputs: wiring.inputs.len(),
            outputs: wiring.outputs.clone(),
            health: self.healths[device.id.0 as usize].clone(),
            poll: Duration::from_millis(device.poll_ms.into()),
        };
        self.spawn(
            device::DeviceTask::new(parts).run(super::signals::when_stopped(&self.stop)),
            device,
            tasks,
        );
    }

    /// Starts a device whose exchange is part of the scan.
    fn within(
        &self,
        opener: Arc<dyn Opener>,
        device: &Device,
        ends: DeviceEnds,
        tasks: &mut JoinSet<()>,
    ) {
        let Some(line) = ends.local else { return };
        let health = self.healths[device.id.0 as usize].clone();
        let mut keeper = DeviceKeeper::new(opener, line, health, self.port.clone());
        keeper.open();
        self.spawn(keeper.run(super::signals::when_stopped(&self.stop)), device, tasks);
    }

    /// If a task panics, only its device is lost (the scan notices the age of its data). The other
    /// devices and the daemon continue.
    fn spawn(
        &self,
        task: impl Future<Output = ()> + Send + 'static,
        device: &Device,
        tasks: &mut JoinSet<()>,
    ) {
        let health = self.healths[device.id.0 as usize].clone();
        tasks.spawn(async move {
            if caught(task).await.is_none() {
                health.end("its task ended because of the bug that is logged above: restart rungd");
            }
        });
    }
}
