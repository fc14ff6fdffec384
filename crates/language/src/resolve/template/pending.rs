//! The results of an expansion that are checked once all names are declared.

use super::given::Given;
use super::kind::ParameterKind;
use crate::source::ladder::{WrittenBlock, WrittenTag};

/// An argument or default of one use.
#[derive(Clone, Debug)]
pub(in crate::resolve) struct Argument {
    pub template: String,
    pub parameter: String,
    pub kind: ParameterKind,
    /// Its type as the template has it: of a record its name.
    pub type_name: String,
    pub given: Given,
}

/// A template that nothing uses, as the body of a Program.
#[derive(Debug)]
pub(in crate::resolve) struct UnusedTemplate {
    pub block: WrittenBlock,
    /// Its own tags, and the tags that are its arguments.
    pub tags: Vec<WrittenTag>,
    /// The arguments of its inner uses.
    pub arguments: Vec<Argument>,
}
