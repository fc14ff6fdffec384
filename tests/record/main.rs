//! The scan log: sections and segments as bytes, what is in memory, the folder on every kind of
//! disk, replay, and the reader of the page.

mod bytes;
mod drawn;
mod folder;
mod format;
mod replayed;
mod size;
mod stored;

/// A binary uses a part of what they share.
#[allow(dead_code, unused_imports)]
#[path = "../support"]
mod support {
    pub mod case;
    pub mod model;
    pub mod needs;
    pub mod run;
    pub mod table;
    pub mod written_out;
}
