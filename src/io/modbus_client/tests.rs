//! The client before peers of its own making.
