//! `[operator]` of a controller file as its author wrote it: the operator's socket.
//!
//! Read by `controller`. What the texts mean is the resolver's business.

use super::reader::{Table, Text};
use super::span::Span;

/// `[operator]`.
#[derive(Clone, Debug)]
pub struct Operator {
    /// The place of its header.
    pub span: Span,
    /// `enabled`: whether there is a socket at all.
    pub enabled: bool,
    /// `socket`: its path, relative to the controller file.
    pub socket: Option<Text>,
    /// `mode`: its permissions, in octal digits.
    pub mode: Option<Text>,
    /// `group`: its group, by name or number.
    pub group: Option<Text>,
}

pub(super) fn read(mut table: Table<'_>) -> Operator {
    let operator = Operator {
        span: table.span(),
        enabled: table.boolean("enabled").is_none_or(|enabled| enabled.value),
        socket: table.string("socket"),
        mode: table.string("mode"),
        group: table.string("group"),
    };
    table.finish();
    operator
}
