//! Code that several folders of tests share.

pub mod bench;
pub mod calm;
pub mod case;
pub mod disk_pace;
pub mod folder;
pub mod helps;
pub mod journal;
pub mod live;
pub mod mangled;
pub mod masked;
pub mod metronome;
pub mod modbus;
pub mod model;
pub mod needs;
pub mod numbers;
pub mod operator;
pub mod page;
pub mod patience;
pub mod plc;
pub mod process;
pub mod run;
pub mod setting;
pub mod shown;
pub mod system;
pub mod table;
pub mod written_out;
