//! The controller file, and everything that it names: from a path to a checked program with
//! settings.
//!
//! [`controller`] reads the file's tables into settings of the drivers and of the daemon, [`load`]
//! finds and reads the ladders and libraries, [`explain`] tells what an instruction or a finding
//! is. Nothing here opens a device or a socket.

pub mod controller;
pub mod explain;
pub mod load;
