//! Reads TOML files into the structures that their author wrote, with the place of every part. This
//! is the only module that handles TOML. It resolves no addresses and no instructions.
//!
//! [`ladder::read`] and `controller::read` read the text of one file. The resolver uses the result
//! of `ladder::read`, and `controller` that of `controller::read`. Both functions also return
//! findings, which [`render`] prints as text.

pub(crate) mod atom;
pub(crate) mod contact;
mod contact_dialects;
mod contact_habits;
mod contact_lexer;
pub mod contact_parser;
mod contact_signs;
pub(crate) mod contact_sum;
#[cfg(test)]
mod contact_tests;
mod doc;
pub(crate) mod expression;
mod expression_lexer;
mod expression_parser;
mod expression_rules;
#[cfg(test)]
mod expression_tests;
pub mod file_kind;
pub mod finding;
mod headers;
pub mod instruction;
mod instruction_commas;
mod instruction_habits;
pub(crate) mod key;
pub(crate) mod ladder;
pub(crate) mod lost;
mod lost_tables;
mod mend;
pub(crate) mod nearest;
pub(crate) mod reader;
pub mod render;
mod rests_on;
pub(crate) mod room;
mod rung;
pub(crate) mod shape;
pub mod span;
mod statements;
mod strict;
pub(crate) mod sum_parser;
pub(crate) mod table;
mod tag;
mod template;
mod toml_slips;
pub(crate) mod wording;
