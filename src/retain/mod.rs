//! Retentive memory: from a scan's image to the bytes of a file and back after a restart.
//!
//! `plan` knows what is retained and what it is called, `content` is that in bytes, `format` the
//! header and the slots around it, `slots` writes and finds them on a [`Storage`], `file` is the
//! device that a real file is, `keeper` decides when something is written. The daemon gives the
//! thread and the log; `docs/retain-format.md` is the page for the authors of other readers.
//!
//! The idea: an image is written beside the last ones, never over the one that is known to be
//! durable, and it is whole or it is nothing: whatever an interrupted write leaves behind, what is
//! found later is exactly one scan's image.
//!
//! Deliberately absent: the scan thread, which publishes an image at every scan for everybody and
//! knows nothing of this; a clock, tracing, threads.

pub mod content;
mod device;
pub mod file;
pub mod format;
pub(crate) mod keeper;
mod limits;
mod owners;
pub(crate) mod plan;
pub mod show;
pub mod slots;

pub use device::Storage;
pub use keeper::Keeper;
pub(crate) use keeper::Kept;
pub use plan::RetainPlan;
