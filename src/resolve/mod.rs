//! Names → addresses. What it finds is unknown, duplicate, read-only or of the wrong kind.

pub mod program;
