//! What an expansion leaves to do once all names are declared.

use super::given::Given;
use super::kind::Kind;
use crate::source::ladder::{Block, Tag};

/// An argument or default of one use.
#[derive(Clone, Debug)]
pub(in crate::resolve) struct Argument {
    pub template: String,
    pub parameter: String,
    pub kind: Kind,
    pub given: Given,
}

/// A template that nothing uses, as the body of a Program.
#[derive(Debug)]
pub(in crate::resolve) struct Trial {
    pub block: Block,
    /// Its own tags, and the tags that it was given.
    pub tags: Vec<Tag>,
    /// What its inner uses give.
    pub arguments: Vec<Argument>,
}
