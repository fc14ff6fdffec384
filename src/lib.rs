//! rungd: a soft-PLC for Linux. `ARCHITECTURE.md` lists the modules from the top down; a module
//! uses only those below it in that list.

pub mod cli;
mod daemon;
