//! The places that write and read a declaration or address: the words of all files of a project
//! that mean it, by its name or its address, each with its place and the text around it.

use std::collections::HashSet;
use std::fmt::Write as _;

use super::super::file::{EditorFile, NumberedFile};
use super::super::names::{Meaning, ProjectNames};
use super::super::project::Project;
use super::super::slots::{DeclaredKind, FileKind, is_of_observer};
use super::super::tag_facts::TagFacts;
use super::super::words::{FileWord, FileWordRole};
use rungd_engine::isa::{Address, Mnemonic, Space};

/// The maximum number of lines of a list.
pub(super) const LINES_MAX: usize = 8;
/// The maximum number of characters of a text in a list.
const SHORT_MAX: usize = 70;

/// The uses of a declaration or address. Each list is in the order of files and places.
#[derive(Debug, Default)]
pub(super) struct HoverUses {
    /// The lists in the order of `TITLES`; uses beyond `LINES_MAX` are counted, but have no line.
    lists: [UseList; 6],
    /// How often tests name the declaration or address.
    tests: usize,
    /// Whether an observer declares it: the lines are those of its rungs.
    is_of_observer: bool,
}

#[derive(Debug, Default)]
struct UseList {
    lines: Vec<String>,
    count: usize,
}

const TITLES: [&str; 6] =
    ["Written by", "Read by", "Given to", "Controller file", "Started or left by", "Used by"];

/// The declarations and the address to find.
struct SoughtUses {
    declared: HashSet<usize>,
    address: Option<Address>,
}

/// The uses of a declaration; for a tag with an address, also the uses of the address.
pub(super) fn of_declared(project: &Project, at: usize) -> HoverUses {
    let address = address_of(project, at);
    let mut sought = sought(project, address);
    sought.declared.insert(at);
    collect(project, &sought)
}

/// The instructions that have a tag as their structure, in the order of places.
pub(super) fn owners(project: &Project, tag: usize) -> Vec<Mnemonic> {
    let mut sought = sought(project, address_of(project, tag));
    sought.declared.insert(tag);
    let mut owners = Vec::new();
    for (number, file) in project.files.iter().enumerate() {
        let words = file.words.all.iter().filter(|word| word.role == FileWordRole::Writes);
        for word in words.filter(|word| sought.means(project, NumberedFile { number, file }, word))
        {
            let before = file
                .words
                .all
                .partition_point(|word_before| word_before.span.start < word.span.start);
            let near = file.words.all[..before].last();
            if let Some(FileWord { role: FileWordRole::Mnemonic(mnemonic), .. }) = near
                && mnemonic.owns_structure()
            {
                owners.push(*mnemonic);
            }
        }
    }
    owners
}

/// The uses of an address, also by its tags.
pub(super) fn of_address(project: &Project, address: Address) -> HoverUses {
    collect(project, &sought(project, Some(address)))
}

/// The tags of an address.
pub(super) fn tags_of(project: &Project, address: Address) -> Vec<usize> {
    let tags = 0..project.names.all.len();
    let has = |at: &usize| {
        address_of(project, *at).is_some_and(|own_address| is_same(own_address, address))
    };
    tags.filter(has).collect()
}

/// The address of a tag, if it has one.
pub(super) fn address_of(project: &Project, at: usize) -> Option<Address> {
    let declared = &project.names.all[at];
    if !matches!(declared.kind, DeclaredKind::Tag | DeclaredKind::OwnTag) {
        return None;
    }
    TagFacts::of(declared, &project.files[declared.file]).address()
}

/// Whether two addresses are the same, or belong to the same structure.
fn is_same(a: Address, b: Address) -> bool {
    a == b || Space::with_members(a).is_some_and(|space| Space::with_members(b) == Some(space))
}

fn sought(project: &Project, address: Option<Address>) -> SoughtUses {
    let declared = address.map(|address| tags_of(project, address)).unwrap_or_default();
    SoughtUses { declared: declared.into_iter().collect(), address }
}

impl SoughtUses {
    /// Whether a word means one of them.
    fn means(&self, project: &Project, file: NumberedFile, word: &FileWord) -> bool {
        project.names.parts(file, word).iter().any(|part| match part.meaning {
            Meaning::Declared(at) => self.declared.contains(&at),
            Meaning::Address(own_address) => {
                self.address.is_some_and(|wanted| is_same(own_address, wanted))
            }
            Meaning::Member | Meaning::Status | Meaning::Unknown => false,
        })
    }
}

fn collect(project: &Project, sought: &SoughtUses) -> HoverUses {
    let is_of_observer = sought.declared.iter().any(|at| project.names.all[*at].is_of_observer);
    let mut uses = HoverUses { is_of_observer, ..HoverUses::default() };
    for (number, file) in project.files.iter().enumerate() {
        for word in &file.words.all {
            if sought.means(project, NumberedFile { number, file }, word) {
                uses.add(project, NumberedFile { number, file }, word);
            }
        }
    }
    uses
}

