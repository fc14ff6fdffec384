//! The names that completion offers, limited in number and in bytes for any ladder.
//!
//! Part of [`super::names::OperandNames`], which fills it once. A name is first offered up to its
//! dot, and its members after the dot is typed.

use std::collections::BTreeMap;
use std::ops::Bound;

use super::protocol::OfferedName;

/// The most names of one answer.
const NAMES_MAX: usize = 1000;
/// The most names that are searched for one answer.
const LOOKED_AT_MAX: usize = 4 * NAMES_MAX;
/// The most bytes of names and their explanations in one answer.
const BYTES_MAX: usize = 256 * 1024;
/// The longest explanation, in characters.
const ABOUT_CHARS_MAX: usize = 100;

/// Names, each with a short explanation.
#[derive(Debug, Default)]
pub(super) struct NameOffer {
    names: BTreeMap<String, String>,
}

impl NameOffer {
    /// Offers a name; the first explanation of a name stays.
    pub fn add(&mut self, name: String, about: &str) {
        self.names.entry(name).or_insert_with(|| brief(about));
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
        let named =
            bounded.map(|(name, about)| OfferedName { name: name.clone(), about: about.clone() });
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
    fn from(&self, prefix: &str, members: bool) -> impl Iterator<Item = (&String, &String)> {
        let mut next = self.names.range::<str, _>((Bound::Included(prefix), Bound::Unbounded));
        let step = move || {
            let found = next.next()?;
            if let (false, Some((base, _))) = (members, found.0.split_once('.')) {
                // `/` is the character after `.`.
                let behind = format!("{base}/");
                let bounds = (Bound::Included(behind.as_str()), Bound::Unbounded);
                next = self.names.range::<str, _>(bounds);
            }
            Some(found)
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
            offer.add(format!("tag{n:04}"), &"many words ".repeat(10_000));
        }
        let names = offer.beginning("tag");
        assert_eq!(names.len(), NAMES_MAX);
        assert!(names.iter().all(|name| name.about.chars().count() <= ABOUT_CHARS_MAX + 1));
        for n in 0..100 {
            offer.add(format!("{}{n}", "n".repeat(10_000)), &"x".repeat(5000));
        }
        let bytes: usize = offer.beginning("n").iter().map(|name| name.name.len()).sum();
        assert!((1..=BYTES_MAX).contains(&bytes), "{bytes}");
    }
    #[test]
    fn offering_names_does_not_visit_every_stage() {
        let mut offer = NameOffer::default();
        for n in 0..20_000 {
            offer.add(format!("Main.Stage{n:05}"), "a Stage");
        }
        offer.add("Main-2".to_owned(), "X1");
        offer.add("Main2".to_owned(), "X2");
        let names = |prefix: &str| {
            offer.beginning(prefix).into_iter().map(|name| name.name).collect::<Vec<_>>()
        };
        assert_eq!(names("M"), ["Main-2", "Main2"]);
        assert_eq!(offer.from("M", false).count(), 3);
        assert_eq!(offer.from("M", true).count(), LOOKED_AT_MAX);
        assert_eq!(names("Main.").len(), NAMES_MAX);
    }
}
