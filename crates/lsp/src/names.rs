//! The meanings of the names of a project: the declarations of all its files, and a look-up of the
//! declaration that each part of a word means.
//!
//! It is built from the words alone, so it also works for a file with errors. The look-up has the
//! order of the resolver (`resolve::scope`): within a template, its parameters and tags come first.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::file::{EditorFile, NumberedFile};
use super::slots::{DeclaredKind, FileKind};
use super::words::{FileWord, FileWordRole};
use rungd_engine::isa::address_text;
use rungd_engine::isa::{Address, MemorySizes};

/// A declaration in a project.
#[derive(Debug)]
pub(super) struct Declaration {
    /// Its kind.
    pub kind: DeclaredKind,
    /// Its name.
    pub name: String,
    /// The number of its file.
    pub file: usize,
    /// The place of its name.
    pub span: Range<usize>,
    /// The object that it is, or that contains it.
    pub object: usize,
    /// The pair of its name.
    pub pair: usize,
    /// The block, stage or template that it belongs to.
    pub parent: Option<usize>,
    /// Its explanation.
    pub doc: Option<String>,
    /// The name of the template that it uses.
    pub template: Option<String>,
    /// The `type` of a tag or parameter, which may be a record.
    pub type_name: Option<String>,
    /// Whether it belongs to the observer of a test file: no other file has this name.
    pub is_of_observer: bool,
}

/// Where a name stands: what it can mean depends on this.
#[derive(Clone, Copy, Debug)]
pub(super) struct NameScope {
    /// The number of the file.
    pub file: usize,
    /// The Program, Task or template around the name.
    pub block: Option<usize>,
}

/// The meaning of a part of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A declaration, by its number.
    Declared(usize),
    /// A member of the part before it: `.Acc`, `.Running`.
    Member,
    /// An address.
    Address(Address),
    /// A status bit.
    Status,
    /// An unknown name.
    Unknown,
}

/// A part of a word, between its dots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WordPart {
    /// Its place.
    pub span: Range<usize>,
    /// Its meaning.
    pub meaning: Meaning,
}

/// All names of a project.
#[derive(Debug, Default)]
pub(super) struct ProjectNames {
    /// The declarations, by file and place.
    pub all: Vec<Declaration>,
    globals: HashMap<String, usize>,
    /// The names of observers, by file and name.
    observers: HashMap<(usize, String), usize>,
    templates: HashMap<String, usize>,
    records: HashMap<String, usize>,
    /// By the parent and the name.
    members: HashMap<(usize, String), usize>,
    /// By file and object.
    objects: HashMap<(usize, usize), usize>,
    /// By file and the first byte of the name.
    places: HashMap<(usize, usize), usize>,
}

impl ProjectNames {
    /// The names of the files of a project.
    pub fn of(files: &[Arc<EditorFile>]) -> ProjectNames {
        let mut names = ProjectNames::default();
        for (number, file) in files.iter().enumerate() {
            for word in &file.words.all {
                if let FileWordRole::Declares(kind) = word.role {
                    names.declare(NumberedFile { number, file }, word, kind);
                }
            }
        }
        for at in 0..names.all.len() {
            let number = names.all[at].file;
            names.link(at, NumberedFile { number, file: &files[number] });
        }
        names
    }

    fn declare(
        &mut self,
        NumberedFile { number, file }: NumberedFile,
        word: &FileWord,
        kind: DeclaredKind,
    ) {
        let outline = &file.outline;
        let text = |key| file.value(word.object, &[key]).map(str::to_owned);
        // A key declares no use, and its object is often the root, which has thousands of pairs.
        let template = if is_of_key(kind) { None } else { text("use") };
        let doc = match is_of_key(kind) {
            true => {
                let doc = outline.value_below(word.pair, "doc");
                doc.map(|doc| file.slice(doc.inner.clone()).to_owned())
            }
            false => text("doc"),
        };
        let kind = match (kind, &template) {
            (DeclaredKind::Rung, Some(_)) => DeclaredKind::Use,
            (kind, _) => kind,
        };
        let name = file.slice(word.span.clone()).to_owned();
        if let Some(last) = self.all.last()
            && last.kind == kind
            && (last.file, last.object, &last.name) == (number, word.object, &name)
            && is_of_key(kind)
        {
            // `tags.eye.at` and `tags.eye.doc` declare the same tag.
            self.places.insert((number, word.span.start), self.all.len() - 1);
            return;
        }
        let (span, object, at) = (word.span.clone(), word.object, self.all.len());
        let is_seen = matches!(kind, DeclaredKind::Tag | DeclaredKind::Use);
        let is_of_observer = is_seen && file.kind == FileKind::Test;
        let slice = |span| file.slice(span);
        self.places.insert((number, span.start), at);
        if is_holder(kind) {
            self.objects.entry((number, object)).or_insert(at);
        }
        let (file, pair, parent) = (number, word.pair, None);
        let type_name = outline.value_below(word.pair, "type").filter(|_| is_of_key(kind));
        let type_name = type_name.map(|value| slice(value.inner.clone()).to_owned());
        self.all.push(Declaration {
            kind,
            name,
            file,
            span,
            object,
            pair,
            parent,
            doc,
            template,
            type_name,
            is_of_observer,
        });
    }

