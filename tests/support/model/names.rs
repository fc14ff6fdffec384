//! Words of the language: integers, durations, addresses, nicknames, tags, blocks and stages.

use super::place::{Area, Loc, Member};
use super::program::{Array, Value};
use std::collections::BTreeMap;

pub fn integer(word: &str) -> Option<i64> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, word),
    };
    let (digits, radix) = match digits.strip_prefix("0x") {
        Some(hex) => (hex, 16),
        None => (digits, 10),
    };
    if !digits.starts_with(|c: char| c.is_ascii_hexdigit()) {
        return None;
    }
    let value = sign * i64::from_str_radix(digits, radix).ok()?;
    i32::try_from(value).ok().map(i64::from)
}

pub fn duration(word: &str) -> Option<i64> {
    if word.contains(':') {
        let parts: Vec<i64> = word.split(':').map_while(|p| p.parse().ok()).collect();
        let [h, m, s, ms] = parts[..] else {
            return None;
        };
        return Some(((h * 60 + m) * 60 + s) * 1000 + ms);
    }
    let mut rest = word;
    let mut total = 0;
    for (unit, factor) in [("h", 3_600_000), ("m", 60_000), ("s", 1000), ("ms", 1)] {
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, tail) = rest.split_at(digits);
        let letters = tail.len() - tail.trim_start_matches(|c: char| c.is_alphabetic()).len();
        if digits > 0 && &tail[..letters] == unit {
            total += number.parse::<i64>().ok()? * factor;
            rest = &tail[letters..];
        }
    }
    (rest.is_empty() && !word.is_empty()).then_some(total)
}

/// A plain address: letters, then a decimal number.
fn address(word: &str) -> Option<(Area, usize)> {
    let split = word.find(|c: char| c.is_ascii_digit())?;
    let (letters, digits) = word.split_at(split);
    let area = match letters {
        "X" => Area::X,
        "Y" => Area::Y,
        "C" => Area::C,
        "V" => Area::V,
        "D" => Area::D,
        "R" => Area::R,
        "MC" => Area::Mc,
        "MI" => Area::Mi,
        "MHR" => Area::Mhr,
        "MIR" => Area::Mir,
        "ST" => Area::St,
        "DST" => Area::Dst,
        "CT" => Area::Ct,
        "T" => Area::T,
        "N" => Area::N,
        _ => return None,
    };
    Some((area, digits.parse().ok()?))
}

fn nickname(name: &str) -> Option<Loc> {
    let bits = [
        "FirstScan",
        "On",
        "Off",
        "1Minute",
        "1Second",
        "100ms",
        "50ms",
        "ScanToggle",
        "LastScan",
        "ForcesActive",
        "DivideByZero",
        "Overflow",
        "OutOfRange",
        "IndexError",
    ];
    let words = [
        "ScanCounter",
        "ScanTime",
        "MinScanTime",
        "MaxScanTime",
        "",
        "Year",
        "Month",
        "Day",
        "Weekday",
        "Hour",
        "Minute",
        "Second",
        "DownSeconds",
        "DayNumber",
        "SecondOfDay",
    ];
    if let Some(n) = bits.iter().position(|b| *b == name) {
        return Some(Loc::whole(Area::St, n));
    }
    words.iter().position(|w| *w == name).map(|n| Loc::whole(Area::Dst, n))
}

pub fn member(area: Area, name: &str) -> Option<Member> {
    Some(match (area, name) {
        (Area::Ct | Area::T, "Acc") => Member::Acc,
        (Area::Ct | Area::T, "Done") => Member::Done,
        (Area::Ct | Area::T, "Reset") => Member::Reset,
        (Area::Ct | Area::T, "Zero") => Member::Zero,
        (Area::Ct, "DnDone") => Member::DnDone,
        (Area::T, "Timing") => Member::Timing,
        (Area::N, "CU") => Member::Cu,
        (Area::N, "CD") => Member::Cd,
        (Area::N, "DN") => Member::Dn,
        (Area::N, "OV") => Member::Ov,
        (Area::N, "UN") => Member::Un,
        (Area::N, "PRE") => Member::Pre,
        (Area::N, "ACC") => Member::Acc,
        _ => return None,
    })
}

