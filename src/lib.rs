//! rungd, the program: the command line and the daemon. Everything else is in the crates below
//! `crates/`, which `ARCHITECTURE.md` lists. `main` only exits with the code that [`cli`] returns.

pub mod cli;
mod daemon;
