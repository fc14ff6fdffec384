//! Places in memory: an area, an index, a member; and the memory that holds their values.

use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Area {
    X,
    Y,
    C,
    V,
    D,
    R,
    Mc,
    Mi,
    Mhr,
    Mir,
    St,
    Dst,
    Ct,
    T,
    N,
    Block,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Member {
    Whole,
    Acc,
    Done,
    Reset,
    Zero,
    DnDone,
    Timing,
    Cu,
    Cd,
    Dn,
    Ov,
    Un,
    Pre,
    Running,
    /// The bit of a Stage: the number of the element in its Program (1 is the initial Stage).
    Stage(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Loc {
    pub area: Area,
    pub index: usize,
    pub member: Member,
    /// The number of the bit, for a bit of a word.
    pub bit: Option<u32>,
}

impl Area {
    /// Whether a place of the area is a timer or a counter, with members.
    pub fn is_structure(self) -> bool {
        matches!(self, Area::Ct | Area::T | Area::N)
    }
}

impl Loc {
    pub fn whole(area: Area, index: usize) -> Loc {
        Loc::of(area, index, Member::Whole)
    }

    pub fn of(area: Area, index: usize, member: Member) -> Loc {
        Loc { area, index, member, bit: None }
    }

    /// The word of a bit.
    fn word(self) -> Loc {
        Loc { bit: None, ..self }
    }

    /// The lowest and highest value of the place.
    pub fn range(self) -> (i64, i64) {
        if self.bit.is_some() {
            return (0, 1);
        }
        let i32_range = (i64::from(i32::MIN), i64::from(i32::MAX));
        match (self.area, self.member) {
            (Area::V | Area::Mhr | Area::Mir, _) => (0, i64::from(u16::MAX)),
            // An R holds the bits of a real.
            (Area::D | Area::R | Area::Dst, _) => i32_range,
            (Area::Ct | Area::T, Member::Acc) => i32_range,
            (Area::N, Member::Acc | Member::Pre) => (i64::from(i16::MIN), i64::from(i16::MAX)),
            _ => (0, 1),
        }
    }
}

#[derive(Clone, Default)]
pub struct Memory {
    values: BTreeMap<Loc, i64>,
    pub limits: BTreeMap<Loc, (i64, i64)>,
}

impl Memory {
    pub fn get(&self, loc: Loc) -> i64 {
        if let Some(bit) = loc.bit {
            return self.get(loc.word()).div_euclid(1 << bit).rem_euclid(2);
        }
        self.values.get(&loc).copied().unwrap_or(0)
    }

    /// The real that an R holds.
    pub fn real(&self, loc: Loc) -> f32 {
        f32::from_bits(self.get(loc) as u32)
    }

    /// Writes an R: never -0.
    pub fn put_real(&mut self, loc: Loc, value: f32) {
        let (low, high) = self.limits.get(&loc).copied().unwrap_or((i64::MIN, i64::MAX));
        let mut value = value;
        if low != i64::MIN {
            value = value.max(low as f32);
        }
        if high != i64::MAX {
            value = value.min(high as f32);
        }
        let bits = if value == 0.0 { 0 } else { value.to_bits() };
        self.values.insert(loc, i64::from(bits as i32));
    }

    /// Writes a whole number: a cold start, a stimulus.
    pub fn put_whole(&mut self, loc: Loc, value: i64) {
        match loc.area {
            Area::R => self.put_real(loc, value as f32),
            _ => self.put(loc, value),
        }
    }

    /// The value as a trace shows it.
    pub fn text(&self, loc: Loc) -> String {
        if loc.area == Area::R {
            return format!("{:?}", self.real(loc));
        }
        self.get(loc).to_string()
    }

    pub fn bit(&self, loc: Loc) -> bool {
        self.get(loc) != 0
    }

    /// Writes, saturating at the range of the place and at the limits of its tag.
    pub fn put(&mut self, loc: Loc, value: i64) {
        if let Some(bit) = loc.bit {
            return self.put_bit_of(loc.word(), bit, value != 0);
        }
        let (low, high) = loc.range();
        let mut value = value.clamp(low, high);
        if let Some((low, high)) = self.limits.get(&loc) {
            value = value.max(*low).min(*high);
        }
        self.values.insert(loc, value);
    }

    /// Changes one bit of a word. The highest bit of a word with a sign counts negatively.
    fn put_bit_of(&mut self, word: Loc, bit: u32, on: bool) {
        let (low, high) = word.range();
        let is_sign = low < 0 && high == (1 << bit) - 1;
        let weight = if is_sign { -(1 << bit) } else { 1 << bit };
        let was = self.get(word).div_euclid(1 << bit).rem_euclid(2);
        let change = i64::from(on) - was;
        self.put(word, self.get(word) + change * weight);
    }

    pub fn put_bit(&mut self, loc: Loc, on: bool) {
        self.put(loc, i64::from(on));
    }
}
