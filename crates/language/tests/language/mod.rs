//! Files before anything runs: reading, findings and their printed forms, and the pages about them.

mod any_bytes;
mod broken;
mod controller;
mod docs_language;
mod findings_pages;
mod findings_shown;
mod formatting;
mod load;
mod template_limits;
mod ui;
