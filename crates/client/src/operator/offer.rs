//! The names that completion offers, limited in number and in bytes for any ladder.
//!
//! Part of [`super::names::OperandNames`], which fills it once. A name is first offered up to its
//! dot, and its members after the dot is typed.

use std::ops::Range;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

/// The most names of one answer.
const NAMES_MAX: usize = 1000;
/// The most names that are searched for one answer.
const LOOKED_AT_MAX: usize = 4 * NAMES_MAX;
/// The most bytes of names and their explanations in one answer.
const BYTES_MAX: usize = 256 * 1024;
/// The longest explanation, in characters.
const ABOUT_CHARS_MAX: usize = 100;

/// The answer to a request for names.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NameList {
    /// In order; incomplete if there are very many.
    pub names: Vec<OfferedName>,
}

/// A name for completion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OfferedName {
    /// The name.
    pub name: String,
    /// A short explanation.
    pub about: String,
}

/// Names, each with a short explanation.
///
/// All texts are in one string, because a large ladder has a hundred thousand names, and most
/// controllers are never asked for one. They are put in order when somebody asks.
#[derive(Debug, Default)]
pub(super) struct NameOffer {
    texts: String,
    added: Vec<AddedName>,
    /// The indexes of the names in byte order; the first of every name.
    in_order: OnceLock<Vec<u32>>,
}

/// The places of a name and its explanation in the texts.
#[derive(Debug)]
struct AddedName {
    name: Range<u32>,
    about: Range<u32>,
}

impl NameOffer {
    /// Offers a name; the first explanation of a name stays.
    pub fn add(&mut self, name: &str, about: &str) {
        self.in_order = OnceLock::new();
        let about = brief(about);
        let before = self.added.last().map(|last| last.about.clone());
        let same = before.filter(|before| self.text(before) == about);
        let name = self.put(name);
        let about = same.unwrap_or_else(|| self.put(&about));
        self.added.push(AddedName { name, about });
    }

    /// Adds a text; returns its place.
    fn put(&mut self, text: &str) -> Range<u32> {
        let begin = self.texts.len() as u32;
        self.texts.push_str(text);
        begin..self.texts.len() as u32
    }

    fn text(&self, place: &Range<u32>) -> &str {
        &self.texts[place.start as usize..place.end as usize]
    }

    fn name(&self, index: u32) -> &str {
        self.text(&self.added[index as usize].name)
    }

    fn in_order(&self) -> &[u32] {
        self.in_order.get_or_init(|| {
            let mut all: Vec<u32> = (0..self.added.len() as u32).collect();
            all.sort_by_key(|index| self.name(*index));
            all.dedup_by_key(|index| self.name(*index));
            all
        })
    }

    /// The names that begin with the prefix; if the prefix has a dot, also members.
    pub fn beginning(&self, prefix: &str) -> Vec<OfferedName> {
        let members = prefix.contains('.');
        let fits = self.from(prefix, members).take_while(|(name, _)| name.starts_with(prefix));
        let wanted = fits.filter(|(name, _)| members || !name.contains('.'));
        let mut bytes = 0;
        let bounded = wanted.take(NAMES_MAX).take_while(|(name, about)| {
            bytes += name.len() + about.len();
            bytes <= BYTES_MAX
        });
        let named = bounded
            .map(|(name, about)| OfferedName { name: name.to_owned(), about: about.to_owned() });
        let mut names: Vec<OfferedName> = named.collect();
        // The prefix is a whole name: offer the members after its dot.
        if !members && names.iter().all(|name| name.name == prefix) {
            names.extend(self.beginning(&format!("{prefix}.")));
            names.truncate(NAMES_MAX);
        }
        names
    }

    /// The names from a prefix on. Without `members`, only the first of all names with the same
    /// text before the dot: a program may have a hundred thousand Stages.
    fn from(&self, prefix: &str, members: bool) -> impl Iterator<Item = (&str, &str)> {
        let all = self.in_order();
        let first = move |text: &str| all.partition_point(|index| self.name(*index) < text);
        let mut next = first(prefix);
        let step = move || {
            let index = *all.get(next)?;
            let name = self.name(index);
            next += 1;
            if let (false, Some((base, _))) = (members, name.split_once('.')) {
                // `/` is the character after `.`.
                next = first(&format!("{base}/"));
            }
            Some((name, self.text(&self.added[index as usize].about)))
        };
        std::iter::from_fn(step).take(LOOKED_AT_MAX)
    }
}

/// The beginning of a text, on one line.
fn brief(text: &str) -> String {
    let mut brief = String::new();
    for word in text.split_whitespace() {
        if !brief.is_empty() {
            brief.push(' ');
        }
        if brief.chars().count() + word.chars().take(ABOUT_CHARS_MAX).count() > ABOUT_CHARS_MAX {
            brief.push('…');
            break;
        }
        brief.push_str(word);
    }
    brief
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_of_offered_names_is_limited_for_any_ladder() {
        let mut offer = NameOffer::default();
        for n in 0..3000 {
            offer.add(&format!("tag{n:04}"), &"many words ".repeat(10_000));
        }
        let names = offer.beginning("tag");
        assert_eq!(names.len(), NAMES_MAX);
        assert!(names.iter().all(|name| name.about.chars().count() <= ABOUT_CHARS_MAX + 1));
        for n in 0..100 {
            offer.add(&format!("{}{n}", "n".repeat(10_000)), &"x".repeat(5000));
        }
        let bytes: usize = offer.beginning("n").iter().map(|name| name.name.len()).sum();
        assert!((1..=BYTES_MAX).contains(&bytes), "{bytes}");
    }
    #[test]
    fn offering_names_does_not_visit_every_stage() {
        let mut offer = NameOffer::default();
        for n in 0..20_000 {
            offer.add(&format!("Main.Stage{n:05}"), "a Stage");
        }
        offer.add("Main-2", "X1");
        offer.add("Main2", "X2");
        let names = |prefix: &str| {
            offer.beginning(prefix).into_iter().map(|name| name.name).collect::<Vec<_>>()
        };
        assert_eq!(names("M"), ["Main-2", "Main2"]);
        assert_eq!(offer.from("M", false).count(), 3);
        assert_eq!(offer.from("M", true).count(), LOOKED_AT_MAX);
        assert_eq!(names("Main.").len(), NAMES_MAX);
    }
}
