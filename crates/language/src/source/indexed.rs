//! Names with an index, which may stand within a name: `recipe[3]`, `recipe[3].target`.
//!
//! Readers of texts split names here, and everything that prints an element puts its index in here.
//! The name of a *column* says where its index belongs: `recipe[].target`; without `[]` the index
//! stands last.

use super::atom::is_name_letter;
use super::fix::{Help, advise, possible};

/// The place of the index in the name of a column.
pub const INDEX: &str = "[]";

/// The parts of a name with an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexedName<'n> {
    /// The name before its `[`: `recipe`.
    pub base: &'n str,
    /// The text between the brackets.
    pub index: &'n str,
    /// The rest, from its dot on: `.target`; empty if there is none.
    pub behind: &'n str,
}

impl<'n> IndexedName<'n> {
    /// The parts of a name; `None` without an index. If a name has two indexes, the last one: a
    /// template's argument may be a slice (`recipe[2..4][0]`).
    pub fn of(name: &'n str) -> Option<IndexedName<'n>> {
        let (mut depth, mut open, mut last) = (0, 0, None);
        for (at, c) in name.char_indices() {
            match c {
                '[' => {
                    open = if depth == 0 { at } else { open };
                    depth += 1;
                }
                ']' if depth > 0 => {
                    depth -= 1;
                    last = if depth == 0 { Some((open, at)) } else { last };
                }
                _ => {}
            }
        }
        let (open, close) = last.filter(|_| depth == 0)?;
        let (base, index) = (name[..open].trim_end(), name[open + 1..close].trim());
        Some(IndexedName { base, index, behind: name[close + 1..].trim_end() })
    }

    /// The name of its column without an index: `recipe.target`.
    pub fn column(&self) -> String {
        format!("{}{}", self.base, self.behind)
    }
}

/// The name of an element of a column.
pub fn with_index(column: &str, index: &str) -> String {
    match column.split_once(INDEX) {
        Some((base, behind)) => format!("{base}[{index}]{behind}"),
        None => format!("{column}[{index}]"),
    }
}

/// The name of element 0, for the name of any element.
pub fn first_of(name: &str) -> String {
    match IndexedName::of(name) {
        Some(IndexedName { base, behind, .. }) => format!("{base}[0]{behind}"),
        None => name.to_owned(),
    }
}

/// The mistake in a text that is no index.
pub(crate) fn not_an_index(text: &str) -> String {
    format!("`{text}` is no index")
}

/// The help about such a text.
pub(crate) fn help_about_index() -> Help {
    let help = "an index is a whole number or a word of whole numbers: `{}`, `recipe[step]`; MATH \
                computes one: `MATH step = …`";
    advise(help, [possible("recipe[3]")])
}

/// The length of the names behind an index: `.target`, `.over.Acc`; else 0.
pub(super) fn rest_length(behind: &str) -> usize {
    let mut length = 0;
    while let Some(rest) = behind[length..].strip_prefix('.')
        && rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
    {
        length += 1 + rest.find(|c| !is_name_letter(c)).unwrap_or(rest.len());
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_its_index_at_its_end_or_within() {
        let check = |name: &str, parts: Option<[&str; 3]>| {
            let found = IndexedName::of(name).map(|name| [name.base, name.index, name.behind]);
            assert_eq!(found, parts, "{name}");
        };
        check("recipe", None);
        check("recipe[3", None);
        check("recipe[3]", Some(["recipe", "3", ""]));
        check("p1.recipe[ step ].target", Some(["p1.recipe", "step", ".target"]));
        check("recipe[1..3].target[0]", Some(["recipe[1..3].target", "0", ""]));
        check("recipe[list[2]]", Some(["recipe", "list[2]", ""]));
        check("recipe[1..2][list[0]].x", Some(["recipe[1..2]", "list[0]", ".x"]));
        assert_eq!(with_index("recipe", "3"), "recipe[3]");
        assert_eq!(with_index("recipe[].target", "i"), "recipe[i].target");
    }

    #[test]
    fn the_rest_of_a_name_begins_with_a_dot_and_a_letter() {
        for (behind, length) in
            [("", 0), (".target > 3", 7), (".over.Acc.3", 9), (".3", 0), ("..4]", 0), (" .x", 0)]
        {
            assert_eq!(rest_length(behind), length, "{behind}");
        }
    }
}
