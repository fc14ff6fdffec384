//! The files of a project: a controller file, ladder files, the report.
//!
//! Called by `rungd import`, which writes them to disk, and by the commands that take a foreign
//! file and need only the texts. The layout is that of `rungd fmt`.

mod ladder;
mod stubs;
mod text;

use std::collections::HashSet;

use crate::model::ForeignProject;
use crate::report;
use rungd_language::format::formatted;
pub use stubs::draw_stubs;
use text::quoted;

/// A file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenFile {
    /// Its path, relative to the project's folder.
    pub path: String,
    /// Its contents.
    pub text: String,
}

/// The name of the controller file.
pub const CONTROLLER: &str = "controller.toml";
/// The name of the report.
pub const REPORT: &str = "import-report.md";

/// The files of a project.
pub fn files(project: &ForeignProject) -> Vec<WrittenFile> {
    let mut files = vec![WrittenFile { path: CONTROLLER.to_owned(), text: controller(project) }];
    for part in &project.parts {
        let path = format!("programs/{}.toml", part.name);
        files.push(WrittenFile { path, text: part.text.to_owned() });
    }
    for file in &project.files {
        let path = format!("programs/{}.toml", file.name);
        files.push(WrittenFile { path, text: laid_out(ladder::text(file)) });
    }
    files.push(WrittenFile { path: REPORT.to_owned(), text: report::text(project) });
    files
}

/// The names of the tags of the original, without those that the import made for itself: what a
/// test of the program can name for good.
pub fn pinned_names(project: &ForeignProject) -> HashSet<String> {
    let tags = project.files.iter().flat_map(|file| &file.tags);
    tags.filter(|tag| !tag.is_own).map(|tag| tag.name.clone()).collect()
}

/// The text in the common layout. A text that is not TOML would be a bug, and stays as it is.
fn laid_out(text: String) -> String {
    formatted(&text).unwrap_or(text)
}

fn controller(project: &ForeignProject) -> String {
    let parts = project.parts.iter().map(|part| part.name);
    let names = parts.chain(project.files.iter().map(|file| file.name.as_str()));
    let own = names.map(|name| format!("programs/{name}.toml"));
    let libraries = project.libraries.iter().map(|library| (*library).to_owned());
    let ladders: Vec<String> = libraries.chain(own).map(|path| quoted(&path)).collect();
    let mut text = text::comment(&format!("{}. {}", project.origin, project.doc));
    text += &format!(
        "\nladder = [\n{}]\n",
        ladders.iter().map(|ladder| format!("    {ladder},\n")).collect::<String>()
    );
    text += &format!("\n[scan]\nperiod = \"{}ms\"\n", project.period_ms.max(1));
    let sizes = ladder::memory(project);
    if !sizes.is_empty() {
        text += "\n[memory]\n";
        sizes.iter().for_each(|size| text += &format!("{} = {}\n", size.space, size.count));
    }
    laid_out(text)
}
