//! The context of a cursor: its file, its place, the block or template around it.

use super::nature::Nature;
use super::site::CompletionSite;
use crate::file::EditorFile;
use crate::names::{NameScope, ProjectNames};
use crate::project::{Library, Project};
use crate::slots::{DeclaredKind, Slot, is_of_observer, of_path};
use crate::workspace::Cursor;
use rungd_language::source::shape::TableShape;

/// A cursor with the data that completion needs.
pub(super) struct CompletionScene<'c> {
    /// The files.
    pub library: &'c Library,
    /// The project.
    pub project: &'c Project,
    /// Its file.
    pub file: &'c EditorFile,
    /// The byte of the cursor.
    pub offset: usize,
    /// The number of its file.
    number: usize,
    /// Its place.
    pub site: CompletionSite,
    /// The Program, Task or template around it.
    pub block: Option<usize>,
}

impl<'c> CompletionScene<'c> {
    /// The scene of a cursor.
    pub fn new(library: &'c Library, cursor: &'c Cursor) -> CompletionScene<'c> {
        let (file, offset) = (cursor.file(), cursor.offset);
        let site = CompletionSite::of(file, offset);
        let block = cursor.project.names.block_of(cursor.numbered(), site.object);
        let number = cursor.number;
        CompletionScene { library, project: &cursor.project, file, offset, number, site, block }
    }

    /// The own ladder of the device that a name begins with, and the rest of the name.
    pub fn side<'t>(&self, name: &'t str) -> Option<(CompletionScene<'c>, &'t str)> {
        let (side, rest) = self.project.side(self.number, name)?;
        let project = &side.project;
        let (file, number, block) = (project.files.first()?, usize::MAX, None);
        let (library, site) = (self.library, self.site.clone());
        let scene = CompletionScene { library, project, file, offset: 0, number, site, block };
        Some((scene, rest))
    }

    /// The names of the project.
    pub fn names(&self) -> &'c ProjectNames {
        &self.project.names
    }

    /// The template around the cursor.
    pub fn template(&self) -> Option<usize> {
        self.block.filter(|at| self.names().all[*at].kind == DeclaredKind::Template)
    }

    /// What a name at the site can mean.
    pub fn scope(&self) -> NameScope {
        NameScope { file: self.number, block: self.block }
    }

    /// Whether a declaration is visible in this file: an observer's names are in its own file only.
    pub fn sees(&self, at: usize) -> bool {
        let declared = &self.names().all[at];
        !declared.is_of_observer || declared.file == self.number
    }

    /// Whether the site is in a rung of an observer.
    pub fn is_in_observer(&self) -> bool {
        is_of_observer(self.file.kind, &self.site.kind)
    }

    /// The properties of a declaration.
    pub fn nature(&self, at: usize) -> Nature {
        let declared = &self.names().all[at];
        let nature = Nature::of(declared, &self.project.files[declared.file]);
        Nature { record: self.names().record_of(at), ..nature }
    }

    /// The typed text from a byte to the cursor.
    pub fn typed(&self, start: usize) -> &'c str {
        self.file.slice(start..self.offset)
    }

    /// The length of the rest of the word after the cursor. `signs`: the signs that the word may
    /// contain besides letters and digits.
    pub fn tail(&self, signs: &str) -> usize {
        let rest = self.file.slice(self.offset..self.file.line(self.offset).end);
        let ends = |c: char| !(c.is_ascii_alphanumeric() || signs.contains(c));
        rest.find(ends).unwrap_or(rest.len())
    }

    /// The keys of the site.
    pub fn keys(&self) -> Vec<&str> {
        self.site.keys.iter().map(String::as_str).collect()
    }

    /// What the value at the site stands for.
    pub fn slot(&self) -> Slot {
        of_path(self.file.kind, &self.site.kind, &self.keys())
    }

    /// The keys that a file of this kind may have.
    pub fn shape(&self) -> TableShape {
        self.file.kind.shape()
    }

    /// The object with the pairs around the cursor; in a row of an array, the object of the row.
    pub fn table(&self) -> usize {
        let objects = &self.file.outline.objects;
        let is_row = |brace| objects.iter().position(|object| object.extent.start == brace);
        self.site.brace.and_then(is_row).unwrap_or(self.site.object)
    }

    /// The first value of a pair of the site's table.
    pub fn value(&self, keys: &[&str]) -> Option<&'c str> {
        self.file.value(self.table(), keys)
    }

    /// All values of a pair of the site's table, except the value at the cursor.
    pub fn other_values(&self, keys: &[&str]) -> Vec<&'c str> {
        let all = self.file.outline.values_of(self.table(), keys);
        let others =
            all.filter(|value| !(value.inner.start..=value.inner.end).contains(&self.offset));
        others.map(|value| self.file.slice(value.inner.clone())).collect()
    }

    /// The field devices that ladders announce; a controller file will declare them.
    pub fn announced_devices(&self) -> impl Iterator<Item = &'c str> {
        self.project.files.iter().flat_map(|file| {
            let values = file.outline.values_of(0, &["ladder", "devices"]);
            values.map(|value| file.slice(value.inner.clone()))
        })
    }
}
