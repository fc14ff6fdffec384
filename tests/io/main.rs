//! The partners of a controller: simulated, local and remote devices, and Modbus clients.

mod bottling_plant;
mod device_bench;
mod device_live;
mod device_task;
mod drivers;
mod field;
mod filling_line;
mod gpio_hardware;
mod liars;
mod lift_station;
mod line;
mod local_device;
mod local_rig;
mod modbus_clients;
mod modbus_devices;
mod modbus_echo;
mod modbus_hostile;
mod modbus_liars;
mod modbus_live;
mod modbus_outputs;
mod modbus_serial_liars;
mod modbus_sweep;
mod modbus_torn;
mod oracle;
mod reals;
mod rig;
mod simulated_device;
mod simulated_lag;
mod simulated_plant;
mod simulated_plant_page;
mod temperature_loop;

/// Each test binary uses only a part of the shared modules.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod bench;
    pub mod calm;
    pub mod live;
    pub mod metronome;
    pub mod modbus;
    pub mod needs;
    pub mod page;
    pub mod process;
    pub mod system;
}
