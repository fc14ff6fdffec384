//! Reads TOML files into the structures that their author wrote, with the place of every part. This
//! is the only module that handles TOML. It resolves no addresses and no instructions.
//!
//! [`reader`] reads the values of a text that is TOML, or of its lines that are. [`toml_tree`] is
//! the text as it is written, even while it is typed: `format` and the editor read it.
//!
//! [`ladder::read`] and `controller::read` read the text of one file. The resolver uses the result
//! of `ladder::read`, and `controller` that of `controller::read`. Both functions also return
//! findings, which [`render`] prints as text.

pub mod atom;
pub mod condition;
pub mod contact;
mod contact_dialects;
mod contact_habits;
mod contact_lexer;
pub mod contact_parser;
pub mod contact_side;
mod contact_signs;
#[cfg(test)]
mod contact_tests;
mod contact_tokens;
mod contact_use;
mod contact_words;
mod doc;
pub mod expression;
mod expression_lexer;
mod expression_parser;
mod expression_rules;
#[cfg(test)]
mod expression_tests;
pub mod file_kind;
pub mod finding;
pub mod fix;
mod foreign_signs;
mod headers;
pub mod indexed;
pub mod infix;
pub mod instruction;
pub(crate) mod instruction_commas;
mod instruction_habits;
pub mod key;
pub mod ladder;
pub mod lost;
mod lost_tables;
mod math_target;
mod mend;
pub mod name_reader;
pub mod nearest;
pub mod observer;
pub mod reader;
pub(crate) mod record;
pub mod renaming;
pub mod render;
mod rests_on;
pub mod room;
mod rung;
pub mod shape;
mod side_parser;
pub mod slot;
pub mod span;
mod statements;
mod strict;
pub(crate) mod table;
pub(crate) mod tag;
mod template;
mod toml_slips;
pub mod toml_tree;
mod toml_tree_reader;
pub mod value_kind;
pub mod was;
pub mod wording;
