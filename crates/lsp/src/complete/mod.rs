//! Completion: proposals of texts at the cursor. In a string they depend on the meaning of the
//! string, elsewhere on the keys that the readers accept. The file may be incomplete.
//!
//! `requests` calls [`completion`]. `site` finds the place of the cursor; `texts`, `keys` and
//! `headers` find the proposals for that place; `proposal` converts them to items.

mod addresses;
mod behind;
mod contacts;
mod describe;
mod files;
mod headers;
mod instructions;
mod keys;
mod lists;
mod nature;
mod operands;
mod points;
pub(super) mod proposal;
mod scene;
mod shapes;
mod site;
mod steps;
mod texts;

use anyhow::Result;
use lsp_types::{CompletionItemKind, CompletionOptions, CompletionParams, CompletionResponse};

use self::behind::ItemEnd;
use self::proposal::{CompletionProposal, ItemPlace, Proposals};
use self::scene::CompletionScene;
use self::site::SitePlace;
use super::workspace::Workspace;
use rungd_language::source::shape::ValueForm;

/// The characters after which an editor requests completion.
const TRIGGERS: [&str; 12] = ["\"", ".", " ", "[", "=", "(", "!", "&", "|", "$", ":", "{"];

/// The options for completion that the server sends at the start.
pub(super) fn options() -> CompletionOptions {
    let triggers = TRIGGERS.map(str::to_owned).to_vec();
    CompletionOptions { trigger_characters: Some(triggers), ..CompletionOptions::default() }
}

/// The proposals at the cursor.
pub(super) fn completion(
    workspace: &mut Workspace,
    params: CompletionParams,
) -> Result<Option<CompletionResponse>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position) else { return Ok(None) };
    let scene = CompletionScene::new(&workspace.library, &cursor);
    let (found, wrap, end) = match scene.site.place {
        SitePlace::Nowhere => return Ok(None),
        SitePlace::Header(start) => {
            let Some(end) = behind::header(&scene, start) else { return Ok(None) };
            (headers::offer(&scene, scene.typed(start)), ("", ""), Some(end))
        }
        SitePlace::Text(start) => plain(texts::offer(&scene, scene.typed(start))),
        SitePlace::Key { start, quoted } => {
            let found = keys::offer(&scene, scene.typed(start), quoted);
            match (quoted, behind::key(&scene, &found.typed)) {
                (true, _) => plain(found),
                (false, None) => return Ok(None),
                (false, Some(end)) => (found, ("", ""), Some(end)),
            }
        }
        SitePlace::Bare(start) => {
            let (found, wrap) = bare(&scene, scene.typed(start));
            let Some(end) = behind::value(&scene, start) else { return Ok(None) };
            // Quotes can only be put around the whole word.
            if found.typed.len() < scene.offset - start {
                return Ok(None);
            }
            (found, wrap, Some(end))
        }
    };
    let start = scene.offset - found.typed.len();
    let tail = if found.typed.is_empty() { 0 } else { scene.tail(found.signs) };
    let end = end.unwrap_or(ItemEnd { end: scene.offset + tail, comma: false });
    let (file, range, comma, can) = (scene.file, start..end.end, end.comma, workspace.can);
    let place = ItemPlace { file, range, wrap, comma, can };
    Ok(Some(CompletionResponse::List(found.items(&place))))
}

/// The text before and after each item.
type Wrap = (&'static str, &'static str);

/// Proposals of words in quotes. They have no `ItemEnd`: an item replaces the rest of its word.
fn plain(found: Proposals) -> (Proposals, Wrap, Option<ItemEnd>) {
    (found, ("", ""), None)
}

/// The proposals for a value that has no quotes yet, and the quotes.
fn bare(scene: &CompletionScene, typed: &str) -> (Proposals, Wrap) {
    let form = scene.shape().entry(&keys::path(scene)).map(|(_, form)| form);
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
        found.add(CompletionProposal::new(word, CompletionItemKind::VALUE, 0));
    }
    found
}
