//! TOML → what its author wrote, with the place of everything. The only module that knows TOML
//! for ladders; it knows no addresses and no instructions.

pub mod finding;
pub mod span;
