//! Names of rungd for foreign names: legal, unique, and as near to the original as they can be.
//!
//! Used by the readers. The one set of names is that of a rungd program: tags, blocks, records and
//! uses share it. A changed name is kept in [`GivenNames::renamed`], and belongs into a `doc`.

use std::collections::{HashMap, HashSet};

use crate::model::Renamed;
use rungd_language::resolve::names::{is_free, is_free_field};
use rungd_language::source::renaming::plain;

/// Longest name that is given; the language allows 128.
const LENGTH_MAX: usize = 100;

/// Names that a program has anyway.
const BUILT_IN: [&str; 5] = ["Main", "FirstScan", "LastScan", "TopOfScan", "BottomOfScan"];

/// The names of a project.
#[derive(Clone, Debug, Default)]
pub struct GivenNames {
    taken: HashSet<String>,
    /// The next number to try behind a name, so that many equal wishes do not take long.
    next: HashMap<String, usize>,
    /// The names that changed, in order.
    pub renamed: Vec<Renamed>,
}

impl GivenNames {
    /// Takes a name for something of the original, and remembers whether it changed.
    pub fn take(&mut self, original: &str) -> String {
        let name = self.fresh(original);
        if name != original {
            self.renamed.push(Renamed { from: original.to_owned(), to: name.clone() });
        }
        name
    }

    /// Whether something else has the name that the original would get.
    pub fn is_taken(&self, original: &str) -> bool {
        self.taken.contains(&legal(original).to_lowercase())
    }

    /// Takes a name for something that the original does not name.
    pub fn fresh(&mut self, wish: &str) -> String {
        let base = legal(wish);
        let mut name = base.clone();
        let number = self.next.entry(base.to_lowercase()).or_insert(2);
        while self.taken.contains(&name.to_lowercase()) {
            name = format!("{base}_{number}");
            *number += 1;
        }
        self.taken.insert(name.to_lowercase());
        name
    }
}

/// A legal name of a tag, a block or a record, near a foreign one.
pub fn legal(original: &str) -> String {
    let short: String = original.chars().take(LENGTH_MAX).collect();
    let mut name = plain(short.trim_matches('_'), "tag");
    while name.contains("__") {
        name = name.replace("__", "_");
    }
    let name = name.trim_end_matches('_');
    let is_word = ["bit", "int", "word", "real", "timer", "counter", "sensaphone"].contains(&name)
        || ["contact", "output", "duration", "array"].contains(&name)
        || BUILT_IN.contains(&name);
    match is_word || !is_free(name) {
        true => format!("{name}_tag"),
        false => name.to_owned(),
    }
}

/// A legal name of a record's field, near a foreign one.
pub fn legal_field(original: &str) -> String {
    let name = plain(original.trim_matches('_'), "field");
    if is_free_field(&name) { name } else { format!("{name}_field") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_becomes_legal_and_stays_near_its_original() {
        for (original, name) in [
            ("Motor_1", "Motor_1"),
            ("Local:1:I.Data", "Local_1_I_Data"),
            ("_hidden", "hidden"),
            ("T1", "T1_tag"),
            ("x0", "x0_tag"),
            ("MOVE", "MOVE_tag"),
            ("rise", "rise_tag"),
            ("3rd", "tag_3rd"),
            ("Überlauf", "Ueberlauf"),
            ("", "tag"),
        ] {
            assert_eq!(legal(original), name, "{original}");
        }
    }

    #[test]
    fn two_originals_never_get_one_name() {
        let mut names = GivenNames::default();
        assert_eq!(names.take("a:b"), "a_b");
        assert_eq!(names.take("A_B"), "A_B_2");
        assert_eq!(names.take("start"), "start");
        let renamed: Vec<&str> = names.renamed.iter().map(|name| name.to.as_str()).collect();
        assert_eq!(renamed, ["a_b", "A_B_2"]);
    }
}
