//! The language server: what an editor shows and changes in ladders, controller files and tests.

mod lines;
mod outline;
mod slots;
mod words;
