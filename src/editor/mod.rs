//! The language server: what an editor shows and changes in ladders, controller files and tests.

mod file;
mod judge;
mod lines;
mod names;
mod outline;
mod project;
mod slots;
mod uri;
mod words;
