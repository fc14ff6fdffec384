//! Places of words in the notation of other controllers: `V0:3`, `D0:W`, `a/3`, `N7:0/3`.
//!
//! None of them is a name here. The readers of names ask [`instead_of`] when a `:` or a `/` follows
//! a name, so that all of them give the same help. This module accepts nothing.

/// The longest text that is read.
const TEXT_MAX: usize = 64;

/// What is written here for a place in the notation of another controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ForeignPlace {
    /// This name.
    Name(String),
    /// No name: the help has to say it in words.
    Words(String),
}

/// The text to write for a word with a `:` or a `/` in it; `None` for any other text.
pub fn instead_of(word: &str) -> Option<ForeignPlace> {
    let at = word.find([':', '/']).filter(|_| word.len() <= TEXT_MAX)?;
    let (base, part) = (&word[..at], &word[at + 1..]);
    let begins_name = base.starts_with(|c: char| c.is_ascii_alphabetic() || c == '$');
    if !begins_name || part.is_empty() {
        return None;
    }
    let is_cast = word[at..].starts_with(':');
    let name = file_address(base, part).filter(|_| is_cast);
    Some(match name.or_else(|| bit(base, part)) {
        Some(name) => ForeignPlace::Name(name),
        None if is_cast => cast(base, &part.to_ascii_uppercase()),
        None => return None,
    })
}

/// The name of a bit of a word: `V0.3` for `V0:3` and `V0/3`. A word has at most 32 bits.
fn bit(base: &str, part: &str) -> Option<String> {
    let number: u8 = part.parse().ok().filter(|number| *number < 32)?;
    Some(format!("{base}.{number}"))
}

/// A part of a word that is read as another type: `D0:W`, `D0:UB1`, `D0:RD`.
fn cast(base: &str, part: &str) -> ForeignPlace {
    let kind = part.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = part[kind.len()..].parse().unwrap_or(0_u8);
    let bits = match kind {
        "B" | "UB" | "SB" => 8,
        "W" | "UW" | "SW" => 16,
        "D" | "UD" | "SD" | "S" | "U" => 32,
        _ => 0,
    };
    let shift = u32::from(number) * bits;
    let mask = 1_u64.checked_shl(bits).unwrap_or(0).saturating_sub(1);
    ForeignPlace::Words(match (bits, shift) {
        (16 | 32, 0) => return ForeignPlace::Name(base.to_owned()),
        (8, 0) => format!("its low byte is computed: `MATH D1 = {base} & {mask}`"),
        (8 | 16, 1..32) => format!("it is computed: `MATH D1 = {base} >> {shift} & {mask}`"),
        _ if kind.starts_with('R') => {
            "a real has a word of its own: `R0`, or a tag with `type = \"real\"`".to_owned()
        }
        _ => "a bit of a word is `D0.3`; other parts of it are computed by MATH".to_owned(),
    })
}

/// The address for one of a file of addresses: `D0.3` for `N7:0/3`, `T0.Done` for `T4:0.DN`.
fn file_address(file: &str, part: &str) -> Option<String> {
    let letter = file.trim_end_matches(|c: char| c.is_ascii_digit());
    let end = part.find(['/', '.']).unwrap_or(part.len());
    let (element, behind) = (part[..end].parse::<u16>().ok()?, part.get(end + 1..));
    let bit = match behind {
        Some(behind) => behind.parse::<u16>().ok().filter(|bit| *bit < 16),
        None => None,
    };
    let space = |of_words: &str| format!("{of_words}{element}");
    let number_of_bit =
        |space: &str| Some(format!("{space}{}", 16 * u32::from(element) + u32::from(bit?)));
    let member = |structure: String| match behind.map(str::to_ascii_uppercase).as_deref() {
        None => Some(structure),
        Some("DN") => Some(format!("{structure}.Done")),
        Some("ACC") => Some(format!("{structure}.Acc")),
        Some(_) => None,
    };
    match (letter, behind) {
        ("N" | "L", None) => Some(space("D")),
        ("N" | "L", Some(_)) => Some(format!("{}.{}", space("D"), bit?)),
        ("B", None) => Some(space("V")),
        ("B", Some(_)) => number_of_bit("C"),
        ("F", None) => Some(space("R")),
        ("I", Some(_)) => number_of_bit("X"),
        ("O", Some(_)) => number_of_bit("Y"),
        ("T", _) => member(space("T")),
        ("C", _) => member(space("CT")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_of_another_controller_has_a_name_here_or_words() {
        let name = |word: &str, right: &str| {
            assert_eq!(instead_of(word), Some(ForeignPlace::Name(right.to_owned())), "{word}");
        };
        name("V0:3", "V0.3");
        name("status:31", "status.31");
        name("list[2]:3", "list[2].3");
        name("D0/3", "D0.3");
        name("p1.status/0", "p1.status.0");
        name("D0:W", "D0");
        name("d:UW0", "d");
        name("D0:SD", "D0");
        name("N7:0", "D0");
        name("N7:10/3", "D10.3");
        name("B3:1/2", "C18");
        name("B3:1", "V1");
        name("F8:2", "R2");
        name("T4:0", "T0");
        name("T4:1.DN", "T1.Done");
        name("C5:2/dn", "CT2.Done");
        name("C5:2.ACC", "CT2.Acc");
        name("I:1/3", "X19");
        name("O:0/3", "Y3");
        let words = |word: &str, begin: &str| match instead_of(word) {
            Some(ForeignPlace::Words(words)) => assert!(words.starts_with(begin), "{words}"),
            other => panic!("{word}: {other:?}"),
        };
        words("V0:B0", "its low byte is computed: `MATH D1 = V0 & 255`");
        words("V0:UB1", "it is computed: `MATH D1 = V0 >> 8 & 255`");
        words("D0:W1", "it is computed: `MATH D1 = D0 >> 16 & 65535`");
        words("D0:RD", "a real has a word of its own");
        words("D0:W2", "a bit of a word is `D0.3`");
        words("V0:32", "a bit of a word is `D0.3`");
        words("T4:0.TT", "a bit of a word is `D0.3`");
        for other in ["", "D0", "1:30", ":3", "D0:", "D0/x", "D0/32", "00:00:02"] {
            assert_eq!(instead_of(other), None, "{other}");
        }
    }
}
