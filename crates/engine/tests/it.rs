//! The engine from outside: ladders in virtual time.

#![allow(clippy::wildcard_enum_match_arm)]

mod engine;
