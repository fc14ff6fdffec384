//! The scan log: sections and segments as bytes, the recording in memory, the folder on every kind
//! of disk, replay, the page's reader, and tests with the real rungd.

mod ages;
mod bytes;
mod drawn;
mod earlier;
mod folder;
mod format;
mod from_outside;
mod hostile;
#[cfg(feature = "prove")]
mod how;
mod line;
mod live_crash;
mod live_disk;
mod live_ends;
mod live_places;
mod live_random;
mod live_removed;
mod live_rig;
mod live_stall;
mod log_changes;
mod recorder;
mod replayed;
mod size;
mod stored;
