//! The scan thread and its meeting point with the world.

pub mod exchange;
mod link;

pub use link::{Publication, Returned, ScanSide, Shape, WorldSide, link};
