//! Finds the known name nearest to a mistyped one, for the help of a finding.
//!
//! The distance is the number of single-letter slips (a letter added, dropped or replaced, or two
//! letters swapped); case is ignored. A search among thousands of names takes long, and a file may
//! hold thousands of unknown names. Therefore a finding keeps a [`UnknownName`], and the search
//! runs only when its help is shown.

use std::fmt;
use std::sync::Arc;

use super::fix::{FixEdit, Help, meant, possible};
use super::span::Span;

/// Number of a name's characters that are compared.
const COMPARED_MAX: usize = 64;

/// The known names of one kind, shared by all findings about an unknown name of that kind.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct KnownNames(Arc<[Box<str>]>);

impl KnownNames {
    /// Sorts the names. If two names are equally near, the first one is offered.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> KnownNames {
        let mut names: Vec<Box<str>> = names.into_iter().map(Box::from).collect();
        names.sort_unstable();
        KnownNames(names.into())
    }

    /// The names, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &str> {
        self.0.iter().map(|name| &**name)
    }

    /// Whether a name is among them.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.0.binary_search_by(|known| (**known).cmp(name)).is_ok()
    }

    /// The names that begin with a text, in order.
    pub(crate) fn beginning_with<'n>(&'n self, text: &'n str) -> impl Iterator<Item = &'n str> {
        let first = self.0.partition_point(|known| **known < *text);
        self.iter().skip(first).take_while(move |name| name.starts_with(text))
    }

    /// The names next to `name` in the order, at most `at_most`.
    fn around(&self, name: &str, at_most: usize) -> impl Iterator<Item = &str> {
        let place = self.0.partition_point(|known| **known < *name);
        let last = self.0.len().saturating_sub(at_most);
        let first = place.saturating_sub(at_most / 2).min(last);
        self.iter().skip(first).take(at_most)
    }
}

impl fmt::Debug for KnownNames {
    /// Prints their number only: there may be thousands.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} names", self.0.len())
    }
}

/// An unknown name, and the known names to search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    name: Box<str>,
    known: KnownNames,
    searched_max: usize,
    /// The texts before and after a name in the help.
    before: Box<str>,
    after: Box<str>,
    /// The search among other names, if none of these is near.
    otherwise: Option<Box<UnknownName>>,
    /// The place of the unknown name; `None`: the place of the finding.
    place: Option<Span>,
}

impl UnknownName {
    /// For the help of a finding about `name`.
    pub fn new(name: &str, known: &KnownNames) -> UnknownName {
        let end = name.char_indices().nth(COMPARED_MAX).map_or(name.len(), |(at, _)| at);
        UnknownName {
            name: name[..end].into(),
            known: known.clone(),
            searched_max: usize::MAX,
            before: "".into(),
            after: "".into(),
            otherwise: None,
            place: None,
        }
    }

    /// For a name that is a part of the finding's place.
    pub(crate) fn at(self, place: Option<Span>) -> UnknownName {
        UnknownName { place, ..self }
    }

    /// Searches at most this number of names: those next to the unknown name in the order. Such a
    /// search finds a slip in a later letter among any number of names, but not a slip in the first
    /// letter.
    pub(crate) fn searching_at_most(self, names: usize) -> UnknownName {
        UnknownName { searched_max: names, ..self }
    }

    /// For names of members: the help also has the text before a member (`Day.`).
    pub fn behind(self, before: &str) -> UnknownName {
        UnknownName { before: before.into(), ..self }
    }

    /// For names with members: the help also has the text after a name (`.run`), which is cut like
    /// the name.
    pub fn followed_by(self, after: &str) -> UnknownName {
        let end = after.char_indices().nth(COMPARED_MAX).map_or(after.len(), |(at, _)| at);
        UnknownName { after: after[..end].into(), ..self }
    }

