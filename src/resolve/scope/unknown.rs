//! The mistake in a name that stands for nothing, with the help that fits it best.

use super::Scope;
use crate::resolve::mistake::{LISTED_MAX, Mistake, habit, new};
use crate::source::finding::Code;
use crate::source::nearest::{KnownNames, Near};

impl Scope {
    /// The mistake in a name that nothing declares.
    pub(super) fn unknown(&self, base: &str, member: Option<&str>) -> Mistake {
        if base.is_empty() {
            let help = "name a tag or an address: `D0`; a range is `D0..D3`".to_owned();
            return new(Code::UnknownName, "a name is missing".to_owned(), Some(help));
        }
        if self.is_of_unknown_use(base, member) {
            return Mistake::Reported;
        }
        if let Some(mistake) = self.of_use(base, member) {
            return mistake;
        }
        let message = format!("nothing is called `{base}`");
        let with_stage = self.stages.get(base).filter(|_| member.is_none());
        if let Some(block) = with_stage.and_then(|id| self.block_names.get(id)) {
            let help = format!("a stage is named with its program: `{block}.{base}`");
            return new(Code::UnknownName, message, Some(help));
        }
        let help = habit(base).unwrap_or_else(|| self.instead(base, member));
        let near = Some(Near::new(base, self.known()).searching_at_most(self.searched_max));
        Mistake::New { code: Code::UnknownName, message, help: Some(help), near }
    }

    /// The mistake in a name of a use of a template, whose tags have names of their own.
    fn of_use(&self, base: &str, member: Option<&str>) -> Option<Mistake> {
        let prefix = format!("{base}.");
        let known = self.known();
        let own = KnownNames::new(known.beginning_with(&prefix).take(LISTED_MAX));
        if own.iter().next().is_none() && !self.uses.contains(base) {
            return None;
        }
        let list = own.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let message = match member {
            Some(member) => format!("the use `{base}` has no tag `{member}`"),
            None => format!("`{base}` is a use of a template, not a tag"),
        };
        let near = member.map(|member| Near::new(&format!("{base}.{member}"), &own));
        let help = match list.is_empty() {
            true => "its template has no tags of its own".to_owned(),
            false => format!("there is {list}"),
        };
        let (code, help) = (Code::UnknownName, Some(help));
        Some(Mistake::New { code, message, help, near })
    }

    /// The help for a name that is near no known one.
    fn instead(&self, base: &str, member: Option<&str>) -> String {
        if base.contains(',') {
            return "a Sensaphone counter is `N,19` or `N19`, and its value `N,19,6` or `N19.ACC`"
                .to_owned();
        }
        if is_name(base) {
            let (first, others) = match member {
                None => ("bit", "\"int\", \"real\""),
                Some(_) => ("timer", "\"counter\""),
            };
            return format!(
                "declare it under [tags]: `{base} = {{ type = \"{first}\" }}`, or {others}; \
                 or with an address: `at = \"…\"`"
            );
        }
        if let Some((low, high)) = base.split_once('-') {
            let together = format!("{low}{high}");
            if self.is_known(&together) {
                return format!("write `{together}`");
            }
            if self.is_known(low) {
                return "nothing is computed here: `MATH D0 = a - b` in a rung above, then `D0`"
                    .to_owned();
            }
        }
        "a tag is a letter, then letters, digits and `_`; a block's name may have `-` too"
            .to_owned()
    }
}

/// Whether a text is valid as a tag's name.
fn is_name(text: &str) -> bool {
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(letters)
}
