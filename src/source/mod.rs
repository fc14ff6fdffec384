//! TOML → what its author wrote, with the place of everything. The only module that knows TOML;
//! it knows no addresses and no instructions.
//!
//! [`ladder::read`] and `controller::read` take one file's text each; the resolver and
//! `controller` take what they give. Findings go out beside it, and [`render`] turns
//! them into text.

pub mod atom;
pub mod contact;
mod contact_lexer;
mod contact_parser;
#[cfg(test)]
mod contact_tests;
pub mod file_kind;
pub mod finding;
mod headers;
pub mod instruction;
pub mod key;
pub mod ladder;
pub mod nearest;
pub mod reader;
pub mod render;
pub mod room;
pub mod shape;
pub mod span;
mod strict;
pub mod table;
mod wording;