    /// If no name is near: the result of a different search.
    pub(crate) fn or(self, otherwise: Option<Box<UnknownName>>) -> UnknownName {
        UnknownName { otherwise, ..self }
    }

    /// `did you mean …?`, if a name is near.
    pub fn help(&self) -> Option<Help> {
        let Some(near) = nearest(&self.name, self.known.around(&self.name, self.searched_max))
        else {
            return self.otherwise.as_ref()?.help();
        };
        let help = meant(format!("{}{near}{}", self.before, self.after)).bounded();
        Some(match self.place {
            Some(place) => help.at(place),
            None => help,
        })
    }
}

/// The known name nearest to a mistyped one, within one slip for every three letters of the
/// mistyped name, and at least one slip if it has two letters. `None` if no known name is that
/// near.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = fold(name);
    let length = name.chars().count();
    let limit = (length / 3).max(usize::from(length > 1));
    let letters = Letters::of(&name);
    let mut best = (limit + 1, None);
    for candidate in known {
        #[cfg(debug_assertions)]
        counted::CANDIDATES.with(|count| count.set(count.get() + 1));
        // Among a hundred thousand names, the letters alone show that most are farther than the
        // best so far.
        if letters.slips_at_least(candidate) >= best.0 {
            continue;
        }
        let slips = distance(&name, &fold(candidate));
        if slips < best.0 {
            best = (slips, Some(candidate));
        }
    }
    best.1
}

/// How often a name has each letter. The distance of two names is at least the distance of their
/// letters in any order.
struct Letters {
    counts: [i16; 128],
    /// The number of letters; 0 if the name is not ASCII.
    length: usize,
}

impl Letters {
    fn of(name: &str) -> Letters {
        let mut counts = [0; 128];
        name.bytes().for_each(|byte| counts[usize::from(byte & 127)] += 1);
        Letters { counts, length: if name.is_ascii() { name.len() } else { 0 } }
    }

    /// A lower bound of the distance; 0 if a name is empty, not ASCII or too long to be compared.
    fn slips_at_least(&self, candidate: &str) -> usize {
        if self.length == 0 || !candidate.is_ascii() || candidate.len() > COMPARED_MAX {
            return 0;
        }
        let mut left = self.counts;
        let mut more = 0;
        for byte in candidate.bytes() {
            let count = &mut left[usize::from(byte.to_ascii_lowercase())];
            more += usize::from(*count <= 0);
            *count -= 1;
        }
        let shared = candidate.len() - more;
        more.max(self.length.saturating_sub(shared))
    }
}

/// `did you mean …?` for a help text, if a name is near. For few known names only: with many, the
/// finding keeps a [`UnknownName`].
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<Help> {
    nearest(name, known).map(|near| meant(near).bounded())
}

/// The words of other systems for keys, and the keys that can be meant: the first one that the
/// table has.
const WORDS: [(&[&str], &[&str]); 13] = [
    (
        &[
            "adr", "addr", "adress", "address", "adresse", "location", "loc", "io", "pin", "alias",
            "register", "reg", "input", "output",
        ],
        &["address", "at"],
    ),
    (&["comment", "description", "desc", "remark", "note", "kommentar"], &["doc"]),
    (&["datatype", "data_type", "data-type", "kind", "typ", "class"], &["type"]),
    (&["init", "default", "initial_value", "initial-value", "start"], &["initial"]),
    (&["lo", "low", "lower", "minimum"], &["min"]),
    (&["hi", "high", "upper", "maximum"], &["max"]),
    (&["units", "eu", "uom"], &["unit"]),
    (&["enum", "labels", "states", "meanings"], &["texts"]),
    (&["size", "len", "length", "elements", "dim", "dimension"], &["count"]),
    (&["const", "constant"], &["value"]),
    (&["if", "condition", "conditions", "contacts", "logic"], &["when"]),
    (&["then", "output", "outputs", "coil", "coils", "action", "actions"], &["do"]),
    (&["cycle", "cycle_time", "interval", "scan_time", "scantime"], &["period", "poll", "every"]),
];

