//! Proposals of keys for the table at the cursor: keys that the reader of the table accepts and
//! that are not there yet; names, if the keys of the table are names; the legs of the rung's
//! instruction.

use lsp_types::CompletionItemKind;

use super::contacts;
use super::headers;
use super::lists;
use super::nature::WantedName;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use super::shapes::{is_taken, skeleton, table};
use crate::outline::KeyPair;
use crate::slots::{FileKind, KeySlot, of_next_key};
use rungd_engine::isa::{LegName, Mnemonic};
use rungd_language::source::shape::ValueForm;

/// Ranks: required keys, optional keys, legs of other instructions, tables.
const NEEDED: u8 = 1;
const OPTIONAL: u8 = 2;
const OTHER_LEG: u8 = 4;
const TABLES: u8 = 5;
/// Arrays of tables that are written with headers.
const BY_HEADERS: [&str; 3] = ["rung", "stage", "branch"];

/// The keys that fit at the site. `typed`: the typed part of the last key; `quoted`: whether it is
/// in quotes.
pub(super) fn offer(scene: &CompletionScene, typed: &str, quoted: bool) -> Proposals {
    let (kind, keys) = (&scene.site.kind, scene.keys());
    let present = present(scene);
    let mut found = Proposals::of(typed);
    match of_next_key(scene.file.kind, kind, &keys) {
        KeySlot::Parameter => {
            let bare = has_equals(scene);
            for parameter in lists::parameters(scene, typed, &present) {
                let name = parameter.label.clone();
                let snippet = format!("{name} = \"$1\"");
                found.add(if bare {
                    parameter
                } else {
                    parameter.writes(format!("{name} = "), Some(snippet))
                });
            }
            return found;
        }
        KeySlot::Operand if scene.file.kind == FileKind::Test || is_open(scene) => {
            let mut found = contacts::offer(scene, typed, WantedName::Anything);
            // A key without quotes cannot contain `$`, and only rungd sets the names with `$`.
            found.retain(|proposal| {
                !proposal.label.starts_with('$') && !present.contains(&proposal.label.as_str())
            });
            return found;
        }
        KeySlot::Operand | KeySlot::Field | KeySlot::Declares(_) | KeySlot::Word => {}
    }
    if quoted {
        return found;
    }
    legs(scene, &present, &mut found);
    known(scene, &present, &mut found);
    let line = scene.file.line(scene.offset);
    let rest = scene.file.slice(scene.offset + scene.tail("_-")..line.end).trim_start();
    let is_last = rest.is_empty() || rest.starts_with('#');
    let is_first = scene.file.slice(line.start..scene.offset - typed.len()).trim().is_empty();
    let is_head = kind.is_empty() && keys.is_empty();
    let is_place = is_head || typed.is_empty() && scene.site.brace.is_none();
    if is_last && is_first && is_place && !is_above_keys(scene) {
        headers::add(scene, TABLES, &mut found);
    }
    found
}

/// The keys from the root to the site.
pub(super) fn path<'s>(scene: &'s CompletionScene) -> Vec<&'s str> {
    let kind = scene.site.kind.split('.').filter(|part| !part.is_empty());
    kind.chain(scene.keys()).collect()
}

/// Whether all keys of the table are names.
fn is_open(scene: &CompletionScene) -> bool {
    let shape = table(&scene.shape(), &path(scene));
    shape.is_some_and(|shape| shape.noted().keys.is_empty() && shape.noted().others.is_some())
}

/// The keys that the table has, without the key at the cursor.
fn present<'s>(scene: &'s CompletionScene) -> Vec<&'s str> {
    let keys = scene.keys();
    let next = |pair: &'s KeyPair| {
        let next = pair.key_below(&keys)?;
        let at_cursor = next.span.start <= scene.offset && scene.offset <= next.span.end;
        (!at_cursor).then_some(next.text.as_str())
    };
    scene.file.outline.pairs_in(scene.table()).filter_map(next).collect()
}

/// Whether keys of the table follow the cursor: a header here would move them to its own table.
fn is_above_keys(scene: &CompletionScene) -> bool {
    let (outline, keys) = (&scene.file.outline, scene.keys());
    let line = scene.file.line(scene.offset);
    let in_header = |at| outline.header_at(at).is_some_and(|header| header.span.contains(&at));
    outline.pairs_in(scene.table()).any(|pair| {
        let own = pair.key_below(&keys).map(|key| key.span.start);
        own.is_some_and(|own| own >= line.end && !in_header(own))
    })
}

