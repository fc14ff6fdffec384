//! Files before anything runs: reading, findings and their printed forms, and the pages about them.

mod instruction_pages;
mod library;
mod library_pages;
mod page_parts;
mod schemas;
mod validator;
