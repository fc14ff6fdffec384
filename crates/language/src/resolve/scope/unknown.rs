//! The mistake in a name that nothing declares, with the help that fits it best.

use super::{Scope, parts};
use crate::resolve::mistake::{Mistake, declared, habit, mistake};
use crate::source::atom::is_name;
use crate::source::finding::Code;
use crate::source::fix::{Help, advise, possible, propose};
use crate::source::nearest::UnknownName;
use rungd_engine::isa::{Structure, dialects};

impl Scope {
    /// The mistake in a name that nothing declares.
    pub(super) fn unknown(&self, name: &str) -> Mistake {
        if let Some(mistake) = self.uses.mistake(name, self.known()) {
            return mistake;
        }
        let (base, member) = parts(name);
        if base.is_empty() {
            let help = "name a tag or an address: `D0`; a range is `D0..D3`";
            return mistake(Code::UnknownName, "a name is missing".to_owned(), help);
        }
        let message = format!("nothing is called `{base}`");
        let with_stage = self.stages.get(base).filter(|_| member.is_none());
        if let Some(block) = with_stage.and_then(|id| self.block_names.get(id)) {
            let name = format!("{block}.{base}");
            let help = advise("a stage is named with its program: `{}`", [name]);
            return mistake(Code::UnknownName, message, help);
        }
        let help = habit(base).unwrap_or_else(|| self.instead(base, member));
        let member = member.map_or(String::new(), |member| format!(".{member}"));
        let near = UnknownName::new(base, self.known()).searching_at_most(self.searched_max);
        let near = near.followed_by(&member);
        let near = Some(Box::new(near));
        Mistake::New { code: Code::UnknownName, message, help: Some(help), near }
    }

    /// The help for a name that is not near any known name.
    fn instead(&self, base: &str, member: Option<&str>) -> Help {
        if base.contains(',') {
            return "a Sensaphone counter is `N,19` or `N19`, and its value `N,19,6` or `N19.ACC`"
                .into();
        }
        let of_structure = |member: &&str| {
            let structures = [Structure::Timer(0), Structure::Counter(0)];
            structures.iter().any(|structure| structure.members().contains(member))
        };
        let is_bit = |member: &str| member.bytes().all(|b| b.is_ascii_digit());
        if is_name(base) && member.is_some_and(is_bit) {
            return declared(
                base,
                &["int", "word"],
                ", or \"word\"; or with an address: `at = \"…\"`",
            );
        }
        if is_name(base) && member.is_some_and(|member| !of_structure(&member)) {
            return "names with members are timers, counters, programs, tasks, devices and uses of \
                    templates"
                .into();
        }
        if is_name(base) {
            let (types, others): (&[_], _) = match member {
                None => (&["bit", "int", "real"], "\"int\", \"real\""),
                Some(_) => (&["timer", "counter"], "\"counter\""),
            };
            let is_capital = base.chars().all(|c| c.is_ascii_uppercase() || c == '_');
            let foreign = dialects::instead_of(base).filter(|_| is_capital && member.is_none());
            let foreign = foreign.map_or(String::new(), |instead| {
                format!("; for the `{base}` of other controllers: {instead}")
            });
            let words = format!(", or {others}; or with an address: `at = \"…\"`{foreign}");
            return declared(base, types, &words);
        }
        if let Some((low, high)) = base.split_once('-') {
            let together = format!("{low}{high}");
            if self.is_known(&together) {
                return propose(together);
            }
            if self.is_known(low) {
                let words =
                    "nothing is computed here: `MATH D0 = a - b` in a rung above, then `{}`";
                return advise(words, [possible("D0")]);
            }
        }
        "a tag is a letter, then letters, digits and `_`; a block's name may have `-` too".into()
    }
}
