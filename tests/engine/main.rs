//! The engine by itself, and compared with a model.

mod arrays;
mod columns;
mod events;
mod forces;
mod formatted;
mod layout;
mod library;
mod math;
mod properties;
mod restarts;
mod runs;
mod semantics_page;
mod templates;
mod why;

/// Each binary uses a part of this shared code.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod case;
    pub mod mangled;
    pub mod model;
    pub mod numbers;
    pub mod plc;
    pub mod run;
    pub mod setting;
    pub mod table;
    pub mod written_out;
}
