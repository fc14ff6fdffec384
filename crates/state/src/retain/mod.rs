//! Retentive memory: from a scan's image to the bytes of a file and back after a restart.
//!
//! `plan` lists the retained elements and their names. `content` encodes them as bytes. `format`
//! encodes the header and the slots around the content. `slots` writes and finds slots on a
//! [`Storage`]. `file` is the [`Storage`] of a real file. `keeper` decides when to write. The
//! daemon provides the thread and the log. `docs/retain-format.md` describes the file for the
//! authors of other readers.
//!
//! An image is never written over the image that is known to be durable. An image whose write was
//! interrupted is ignored, so a start always finds the image of exactly one scan.
//!
//! This folder has no clock, no threads and no tracing. The scan thread does not use it: it only
//! publishes an image at every scan.

pub mod content;
mod device;
pub mod file;
pub mod format;
pub mod keeper;
mod limits;
mod owners;
pub mod plan;
mod restoration;
pub mod show;
pub mod slots;
mod stages;

pub use device::Storage;
pub use keeper::Keeper;
pub use keeper::StoredImage;
pub use plan::RetainPlan;
