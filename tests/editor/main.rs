//! The language server: an editor of the tests' own speaks with it, in memory.

mod client;
mod findings;
mod fixes;
mod hover;
mod navigation;
mod project;
