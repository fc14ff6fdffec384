//! The engine by itself, and compared with a model.

mod arrays;
mod columns;
mod computed;
mod events;
mod forces;
mod formatted;
mod layout;
mod library;
mod math;
mod properties;
mod record_parameters;
mod records;
mod restarts;
mod runs;
mod semantics_page;
mod subroutines;
mod templates;
mod why;
mod word_bits;
