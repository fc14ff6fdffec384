//! A ladder as people look things up in it: the cross-reference. Pure: programs and settings in,
//! data and texts out.
//!
//! Called by `cli`. What touches a cell comes from `observe`, so that `rungd why` and these pages
//! never differ.

pub mod xref;