/// What stands elsewhere: the place of the key, its words, and the help.
const ELSEWHERE: [(&str, &[&str], &str); 2] = [
    (
        "a tag",
        &["retain", "retentive", "retained", "persistent"],
        "take it away: what is kept stands in the controller file, under `[retain]`",
    ),
    (
        "a tag",
        &["preset", "pt", "pv"],
        "take it away: a preset stands in the instruction, as `TMR t preset=5s`",
    ),
];

/// The help for a wrong key of a table: the meant one, if `has` says that the table lacks it, else
/// all keys. `place`: what the table is called.
pub(super) fn key_help(
    name: &str,
    keys: &[&'static str],
    place: &str,
    has: impl Fn(&str) -> bool,
) -> Help {
    let free: Vec<&'static str> = keys.iter().copied().filter(|key| !has(key)).collect();
    meant_key(name, &free, place).unwrap_or_else(|| {
        let known: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
        Help::from(format!("the keys here are {}", known.join(", "))).with(possible(FixEdit::Omit))
    })
}

/// The question for a wrong key of a table: the key that other systems call so, else the nearest.
/// `place`: what the table is called.
fn meant_key(name: &str, keys: &[&'static str], place: &str) -> Option<Help> {
    let folded = fold(name);
    let is_in = |words: &[&str]| words.contains(&folded.as_str());
    if let Some((.., help)) = ELSEWHERE.iter().find(|(at, words, _)| *at == place && is_in(words)) {
        return Some(Help::from(*help).with(FixEdit::Delete));
    }
    let rows = WORDS.iter().filter(|(words, _)| is_in(words));
    let other = rows.flat_map(|(_, meant)| meant.iter()).find(|key| keys.contains(key));
    let key = keys.iter().find(|key| **key == folded).or(other);
    key.map(|key| meant(*key)).or_else(|| did_you_mean(name, keys.iter().copied()))
}

fn fold(name: &str) -> String {
    name.chars().take(COMPARED_MAX).flat_map(char::to_lowercase).collect()
}

fn distance(a: &str, b: &str) -> usize {
    #[cfg(debug_assertions)]
    counted::COMPUTED.with(|count| count.set(count.get() + 1));
    strsim::osa_distance(a, b)
}

/// The number of names that this thread has compared, and of distances that it has computed. Tests
/// use them to show which searches are skipped.
#[cfg(debug_assertions)]
pub mod counted {
    use std::cell::Cell;

    thread_local! {
        pub(super) static CANDIDATES: Cell<usize> = const { Cell::new(0) };
        pub(super) static COMPUTED: Cell<usize> = const { Cell::new(0) };
    }

    /// The number of distances since the last call.
    pub fn take() -> usize {
        COMPUTED.with(Cell::take)
    }

    /// The number of names since the last call.
    pub fn take_candidates() -> usize {
        CANDIDATES.with(Cell::take)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_with_few_typos_are_suggested() {
        let known = ["bottles", "bin_size", "bin_full", "jam"];
        assert_eq!(nearest("botles", known), Some("bottles"));
        assert_eq!(nearest("bin_fulll", known), Some("bin_full"));
        assert_eq!(nearest("BOTTLES", known), Some("bottles"));
        assert_eq!(nearest("bin_szie", known), Some("bin_size"));
        assert_eq!(nearest("jma", known), Some("jam"));
        assert_eq!(nearest("conveyor", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest("Q", ["X", "Y"]), None);
    }

    #[test]
    fn a_synonym_of_another_system_suggests_the_key_of_the_table() {
        const TAG: [&str; 10] =
            ["at", "count", "initial", "type", "value", "doc", "unit", "min", "max", "log"];
        const RUNG: [&str; 5] = ["name", "doc", "when", "leg", "do"];
        let pairs = [
            ("adress", &TAG[..], Some("did you mean `at`?")),
            ("pin", &TAG, Some("did you mean `at`?")),
            ("At", &TAG, Some("did you mean `at`?")),
            ("lo", &TAG, Some("did you mean `min`?")),
            ("output", &RUNG, Some("did you mean `do`?")),
            ("then", &RUNG, Some("did you mean `do`?")),
            ("adress", &["name", "address"], Some("did you mean `address`?")),
            ("frobnicate", &TAG, None),
        ];
        for (name, keys, wanted) in pairs {
            let help = meant_key(name, keys, "a tag").map(|help| help.text);
            assert_eq!(help.as_deref(), wanted, "{name}");
        }
        let retain = |place| meant_key("retain", &TAG, place);
        assert!(retain("a tag").is_some_and(|help| help.text.contains("[retain]")));
        assert_eq!(retain("a rung"), None);
    }

    #[test]
    fn the_estimate_by_letters_never_exceeds_the_edit_distance() {
        let names = ["", "a", "tag_12", "tga_21", "TAG_1", "bottles", "botles", "zzzzzz", "größe"];
        for (a, b) in names.iter().flat_map(|a| names.iter().map(move |b| (fold(a), fold(b)))) {
            if a.is_ascii() {
                assert!(Letters::of(&a).slips_at_least(&b) <= distance(&a, &b), "{a} {b}");
            }
        }
        assert_eq!(Letters::of("tag_1").slips_at_least("zzz"), 5);
    }

    #[test]
    fn a_swap_or_an_edit_adds_one_to_the_distance() {
        let d = |a: &str, b: &str| distance(&fold(a), &fold(b));
        assert_eq!(d("", "abc"), 3);
        assert_eq!(d("CNTDN", "CTNDN"), 1);
        assert_eq!(d("kitten", "sitting"), 3);
    }

    #[test]
    fn a_limited_search_compares_the_neighbours_in_sorted_order() {
        let names: Vec<String> = (0..1000).map(|n| format!("pump_{n:03}")).collect();
        let known = KnownNames::new(names.iter().map(String::as_str));
        for (wrong, near) in [
            ("pump_50", Some("pump_500")),
            ("pump_777x", Some("pump_777")),
            ("pump_999x", Some("pump_999")),
            ("ump_500", None),
        ] {
            counted::take_candidates();
            let help = UnknownName::new(wrong, &known).searching_at_most(20).help();
            assert_eq!(help, near.map(meant), "{wrong}");
            assert!(counted::take_candidates() <= 20, "{wrong}");
        }
        assert_eq!(known.around("pump_500", usize::MAX).count(), 1000);
        assert_eq!(known.around("a", 2).collect::<Vec<_>>(), ["pump_000", "pump_001"]);
        assert_eq!(known.around("z", 2).collect::<Vec<_>>(), ["pump_998", "pump_999"]);
    }

    #[test]
    fn a_second_search_runs_only_if_the_first_finds_nothing() {
        let (own, all) = (KnownNames::new(["level"]), KnownNames::new(["lever", "pump_1"]));
        let near = |name: &str| {
            counted::take_candidates();
            let second = UnknownName::new(name, &all).followed_by(".run");
            let help = UnknownName::new(name, &own).or(Some(Box::new(second))).help();
            (help.map_or(String::new(), |help| help.text), counted::take_candidates())
        };
        assert_eq!(near("leved"), ("did you mean `level`?".to_owned(), 1));
        assert_eq!(near("pmup_1"), ("did you mean `pump_1.run`?".to_owned(), 3));
        assert_eq!(near("conveyor"), (String::new(), 3));
    }

    #[test]
    fn an_overlong_unknown_name_is_cut() {
        let known = KnownNames::new(["bottles"]);
        let near = UnknownName::new(&"ä".repeat(1_000_000), &known);
        assert_eq!((near.name.len(), near.help()), (2 * COMPARED_MAX, None));
    }
}
