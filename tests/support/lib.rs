//! Code that the tests of several crates share. What starts the program itself is in `running/`.

// A test says what went wrong by a panic; its parts need no documentation of their own.
#![allow(missing_docs, unsafe_code, clippy::wildcard_enum_match_arm)]
#![allow(clippy::new_without_default, clippy::should_implement_trait)]

pub mod abc;
pub mod bare_run;
pub mod bench;
pub mod calm;
pub mod case;
pub mod disk_pace;
pub mod fake_chip;
pub mod folder;
pub mod follower;
pub mod helps;
pub mod journal;
pub mod logged_plant;
pub mod mangled;
pub mod masked;
pub mod metronome;
pub mod modbus;
pub mod model;
pub mod needs;
pub mod numbers;
pub mod page;
pub mod patience;
pub mod plc;
pub mod run;
pub mod running;
pub mod setting;
pub mod shares;
pub mod shown;
pub mod system;
pub mod table;
pub mod written_out;
