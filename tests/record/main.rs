//! The scan log: sections and segments as bytes, what is in memory, the folder on every kind of
//! disk, replay, and the reader of the page.

mod bytes;
mod drawn;