/// Whether the key at the cursor has its `=`.
fn has_equals(scene: &CompletionScene) -> bool {
    let line = scene.file.line(scene.offset);
    let rest = scene.file.slice(scene.offset..line.end);
    let behind =
        rest.trim_start_matches(|c: char| c.is_ascii_alphanumeric() || "_-.\"".contains(c));
    behind.trim_start().starts_with('=')
}

/// Adds the keys that the reader of the table accepts.
fn known(scene: &CompletionScene, present: &[&str], into: &mut Proposals) {
    let Some(shape) = table(&scene.shape(), &path(scene)) else { return };
    let noted = shape.noted();
    let is_root = scene.site.kind.is_empty() && scene.site.keys.is_empty();
    let is_needed = |name: &str| noted.required.contains(&name);
    let bare = has_equals(scene);
    for (order, (key, form)) in noted.keys.iter().enumerate() {
        let by_header = match form {
            ValueForm::Table(_) => is_root,
            ValueForm::Tables(_) => is_root || BY_HEADERS.contains(&key.name),
            ValueForm::Any
            | ValueForm::Text
            | ValueForm::Words(_)
            | ValueForm::Flag
            | ValueForm::Integer(..)
            | ValueForm::Integers(..)
            | ValueForm::Duration
            | ValueForm::Period
            | ValueForm::Constant
            | ValueForm::Constants
            | ValueForm::Scalar
            | ValueForm::Texts
            | ValueForm::TextOrTexts
            | ValueForm::TextOrTable(_) => false,
        };
        let is_leg = key.name == "leg" && is_rung(scene);
        if by_header || is_leg || !is_taken(key) || present.contains(&key.name) {
            continue;
        }
        let rank = if is_needed(key.name) { NEEDED } else { OPTIONAL };
        let mut proposal = CompletionProposal::new(key.name, CompletionItemKind::PROPERTY, rank);
        proposal.order = order;
        let needed = if is_needed(key.name) { "needed" } else { "" };
        proposal = proposal.detail(needed).doc(key.doc);
        if !bare {
            let (plain, snippet) = skeleton(form);
            let snippet = Some(format!("{}{snippet}", key.name));
            proposal = proposal.writes(format!("{}{plain}", key.name), snippet);
        }
        into.add(proposal);
    }
}

fn is_rung(scene: &CompletionScene) -> bool {
    (scene.file.kind == FileKind::Ladder || scene.is_in_observer())
        && scene.site.kind.rsplit('.').next() == Some("rung")
        && scene.site.keys.is_empty()
}

/// Adds the legs that the rung lacks: the legs of its instruction, or without an instruction all
/// legs.
fn legs(scene: &CompletionScene, present: &[&str], into: &mut Proposals) {
    let within = scene.site.keys.len() == 1 && scene.site.keys[0] == "leg";
    let is_rung = is_rung(scene);
    if !(is_rung || within) || present.contains(&"when") || present.contains(&"use") {
        return;
    }
    let first = scene.value(&["do"]).and_then(|text| text.split_whitespace().next());
    let wanted = first.and_then(Mnemonic::from_name).map(|mnemonic| mnemonic.spec().legs);
    let outline = &scene.file.outline;
    let has = |leg: &LegName| {
        let pair = outline.pair(scene.table(), &["leg", leg.key()]);
        pair.is_some_and(|pair| {
            let span = &outline.pairs[pair].key().span;
            !(span.start <= scene.offset && scene.offset <= span.end)
        })
    };
    let bare = has_equals(scene);
    for (order, leg) in LegName::KEYED.into_iter().enumerate().filter(|(_, leg)| !has(leg)) {
        let rank = match wanted {
            Some(legs) if legs.contains(&leg) => 0,
            Some(_) => continue,
            None => OTHER_LEG,
        };
        let name = if within { leg.key().to_owned() } else { format!("leg.{}", leg.key()) };
        let mut proposal = CompletionProposal::new(&name, CompletionItemKind::PROPERTY, rank);
        proposal.order = order;
        proposal = proposal.detail("a leg").doc("The contacts of this leg, in series.");
        if !bare {
            let snippet = Some(format!("{name} = [\"$1\"]"));
            proposal = proposal.writes(format!("{name} = "), snippet);
        }
        into.add(proposal);
    }
}
