//! The past of a controller: [`record`] is the scan log on disk and in memory, [`observe`] says why
//! a cell has its value, [`playback`] executes recorded calls again.
//!
//! Nothing here asks a running controller; `rungd-client` does.

pub mod observe;
pub mod playback;
pub mod record;
