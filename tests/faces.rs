//! What shows a controller or a ladder to people and other programs: the editor, browsers, brokers,
//! metrics.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

mod editor;
#[cfg(feature = "fleet")]
mod fleet;
#[cfg(feature = "fleet")]
mod metrics;
#[cfg(feature = "web")]
mod web;
