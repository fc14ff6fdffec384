//! Texts: ladder files before anything runs, the pages of the documentation, and the sources.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

mod house;
mod language;
