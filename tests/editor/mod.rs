//! The language server: the tests' own editor talks to it in memory.

mod client;
mod commands;
mod completion;
mod completion_log;
mod completion_shipped;
mod completion_uses;
mod completion_written;
mod device_sides;
mod findings;
mod fixes;
mod formatting;
mod help_trials;
mod hover;
mod large;
mod large_texts;
mod live;
mod navigation;
mod neovim;
mod observers;
mod on_disk;
mod project;
mod renames;
mod typing;
