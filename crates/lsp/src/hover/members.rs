//! The meaning of a member of a structure, a block or a field device. For timers and counters it
//! comes from the page of the instruction that owns the structure.

use std::ops::Range;

use super::super::names::Meaning;
use super::super::project::Project;
use super::super::slots::DeclaredKind;
use super::super::tag_facts::TagFacts;
use super::super::workspace::Cursor;
use super::uses;
use rungd_engine::isa::instruction::TABLE;
use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockBit, DeviceBit, Mnemonic, Space, Spec, Word, WordSpace, status,
};

/// The meaning of a member after a name: `.Done` of `late.Done`.
pub(super) fn of_word(cursor: &Cursor, range: &Range<usize>) -> Option<String> {
    let word = cursor.word()?;
    let project = &cursor.project;
    let parts = project.names.parts(cursor.numbered(), word);
    let before = parts.iter().rev().find_map(|part| match part.meaning {
        Meaning::Declared(at) if part.span.end < range.end => Some(at),
        Meaning::Declared(_)
        | Meaning::Member
        | Meaning::Address(_)
        | Meaning::Status
        | Meaning::Unknown => None,
    })?;
    let name = cursor.file().slice(range.clone());
    let declared = &project.names.all[before];
    let meaning = match declared.kind {
        DeclaredKind::Program | DeclaredKind::Task => {
            BlockBit::from_name(name)?.meaning().to_owned()
        }
        DeclaredKind::Device => DeviceBit::from_name(name)?.meaning().to_owned(),
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Field
            if name.bytes().all(|byte| byte.is_ascii_digit()) =>
        {
            let facts = TagFacts::of(declared, &project.files[declared.file]);
            let last = facts.word()?.bit_count().checked_sub(1)?;
            format!("a bit of the word, of 0 (the lowest) to {last}")
        }
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Field => of_structure(owners(project, before), name)?,
        DeclaredKind::Subroutine
        | DeclaredKind::Stage
        | DeclaredKind::Rung
        | DeclaredKind::Template
        | DeclaredKind::Use
        | DeclaredKind::Record
        | DeclaredKind::Test => return None,
    };
    Some(format!("**.{name}** of {}: {meaning}\n", declared.name))
}

/// The meaning of a status bit or word; `None` for every other address.
pub(super) fn of_status(address: Address) -> Option<&'static str> {
    match address {
        Address::Bit(Bit::Space(BitSpace::St, n)) => status::bit_meaning(n),
        Address::Word(Word::Space(WordSpace::Dst, n)) => status::word_meaning(n),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
    }
}

/// The meaning of the address of a member; `None` for every other address.
pub(super) fn of_address(project: &Project, address: Address) -> Option<String> {
    let member = address.member()?;
    let tag = uses::tags_of(project, address).first().map(|at| owners(project, *at));
    let owners = tag.unwrap_or_else(|| {
        Space::with_members(address).map_or_else(Vec::new, |(space, _)| owners_in(space).collect())
    });
    Some(format!("{}\n", of_structure(owners, member)?))
}

/// The instructions that have a tag as their structure, followed by all that could.
fn owners(project: &Project, tag: usize) -> Vec<Mnemonic> {
    let mut owners = uses::owners(project, tag);
    owners
        .extend([Space::Timer, Space::Counter, Space::Sensaphone].into_iter().flat_map(owners_in));
    owners
}

/// The instructions of the table that own a structure of this space.
fn owners_in(space: Space) -> impl Iterator<Item = Mnemonic> {
    let owns =
        move |row: &&Spec| row.owned().is_some_and(|owned| owned.kind.is_structure_of(space));
    TABLE.iter().filter(owns).map(|row| row.mnemonic)
}

/// The text about a member in the page of the first instruction that has such a member.
fn of_structure(owners: Vec<Mnemonic>, name: &str) -> Option<String> {
    owners.into_iter().find_map(|mnemonic| {
        let page = mnemonic.spec().page;
        let members = page.split("\n## Members\n").nth(1)?.split("\n## ").next()?;
        let row = members.lines().find(|line| line.starts_with(&format!("| `.{name}` ")))?;
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        Some(format!("{} ({})", cells.get(2)?, cells.get(1)?))
    })
}
