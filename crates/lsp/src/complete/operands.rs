//! Proposals of names for an operand: declarations that are visible at a place, members after a
//! dot, status bits and words, addresses.

use lsp_types::CompletionItemKind;

use super::addresses;
use super::describe::{detail, doc, symbol};
use super::nature::{Nature, WantedName};
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use crate::names::Meaning;
use crate::slots::DeclaredKind;
use crate::tag_facts::TagFacts;
use rungd_engine::isa::{
    Address, BlockBit, DeviceBit, MemorySizes, Structure, Word, address_text, status,
};

/// Ranks, by the place of the declaration.
const OWN: u8 = 1;
const TAG: u8 = 2;
const USE: u8 = 3;
const BLOCK: u8 = 4;
const STATUS: u8 = 6;
/// The addition to the rank of a name for each step of its distance from the wish of the place.
const FARTHER: u8 = 20;

/// Offers the names for a place. `base`: the part of the word before its last dot.
pub(super) fn offer(
    scene: &CompletionScene,
    base: Option<&str>,
    wish: WantedName,
    into: &mut Proposals,
) {
    if let Some((side, rest)) = base.and_then(|base| scene.side(base)) {
        match rest {
            "" => declared(&side, wish, into),
            rest => members(&side, rest, wish, into),
        }
    }
    match base {
        Some(base) => members(scene, base, wish, into),
        None => {
            declared(scene, wish, into);
            nicknames(wish, into);
            if !(scene.is_in_observer() && wish.is_written()) {
                addresses::offer(scene, wish, into);
            }
        }
    }
}

/// Offers the declarations that are visible at the place.
fn declared(scene: &CompletionScene, wish: WantedName, into: &mut Proposals) {
    for at in 0..scene.names().all.len() {
        let declared = &scene.names().all[at];
        if !into.fits(&declared.name) || !scene.sees(at) || is_foreign(scene, at, wish) {
            continue;
        }
        let around = declared.parent.and_then(|parent| scene.names().template_around(parent));
        let is_own = around.is_some() && around == scene.template();
        let rank = match declared.kind {
            DeclaredKind::Parameter | DeclaredKind::OwnTag if is_own => OWN,
            DeclaredKind::Use if is_own => OWN,
            DeclaredKind::Tag => TAG,
            DeclaredKind::Use if around.is_none() => USE,
            DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Device => BLOCK,
            DeclaredKind::Parameter
            | DeclaredKind::OwnTag
            | DeclaredKind::Use
            | DeclaredKind::Subroutine
            | DeclaredKind::Stage
            | DeclaredKind::Rung
            | DeclaredKind::Template
            | DeclaredKind::Record
            | DeclaredKind::Field
            | DeclaredKind::Test => continue,
        };
        add(scene, at, RankedWish { wish, rank }, into);
    }
    for device in scene.announced_devices() {
        if let Some(distance) = wish.distance(&Nature::BITS_INSIDE) {
            let rank = BLOCK + distance * FARTHER;
            let proposal = CompletionProposal::new(device, CompletionItemKind::INTERFACE, rank);
            into.add(proposal.detail("field device"));
        }
    }
}

/// Whether the site is in an observer, wants something to write, and the declaration is none of
/// the observer's own.
fn is_foreign(scene: &CompletionScene, at: usize, wish: WantedName) -> bool {
    scene.is_in_observer() && wish.is_written() && !scene.names().all[at].is_of_observer
}

/// The wish of a place, and the rank of a declaration that fits it exactly.
struct RankedWish {
    wish: WantedName,
    rank: u8,
}

/// Offers a declaration if it may fit the wish of a place.
fn add(scene: &CompletionScene, at: usize, ranked: RankedWish, into: &mut Proposals) {
    let RankedWish { wish, rank } = ranked;
    let declared = &scene.names().all[at];
    let Some(distance) = wish.distance(&scene.nature(at)) else { return };
    let proposal =
        CompletionProposal::new(&declared.name, symbol(declared.kind), rank + distance * FARTHER);
    into.add(proposal.detail(detail(declared, scene.project)).doc(doc(declared, scene.project)));
}

/// Offers the names of status bits and words.
fn nicknames(wish: WantedName, into: &mut Proposals) {
    for name in status::nicknames().filter(|name| into.fits(name)).collect::<Vec<_>>() {
        let Ok(address) = address_text::parse(name, &MemorySizes::default()) else { continue };
        if let Some(distance) = wish.distance(&Nature::of_address(address)) {
            let rank = STATUS + distance * FARTHER;
            let proposal = CompletionProposal::new(name, CompletionItemKind::CONSTANT, rank);
            into.add(proposal.detail(format!("status, {address}")));
        }
    }
}

