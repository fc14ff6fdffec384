//! `[retain] tags`: the tags that the patterns name, as ranges of their elements.
//!
//! Called by [`super`], beside the ranges. In a pattern `*` stands for any part of a name; tags
//! with an address and tags with a `type` are named in the same way. The name of an array stands
//! for all of its elements.
//!
//! ```toml
//! # passes: all tags that begin with `total_`, and one by its name
//! [retain]
//! tags = ["total_*", "shift"]      # fails with "totl_*": no tag has such a name
//! ```

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops;

use rungd_base::progress::Progress;
use rungd_engine::isa::{Address, Space};
use rungd_language::resolve::program::{Program, Tag, TagMeaning};
use rungd_language::resolve::range::Range;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, advise, possible};
use rungd_language::source::indexed::IndexedName;
use rungd_language::source::nearest::KnownNames;
use rungd_language::source::reader::Text;
use rungd_language::source::wording::thousands;

/// Maximum number of comparisons of a pattern with a tag: each pattern with `*` is compared with
/// all tags.
const COMPARISONS_MAX: usize = 100_000_000;

/// The ranges of the tags that the patterns name.
pub(super) fn resolve(
    patterns: &[Text],
    program: &Program,
    progress: &Progress,
    findings: &mut Vec<Finding>,
) -> Vec<Range> {
    if patterns.is_empty() {
        return Vec::new();
    }
    let too_many = too_many(patterns, program);
    let compares_stars = too_many.is_none();
    findings.extend(too_many);
    let mut tags = Tags::of(program);
    let known = || {
        program.tags.iter().filter(|tag| tag.of_array.is_none_or(|array_place| array_place.at == 0))
    };
    let names: Vec<Cow<'_, str>> = known().map(Tag::array_name).collect();
    let records = program.records.iter().map(|record| record.name.as_str());
    let known = KnownNames::new(names.iter().map(|name| &**name).chain(records));
    let mut found: HashMap<&str, RetainedNames> = HashMap::new();
    for pattern in progress.during(patterns) {
        if !compares_stars && pattern.text.contains('*') {
            continue;
        }
        match found.entry(&pattern.text).or_insert_with(|| tags.retain(pattern)) {
            RetainedNames::Nothing => findings.push(nothing(pattern, &known)),
            RetainedNames::Other(at) => findings.push(not_retained(pattern, &program.tags[*at])),
            RetainedNames::Ranges => {}
        }
    }
    tags.ranges
}

/// The finding for more patterns with `*` than can be compared with all tags.
fn too_many(patterns: &[Text], program: &Program) -> Option<Finding> {
    let most = COMPARISONS_MAX / program.tags.len().max(1);
    let beyond = patterns.iter().filter(|pattern| pattern.text.contains('*')).nth(most)?;
    let [most, tags] = [most, program.tags.len()].map(|number| thousands(number as u64));
    let message = format!("more than {most} patterns with `*`, the maximum for {tags} tags");
    let finding = Finding::new(Code::Controller, beyond.span, message);
    Some(finding.help("write fewer patterns, or the whole names of the tags"))
}

/// The tags that a pattern names.
#[derive(Clone, Copy)]
enum RetainedNames {
    /// At least one of them can be retained.
    Ranges,
    /// None of them can be retained; with the index of the first.
    Other(usize),
    /// There are none.
    Nothing,
}

/// The tags of a program, and the ranges of those that are named so far.
struct Tags<'p> {
    program: &'p Program,
    /// For each name of a tag or of an array: the indices of its tags.
    by_name: HashMap<Cow<'p, str>, ops::Range<usize>>,
    /// For each tag: its range, if it can be retained.
    retainable: Vec<Option<Range>>,
    /// For each tag: the index of its range in `ranges`.
    named: Vec<Option<usize>>,
    ranges: Vec<Range>,
}

