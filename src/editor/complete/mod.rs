//! Completion: what could be written at the cursor, in strings by what they stand for, outside of
//! them by the keys that the readers know. It needs no whole file: what is typed may be broken.
//!
//! `requests` calls [`completion`]. `site` says where the cursor stands, `texts`, `keys` and
//! `headers` what fits there, `proposal` makes items of it.

mod addresses;
mod contacts;
mod describe;
mod files;
mod headers;
mod instructions;
mod keys;
mod lists;
mod nature;
mod operands;
pub(super) mod proposal;
mod scene;
mod shapes;
mod site;
mod steps;
mod texts;

use anyhow::Result;
use lsp_types::{CompletionItemKind, CompletionOptions, CompletionParams, CompletionResponse};

use self::proposal::{ItemPlace, Proposal, Proposals};
use self::scene::CompletionScene;
use self::shapes::entry;
use self::site::SitePlace;
use super::workspace::Workspace;
use crate::source::shape::ValueForm;

/// The characters that ask for completion.
const TRIGGERS: [&str; 11] = ["\"", ".", " ", "[", "=", "(", "!", "&", "|", "$", ":"];

/// What the server tells of it at the start.
pub(super) fn options() -> CompletionOptions {
    let triggers = TRIGGERS.map(str::to_owned).to_vec();
    CompletionOptions { trigger_characters: Some(triggers), ..CompletionOptions::default() }
}

/// What could be written at the cursor.
pub(super) fn completion(
    workspace: &mut Workspace,
    params: CompletionParams,
) -> Result<Option<CompletionResponse>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position) else { return Ok(None) };
    let scene = CompletionScene::new(&workspace.library, &cursor);
    let (found, wrap) = match scene.site.place {
        SitePlace::Nowhere => return Ok(None),
        SitePlace::Header(start) => (headers::offer(&scene, scene.typed(start)), ("", "")),
        SitePlace::Key { start, quoted } => {
            (keys::offer(&scene, scene.typed(start), quoted), ("", ""))
        }
        SitePlace::Text(start) => (texts::offer(&scene, scene.typed(start)), ("", "")),
        SitePlace::Bare(start) => bare(&scene, scene.typed(start)),
    };
    let start = scene.offset - found.typed.len();
    let tail = if found.typed.is_empty() { 0 } else { scene.tail(found.signs) };
    let range = start..scene.offset + tail;
    let place = ItemPlace { file: scene.file, range, wrap, can: workspace.can };
    Ok(Some(CompletionResponse::List(found.items(&place))))
}

/// What fits a value that has no quotes yet, and the quotes.
fn bare(scene: &CompletionScene, typed: &str) -> (Proposals, (&'static str, &'static str)) {
    let form = entry(&scene.shape(), &keys::path(scene)).map(|(_, form)| form);
    match form {
        Some(ValueForm::Flag) => (switches(typed), ("", "")),
        Some(ValueForm::Constant | ValueForm::Constants) => (switches(typed), ("", "")),
        Some(ValueForm::Texts) if !scene.site.in_array => {
            (texts::offer(scene, typed), ("[\"", "\"]"))
        }
        Some(_) | None => (texts::offer(scene, typed), ("\"", "\"")),
    }
}

fn switches(typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    for word in ["true", "false"] {
        found.add(Proposal::new(word, CompletionItemKind::VALUE, 0));
    }
    found
}