impl HoverUses {
    fn add(&mut self, project: &Project, numbered: NumberedFile, word: &FileWord) {
        let Some(list) = self.list(numbered.file, word) else {
            let names = !matches!(word.role, FileWordRole::Declares(_));
            self.tests += usize::from(names && numbered.file.kind == FileKind::Test);
            return;
        };
        let UseList { lines, count } = &mut self.lists[list];
        *count += 1;
        if lines.len() < LINES_MAX {
            lines.push(line(project, numbered, word));
        }
    }

    /// The number of the list that a word belongs to.
    fn list(&self, file: &EditorFile, word: &FileWord) -> Option<usize> {
        let object = &file.outline.objects[word.object].kind;
        match is_of_observer(file.kind, object) {
            true if !self.is_of_observer => None,
            true => list(FileKind::Ladder, file, word),
            false => list(file.kind, file, word),
        }
    }

    /// The uses as Markdown; empty without uses.
    pub fn shown(&self) -> String {
        let mut text = String::new();
        for (UseList { lines, count }, title) in self.lists.iter().zip(TITLES) {
            if !lines.is_empty() {
                let _ = write!(text, "\n{title}:\n\n{}", lines.concat());
            }
            if *count > lines.len() {
                let _ = writeln!(text, "- and {} more", count - lines.len());
            }
        }
        match self.tests {
            0 => {}
            1 => text.push_str("\nTests name it once.\n"),
            many => drop(write!(text, "\nTests name it {many} times.\n")),
        }
        text
    }
}

/// The number of the list that a word of a file of this kind belongs to.
fn list(kind: FileKind, file: &EditorFile, word: &FileWord) -> Option<usize> {
    match (kind, word.role) {
        (FileKind::Test, _) | (_, FileWordRole::Declares(_)) => None,
        (FileKind::Controller, FileWordRole::Names) => Some(3),
        (_, FileWordRole::Writes) => Some(0),
        (_, FileWordRole::Reads) => Some(1),
        (FileKind::Ladder, FileWordRole::Names) => {
            let is_argument = file.outline.pairs[word.pair].keys[0].text == "with";
            is_argument.then_some(2)
        }
        (_, FileWordRole::Block | FileWordRole::Stage) => Some(4),
        (
            _,
            FileWordRole::Template
            | FileWordRole::Type
            | FileWordRole::Parameter
            | FileWordRole::Placeholder
            | FileWordRole::Device,
        ) => Some(5),
        (
            _,
            FileWordRole::File
            | FileWordRole::DeviceLadder
            | FileWordRole::Mnemonic(_)
            | FileWordRole::Function(_)
            | FileWordRole::Warning,
        ) => None,
    }
}

fn line(project: &Project, numbered: NumberedFile, word: &FileWord) -> String {
    let file = numbered.file;
    let line = file.place(word.span.clone()).start.line + 1;
    let name = file.path.file_name().unwrap_or(file.path.as_os_str()).to_string_lossy();
    let text = match file.outline.value_at(&word.span) {
        Some(value) if file.kind != FileKind::Controller => file.slice(value.inner.clone()),
        Some(_) | None => file.slice(file.line(word.span.start)).trim(),
    };
    let place = place(project, numbered, word);
    format!("- `{}` {place}{name}:{line}\n", short(text))
}

/// The block, Stage and rung that contain a word.
fn place(project: &Project, numbered: NumberedFile, word: &FileWord) -> String {
    let (names, file) = (&project.names, numbered.file);
    let block = match names.holder(numbered, word.object) {
        Some(holder) => block(names, holder),
        None if file.kind == FileKind::Test => "observer".to_owned(),
        None => return String::new(),
    };
    let name = file.value(word.object, &["name"]);
    let is_of_rung = file.outline.objects[word.object].kind.ends_with(".rung");
    match name.filter(|_| is_of_rung) {
        Some(name) => format!("{block}/{name} "),
        None => format!("{block} "),
    }
}

/// A block, or a Stage with its Program.
fn block(names: &ProjectNames, holder: usize) -> String {
    let declared = &names.all[holder];
    match declared.parent.filter(|_| declared.kind == DeclaredKind::Stage) {
        Some(parent) => format!("{}.{}", names.all[parent].name, declared.name),
        None => declared.name.clone(),
    }
}

/// A text, cut to the length of a line.
pub(super) fn short(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    let is_whole = line.len() == text.len() && line.chars().count() <= SHORT_MAX;
    match is_whole {
        true => line.to_owned(),
        false => line.chars().take(SHORT_MAX).collect::<String>() + "…",
    }
}
