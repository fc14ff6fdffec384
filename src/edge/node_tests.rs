//! The node without I/O.
