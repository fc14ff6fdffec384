//! The data for the search for mutants of a program: its texts, limits and scan period.
//!
//! Made once for a program; used by the other files of this folder.

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::Word;
use rungd_language::lower::WordLimits;
use rungd_language::resolve::program::Program;
use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::span::{SourceFile, Span};

use super::kind::MutantKind;
use super::mutation::Mutation;

/// The program that is searched for mutants.
pub(super) struct Ground<'a> {
    /// The program.
    pub program: &'a Program,
    files: &'a [SourceFile],
    /// The scan period, ms.
    pub period: ScanPeriod,
    /// Whether all rungs are in files of the library; then these files are under test.
    has_library_only: bool,
    limits: WordLimits,
}

/// What a mutation changes: the kind of the change, the changed text, and the number of the change
/// among those of the same kind at this text.
#[derive(Clone, Copy)]
pub(super) struct MutationSite {
    pub kind: MutantKind,
    pub span: Span,
    pub variant: u32,
}

impl MutationSite {
    /// The only change of its kind at a text.
    pub fn new(kind: MutantKind, span: Span) -> MutationSite {
        MutationSite { kind, span, variant: 0 }
    }
}

/// A mutation of one rung that was found.
pub(super) struct FoundMutation {
    /// Its kind.
    pub kind: MutantKind,
    /// Its place, in a file.
    pub place: Span,
    /// A number that distinguishes it from other mutations of its kind at its place.
    pub variant: u32,
    /// The change, in one line.
    pub what: String,
    /// The number of its branch, from 1.
    pub branch: Option<usize>,
    /// The mutation.
    pub mutation: Mutation,
}

impl<'a> Ground<'a> {
    pub fn new(program: &'a Program, files: &'a [SourceFile], period: ScanPeriod) -> Ground<'a> {
        let is_library = |span: Span| {
            files.get(span.file.0 as usize).is_some_and(|file| file.name.starts_with(LIBRARY))
        };
        let rungs = program.parts().flat_map(|part| part.rungs);
        let mut places = rungs.map(|rung| program.layers.in_file(rung.extent));
        let has_library_only = places.all(is_library);
        let limits = WordLimits::of(program);
        Ground { program, files, period, has_library_only, limits }
    }

    /// Whether the file of a place is under test. Files of the library have tests of their own.
    pub fn is_under_test(&self, place: Span) -> bool {
        let file = self.files.get(place.file.0 as usize);
        file.is_some_and(|file| self.has_library_only || !file.name.starts_with(LIBRARY))
    }

    /// The place in a file at which the author wrote contacts or an instruction; it is the same for
    /// all uses of a template.
    pub fn place(&self, span: Span) -> Span {
        let layers = &self.program.layers;
        layers.in_file(layers.text(span))
    }

    /// The place of a constant in a file; for an argument of a template, the place in the use.
    pub fn constant_place(&self, span: Span) -> Span {
        self.program.layers.in_file(span)
    }

    /// The text at a place of a file; a whole string is without its quotes.
    pub fn text(&self, place: Span) -> &'a str {
        let text = self.files.get(place.file.0 as usize).map_or("", |file| file.text.as_str());
        let text = text.get(place.start as usize..place.end as usize).unwrap_or("").trim();
        text.trim_matches(['"', '\'']).trim()
    }

    /// The text of contacts or an instruction.
    pub fn text_of(&self, span: Span) -> &'a str {
        self.text(self.place(span))
    }

    /// The text of contacts within other contacts; for an argument of a template, the name of the
    /// parameter.
    pub fn text_within(&self, part: Span, whole: Span) -> &'a str {
        let layers = &self.program.layers;
        match layers.is_given(whole.file) {
            true => self.text_of(part),
            false => self.text(layers.in_file(layers.place_in_rung(part))),
        }
    }

    /// The minimum and maximum content of a word's cell.
    pub fn limits(&self, word: Word) -> (i32, i32) {
        self.limits.get(word)
    }
}

/// A part of an instruction or contact before and after a mutation.
#[derive(Clone, Copy)]
pub(super) struct ExchangedText<'t> {
    pub old: &'t str,
    pub new: &'t str,
}

/// The text for a constant and its neighbour: `80 is 81` for a literal, `` `limit` (80) is 81`` for
/// a name.
pub(super) fn change_of_constant(written: &str, texts: ExchangedText) -> String {
    let ExchangedText { old, new } = texts;
    let is_name = written.starts_with(|char: char| char.is_ascii_alphabetic());
    match is_name {
        true => format!("`{written}` ({old}) is {new}"),
        false => format!("{written} is {new}"),
    }
}
