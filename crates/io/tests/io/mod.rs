//! The partners of a controller: simulated, local and remote devices, and Modbus clients.

mod device_bench;
mod device_task;
mod drivers;
mod field;
mod filling_line;
mod lift_station;
mod local_device;
mod local_rig;
mod modbus_notations;
mod rig;
mod simulated_device;
mod simulated_lag;
mod simulated_plant;
mod simulated_plant_page;
mod temperature_loop;
