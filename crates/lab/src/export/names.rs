//! Names of IEC 61131-3 for the names of a ladder: legal, unique in any case, and as near to the
//! original as they can be.

use std::collections::{HashMap, HashSet};

/// Longest name that is given.
const LENGTH_MAX: usize = 100;

/// The words of the standard that are no names, its functions and blocks, and the blocks of its
/// examples, which MatIEC has in its library.
const WORDS: &str = " \
    abs action acos add and any array asin at atan atan2 bit bool by byte case concat \
    configuration constant continue cos ctd ctu ctud date date_and_time delete derivative derived \
    dint div do dt dword else elsif end en end_if eno eq exit exp expt f_edge f_trig false \
    find for from function function_block ge gt hysteresis \
    if initial_step insert int integral interval \
    jmp lbl le left len limit lint ln log lreal lt lword max mid min mod move mul mux ne \
    nil non_retain not of on or pid pointer priority program r_edge r_trig ramp read_only \
    read_write real ref repeat replace resource ret retain return right rol ror rs rtc sel \
    sema shl shr sin single sint sqrt sr step string struct sub super tan task then this \
    time time_of_day to tod tof ton tp trunc transition true type udint uint ulint until \
    usint var via while with word wstring xor ";

/// The names of a project.
#[derive(Clone, Debug, Default)]
pub(super) struct IecNames {
    /// In small letters.
    taken: HashSet<String>,
    /// The next number to try behind a name, so that many equal wishes do not take long.
    next: HashMap<String, usize>,
}

impl IecNames {
    /// Takes a name near a wish.
    pub(super) fn take(&mut self, wish: &str) -> String {
        let base = legal(wish);
        let mut name = base.clone();
        let number = self.next.entry(base.to_lowercase()).or_insert(2);
        while !self.taken.insert(name.to_lowercase()) {
            name = format!("{base}_{number}");
            *number += 1;
        }
        name
    }
}

/// A legal name near a wish: letters, digits and single underscores.
fn legal(wish: &str) -> String {
    let mut name = String::new();
    for letter in wish.chars().take(LENGTH_MAX) {
        match letter {
            letter if letter.is_ascii_alphanumeric() => name.push(letter),
            '$' | ']' => {}
            _ if name.ends_with('_') || name.is_empty() => {}
            _ => name.push('_'),
        }
    }
    let name = name.trim_end_matches('_');
    let is_word = WORDS.contains(&format!(" {} ", name.to_lowercase()));
    match name.chars().next() {
        Some(first) if first.is_ascii_alphabetic() && !is_word => name.to_owned(),
        Some(first) if first.is_ascii_alphabetic() => format!("{name}_tag"),
        _ => format!("tag_{name}").trim_end_matches('_').to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_becomes_legal_and_stays_near_its_original() {
        for (wish, name) in [
            ("motor", "motor"),
            ("p1.lamp.Done", "p1_lamp_Done"),
            ("recipe[3]", "recipe_3"),
            ("recipe[3].target", "recipe_3_target"),
            ("step", "step_tag"),
            ("On", "On_tag"),
            ("ramp", "ramp_tag"),
            ("Hysteresis", "Hysteresis_tag"),
            ("$Hour", "Hour"),
            ("a__b_", "a_b"),
            ("3rd", "tag_3rd"),
            ("", "tag"),
        ] {
            assert_eq!(legal(wish), name, "{wish}");
        }
    }

    #[test]
    fn two_wishes_never_get_one_name_whatever_their_case() {
        let mut names = IecNames::default();
        assert_eq!(names.take("a.b"), "a_b");
        assert_eq!(names.take("A_B"), "A_B_2");
        assert_eq!(names.take("a_b"), "a_b_3");
    }
}