impl<'p> Tags<'p> {
    fn of(program: &'p Program) -> Tags<'p> {
        let mut by_name: HashMap<Cow<'_, str>, ops::Range<usize>> = HashMap::new();
        for (at, tag) in program.tags.iter().enumerate() {
            by_name.entry(Cow::Borrowed(&tag.name)).or_insert(at..at + 1);
            if let Some(array_place) = tag.of_array.filter(|array_element| array_element.at == 0) {
                by_name
                    .entry(tag.array_name())
                    .or_insert(at..at + array_place.array.count as usize);
            }
        }
        let retainable = program.tags.iter().map(|tag| range(program, tag)).collect();
        let named = vec![None; program.tags.len()];
        Tags { program, by_name, retainable, named, ranges: Vec::new() }
    }

    /// Adds the ranges of the tags that a pattern names, each once.
    fn retain(&mut self, pattern: &Text) -> RetainedNames {
        let named: Vec<usize> = match pattern.text.contains('*') {
            true => self.fitting(&pattern.text),
            false => self.by_name.get(&*pattern.text).cloned().unwrap_or_default().collect(),
        };
        let fields = self.fields(&pattern.text);
        let Some(first) = named.first().or(fields.first()) else { return RetainedNames::Nothing };
        let mut found = RetainedNames::Other(*first);
        let named = named.iter().map(|at| (*at, false));
        for (at, of_record) in named.chain(fields.iter().map(|at| (*at, true))) {
            let Some(range) = self.retainable[at] else { continue };
            found = RetainedNames::Ranges;
            if let Some(range) = self.named[at] {
                self.ranges[range].of_record &= of_record;
                continue;
            }
            self.named[at] = Some(self.ranges.len());
            self.ranges.push(Range { span: pattern.span, of_record, ..range });
        }
        found
    }

    /// The indices of the fields of the records whose names fit a pattern: of `recipe` all of it,
    /// of `recipe[2]` one record.
    fn fields(&self, pattern: &str) -> Vec<usize> {
        let mut tags = Vec::new();
        let stars = pattern.contains('*').then(|| NamePattern::of(pattern));
        let fits = |name: &str| match &stars {
            Some(stars) => stars.fits(name),
            None => pattern == name,
        };
        for record in &self.program.records {
            if fits(&record.name) {
                tags.extend(record.tags(None));
                continue;
            }
            let one = IndexedName::of(pattern).filter(|one| one.behind.is_empty());
            let one = one.filter(|one| one.base == record.name);
            let at = one.and_then(|one| one.index.parse().ok());
            if let Some(at) = at.filter(|at| record.count.is_some_and(|count| *at < count)) {
                tags.extend(record.tags(Some(at)));
            }
        }
        tags
    }

    /// The indices of the tags whose names fit a pattern.
    fn fitting(&self, pattern: &str) -> Vec<usize> {
        let pattern = NamePattern::of(pattern);
        let fits = |tag: &Tag| {
            pattern.fits(&tag.name) || (tag.of_array.is_some() && pattern.fits(&tag.array_name()))
        };
        let tags = self.program.tags.iter().enumerate();
        tags.filter(|(_, tag)| fits(tag)).map(|(at, _)| at).collect()
    }
}

/// The elements of a tag, if they can be retained.
fn range(program: &Program, tag: &Tag) -> Option<Range> {
    let TagMeaning::Address(address) = tag.meaning else { return None };
    let (space, first) = Space::of(address)?;
    let count = program.names.places.named(&tag.name).map_or(1, |place| place.count);
    let last = first + count - 1;
    let range = Range { space, first, last, span: tag.span, of_tag: true, of_record: false };
    Space::RETAINABLE.contains(&space).then_some(range)
}

fn nothing(pattern: &Text, known: &KnownNames) -> Finding {
    let text = &pattern.text;
    let (message, help) = match text.contains('*') {
        true => (
            format!("no tag has a name like `{text}`"),
            advise(
                "`*` stands for any part of a name: `{}`, `{}`",
                ["total_*", "*.hours"].map(possible),
            ),
        ),
        false => {
            let help = "name tags here; addresses belong in `ranges`";
            let help = Help::from(help).with(possible(FixEdit::Omit));
            (format!("no tag is called `{text}`"), help)
        }
    };
    Finding::new(Code::UnknownName, pattern.span, message).help(help).near(text, known)
}

fn not_retained(pattern: &Text, tag: &Tag) -> Finding {
    let what = match tag.meaning {
        TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => "it is a constant",
        TagMeaning::Address(address) if address.member().is_some() => "it is a member",
        TagMeaning::Address(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) => {
            "it is neither data nor a structure"
        }
    };
    let message = format!("`{}` cannot be retained: {what}", tag.name);
    let finding = Finding::new(Code::RetainRange, pattern.span, message);
    let help = "name tags of C, MC, MI, V, D, R, MHR, MIR, CT, T, N, or with a `type`";
    finding.help(help).or_omit()
}

/// A pattern: the texts between its `*`.
pub(super) struct NamePattern<'p>(Vec<&'p str>);

impl<'p> NamePattern<'p> {
    pub fn of(text: &'p str) -> NamePattern<'p> {
        let mut pieces: Vec<&str> = text.split('*').collect();
        let (mut at, last) = (0, pieces.len() - 1);
        // Between two `*` beside each other there is nothing to find.
        pieces.retain(|piece| {
            at += 1;
            at == 1 || at > last || !piece.is_empty()
        });
        NamePattern(pieces)
    }

    /// Whether a name matches it. The time is proportional to the length of the name.
    pub fn fits(&self, name: &str) -> bool {
        let Some((first, pieces)) = self.0.split_first() else { return false };
        let Some(name) = name.strip_prefix(*first) else { return false };
        let Some((last, pieces)) = pieces.split_last() else { return name.is_empty() };
        let Some(mut rest) = name.strip_suffix(*last) else { return false };
        for piece in pieces {
            let Some((_, behind)) = rest.split_once(*piece) else { return false };
            rest = behind;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fits(pattern: &str, name: &str) -> bool {
        NamePattern::of(pattern).fits(name)
    }

    #[test]
    fn a_star_matches_any_part_of_a_name() {
        for (pattern, fitting, others) in [
            ("total", "total", "total_a tota atotal"),
            ("total_*", "total_ total_a total_a_b", "total totals a_total_"),
            ("*.hours", "p1.hours p1.lamp.hours .hours", "hours p1.hours.x"),
            ("*a*b*", "ab xaxbx aab abb", "ba a b"),
            ("*", "a p1.hours", ""),
            ("**b", "b ab abb", "a ba"),
            ("a*a", "aa aba", "a ab"),
            ("a***", "a ab", "b"),
        ] {
            assert!(fitting.split(' ').all(|name| fits(pattern, name)), "{pattern}");
            let mut others = others.split(' ').filter(|name| !name.is_empty());
            assert!(!others.any(|name| fits(pattern, name)), "{pattern}");
        }
        assert!(!fits(&"*a".repeat(60), &"a".repeat(59)));
    }
}
