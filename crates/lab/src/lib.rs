//! Ladders without a machine: virtual time, stimulus, plants, tests, drawings.
//!
//! [`rig`] is a whole controller in virtual time (a ladder alone has no devices), [`traces`] has
//! the stimulus and the trace of its simulation, [`testing`] plays test files on it, [`draw`] shows
//! a ladder to people, [`svg`] writes the elements of all pictures. Nothing here waits, and nothing
//! opens a socket.

pub mod draw;
pub mod export;
pub mod rig;
pub mod svg;
pub mod testing;
pub mod traces;
