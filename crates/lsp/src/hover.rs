//! The hover at a name, a key or a number: its explanation, and the places that read and write it.
//!
//! `requests` calls [`hover`]. The meaning of a name comes from `names`, a text about rungd itself
//! from `explain`, the explanation of a key from its reader (`source::shape`). Nothing is judged
//! here.

use std::ops::Range;

use anyhow::Result;
use lsp_types::{ClientCapabilities, Hover, HoverContents, HoverParams, MarkupContent, MarkupKind};

use super::device_sides::{self, SideName};
use super::names::Meaning;
use super::navigate::part_at;
use super::words::FileWordRole;
use super::workspace::{Cursor, Workspace};
use rungd_config::explain;

mod declared;
mod keys;
mod members;
mod uses;
mod values;

/// The explanation of the name, key or value at the cursor.
pub(super) fn hover(workspace: &mut Workspace, params: HoverParams) -> Result<Option<Hover>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position_params) else {
        return Ok(None);
    };
    let Some((range, text)) = at(&cursor) else { return Ok(None) };
    let (kind, value) = match wants_plain(&workspace.client) {
        true => (MarkupKind::PlainText, plain(&text)),
        false => (MarkupKind::Markdown, text),
    };
    let contents = HoverContents::Markup(MarkupContent { kind, value });
    Ok(Some(Hover { contents, range: Some(cursor.file().place(range)) }))
}

fn at(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    of_word(cursor).or_else(|| values::at(cursor)).or_else(|| keys::at(cursor))
}

/// The text at the cursor, and its explanation without the marks of Markdown.
pub(super) fn explained(cursor: &Cursor) -> Option<(String, String)> {
    let (range, text) = at(cursor)?;
    Some((cursor.file().slice(range).to_owned(), plain(&text)))
}

/// Whether an editor shows only plain text, or prefers it.
fn wants_plain(client: &ClientCapabilities) -> bool {
    let abilities = client.text_document.as_ref().and_then(|document| document.hover.as_ref());
    let formats = abilities.and_then(|hover| hover.content_format.as_ref());
    formats.and_then(|formats| formats.first()) == Some(&MarkupKind::PlainText)
}

/// Markdown without its marks.
fn plain(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with("```"));
    lines.map(|line| line.replace("**", "").replace('`', "") + "\n").collect()
}

fn of_word(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    let word = cursor.word().filter(|word| cursor.offset < word.span.end)?;
    let whole = |text: String| Some((word.span.clone(), text));
    match word.role {
        FileWordRole::Mnemonic(mnemonic) => whole(explain::instruction_page(mnemonic.spec())),
        FileWordRole::Function(function) => whole(explain::explanation(function.spec().name)?),
        FileWordRole::Warning => {
            whole(explain::explanation(cursor.file().slice(word.span.clone()))?)
        }
        FileWordRole::File | FileWordRole::DeviceLadder => None,
        FileWordRole::Declares(_)
        | FileWordRole::Reads
        | FileWordRole::Writes
        | FileWordRole::Names
        | FileWordRole::Block
        | FileWordRole::Stage
        | FileWordRole::Template
        | FileWordRole::Type
        | FileWordRole::Parameter
        | FileWordRole::Placeholder
        | FileWordRole::Device => of_name(cursor),
    }
}

fn of_name(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    if let Some(SideName { span, project, at }) = device_sides::at_cursor(cursor) {
        return Some((span, declared::shown(project, at)));
    }
    let (range, meaning) = part_at(cursor)?;
    let project = &cursor.project;
    let text = cursor.file().slice(range.clone());
    let shown = match meaning {
        Meaning::Declared(at) => declared::shown(project, at),
        Meaning::Address(address) => {
            let nickname = members::of_status(address).map(|meaning| format!("{meaning}\n"));
            let about = nickname.or_else(|| members::of_address(project, address));
            let uses = uses::of_address(project, address);
            format!("**{text}**\n\n{}{}", about.unwrap_or_default(), uses.shown())
        }
        Meaning::Member => members::of_word(cursor, &range)?,
        Meaning::Status | Meaning::Unknown => return None,
    };
    Some((range, shown))
}
