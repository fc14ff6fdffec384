//! Resolves ranges of a controller file: `Y8..Y9`, `CT8..CT15`, a single address, or a tag.

use super::scope::{NamedThing, Scope};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible, propose, proposed, write};
use crate::source::reader::Text;
use crate::source::span::Span;
use rungd_engine::isa::{Address, NumberRange, Space};

/// Elements `first..=last` of one space, numbered as written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Range {
    /// The space.
    pub space: Space,
    /// The first number.
    pub first: u32,
    /// The last number; never less than the first.
    pub last: u32,
    /// Its place.
    pub span: Span,
    /// Whether it stands for a tag that `[retain] tags` names.
    pub of_tag: bool,
    /// Whether it stands for a structure that is retained only as a part of a whole record.
    pub of_record: bool,
}

impl Range {
    /// The number of its elements.
    pub fn count(&self) -> u32 {
        self.last - self.first + 1
    }

    /// Its numbers, with their space.
    pub fn numbers(&self) -> NumberRange<Space> {
        NumberRange { kind: self.space, first: self.first, last: self.last }
    }

    /// Its addresses, in order.
    pub fn addresses(&self) -> impl Iterator<Item = Address> {
        let space = self.space;
        (self.first..=self.last).map(move |n| space.address(n))
    }

    /// Whether an address is in it. The members of a structure in the range are not in it.
    pub(crate) fn holds(&self, address: Address) -> bool {
        Space::of(address).is_some_and(|(space, number)| self.has(space, number))
    }

    /// Whether an address is in it, or is a member of a structure in it.
    pub fn holds_member(&self, address: Address) -> bool {
        Space::with_members(address).is_some_and(|(space, number)| self.has(space, number))
    }

    fn has(&self, space: Space, number: u32) -> bool {
        space == self.space && (self.first..=self.last).contains(&number)
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.space.name();
        if self.first == self.last {
            return write!(f, "{name}{}", self.first);
        }
        write!(f, "{name}{}..{name}{}", self.first, self.last)
    }
}

/// Whether a text has the form of a range: it contains `..`, which no name does.
pub fn is_range(text: &str) -> bool {
    text.contains("..")
}

/// Whether the two dots of a text are within brackets.
pub(super) fn is_slice(text: &str) -> bool {
    let before = text.split_once("..").map_or("", |(before, _)| before);
    before.contains('[') && !before.contains(']')
}

/// Resolves `A..B`, or a single address or tag.
///
/// # Errors
/// A finding: an end is not an address, the ends are in different spaces, or they are in the wrong
/// order.
pub fn resolve_range(scope: &Scope, text: &Text) -> Result<Range, Finding> {
    if let Some(finding) = other_range(scope, text) {
        return Err(finding);
    }
    let whole = look_up(scope, text.text.trim(), text.span);
    if is_slice(&text.text) {
        whole.as_ref().map_err(Finding::clone)?;
    }
    if let Ok(NamedThing::Array(array)) = whole {
        let (space, first, last) = (array.space, array.first, array.first + array.count - 1);
        return Ok(Range { space, first, last, span: text.span, of_tag: false, of_record: false });
    }
    let (low, high) = match text.text.split_once("..") {
        Some((low, high)) => (low.trim(), high.trim()),
        None => (text.text.trim(), text.text.trim()),
    };
    if is_range(&text.text) && (low.is_empty() || high.is_empty()) {
        let message = format!("`{}` is no range", text.text);
        let finding = Finding::new(Code::Controller, text.span, message);
        let ranges = ["Y8..Y9", "D100..D199"].map(possible);
        return Err(finding.help(advise("write both ends: `{}`, `{}`", ranges)));
    }
    let (space, first) = element(scope, low, text.span)?;
    let (other, last) = element(scope, high, text.span)?;
    let finding = |message: String| Finding::new(Code::Controller, text.span, message);
    if space != other {
        let message = format!(
            "a range lies in one memory block, not in {space} and {other}",
            space = space.name(),
            other = other.name()
        );
        return Err(finding(message));
    }
    let (least, most) = (first.min(last), first.max(last));
    let range =
        Range { space, first: least, last: most, span: text.span, of_tag: false, of_record: false };
    if let Some(finding) = is_range(&text.text).then(|| placed_in(scope, &range, low)).flatten() {
        return Err(finding);
    }
    if last < first {
        let finding = finding("a range goes from low to high".to_owned());
        return Err(finding.write(format!("{high}..{low}")));
    }
    Ok(range)
}

