//! The importer: what it makes of foreign programs, executed and counted.

#![allow(missing_docs, clippy::wildcard_enum_match_arm)]

mod click;
mod damage;
mod domore;
mod export;

mod l5x;
mod large;
mod numbers;
mod plant;
mod plcopen;