    /// Sets the parent of a declaration, and registers its name there.
    fn link(&mut self, at: usize, file: NumberedFile) {
        let declared = &self.all[at];
        let (kind, name, object) = (declared.kind, declared.name.clone(), declared.object);
        let parent = match is_holder(kind) {
            true if object == 0 => None,
            true => self.holder(file, file.file.outline.objects[object].parent),
            false => self.holder(file, object),
        };
        self.all[at].parent = parent;
        if kind == DeclaredKind::Device {
            self.unite(at);
        }
        match self.all[at].is_of_observer {
            true => drop(self.observers.entry((file.number, name)).or_insert(at)),
            false => self.know(at, kind, name, parent),
        }
    }

    /// Several controller files with the same ladder each declare the device that the ladder names.
    /// They count as one declaration, the first of them.
    fn unite(&mut self, at: usize) {
        let declared = &self.all[at];
        let place = (declared.file, declared.span.start);
        let same = self.global(&declared.name).filter(|first| {
            self.all[*first].kind == DeclaredKind::Device && self.all[*first].file != declared.file
        });
        if let Some(first) = same {
            self.places.insert(place, first);
        }
    }

    fn know(&mut self, at: usize, kind: DeclaredKind, name: String, parent: Option<usize>) {
        let in_template = parent.and_then(|parent| self.template_around(parent));
        match (kind, in_template) {
            (DeclaredKind::Template, _) => drop(self.templates.entry(name).or_insert(at)),
            (DeclaredKind::Record, _) => drop(self.records.entry(name).or_insert(at)),
            (DeclaredKind::Parameter | DeclaredKind::OwnTag, Some(template))
            | (DeclaredKind::Use | DeclaredKind::Stage, Some(template)) => {
                self.members.entry((template, name)).or_insert(at);
            }
            (
                DeclaredKind::Stage
                | DeclaredKind::Parameter
                | DeclaredKind::OwnTag
                | DeclaredKind::Field,
                _,
            ) => {
                if let Some(parent) = parent {
                    self.members.entry((parent, name)).or_insert(at);
                }
            }
            (DeclaredKind::Rung | DeclaredKind::Test, _) => {}
            (
                DeclaredKind::Tag
                | DeclaredKind::Program
                | DeclaredKind::Task
                | DeclaredKind::Subroutine
                | DeclaredKind::Use
                | DeclaredKind::Device,
                _,
            ) => drop(self.globals.entry(name).or_insert(at)),
        }
    }

    /// The template that a declaration is, or belongs to.
    pub fn template_around(&self, mut at: usize) -> Option<usize> {
        loop {
            if self.all[at].kind == DeclaredKind::Template {
                return Some(at);
            }
            at = self.all[at].parent?;
        }
    }

    /// The block, stage or template that an object is, or that contains the object.
    pub fn holder(&self, file: NumberedFile, object: usize) -> Option<usize> {
        let NumberedFile { number, file } = file;
        let mut at = object;
        loop {
            if let Some(found) = self.objects.get(&(number, at)) {
                return Some(*found);
            }
            let parent = file.outline.objects[at].parent;
            if parent == at {
                return None;
            }
            at = parent;
        }
    }

    /// The Program, Task or template that contains a word.
    pub fn block_of(&self, file: NumberedFile, object: usize) -> Option<usize> {
        let mut at = self.holder(file, object)?;
        while self.all[at].kind == DeclaredKind::Stage {
            at = self.all[at].parent?;
        }
        Some(at)
    }

    /// The declaration of a template.
    pub fn template(&self, name: &str) -> Option<usize> {
        self.templates.get(name).copied()
    }

    /// The declaration of a global name.
    pub fn global(&self, name: &str) -> Option<usize> {
        self.globals.get(name).copied()
    }

    /// The declaration of a name within a template.
    pub fn own(&self, template: usize, name: &str) -> Option<usize> {
        self.members.get(&(template, name.to_owned())).copied()
    }

    /// The declaration that a part after a dot names.
    pub fn member(&self, holder: usize, name: &str) -> Option<usize> {
        let own = self.members.get(&(holder, name.to_owned())).copied();
        let template = || self.template(self.all[holder].template.as_deref()?);
        own.or_else(|| self.own(template()?, name))
            .or_else(|| self.own(self.record_of(holder)?, name))
    }

    /// The record that is the type of a tag or parameter.
    pub fn record_of(&self, at: usize) -> Option<usize> {
        self.records.get(self.all[at].type_name.as_deref()?).copied()
    }

    /// The declaration of a record.
    pub fn record(&self, name: &str) -> Option<usize> {
        self.records.get(name).copied()
    }

