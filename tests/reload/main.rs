//! What a reload keeps: tests of the rules, with random programs, and with the real binary.

mod anywhere;
mod back;
mod blocks;
mod data;
mod edited;
mod large;
mod live;
mod properties;
mod random;
mod reloaded;
mod report;
mod rules;
mod templates;
mod types;
mod unit;

/// Each test binary uses only a part of the shared modules.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod case;
    pub mod live;
    pub mod metronome;
    pub mod model;
    pub mod needs;
    pub mod numbers;
    pub mod plc;
    pub mod process;
    pub mod run;
    pub mod setting;
    pub mod shown;
    pub mod system;
    pub mod table;
    pub mod written_out;
}
