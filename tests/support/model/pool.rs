//! The operands of generated programs: few of each, so that things interact.

use super::case::Expr;
use super::drawn_records::DrawnRecord;
use super::names::split_bit;
use super::rng::Rng;
use std::collections::BTreeMap;

/// Area, first index, count.
pub const AREAS: [(&str, usize, usize); 12] = [
    ("X", 0, 4),
    ("Y", 0, 3),
    ("C", 0, 3),
    ("V", 0, 2),
    ("D", 0, 3),
    ("R", 0, 3),
    ("MC", 1, 2),
    ("MI", 1, 2),
    ("MHR", 1, 2),
    ("MIR", 1, 2),
    ("ST", 0, 14),
    ("DST", 0, 15),
];

type Structure = (&'static str, usize, &'static [&'static str]);

pub const STRUCTURES: [Structure; 3] = [
    ("CT", 4, &["Acc", "Done", "Reset", "Zero", "DnDone"]),
    ("T", 6, &["Acc", "Done", "Reset", "Zero", "Timing"]),
    ("N", 2, &["ACC", "PRE", "CU", "CD", "DN", "OV", "UN"]),
];

const NICKNAMES: [&str; 14] = [
    "$FirstScan",
    "$On",
    "$Off",
    "$1Minute",
    "$1Second",
    "$100ms",
    "$50ms",
    "$ScanToggle",
    "$LastScan",
    "$ForcesActive",
    "$DivideByZero",
    "$Overflow",
    "$OutOfRange",
    "$IndexError",
];

const WORD_NICKNAMES: [&str; 13] = [
    "$ScanCounter",
    "$ScanCounter",
    "$ScanCounter",
    "$Year",
    "$Month",
    "$Day",
    "$Weekday",
    "$Hour",
    "$Minute",
    "$Second",
    "$DownSeconds",
    "$DayNumber",
    "$SecondOfDay",
];

const OPERATORS: [&str; 8] = ["==", "!=", "<", "<=", ">", ">=", "<", ">="];

/// An array. If it has an address, it begins at the first place of its area.
#[derive(Clone, Copy)]
pub struct DrawnArray {
    pub name: &'static str,
    /// The field of an array of records; empty for any other array.
    pub field: &'static str,
    pub area: &'static str,
    pub count: usize,
    /// Whether it has a `type` instead of an address.
    pub placed: bool,
}

/// A structure with an owner: `CT0`, `recipe[1].over`.
#[derive(Clone)]
pub struct Owned {
    pub name: String,
    /// `CT`, `T` or `N`.
    pub area: &'static str,
}

pub struct Pool {
    pub rng: Rng,
    pub period: i64,
    /// The percentage of contacts that read inputs; the others read any bits.
    pub lively: usize,
    /// The structures that have an owner.
    pub owned: Vec<Owned>,
    /// Tags by their addresses.
    pub tags: BTreeMap<String, String>,
    /// Named constants.
    pub constants: Vec<String>,
    pub limits: BTreeMap<String, (i64, i64)>,
    pub arrays: Vec<DrawnArray>,
    /// Tags with a `type`, fields and their elements, each with the area of the same kind.
    pub typed: Vec<(String, &'static str)>,
    /// Arrays of structures, and structures in arrays of records.
    pub structures: Vec<DrawnArray>,
    pub records: Vec<DrawnRecord>,
    /// The bits of blocks: Stages, `.Running`, `.Done`.
    pub block_bits: Vec<String>,
    /// Whether the expression is drawn for a contact.
    pub in_contact: bool,
}

impl Pool {
    /// The address, its tag, or a different spelling of it.
    pub fn name(&mut self, address: &str) -> String {
        if self.rng.chance(50)
            && let Some(tag) = self.tags.get(address)
        {
            return tag.clone();
        }
        if let Some((word, bit)) = split_bit(address) {
            return match self.tags.get(word) {
                Some(tag) if self.rng.chance(50) => format!("{tag}.{bit}"),
                _ => address.to_string(),
            };
        }
        let Some((structure, member)) = address.split_once('.') else {
            return self.as_element(address);
        };
        if self.rng.chance(50)
            && let Some(tag) = self.tags.get(structure)
        {
            return format!("{tag}.{member}");
        }
        let element = match (structure.strip_prefix('N'), member) {
            (None, _) => None,
            (Some(n), "CU") => Some((n, 0)),
            (Some(n), "CD") => Some((n, 1)),
            (Some(n), "DN") => Some((n, 2)),
            (Some(n), "OV") => Some((n, 3)),
            (Some(n), "UN") => Some((n, 4)),
            (Some(n), "PRE") => Some((n, 5)),
            (Some(n), _) => Some((n, 6)),
        };
        match element {
            Some((n, element)) if self.rng.chance(30) => format!("N,{n},{element}"),
            _ => address.to_string(),
        }
    }

    pub fn indexed(&mut self, area: &str) -> String {
        let typed = self.typed.iter().filter(|(_, like)| *like == area).map(|(name, _)| name);
        let typed: Vec<&String> = typed.collect();
        if !typed.is_empty() && self.rng.chance(25) {
            return (*self.rng.pick(&typed)).clone();
        }
        let found = AREAS.iter().find(|(name, _, _)| *name == area);
        let (first, count) = found.map_or((0, 1), |(_, first, count)| (*first, *count));
        format!("{area}{}", first + self.rng.below(count))
    }

    /// A flag of a structure, mostly of a structure with an owner.
    fn flag(&mut self, area: &str) -> String {
        let found = STRUCTURES.iter().find(|(name, _, _)| *name == area);
        let (_, count, members) = found.unwrap_or(&STRUCTURES[0]);
        let flags = if area == "N" { &members[2..] } else { &members[1..] };
        let owned = self.owned.iter().filter(|owned| owned.area == area);
        let owned: Vec<String> = owned.map(|owned| owned.name.clone()).collect();
        let name = match owned.is_empty() || self.rng.chance(10) {
            true => format!("{area}{}", self.rng.below(*count)),
            false => self.rng.pick(&owned).clone(),
        };
        format!("{name}.{}", self.rng.pick(flags))
    }

    pub fn bit(&mut self) -> String {
        if self.rng.chance(5)
            && let Some(element) = self.element(true, false)
        {
            return element;
        }
        if self.rng.chance(5)
            && let Some(flag) = self.moving_member(true)
        {
            return flag;
        }
        if self.rng.chance(9) {
            return self.word_bit();
        }
        let inputs = self.rng.chance(self.lively);
        let address = match self.rng.weighted(&[6, 16, 10, 4, 3, 14, 14, 7, 10, 16]) {
            _ if inputs => self.indexed("X"),
            0 => self.rng.pick(&["$ScanToggle", "$50ms", "$100ms"]).to_string(),
            1 => self.indexed("C"),
            2 => self.indexed("Y"),
            3 => self.indexed("MC"),
            4 => self.indexed("MI"),
            5 => self.flag("CT"),
            6 => self.flag("T"),
            7 => self.flag("N"),
            8 if self.rng.chance(50) => self.indexed("ST"),
            8 => self.rng.pick(&NICKNAMES).to_string(),
            _ if self.block_bits.is_empty() => self.indexed("X"),
            _ => self.rng.pick(&self.block_bits).clone(),
        };
        self.name(&address)
    }

    /// The address of a bit that programs write.
    pub fn written_bit(&mut self) -> String {
        if self.rng.chance(18) {
            return self.written_word_bit().unwrap_or_else(|| "C0".to_string());
        }
        let area = match self.rng.weighted(&[40, 40, 12, 8]) {
            0 => "Y",
            1 => "C",
            2 => "MC",
            _ => "MI",
        };
        self.indexed(area)
    }

    /// The address of a word that programs write.
    pub fn written_word(&mut self) -> String {
        let owned = 8 * usize::from(!self.owned.is_empty());
        match self.rng.weighted(&[40, 16, 8, 4, 10, 10, 6, 6, owned]) {
            8 => {
                let of = self.rng.pick(&self.owned).clone();
                of.accumulator()
            }
            0 => self.indexed("D"),
            1 => self.indexed("V"),
            2 => self.indexed("MHR"),
            3 => self.indexed("MIR"),
            4 => format!("CT{}.Acc", self.rng.below(4)),
            5 => format!("T{}.Acc", self.rng.below(6)),
            6 => format!("N{}.ACC", self.rng.below(2)),
            _ => format!("N{}.PRE", self.rng.below(2)),
        }
    }

    pub fn word(&mut self) -> String {
        if self.rng.chance(8)
            && let Some(element) = self.element(false, false)
        {
            return element;
        }
        if self.rng.chance(5)
            && let Some(word) = self.moving_member(false)
        {
            return word;
        }
        let address = match self.rng.weighted(&[90, 6, 4]) {
            0 => self.written_word(),
            1 => self.rng.pick(&WORD_NICKNAMES).to_string(),
            _ => self.indexed("DST"),
        };
        self.name(&address)
    }

    /// A number that is small, of the period's size, or extreme.
    pub fn number(&mut self) -> i64 {
        match self.rng.weighted(&[62, 32, 6]) {
            0 => self.rng.range(-3, 8),
            1 => self.milliseconds(),
            _ => *self.rng.pick(&[
                i64::from(i32::MIN),
                i64::from(i32::MIN) + 1,
                i64::from(i32::MAX) - 1,
                i64::from(i32::MAX),
                32_766,
                32_767,
                -32_768,
                -32_767,
                65_534,
                65_535,
                65_536,
                -1,
            ]),
        }
    }

    pub fn milliseconds(&mut self) -> i64 {
        let near = self.rng.range(-1, 1) * i64::from(self.rng.chance(50));
        (self.rng.range(0, 7) * self.period + near).max(0)
    }

    pub fn integer_text(&mut self, number: i64) -> String {
        match (self.rng.chance(12), number < 0) {
            (false, _) => number.to_string(),
            (true, false) => format!("0x{number:x}"),
            (true, true) => format!("-0x{:X}", -number),
        }
    }

    pub fn duration_text(&mut self, ms: i64) -> String {
        let (hours, minutes) = (ms / 3_600_000, ms / 60_000 % 60);
        let (seconds, rest) = (ms / 1000 % 60, ms % 1000);
        match self.rng.weighted(&[40, 25, 20, 15]) {
            0 => format!("{ms}ms"),
            1 => self.integer_text(ms),
            2 => format!("{hours:02}:{minutes:02}:{seconds:02}:{rest:03}"),
            _ => {
                let parts = [(hours, "h"), (minutes, "m"), (seconds, "s"), (rest, "ms")];
                let used = parts.iter().filter(|(n, unit)| *n > 0 || (*unit == "ms" && ms == 0));
                used.map(|(n, unit)| format!("{n}{unit}")).collect()
            }
        }
    }

    /// A value: a place, a constant or a named constant.
    pub fn value(&mut self) -> String {
        match self.rng.weighted(&[45, 40, 10, 5]) {
            0 => self.word(),
            1 => {
                let number = self.number();
                self.integer_text(number)
            }
            2 => {
                let ms = self.milliseconds();
                self.duration_text(ms)
            }
            _ if self.constants.is_empty() => self.word(),
            _ => self.rng.pick(&self.constants).clone(),
        }
    }

    fn compare(&mut self) -> Expr {
        if self.rng.chance(35) {
            return Expr::Compare(self.computed_compare());
        }
        let (left, right) = match self.rng.chance(90) {
            true => (self.any_word(), self.any_value()),
            false => (self.any_value(), self.any_word()),
        };
        let operator = *self.rng.pick(&OPERATORS);
        let space = if self.rng.chance(70) { " " } else { "" };
        Expr::Compare(format!("{left}{space}{operator}{space}{right}"))
    }

    fn leaf(&mut self) -> Expr {
        match self.rng.weighted(&[68, 9, 7, 14, 2]) {
            0 => Expr::Leaf(self.bit()),
            1 => Expr::Leaf(format!("rise({})", self.bit())),
            2 => Expr::Leaf(format!("fall({})", self.bit())),
            3 => self.compare(),
            _ => Expr::Leaf(self.computed_bit().unwrap_or_else(|| self.bit())),
        }
    }

    pub fn expr(&mut self, depth: usize) -> Expr {
        if depth == 0 {
            return self.leaf();
        }
        match self.rng.weighted(&[56, 20, 6, 14, 4, 5]) {
            0 => self.leaf(),
            1 => Expr::Not(Box::new(self.expr(depth - 1))),
            2 => {
                let count = 2 + self.rng.below(2);
                Expr::All((0..count).map(|_| self.expr(depth - 1)).collect())
            }
            3 => {
                let count = 2 + self.rng.below(2);
                Expr::Any((0..count).map(|_| self.expr(depth - 1)).collect())
            }
            4 => Expr::Group(Box::new(self.expr(depth - 1))),
            _ => {
                let word = *self.rng.pick(&["rise", "fall"]);
                Expr::Edge(word, Box::new(self.expr(depth - 1)))
            }
        }
    }

    /// A series of contacts for a leg.
    pub fn series(&mut self) -> Vec<Expr> {
        if self.rng.chance(12) {
            return vec![Expr::Leaf("$On".to_string())];
        }
        let count = 1 + self.rng.weighted(&[80, 17, 3]);
        (0..count).map(|_| self.expr(3)).collect()
    }

    /// A series that is seldom ON, for instructions that would stop everything.
    pub fn rare_series(&mut self) -> Vec<Expr> {
        match self.rng.weighted(&[40, 20, 20, 20]) {
            0 => vec![Expr::Leaf(format!("rise({})", self.bit()))],
            1 => vec![Expr::Leaf(format!("fall({})", self.bit()))],
            2 => {
                let operator = self.rng.pick(&["==", "==", ">="]);
                vec![Expr::Compare(format!("$ScanCounter {operator} {}", self.rng.below(40)))]
            }
            _ => vec![self.leaf(), self.leaf()],
        }
    }
}