    /// The meanings of the parts of a word.
    pub fn parts(&self, numbered: NumberedFile, word: &FileWord) -> Vec<WordPart> {
        let NumberedFile { number, file } = numbered;
        let text = file.slice(word.span.clone());
        let one = |meaning| vec![WordPart { span: word.span.clone(), meaning }];
        let known = |at: Option<usize>| one(at.map_or(Meaning::Unknown, Meaning::Declared));
        match word.role {
            FileWordRole::Declares(_) => {
                known(self.places.get(&(number, word.span.start)).copied())
            }
            FileWordRole::Reads | FileWordRole::Writes | FileWordRole::Names => {
                let scope = NameScope { file: number, block: self.block_of(numbered, word.object) };
                match &word.array {
                    Some(array) => {
                        let whole = format!("{}.{text}", file.slice(array.clone()));
                        self.behind(&whole, array.len() + 1, word.span.start, scope)
                    }
                    None => self.dotted(text, word.span.start, scope),
                }
            }
            FileWordRole::Type => known(self.record(text)),
            FileWordRole::Block => {
                let is_block = |at: &usize| {
                    let kind = self.all[*at].kind;
                    matches!(
                        kind,
                        DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Subroutine
                    )
                };
                known(self.global(text).filter(is_block))
            }
            FileWordRole::Stage => {
                let block = self.block_of(numbered, word.object);
                known(block.and_then(|block| self.member(block, text)))
            }
            FileWordRole::Template => known(self.template(text)),
            FileWordRole::Parameter => {
                let used = file.value(word.object, &["use"]);
                let used = used.and_then(|used| self.template(used));
                known(used.and_then(|template| self.own(template, text)))
            }
            FileWordRole::Device => {
                known(self.global(text).filter(|at| self.all[*at].kind == DeclaredKind::Device))
            }
            FileWordRole::Placeholder => {
                let block = self.block_of(numbered, word.object);
                known(block.and_then(|block| self.own(block, text)))
            }
            FileWordRole::File
            | FileWordRole::DeviceLadder
            | FileWordRole::Mnemonic(_)
            | FileWordRole::Function(_)
            | FileWordRole::Warning => Vec::new(),
        }
    }

    /// The meanings of the parts of a name from a byte on; `start`: the place of this byte.
    fn behind(&self, whole: &str, from: usize, start: usize, scope: NameScope) -> Vec<WordPart> {
        let parts = self.dotted(whole, 0, scope).into_iter();
        let parts = parts.filter(|part| part.span.start >= from);
        let moved = |part: WordPart| {
            let span = part.span.start - from + start..part.span.end - from + start;
            WordPart { span, ..part }
        };
        let parts: Vec<WordPart> = parts.map(moved).collect();
        match parts.is_empty() {
            true => {
                let span = start..start + whole.len() - from;
                vec![WordPart { span, meaning: Meaning::Unknown }]
            }
            false => parts,
        }
    }

    /// The meanings of the parts of a name in a scope; `start`: the place of the name.
    pub fn dotted(&self, text: &str, start: usize, scope: NameScope) -> Vec<WordPart> {
        let part =
            |from: usize, to: usize, meaning| WordPart { span: start + from..start + to, meaning };
        let first = text.split('.').next().unwrap_or(text);
        let template = scope.block.filter(|at| self.all[*at].kind == DeclaredKind::Template);
        let own = template.and_then(|template| self.own(template, first));
        let observers = || self.observers.get(&(scope.file, first.to_owned())).copied();
        let Some(mut at) = own.or_else(observers).or_else(|| self.global(first)) else {
            let meaning = match address_text::parse(text, &MemorySizes::default()) {
                Ok(address) => Meaning::Address(address),
                Err(_) if text.starts_with('$') => Meaning::Status,
                Err(_) => Meaning::Unknown,
            };
            return vec![part(0, text.len(), meaning)];
        };
        let mut parts = vec![part(0, first.len(), Meaning::Declared(at))];
        let mut from = first.len() + 1;
        for piece in text.split('.').skip(1) {
            match self.member(at, piece) {
                Some(member) => {
                    parts.push(part(from, from + piece.len(), Meaning::Declared(member)));
                    at = member;
                }
                None => {
                    parts.push(part(from, text.len().max(from), Meaning::Member));
                    break;
                }
            }
            from += piece.len() + 1;
        }
        parts
    }
}

/// Whether a key makes a declaration of this kind.
pub(super) fn is_of_key(kind: DeclaredKind) -> bool {
    match kind {
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Field => true,
        DeclaredKind::Record
        | DeclaredKind::Program
        | DeclaredKind::Task
        | DeclaredKind::Subroutine
        | DeclaredKind::Stage
        | DeclaredKind::Rung
        | DeclaredKind::Template
        | DeclaredKind::Use
        | DeclaredKind::Device
        | DeclaredKind::Test => false,
    }
}

/// Whether a declaration of this kind is an object that other declarations can belong to.
fn is_holder(kind: DeclaredKind) -> bool {
    match kind {
        DeclaredKind::Program
        | DeclaredKind::Task
        | DeclaredKind::Subroutine
        | DeclaredKind::Stage
        | DeclaredKind::Template
        | DeclaredKind::Record
        | DeclaredKind::Device
        | DeclaredKind::Test => true,
        DeclaredKind::Tag
        | DeclaredKind::Rung
        | DeclaredKind::Parameter
        | DeclaredKind::OwnTag
        | DeclaredKind::Field
        | DeclaredKind::Use => false,
    }
}
