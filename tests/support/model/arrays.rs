//! Arrays: elements that a word selects, COPY, FILL and SR.

use super::exec::Sim;
use super::names::{Names, member};
use super::place::{Area, Loc};
use super::program::{Array, To, Value};

const INDEX_ERROR: usize = 13;

impl Array {
    /// The place of an element.
    pub fn element(self, index: i64) -> Option<Loc> {
        let at = usize::try_from(index).ok().filter(|at| *at < self.count)?;
        Some(Loc { index: self.first.index + at, ..self.first })
    }

    /// The bit with this number of each word, or this member of each structure.
    fn part(self, name: &str) -> Option<Array> {
        let first = match name.parse() {
            Ok(number) => Loc { bit: Some(number), ..self.first },
            Err(_) => Loc { member: member(self.first.area, name)?, ..self.first },
        };
        Some(Array { first, ..self })
    }

    /// The elements from `low` to `high`.
    pub fn slice(self, low: usize, high: usize) -> Option<Array> {
        self.element(i64::try_from(high).ok()?)?;
        let count = (high + 1).checked_sub(low)?;
        Some(Array { first: self.element(i64::try_from(low).ok()?)?, count })
    }

    pub fn each(self) -> impl Iterator<Item = Loc> {
        (0..self.count).map(move |at| Loc { index: self.first.index + at, ..self.first })
    }
}

impl Sim<'_> {
    pub fn wrong_index(&mut self) {
        if self.quiet {
            return;
        }
        self.memory.put_bit(Loc::whole(Area::St, INDEX_ERROR), true);
    }

    /// Reads a value for an instruction that acts; notes a wrong index.
    pub fn read(&mut self, value: Value) -> i64 {
        if let Value::Element(array, index) = value
            && array.element(self.memory.get(index)).is_none()
        {
            self.wrong_index();
        }
        self.value(value)
    }

    /// Writes a word or bit that may be an element.
    pub fn write(&mut self, to: To, value: i64) {
        match to {
            To::At(loc) => self.memory.put(loc, value),
            To::Element(array, index) => match array.element(self.memory.get(index)) {
                Some(loc) => self.memory.put(loc, value),
                None => self.wrong_index(),
            },
        }
    }

    pub fn copy(&mut self, from: Array, to: Array) {
        let values: Vec<_> = from.each().map(|loc| self.at(loc)).collect();
        to.each().zip(values).for_each(|(loc, value)| self.store_at(loc, value));
    }

    pub fn fill(&mut self, value: Value, to: Array) {
        let value = self.operand(value);
        to.each().for_each(|loc| self.store_at(loc, value));
    }

    pub fn pack(&mut self, from: Array, to: To) {
        let area = match to {
            To::At(loc) => loc.area,
            To::Element(array, _) => array.first.area,
        };
        let sign = match area {
            Area::V | Area::Mhr | Area::Mir => None,
            Area::N => Some(15),
            _ => Some(31),
        };
        let mut word = 0;
        for (at, bit) in from.each().enumerate() {
            let weight = if sign == Some(at) { -(1i64 << at) } else { 1 << at };
            word += if self.memory.bit(bit) { weight } else { 0 };
        }
        self.write(to, word);
    }

    pub fn unpack(&mut self, value: Value, to: Array) {
        let word = self.read(value);
        for (at, bit) in to.each().enumerate() {
            self.memory.put_bit(bit, (word >> at) % 2 != 0);
        }
    }

    pub fn shift(&mut self, bits: &[Loc], history: usize, legs: &[bool]) {
        let leg = |n: usize| legs.get(n).copied().unwrap_or(false);
        let rises = self.edge(history, leg(1));
        if leg(2) {
            bits.iter().for_each(|bit| self.memory.put_bit(*bit, false));
        } else if rises {
            let mut before = leg(0);
            for bit in bits {
                let now = self.memory.bit(*bit);
                self.memory.put_bit(*bit, before);
                before = now;
            }
        }
    }
}

impl Names {
    /// The array of a name without its index: `row`, `recipe.kind`, `recipe.over.Done`, `row.3`.
    pub fn column(&self, name: &str) -> Option<Array> {
        if let Some(array) = self.arrays.get(name) {
            return Some(*array);
        }
        let (base, part) = name.rsplit_once('.')?;
        self.column(base)?.part(part)
    }

    /// The array of an element or a slice, and what stands in its brackets.
    fn indexed<'a>(&self, word: &'a str) -> Option<(Array, &'a str)> {
        let (name, rest) = word.split_once('[')?;
        let (index, part) = rest.split_once(']')?;
        Some((self.column(&format!("{name}{part}"))?, index))
    }

    /// An element such as `row[step]`: the array, and the place of the index word.
    pub fn element(&self, word: &str) -> Option<(Array, Loc)> {
        let (array, index) = self.indexed(word)?;
        Some((array, self.place(index).ok()?))
    }

    /// The place of an element with a constant index, such as `row[2]`.
    pub fn constant_element(&self, word: &str) -> Option<Loc> {
        let (array, index) = self.indexed(word)?;
        match self.value(index).ok()? {
            Value::Const(number) => array.element(number),
            Value::Real(_) | Value::At(_) | Value::Element(..) => None,
        }
    }

    /// The places, in order, of a whole array, a slice or a range.
    pub fn run(&self, word: &str) -> Result<Vec<Loc>, String> {
        if let Some(array) = self.arrays.get(word) {
            return Ok(array.each().collect());
        }
        let missing = || format!("`{word}` is no array");
        if let Some((array, ends)) = self.indexed(word) {
            let slice = ends
                .split_once("..")
                .and_then(|(low, high)| array.slice(low.parse().ok()?, high.parse().ok()?));
            return Ok(slice.ok_or_else(missing)?.each().collect());
        }
        let (low, high) = word.split_once("..").ok_or_else(missing)?;
        Ok(between(self.place(low)?, self.place(high)?))
    }

    /// A run in ascending order, as an array.
    pub fn array(&self, word: &str) -> Result<Array, String> {
        let run = self.run(word)?;
        Ok(Array { first: run[0], count: run.len() })
    }
}

fn between(low: Loc, high: Loc) -> Vec<Loc> {
    let at = |index| Loc::whole(low.area, index);
    if low.index <= high.index {
        (low.index..=high.index).map(at).collect()
    } else {
        (high.index..=low.index).rev().map(at).collect()
    }
}
