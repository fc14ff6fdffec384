//! Ladders without a machine: virtual time, stimulus, plants, tests, drawings.
//!
//! [`sim`] runs a ladder in virtual time and writes traces, [`rig`] is a whole controller in
//! virtual time, [`testing`] plays test files on it, [`draw`] shows a ladder to people. Nothing
//! here waits, and nothing opens a socket.

pub mod draw;
pub mod rig;
pub mod sim;
pub mod testing;
