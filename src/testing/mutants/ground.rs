//! What the search for mutants knows of a program: its texts, limits and scan period.
//!
//! Made once for a program; the other files of this folder ask it.

use std::collections::HashMap;

use crate::isa::{Address, Word};
use crate::resolve::program::{Program, TagMeaning};
use crate::source::file_kind::LIBRARY;
use crate::source::span::{SourceFile, Span};

use super::kind::MutantKind;
use super::mutation::Mutation;

/// The program whose mutants are sought.
pub(super) struct Ground<'a> {
    /// The program.
    pub program: &'a Program,
    files: &'a [SourceFile],
    /// The scan period, ms.
    pub period_ms: u32,
    /// Whether files of the library are under test: there is no other ladder.
    has_library_only: bool,
    /// The limits of the words whose tags have any.
    limits: HashMap<Word, (i32, i32)>,
}

/// A mutation of one rung that was found.
pub(super) struct Found {
    /// Its kind.
    pub kind: MutantKind,
    /// Its place, in a file.
    pub place: Span,
    /// What distinguishes it from others of its kind at its place.
    pub variant: u32,
    /// What is changed, in one line.
    pub what: String,
    /// The branch that it is about, from 1.
    pub branch: Option<usize>,
    /// The mutation.
    pub mutation: Mutation,
}

impl<'a> Ground<'a> {
    pub fn new(program: &'a Program, files: &'a [SourceFile], period_ms: u32) -> Ground<'a> {
        let is_library = |span: Span| {
            files.get(span.file.0 as usize).is_some_and(|file| file.name.starts_with(LIBRARY))
        };
        let rungs = program.parts().flat_map(|part| part.rungs);
        let mut places = rungs.map(|rung| program.layers.in_file(rung.extent));
        let has_library_only = places.all(is_library);
        let limits = limits(program);
        Ground { program, files, period_ms, has_library_only, limits }
    }

    /// Whether the file of a place is under test. Files of the library have tests of their own.
    pub fn is_under_test(&self, place: Span) -> bool {
        let file = self.files.get(place.file.0 as usize);
        file.is_some_and(|file| self.has_library_only || !file.name.starts_with(LIBRARY))
    }

    /// The place of contacts or an instruction in a file: where their author wrote them, for all
    /// uses of a template alike.
    pub fn place(&self, span: Span) -> Span {
        let layers = &self.program.layers;
        layers.in_file(layers.text(span))
    }

    /// The place of a constant in a file: of one that a use gives, in the use.
    pub fn constant_place(&self, span: Span) -> Span {
        self.program.layers.in_file(span)
    }

    /// The text of a place of a file; of a whole string without its quotes.
    pub fn text(&self, place: Span) -> &'a str {
        let text = self.files.get(place.file.0 as usize).map_or("", |file| file.text.as_str());
        let text = text.get(place.start as usize..place.end as usize).unwrap_or("").trim();
        text.trim_matches(['"', '\'']).trim()
    }

    /// The text of contacts or an instruction.
    pub fn text_of(&self, span: Span) -> &'a str {
        self.text(self.place(span))
    }

    /// The text of contacts as it stands in others: of contacts that a use gives, the name of the
    /// parameter.
    pub fn text_within(&self, part: Span, whole: Span) -> &'a str {
        let layers = &self.program.layers;
        match layers.is_given(whole.file) {
            true => self.text_of(part),
            false => self.text(layers.in_file(layers.stands_at(part))),
        }
    }

    /// The least and greatest content of a word's cell.
    pub fn limits(&self, word: Word) -> (i32, i32) {
        self.limits.get(&word).copied().unwrap_or(word.range())
    }
}

fn limits(program: &Program) -> HashMap<Word, (i32, i32)> {
    let mut limits = HashMap::new();
    for tag in &program.tags {
        let TagMeaning::Address(Address::Word(word)) = tag.meaning else { continue };
        let (low, high) = limits.get(&word).copied().unwrap_or(word.range());
        let low = tag.min.map_or(low, |(min, _)| low.max(min));
        let high = tag.max.map_or(high, |(max, _)| high.min(max));
        if (low, high) != word.range() {
            limits.insert(word, (low, high.max(low)));
        }
    }
    limits
}

/// A constant and its neighbour, for people: of a literal `80 is 81`, of a name `` `limit` (80) is
/// 81``.
pub(super) fn change_of_constant(written: &str, (old, new): (&str, &str)) -> String {
    let is_name = written.starts_with(|char: char| char.is_ascii_alphabetic());
    match is_name {
        true => format!("`{written}` ({old}) is {new}"),
        false => format!("{written} is {new}"),
    }
}
