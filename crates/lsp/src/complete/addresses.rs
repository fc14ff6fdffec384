//! Proposals of addresses: the addresses that the project names, with their tags, and the next free
//! address of each space.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use lsp_types::CompletionItemKind;

use super::nature::{Nature, WantedName};
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use crate::slots::{DeclaredKind, FileKind};
use crate::tag_facts::TagFacts;
use crate::words::FileWordRole;
use rungd_engine::isa::{MemorySizes, Space, address_text};

/// The ranks of addresses, after the ranks of names.
const ADDRESS: u8 = 8;
const FREE: u8 = 9;
const FARTHER: u8 = 20;
/// The maximum number of elements of an array that are considered.
const COUNT_MAX: u32 = 4096;

/// Offers addresses, as soon as the word begins like an address.
pub(super) fn offer(scene: &CompletionScene, wish: WantedName, into: &mut Proposals) {
    let letters = into.typed.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    into.is_incomplete |= letters.is_empty();
    let begins = |space: &&Space| space.name().starts_with(&letters);
    let spaces: Vec<Space> = Space::ALL.iter().filter(begins).copied().collect();
    if !letters.is_empty() && !spaces.is_empty() {
        of_spaces(scene, &spaces, wish, into);
    }
}

/// Offers addresses for a tag, even before anything is typed.
pub(super) fn offer_places(scene: &CompletionScene, into: &mut Proposals) {
    into.is_incomplete = true;
    match into.typed.is_empty() {
        true => of_spaces(scene, &Space::ALL, WantedName::Anything, into),
        false => offer(scene, WantedName::Anything, into),
    }
}

fn of_spaces(scene: &CompletionScene, spaces: &[Space], wish: WantedName, into: &mut Proposals) {
    let sizes = sizes(scene);
    let tags = tagged(scene, &sizes);
    let mut used: BTreeMap<Space, BTreeSet<u32>> = BTreeMap::new();
    for (space, number) in tags.keys().copied().chain(named(scene, spaces, &sizes)) {
        used.entry(space).or_default().insert(number);
    }
    for space in spaces {
        let Some(distance) = wish.distance(&Nature::of_address(space.address(0))) else { continue };
        let rank = distance * FARTHER;
        let numbers = used.get(space).into_iter().flatten();
        for number in numbers {
            let proposal = CompletionProposal::new(
                space.address(*number).to_string(),
                CompletionItemKind::UNIT,
                ADDRESS + rank,
            );
            into.add(proposal.detail(tags.get(&(*space, *number)).cloned().unwrap_or_default()));
        }
        let taken = used.get(space);
        let free = (space.first()..space.first() + space.count(&sizes))
            .find(|number| taken.is_none_or(|taken| !taken.contains(number)));
        if let Some(free) = free.filter(|_| is_given(*space)) {
            let label = space.address(free).to_string();
            let proposal = CompletionProposal::new(label, CompletionItemKind::UNIT, FREE + rank);
            into.add(proposal.detail("the next free address"));
        }
    }
}

/// Whether a ladder's author may give the elements of a space a meaning; false for the status
/// spaces.
fn is_given(space: Space) -> bool {
    space.name() != "ST" && space.name() != "DST"
}

/// The tags of addresses; an array has its tag at each of its elements.
fn tagged(scene: &CompletionScene, sizes: &MemorySizes) -> BTreeMap<(Space, u32), String> {
    let mut tags = BTreeMap::new();
    let all = scene.names().all.iter();
    for tag in
        all.filter(|declared| matches!(declared.kind, DeclaredKind::Tag | DeclaredKind::OwnTag))
    {
        let facts = TagFacts::of(tag, &scene.project.files[tag.file]);
        let Some(Ok(address)) = facts.text("at").map(|at| address_text::parse(at, sizes)) else {
            continue;
        };
        let Some((space, first)) = Space::with_members(address) else { continue };
        let count = facts.text("count").and_then(|count| count.parse().ok()).unwrap_or(1);
        for number in 0..count.min(COUNT_MAX) {
            let element = (space, first.saturating_add(number));
            tags.entry(element).or_insert_with(|| tag.name.clone());
        }
    }
    tags
}

/// The addresses among the words of the project's files.
fn named(scene: &CompletionScene, spaces: &[Space], sizes: &MemorySizes) -> Vec<(Space, u32)> {
    let (mut seen, mut found) = (HashSet::new(), Vec::new());
    for file in &scene.project.files {
        for word in &file.words.all {
            if !matches!(
                word.role,
                FileWordRole::Reads | FileWordRole::Writes | FileWordRole::Names
            ) {
                continue;
            }
            let text = file.slice(word.span.clone());
            let text = text.split('.').next().unwrap_or(text);
            let begins = |space: &Space| {
                let number = text.strip_prefix(space.name());
                number.is_some_and(|number| number.starts_with(|c: char| c.is_ascii_digit()))
            };
            if spaces.iter().any(begins) && seen.insert(text) {
                let address = address_text::parse(text, sizes).ok();
                found.extend(address.and_then(Space::of));
            }
        }
    }
    found
}

/// The sizes of memory in the controller file.
fn sizes(scene: &CompletionScene) -> MemorySizes {
    let mut sizes = MemorySizes::default();
    let controller = scene.project.files.iter().find(|file| file.kind == FileKind::Controller);
    for space in Space::ALL {
        let count =
            controller.and_then(|file| file.value(0, &["memory", space.name()])?.parse().ok());
        if let Some(count) = count.filter(|count| (1..=65_536).contains(count)) {
            sizes = space.sized(&sizes, count);
        }
    }
    sizes
}