/// The finding for a range that contains a tag with a `type`; `low`: the range's first text.
pub(super) fn placed_in(scope: &Scope, range: &Range, low: &str) -> Option<Finding> {
    let name = &scope.places().in_range(range.space, range.first, range.last)?.name;
    let message = format!("`{name}` is in this range, and can be used only by its name");
    let finding = Finding::new(Code::Controller, range.span, message);
    let has_members = matches!(range.space, Space::Counter | Space::Timer | Space::Sensaphone);
    let member = low.rsplit_once('.').filter(|_| has_members);
    let member = member.map_or(String::new(), |(_, member)| format!(".{member}"));
    let alone = [proposed(format!("{name}{member}"))];
    Some(finding.help(advise("name it alone: `{}`; ranges are of addresses", alone)))
}

/// The finding for a range in a different notation, such as `Y8-Y9`.
pub fn other_range(scope: &Scope, text: &Text) -> Option<Finding> {
    let split = |sign: &&'static str| Some((*sign, text.text.split_once(*sign)?));
    let (sign, (low, high)) = ["-", ":", "…", ","].iter().find_map(split)?;
    let (low, high) = (low.trim(), high.trim());
    // Accepts `Y8-9` too.
    let letters = low.trim_end_matches(|c: char| c.is_ascii_digit());
    let highs = [high.to_owned(), format!("{letters}{high}")];
    let high = highs.iter().find(|high| element(scope, high, text.span).is_ok())?;
    element(scope, low, text.span).ok()?;
    let message = format!("`{}` is no range", text.text);
    let finding = Finding::new(Code::Controller, text.span, message);
    let range = format!("{low}..{high}");
    Some(
        finding.help(match sign {
            "," => propose(range)
                .and(&format!(" for all of them; or `{low}` and `{high}`, each on its own")),
            _ => write(range),
        }),
    )
}

/// Looks up a name.
///
/// # Errors
/// The finding for an unknown or wrong name.
pub(super) fn look_up(scope: &Scope, name: &str, span: Span) -> Result<NamedThing, Finding> {
    match scope.look_up(name) {
        Ok(found) => Ok(found.thing),
        Err(mistake) => Err(mistake.finding(span).unwrap_or_else(|| {
            Finding::new(
                Code::UnknownName,
                span,
                format!("the declaration of `{name}` has a mistake"),
            )
        })),
    }
}

fn element(scope: &Scope, name: &str, span: Span) -> Result<(Space, u32), Finding> {
    let thing = look_up(scope, name, span)?;
    let wrong = |help: Help| {
        let message = format!("`{name}` cannot stand in a range");
        Err(Finding::new(Code::Controller, span, message).help(help))
    };
    let NamedThing::Address(address) = thing else {
        let ranges = ["Y8..Y9", "D100..D199", "CT8..CT15"].map(possible);
        return wrong(advise("ranges are of addresses: `{}`, `{}`, `{}`", ranges));
    };
    if address.without_bit() != address {
        let word = name.rsplit_once('.').map_or(name, |(word, _)| word);
        return wrong(advise("name the word, with all its bits: `{}`", [possible(word)]));
    }
    let structures = || advise("name whole structures: `{}`", [possible("CT8..CT15")]);
    Space::of(address).map_or_else(|| wrong(structures()), Ok)
}
