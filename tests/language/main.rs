//! Files before anything runs: what is read, what is found wrong, how that is told, and the pages
//! about it.

mod any_bytes;
mod broken;
mod controller;
mod docs_language;
mod findings_pages;
mod findings_shown;
mod formatting;
mod instruction_pages;
mod library;
mod library_pages;
mod load;
mod page_parts;
mod schemas;
mod template_limits;
mod ui;
mod validator;

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod mangled;
    pub mod needs;
}