/// Offers the members after a dot.
fn members(scene: &CompletionScene, base: &str, wish: WantedName, into: &mut Proposals) {
    let parts = scene.names().dotted(base, 0, scene.scope());
    match parts.last().map(|part| part.meaning) {
        Some(Meaning::Declared(at)) => members_of(scene, at, wish, into),
        Some(Meaning::Address(Address::Structure(structure))) => {
            structure_members(structure, wish, into);
        }
        Some(Meaning::Address(Address::Word(word))) => word_bits(word, wish, into),
        Some(Meaning::Address(_) | Meaning::Member | Meaning::Status | Meaning::Unknown) | None => {
            if scene.announced_devices().any(|device| device == base) {
                words(&DeviceBit::ALL.map(DeviceBit::name), "bit of a field device", into);
            }
        }
    }
}

fn members_of(scene: &CompletionScene, at: usize, wish: WantedName, into: &mut Proposals) {
    let declared = &scene.names().all[at];
    if let Some(structure) = scene.nature(at).structure {
        structure_members(structure, wish, into);
    }
    let file = &scene.project.files[declared.file];
    if let Some(word) = TagFacts::of(declared, file).word().filter(|_| is_tag(declared.kind)) {
        word_bits(word, wish, into);
    }
    match declared.kind {
        DeclaredKind::Program => words(&[BlockBit::Running.name()], "bit of a program", into),
        DeclaredKind::Task => words(&BlockBit::ALL.map(BlockBit::name), "bit of a task", into),
        DeclaredKind::Device => {
            words(&DeviceBit::ALL.map(DeviceBit::name), "bit of a field device", into);
        }
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Use
        | DeclaredKind::Subroutine
        | DeclaredKind::Stage
        | DeclaredKind::Rung
        | DeclaredKind::Template
        | DeclaredKind::Record
        | DeclaredKind::Field
        | DeclaredKind::Test => {}
    }
    let template = declared.template.as_deref().and_then(|name| scene.names().template(name));
    let record = scene.names().record_of(at);
    for (number, inner) in scene.names().all.iter().enumerate() {
        if !into.fits(&inner.name) {
            continue;
        }
        let is_field = inner.parent == record && inner.kind == DeclaredKind::Field;
        let is_own = inner.parent == Some(at) && inner.kind == DeclaredKind::Stage || is_field;
        let around = inner.parent.and_then(|parent| scene.names().template_around(parent));
        let is_of_template = around.is_some() && around == template;
        let is_seen =
            matches!(inner.kind, DeclaredKind::OwnTag | DeclaredKind::Use | DeclaredKind::Stage);
        if is_own || (is_of_template && is_seen) {
            add(scene, number, RankedWish { wish, rank: OWN }, into);
        }
    }
}

fn structure_members(structure: Structure, wish: WantedName, into: &mut Proposals) {
    for (name, address) in structure.members().iter().zip(structure.member_addresses()) {
        let nature = Nature::of_address(address);
        if let Some(distance) = wish.distance(&nature) {
            let what =
                if nature.word > super::nature::OperandAccess::None { "word" } else { "bit" };
            let rank = OWN + distance * FARTHER;
            let proposal = CompletionProposal::new(*name, CompletionItemKind::FIELD, rank);
            into.add(proposal.detail(format!("{what} of a {}", structure.kind_name())));
        }
    }
}

/// Offers the numbers of the bits of a word.
fn word_bits(word: Word, wish: WantedName, into: &mut Proposals) {
    for number in 0..word.bit_count() {
        let Some(bit) = word.bit(number) else { continue };
        let Some(distance) = wish.distance(&Nature::of_address(Address::Bit(bit))) else {
            continue;
        };
        let rank = OWN + distance * FARTHER;
        let name = number.to_string();
        let proposal = CompletionProposal::new(name, CompletionItemKind::FIELD, rank);
        into.add(proposal.detail("bit of a word"));
    }
}

/// Whether a declaration may name a word.
fn is_tag(kind: DeclaredKind) -> bool {
    use DeclaredKind::{Field, OwnTag, Parameter, Tag};
    matches!(kind, Tag | OwnTag | Parameter | Field)
}

fn words(words: &[&str], about: &str, into: &mut Proposals) {
    for word in words {
        into.add(CompletionProposal::new(*word, CompletionItemKind::FIELD, TAG).detail(about));
    }
}
