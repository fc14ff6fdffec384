//! Files of every kind, from their text to findings.

#![allow(clippy::wildcard_enum_match_arm)]

mod language;
