//! Drivers from outside, with peers that misbehave.

#![allow(clippy::wildcard_enum_match_arm)]

mod io;
