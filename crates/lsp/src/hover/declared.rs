//! The hover of a declaration: its explanation, the keys in its table, its uses.

use std::fmt::Write as _;

use super::super::file::EditorFile;
use super::super::names::{Declaration, is_of_key};
use super::super::project::Project;
use super::super::slots::DeclaredKind;
use super::uses;

/// The keys that are not shown, because they are shown elsewhere or are too long.
const LEFT_OUT: [&str; 11] =
    ["fields", "name", "doc", "when", "leg", "do", "rung", "stage", "branch", "steps", "map"];

/// The text of the hover of a declaration.
pub(super) fn shown(project: &Project, at: usize) -> String {
    let declared = &project.names.all[at];
    let mut text = format!("**{}**: {}\n", declared.name, place(project, declared));
    if let Some(doc) = &declared.doc {
        let _ = write!(text, "\n{doc}\n");
    }
    let file = &project.files[declared.file];
    let said = said(file, declared);
    if !said.is_empty() {
        let _ = write!(text, "\n{}\n", said.join(", "));
    }
    text.push_str(&template(project, declared));
    text.push_str(&parts(project, at));
    text.push_str(&uses::of_declared(project, at).shown());
    text
}

/// The kind of a declaration, and the name of its parent.
fn place(project: &Project, declared: &Declaration) -> String {
    let kind = match declared.kind {
        DeclaredKind::Tag if declared.is_of_observer => "tag of the observer",
        DeclaredKind::Tag | DeclaredKind::OwnTag => "tag",
        DeclaredKind::Program => "Program",
        DeclaredKind::Task => "Task",
        DeclaredKind::Subroutine => "Subroutine",
        DeclaredKind::Stage => "Stage",
        DeclaredKind::Rung => "rung",
        DeclaredKind::Template => "template",
        DeclaredKind::Parameter => "parameter",
        DeclaredKind::Use => "use of a template",
        DeclaredKind::Device => "field device",
        DeclaredKind::Record => "record",
        DeclaredKind::Field => "field",
        DeclaredKind::Test => "test",
    };
    match declared.parent.map(|parent| &project.names.all[parent].name) {
        Some(parent) => format!("{kind} of {parent}"),
        None => kind.to_owned(),
    }
}

/// The keys and values in the table of a declaration: `at = "X0"`, `min = 0`.
fn said(file: &EditorFile, declared: &Declaration) -> Vec<String> {
    let outline = &file.outline;
    let own = match is_of_key(declared.kind) {
        true => outline.pairs[declared.pair].names(),
        false => Vec::new(),
    };
    let shown = outline.pairs_in(declared.object).filter_map(|pair| {
        pair.key_below(&own)?;
        let keys = &pair.names()[own.len()..];
        let value = file.slice(pair.value.clone());
        let is_shown = !LEFT_OUT.contains(&keys[0])
            && !matches!(keys[0], "tags" | "parameters")
            && !value.starts_with('{')
            && !value.is_empty();
        is_shown.then(|| format!("`{} = {}`", keys.join("."), uses::short(value)))
    });
    shown.take(uses::LINES_MAX * 2).collect()
}

/// The template of a use.
fn template(project: &Project, declared: &Declaration) -> String {
    let Some(name) = &declared.template else { return String::new() };
    let found = project.names.template(name);
    match found.and_then(|at| project.names.all[at].doc.as_ref()) {
        Some(doc) => format!("\n{name}: {doc}\n"),
        None => String::new(),
    }
}

/// The stages of a Program; the parameters and tags of a template.
fn parts(project: &Project, at: usize) -> String {
    let mut text = String::new();
    let named = |kind| {
        let all = project.names.all.iter();
        all.filter(move |part| part.parent == Some(at) && part.kind == kind)
    };
    let stages: Vec<String> =
        named(DeclaredKind::Stage).map(|stage| format!("`{}`", stage.name)).collect();
    if !stages.is_empty() {
        let _ = write!(text, "\nStages: {}\n", stages.join(", "));
    }
    let all = project.names.all.iter();
    let record = project.names.record_of(at).unwrap_or(at);
    let fields = all.filter(|part| part.parent == Some(record) && part.kind == DeclaredKind::Field);
    for (title, parts) in [
        ("Parameters", named(DeclaredKind::Parameter).collect::<Vec<_>>()),
        ("Own tags", named(DeclaredKind::OwnTag).collect()),
        ("Fields", fields.collect()),
    ] {
        let lines: Vec<String> = parts.into_iter().map(|part| one(project, part)).collect();
        if !lines.is_empty() {
            let _ = write!(text, "\n{title}:\n\n{}", lines.concat());
        }
    }
    text
}

/// A parameter or tag of a template, as one line.
fn one(project: &Project, part: &Declaration) -> String {
    let said = said(&project.files[part.file], part).join(", ");
    let doc = part.doc.as_ref().map(|doc| format!(" {doc}")).unwrap_or_default();
    format!("- `{}` {said}{doc}\n", part.name)
}
