//! Compares the outputs about a recording on a page with those of the present run. Times, scan
//! numbers and sizes differ in every run.
//!
//! A token that is a number, a time or a duration is masked. [`Carried`] remembers the number of
//! the present run for each number on the page, so that the page's next command can use it.

use std::collections::HashMap;

/// The units that follow a number, directly or as a separate word.
const UNITS: [&str; 9] = ["us", "ms", "s", "m", "min", "h", "d", "kB", "MB"];

/// A shorter number in a command is not a scan or a time, but the value of an option: `head -n 3`.
const LENGTH_MIN: usize = 3;

/// A line with `#` for each number, time and duration, and with single spaces between its words.
pub fn masked(line: &str) -> String {
    let indent: String = line.chars().take_while(|&char| char == ' ').collect();
    let mut words: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        let (before, body, after) = parts(word);
        let is_unit = UNITS.contains(&body) && before.is_empty();
        let follows_number = words.last().is_some_and(|last| last.ends_with('#'));
        if is_unit && follows_number {
            let last = words.last_mut().expect("a word");
            last.push_str(after);
        } else if is_number(body) {
            words.push(format!("{before}#{after}"));
        } else {
            words.push(word.to_owned());
        }
    }
    indent + &words.join(" ")
}

/// A word in three parts: quotes, parentheses or a `scan=` before it, its body, and punctuation
/// after it.
fn parts(word: &str) -> (&str, &str, &str) {
    let is_edge = |char: char| "\"'(),;:".contains(char);
    let begin = word.rfind(['=', '(', '"', '\'']).filter(|&at| at + 1 < word.len());
    let begin = begin.map_or(0, |at| at + 1);
    let body = word[begin..].trim_end_matches(is_edge);
    (&word[..begin], body, &word[begin + body.len()..])
}

/// Whether a word is a number, a date, a time, or a number with its unit: `1,323`, `22:07:59.415`,
/// `1s500ms`.
fn is_number(body: &str) -> bool {
    let body = body.strip_prefix('-').unwrap_or(body);
    if !body.starts_with(|char: char| char.is_ascii_digit()) {
        return false;
    }
    let is_digit = |char: char| char.is_ascii_digit() || "-:.,TZ".contains(char);
    body.split(is_digit).all(|text| text.is_empty() || UNITS.contains(&text))
}

/// The number of the present run for each number on the page.
#[derive(Default)]
pub struct Carried(HashMap<String, String>);

impl Carried {
    /// Remembers the numbers of a line on the page and of the printed line.
    pub fn learn(&mut self, shown: &str, printed: &str) {
        let (shown, printed) = (shown.split_whitespace(), printed.split_whitespace());
        for (shown, printed) in shown.zip(printed) {
            let (old, new) = (parts(shown).1, parts(printed).1);
            if old.len() >= LENGTH_MIN && is_number(old) && is_number(new) {
                self.0.insert(old.to_owned(), new.to_owned());
            }
        }
    }

    /// A command of the page with the numbers of the present run.
    pub fn translate(&self, command: &str) -> String {
        let words = command.split(' ').map(|word| {
            let (before, body, after) = parts(word);
            self.0.get(body).map_or_else(|| word.to_owned(), |now| format!("{before}{now}{after}"))
        });
        words.collect::<Vec<_>>().join(" ")
    }
}

#[test]
fn numbers_times_and_durations_are_masked() {
    let cases = [
        ("  turned it OFF 3.0 s ago, in scan 861: Main", "  turned it OFF # ago, in scan #: Main"),
        ("  turned it OFF 998 ms ago", "  turned it OFF # ago"),
        ("2026-11-22 22:07:50.825 to 22:08:04.055  scans 1", "# # to # scans #"),
        (
            "old ON, new OFF (scan 741); 1 time, 1.200 s and",
            "old ON, new OFF (scan #); # time, # and",
        ),
        ("tag=not_leaving scan=860", "tag=not_leaving scan=#"),
        ("belt (Y0) is OFF: plant.toml:75", "belt (Y0) is OFF: plant.toml:75"),
        ("1,323 scans replayed in 0.1 s, 105 × real", "# scans replayed in #, # × real"),
        ("the last 1m02s in memory", "the last # in memory"),
    ];
    for (line, shown) in cases {
        assert_eq!(masked(line), shown);
    }
}

#[test]
fn numbers_of_a_page_are_replaced_by_present_numbers_in_commands() {
    let mut carried = Carried::default();
    carried.learn("alarm ON tag=jam scan=860", "alarm ON tag=jam scan=913");
    carried.learn("all 3 hashes", "all 4 hashes");
    assert_eq!(carried.translate("why Y0 --at \"scan 860\""), "why Y0 --at \"scan 913\"");
    assert_eq!(carried.translate("head -n 3"), "head -n 3");
}
