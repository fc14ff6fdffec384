//! The language server: an editor of the tests' own speaks with it, in memory.

mod client;
mod completion;
mod completion_shipped;
mod findings;
mod navigation;
mod project;
