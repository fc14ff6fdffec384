//! The explanation of the name at the cursor, as a text of its own: of a mnemonic, a function or a
//! warning that of `rungd explain`; of a declared name its declaration.

use super::names::{Declared, Meaning};
use super::slots::DeclaredKind;
use super::words::Role;
use super::workspace::Cursor;
use crate::explain::explanation;

/// The name, and the text.
pub(super) fn of(cursor: &Cursor) -> Option<(String, String)> {
    let (file, word) = (cursor.file(), cursor.word()?);
    let text = file.slice(word.span.clone());
    match word.role {
        Role::Mnemonic(_) | Role::Function(_) | Role::Warning => {
            Some((text.to_owned(), explanation(text)?))
        }
        Role::Declares(_)
        | Role::Reads
        | Role::Writes
        | Role::Names
        | Role::Block
        | Role::Stage
        | Role::Template
        | Role::Parameter
        | Role::Device => {
            let parts = cursor.project.names.parts(cursor.numbered(), word);
            let at = cursor.offset;
            let part = parts.iter().find(|of| of.span.start <= at && at <= of.span.end)?;
            let Meaning::Declared(number) = part.meaning else { return None };
            let declared = &cursor.project.names.all[number];
            Some((declared.name.clone(), of_declared(cursor, declared)))
        }
        Role::File => None,
    }
}

fn of_declared(cursor: &Cursor, declared: &Declared) -> String {
    let file = &cursor.project.files[declared.file];
    let mut text = format!("{}, {}\n", declared.name, kind(declared.kind));
    if let Some(doc) = &declared.doc {
        text += &format!("\n{doc}\n");
    }
    let line = file.place(declared.span.clone()).start.line + 1;
    text += &format!("\n{}:{line}\n\n", file.path.display());
    for line in file.slice(declared.extent.clone()).lines() {
        text += &format!("  {line}\n");
    }
    text
}

fn kind(kind: DeclaredKind) -> &'static str {
    match kind {
        DeclaredKind::Tag => "a tag",
        DeclaredKind::Program => "a Program",
        DeclaredKind::Task => "a Task",
        DeclaredKind::Stage => "a Stage",
        DeclaredKind::Rung => "a rung",
        DeclaredKind::Template => "a template",
        DeclaredKind::Parameter => "a parameter of a template",
        DeclaredKind::OwnTag => "a tag of a template",
        DeclaredKind::Use => "a use of a template",
        DeclaredKind::Device => "a field device",
        DeclaredKind::Test => "a test",
    }
}
