//! What the semantics tests share: the form of a case, loading a ladder, running it.
//!
//! Included by several test crates, each of which uses a part of it.
#![allow(dead_code)]

pub mod case;
pub mod plc;
pub mod run;
pub mod table;
