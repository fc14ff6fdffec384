//! What a reload keeps: tests of the rules, with random programs, and with the real binary.

mod anywhere;
mod blocks;
mod data;
mod edited;
mod large;
mod properties;
mod reloaded;
mod report;
mod rules;
mod subroutines;
mod templates;
mod types;