/// The place of a numbered member, such as `N,19,6`.
fn numbered_element(word: &str) -> Option<Loc> {
    let mut parts = word.strip_prefix("N,")?.split(',');
    let index = parts.next()?.parse().ok()?;
    let number: usize = parts.next()?.parse().ok()?;
    let members =
        [Member::Cu, Member::Cd, Member::Dn, Member::Ov, Member::Un, Member::Pre, Member::Acc];
    Some(Loc::of(Area::N, index, *members.get(number)?))
}

/// Splits the number of a bit off: `D0.3`, `row[step].3`.
pub fn split_bit(word: &str) -> Option<(&str, u32)> {
    let (base, bit) = word.rsplit_once('.')?;
    let is_name = base.starts_with(|c: char| c.is_alphabetic() || c == '$');
    let is_number = bit.bytes().all(|b| b.is_ascii_digit());
    Some((base, bit.parse().ok().filter(|_| is_name && is_number)?))
}

#[derive(Default)]
pub struct Names {
    pub places: BTreeMap<String, Loc>,
    pub constants: BTreeMap<String, i64>,
    pub arrays: BTreeMap<String, Array>,
    /// The bits and words of each tag of a record: an array for each field.
    pub records: BTreeMap<String, Vec<Array>>,
    /// The number of places of tags with a `type`.
    pub placed: usize,
    /// Each block's name and the names of its Stages.
    pub blocks: Vec<(String, Vec<String>)>,
}

impl Names {
    pub fn place(&self, word: &str) -> Result<Loc, String> {
        self.find(word).ok_or_else(|| format!("`{word}` is no place"))
    }

    fn find(&self, word: &str) -> Option<Loc> {
        if let Some((base, bit)) = split_bit(word) {
            return Some(Loc { bit: Some(bit), ..self.find(base)? });
        }
        if let Some(name) = word.strip_prefix('$') {
            return nickname(name);
        }
        if word.contains('[') {
            return self.constant_element(word);
        }
        if let Some(loc) = numbered_element(word).or_else(|| self.places.get(word).copied()) {
            return Some(loc);
        }
        let Some((head, tail)) = word.rsplit_once('.') else {
            return address(word).map(|(area, index)| Loc::whole(area, index));
        };
        if let Some(block) = self.blocks.iter().position(|(name, _)| name == head) {
            let member = match tail {
                "Running" => Member::Running,
                "Done" => Member::Done,
                stage => Member::Stage(self.stage(block, stage).ok()?),
            };
            return Some(Loc::of(Area::Block, block, member));
        }
        let (area, index) = match self.places.get(head) {
            Some(loc) => (loc.area, loc.index),
            None => address(head)?,
        };
        Some(Loc::of(area, index, member(area, tail)?))
    }

    pub fn value(&self, word: &str) -> Result<Value, String> {
        let constant = integer(word).or_else(|| duration(word));
        if let Some(number) = constant.or_else(|| self.constants.get(word).copied()) {
            return Ok(Value::Const(number));
        }
        let digits = word.strip_prefix('-').unwrap_or(word);
        if digits.starts_with(|c: char| c.is_ascii_digit())
            && let Ok(real) = word.parse::<f32>()
        {
            return Ok(Value::Real(f64::from(real)));
        }
        if let Some((array, index)) = self.element(word) {
            return Ok(Value::Element(array, index));
        }
        self.place(word).map(Value::At)
    }

    /// The number of a structure in its area.
    pub fn structure(&self, area: Area, word: &str) -> Result<usize, String> {
        let loc = self.place(word)?;
        if loc.area == area && loc.member == Member::Whole {
            return Ok(loc.index);
        }
        Err(format!("`{word}` is no structure of {area:?}"))
    }

    pub fn block(&self, name: &str) -> Result<usize, String> {
        let found = self.blocks.iter().position(|(block, _)| block == name);
        found.ok_or_else(|| format!("no block `{name}`"))
    }

    /// The number of a Stage among the elements of its Program.
    pub fn stage(&self, block: usize, name: &str) -> Result<usize, String> {
        let stages = self.blocks.get(block).map(|(_, stages)| stages.as_slice());
        let found = stages.unwrap_or_default().iter().position(|stage| stage == name);
        found.map(|n| n + 1).ok_or_else(|| format!("no stage `{name}`"))
    }
}
