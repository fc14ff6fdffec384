//! The values of both sides of the compares in a text of contacts, if a side is an expression:
//! `139 > 120`. `hints` shows them beside the values of the words.
//!
//! The values of the words are written into the text in place of the names, and what then has only
//! constants is resolved and computed as a condition of a test is: no operator is known here.

use std::ops::Range;

use super::file::NumberedFile;
use super::live_poller::LiveValues;
use super::names::{Meaning, WordPart};
use super::operands::{index_behind, named, words};
use super::outline::OutlineValue;
use super::project::Project;
use super::tag_facts::TagFacts;
use super::words::{FileWord, FileWordRole};
pub use rungd_client::operator::protocol::BitOrNumber;
use rungd_engine::{Engine, Image, Layout};
use rungd_history::observe::CompareText;
use rungd_language::lower::formula_value::CellFormula;
use rungd_language::lower::lower;
use rungd_language::resolve::condition::ConditionNames;
use rungd_language::resolve::program::{Contact, Program};
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::condition::condition;
use rungd_language::source::contact::WrittenContact;
use rungd_language::source::contact_parser;
use rungd_language::source::contact_side::CompareSide;
use rungd_language::source::span::{SourceFile, Span};

/// A ladder without names, in which constants are computed.
const EMPTY: &str = "[[program]]\nname = \"Main\"\nrung = []\n";

/// Computes with constants alone.
pub(super) struct ConstantSides {
    program: Program,
    image: Image,
    layout: Layout,
}

impl ConstantSides {
    /// `None`: the empty ladder does not load.
    pub fn new() -> Option<ConstantSides> {
        let file = SourceFile { name: "empty.toml".to_owned(), text: EMPTY.to_owned() };
        let (program, _) = load_ladders(&[file], &LoadOptions::default());
        let program = program?;
        let (code, symbols) = lower(&program);
        let image = Engine::new(code).image().clone();
        Some(ConstantSides { program, image, layout: symbols.layout })
    }

    /// The values of the sides of a compare of constants.
    fn values(&self, text: &str, is_time: bool) -> Option<String> {
        let place = Span::default();
        let written = condition(text, place).ok()?;
        let options = LoadOptions::default();
        let mut names = ConditionNames::of(&self.program, &options);
        let Contact::Computed(computed, _) = names.resolve(&written).ok()?.contact else {
            return None;
        };
        let comparison = computed.compare.as_ref()?.comparison;
        let mut sides = computed
            .formulas()
            .map(|formula| CellFormula::new(formula, &self.layout).value(&self.image).number);
        let sides = [sides.next()?, sides.next()?];
        Some(CompareText::new(comparison, is_time).with(sides))
    }
}

/// A text of contacts in a file, with the live values of its project.
#[derive(Clone, Copy)]
pub(super) struct LiveText<'p> {
    pub project: &'p Project,
    pub numbered: NumberedFile<'p>,
    pub live: &'p LiveValues,
}

/// The values of the compares with an expression in a text of contacts.
pub(super) fn compared(
    scene: LiveText<'_>,
    value: &OutlineValue,
    constants: &ConstantSides,
) -> Vec<String> {
    let text = scene.numbered.file.slice(value.inner.clone());
    let Ok(written) = contact_parser::parse(text, Span::default()) else { return Vec::new() };
    let mut places = Vec::new();
    computed_compares(&written, &mut places);
    let shown = places.into_iter().filter_map(|place| {
        let begin = value.inner.start;
        let place = begin + place.start as usize..begin + place.end as usize;
        let ConstantText { text, is_time } = ConstantText::of(scene, value, place)?;
        constants.values(&text, is_time)
    });
    shown.collect()
}

/// The places of the compares with an expression.
fn computed_compares(contact: &WrittenContact, places: &mut Vec<Span>) {
    match contact {
        WrittenContact::Not(inner, _) | WrittenContact::Edge(_, inner, _) => {
            computed_compares(inner, places);
        }
        WrittenContact::All(items, _) | WrittenContact::Any(items, _) => {
            items.iter().for_each(|item| computed_compares(item, places));
        }
        WrittenContact::Compare(left, _, right, span) => {
            if [left, right].into_iter().any(|side| matches!(side, CompareSide::Computed(_))) {
                places.push(*span);
            }
        }
        WrittenContact::Bit(_) | WrittenContact::Indexed(_) => {}
    }
}

/// A compare with the values of its words in place of their names.
struct ConstantText {
    text: String,
    /// Whether a word is a time.
    is_time: bool,
}

impl ConstantText {
    /// `None`: the value of a word is not known.
    fn of(scene: LiveText<'_>, value: &OutlineValue, place: Range<usize>) -> Option<ConstantText> {
        let file = scene.numbered.file;
        let mut compare =
            ConstantText { text: file.slice(place.clone()).to_owned(), is_time: false };
        let within = |word: &&FileWord| place.contains(&word.span.start);
        for word in words(file, value).iter().filter(within).rev() {
            if matches!(word.role, FileWordRole::Function(_)) {
                continue;
            }
            let (number, length) = compare.number(scene, word)?;
            let begin = word.span.start - place.start;
            compare.text.replace_range(begin..begin + length, &number);
        }
        Some(compare)
    }

    /// The value of a word as a constant, and the length of the name that it replaces.
    fn number(&mut self, scene: LiveText<'_>, word: &FileWord) -> Option<(String, usize)> {
        let LiveText { project, numbered, live } = scene;
        let file = numbered.file;
        if word.array.is_some() {
            return None;
        }
        let Some(named) = named(project, numbered, word) else {
            return Some((constant(scene, word)?, word.span.len()));
        };
        self.is_time |= named.is_time;
        let number = match live.get(&named.operand)?.memory {
            BitOrNumber::Bit(on) => u8::from(on).to_string(),
            BitOrNumber::Word(number) => number.to_string(),
            BitOrNumber::Real(real) => format!("{real:?}"),
        };
        Some((number, word.span.len() + index_behind(file, word)?.len()))
    }
}

/// The value of a tag that is a constant.
fn constant(LiveText { project, numbered, .. }: LiveText<'_>, word: &FileWord) -> Option<String> {
    let parts = project.names.parts(numbered, word);
    let [WordPart { meaning: Meaning::Declared(at), .. }] = parts.as_slice() else { return None };
    let declared = &project.names.all[*at];
    let facts = TagFacts::of(declared, &project.files[declared.file]);
    facts.text("value").map(str::to_owned)
}
