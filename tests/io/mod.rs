//! The partners of a controller: simulated, local and remote devices, and Modbus clients.

mod bottling_plant;
mod device_live;
mod gpio_hardware;
mod habit_peer;
mod ladder_plants;
mod liars;
mod line;
mod modbus_clients;
mod modbus_devices;
mod modbus_echo;
mod modbus_habits;
mod modbus_hostile;
mod modbus_liars;
mod modbus_live;
mod modbus_numbers;
mod modbus_outputs;
mod modbus_resting;
mod modbus_serial_liars;
mod modbus_sweep;
mod modbus_torn;
mod oracle;
mod reals;
mod virtual_devices;
