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

use crate::isa::{Address, Space};
use crate::progress::Progress;
use crate::resolve::program::{Program, Tag, TagMeaning};
use crate::resolve::range::Range;
use crate::source::finding::{Code, Finding};
use crate::source::nearest::KnownNames;
use crate::source::reader::Text;

/// The ranges of the tags that the patterns name.
pub(super) fn resolve(
    patterns: &[Text],
    (program, progress): (&Program, &Progress),
    findings: &mut Vec<Finding>,
) -> Vec<Range> {
    let mut ranges = Vec::new();
    for pattern in progress.during(patterns) {
        let is_named = |tag: &&Tag| {
            [tag.name.as_str(), tag.array_name()].into_iter().any(|name| fits(&pattern.text, name))
        };
        let tags: Vec<&Tag> = program.tags.iter().filter(is_named).collect();
        let found: Vec<Range> =
            tags.iter().filter_map(|tag| range(program, tag, pattern)).collect();
        match tags.first() {
            None => findings.push(nothing(pattern, program)),
            Some(tag) if found.is_empty() => findings.push(not_retained(pattern, tag)),
            Some(_) => ranges.extend(found),
        }
    }
    ranges
}

/// The elements of a tag, if they can be retained.
fn range(program: &Program, tag: &Tag, pattern: &Text) -> Option<Range> {
    let TagMeaning::Address(address) = tag.meaning else { return None };
    let (space, first) = Space::of(address)?;
    let count = program.places.named(&tag.name).map_or(1, |place| place.count);
    let range = Range { space, first, last: first + count - 1, span: pattern.span };
    Space::RETAINABLE.contains(&space).then_some(range)
}

fn nothing(pattern: &Text, program: &Program) -> Finding {
    let text = &pattern.text;
    let (message, help) = match text.contains('*') {
        true => (
            format!("no tag has a name as `{text}`"),
            "`*` stands for any part of a name: `total_*`, `*.hours`",
        ),
        false => {
            (format!("no tag is called `{text}`"), "name tags here; addresses stand in `ranges`")
        }
    };
    let names = KnownNames::new(program.tags.iter().map(Tag::array_name));
    Finding::new(Code::UnknownName, pattern.span, message).help(help).near(text, &names)
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
    finding.help("name tags of C, MC, MI, V, D, R, MHR, MIR, CT, T, N, or with a `type`")
}

/// Whether a name matches a pattern. The time is at most proportional to the product of their
/// lengths.
fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name) = (pattern.as_bytes(), name.as_bytes());
    let (mut at, mut in_name) = (0, 0);
    // The position after the last `*` of the pattern, and the position in the name from which the
    // rest of the pattern is tried.
    let mut star: Option<(usize, usize)> = None;
    while in_name < name.len() {
        match pattern.get(at) {
            Some(b'*') => {
                star = Some((at + 1, in_name));
                at += 1;
            }
            Some(c) if *c == name[in_name] => (at, in_name) = (at + 1, in_name + 1),
            Some(_) | None => {
                let Some((behind, tried)) = star else { return false };
                (at, in_name) = (behind, tried + 1);
                star = Some((behind, tried + 1));
            }
        }
    }
    pattern[at..].iter().all(|c| *c == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_any_part_of_a_name() {
        for (pattern, fitting, others) in [
            ("total", "total", "total_a tota atotal"),
            ("total_*", "total_ total_a total_a_b", "total totals a_total_"),
            ("*.hours", "p1.hours p1.lamp.hours .hours", "hours p1.hours.x"),
            ("*a*b*", "ab xaxbx aab abb", "ba a b"),
            ("*", "a p1.hours", ""),
            ("**b", "b ab abb", "a ba"),
        ] {
            assert!(fitting.split(' ').all(|name| fits(pattern, name)), "{pattern}");
            let mut others = others.split(' ').filter(|name| !name.is_empty());
            assert!(!others.any(|name| fits(pattern, name)), "{pattern}");
        }
        assert!(!fits(&"*a".repeat(60), &"a".repeat(59)));
    }
}
