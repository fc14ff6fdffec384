//! The uses of templates by their whole names (`p1`, `p1.lamp`), and the mistakes in names that
//! begin with the name of a use.
//!
//! Part of [`super::scope`]. The own tags of a use are ordinary tags of the scope: a name is looked
//! up here only if it is not a tag.

use std::collections::HashSet;

use super::mistake::{LISTED_MAX, Mistake};
use crate::source::finding::Code;
use crate::source::fix::one_of;
use crate::source::nearest::{KnownNames, did_you_mean};

/// All uses of a program.
#[derive(Debug, Default)]
pub(super) struct NameUses {
    known: HashSet<String>,
    /// The uses of unknown templates: names of their tags cause no findings.
    unknown: HashSet<String>,
    /// The length of the longest name of a use, at most [`LOOKED_UP_MAX`].
    longest: usize,
}

/// Maximum length of a part of a name that is looked up as a use. A text may be one name with
/// thousands of dots.
const LOOKED_UP_MAX: usize = 512;

impl NameUses {
    pub fn add(&mut self, name: String) {
        self.longest = self.longest.max(name.len()).min(LOOKED_UP_MAX);
        self.known.insert(name);
    }

    pub fn add_unknown(&mut self, name: String) {
        self.longest = self.longest.max(name.len()).min(LOOKED_UP_MAX);
        self.unknown.insert(name);
    }

    /// Whether there is a use with this name.
    pub fn has(&self, name: &str) -> bool {
        self.known.contains(name) || self.unknown.contains(name)
    }

    /// Whether a name is that of a use within a use, or begins with such a name: `own.inner.lit`.
    pub fn is_of_inner(&self, name: &str) -> bool {
        let is_inner = |end: usize| {
            let owner = &name[..end];
            owner.contains('.') && self.has(owner)
        };
        self.ends(name).any(is_inner)
    }

    /// The mistake in a name that is that of a use, or begins with it. `names` are all names of the
    /// program.
    pub fn mistake(&self, name: &str, names: &KnownNames) -> Option<Mistake> {
        if self.ends(name).any(|end| self.unknown.contains(&name[..end])) {
            return Some(Mistake::Reported);
        }
        let is_use = |end: &usize| self.known.contains(&name[..*end]);
        // A scope made from a resolved program has the tags of the uses, but no list of the uses.
        let end = self.ends(name).find(is_use).or_else(|| name.find('.'))?;
        let (owner, member) = (&name[..end], name.get(end + 1..));
        let prefix = format!("{owner}.");
        let own = KnownNames::new(names.beginning_with(&prefix).take(LISTED_MAX));
        let is_empty = own.iter().len() == 0;
        if is_empty && !self.known.contains(owner) {
            return None;
        }
        let message = match member {
            Some(member) => format!("the use `{owner}` has no tag `{member}`"),
            None => format!("`{owner}` is a use of a template, not a tag"),
        };
        let help = member.and_then(|_| did_you_mean(name, own.iter()));
        let help = help.unwrap_or_else(|| match is_empty {
            true => "its template has no tags of its own".into(),
            false => one_of("there is", own.iter()),
        });
        Some(Mistake::New { code: Code::UnknownName, message, help: Some(help), near: None })
    }

    /// The ends of the whole name and of its parts before a dot, the longest first. Leaves out
    /// parts that are longer than any use's name.
    fn ends(&self, name: &str) -> impl Iterator<Item = usize> {
        let longest = self.longest;
        let ends = name.rmatch_indices('.').map(|(at, _)| at);
        std::iter::once(name.len()).chain(ends).filter(move |end| *end <= longest)
    }
}
