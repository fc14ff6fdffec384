//! Instructions of Logix on arrays: COP, FLL, FFL, FFU, BSL, BSR.

use super::formula::{LogixFormula, ValueType};
use super::locate::{Index, LocatedOperand};
use super::path::whole;
use super::rll::RllInstruction;
use super::translate::{Terms, Translation, contact_on, operand};
use super::types::Kind;
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::Term;

/// Most words of a bit shift.
const SHIFT_WORDS_MAX: u32 = 32;

/// Neighbours in an array.
struct ArrayPart {
    /// The tag of the array, or a plain tag.
    array: String,
    /// The field behind the index.
    field: String,
    first: u32,
    count: u32,
    kind: Kind,
    place: TouchedPlace,
    /// Whether other members of a structure lie behind it.
    is_member: bool,
}

impl ArrayPart {
    fn element(&self, at: u32) -> String {
        match self.is_array() {
            true => format!("{}[{}]{}", self.array, self.first + at, self.field),
            false => format!("{}{}", self.array, self.field),
        }
    }

    fn is_array(&self) -> bool {
        self.count != 0
    }

    /// The first element, as a value.
    fn first_value(&self) -> LogixFormula {
        let is_real = self.kind == Kind::Real;
        let value = if is_real { ValueType::Real } else { ValueType::Whole };
        let (text, reads) = (self.element(0), vec![self.place.clone()]);
        LogixFormula { text, reads, value, is_atom: true, ..LogixFormula::whole(0) }
    }

    /// How many elements there are.
    fn room(&self) -> u32 {
        if self.is_array() { self.count } else { 1 }
    }

    /// The part of a length that Logix writes: it stops at the end of a tag.
    fn fitting(&self, length: u32) -> Result<u32, String> {
        match length > self.room() && self.is_member {
            true => Err("a copy beyond the end of a member, into the next ones".to_owned()),
            false => Ok(length.min(self.room())),
        }
    }

    fn slice(&self, from: u32, length: u32) -> String {
        let (first, last) = (self.first + from, self.first + from + length - 1);
        format!("{}[{first}..{last}]{}", self.array, self.field)
    }
}

impl Translation<'_> {
    /// An instruction on arrays.
    pub(super) fn file(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        match instruction.name.as_str() {
            "COP" | "CPS" => self.copy(instruction, when),
            "FLL" => self.fill(instruction, when),
            "FFL" => self.load(instruction, when),
            "FFU" => self.unload(instruction, when),
            name => self.shift(instruction, when, name == "BSL"),
        }
    }

    /// The elements from the one that a text names on.
    fn run(&mut self, text: &str) -> Result<ArrayPart, String> {
        let located = self.written(text, &Kind::Dint)?;
        self.memory.variables[located.variable].is_read = true;
        self.run_of(located)
    }

    fn run_of(&mut self, located: LocatedOperand) -> Result<ArrayPart, String> {
        if located.word.is_some() {
            return Err(format!("`{}` is a bit", located.text));
        }
        let whole = located.dimensions.iter().product::<u32>();
        let (array, behind) = match located.text.split_once('[') {
            Some((array, rest)) => (array.to_owned(), rest.split_once(']').map_or("", |(_, f)| f)),
            None => (located.text.clone(), ""),
        };
        let first = match located.index {
            Index::None => 0,
            // An array within an element: those of all elements are one array.
            Index::Fixed(at) => at.saturating_mul(whole),
            Index::Moving(_) => return Err("a run of elements with a moving index".to_owned()),
        };
        let total = self.memory.total(&located);
        let count = match (located.dimensions.is_empty(), &located.index) {
            (true, Index::None) => 0,
            // An array of one plain element is a plain tag.
            _ if total == 0 => 0,
            (false, Index::Fixed(_)) => whole,
            _ => total.saturating_sub(first).min(located.within()),
        };
        let place = located.place();
        let is_member = !located.path.is_empty();
        let (field, kind) = (behind.to_owned(), located.kind);
        Ok(ArrayPart { array, field, first, count, kind, place, is_member })
    }

    /// SIZE: how many elements a dimension of an array has, which is a constant.
    pub(super) fn size(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        let text = operand(instruction, 0)?;
        let sizes = self.memory.sizes_at(self.scope, text).unwrap_or_default();
        let dimension = whole(operand(instruction, 1)?).and_then(|at| usize::try_from(at).ok());
        let size = dimension.and_then(|at| sizes.get(at));
        let size =
            size.ok_or_else(|| format!("SIZE of `{text}`, whose size is not in the file"))?;
        self.store(operand(instruction, 2)?, LogixFormula::whole(i64::from(*size)), when)
    }

    /// COP: elements of the same type.
    fn copy(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<(), String> {
        let length = fixed(operand(instruction, 2)?)?;
        if let Some(result) = self.copy_structure(instruction, when, length) {
            return result;
        }
        let from = self.run(operand(instruction, 0)?)?;
        let to = self.run(operand(instruction, 1)?)?;
        if from.kind != to.kind || from.kind.plain().is_none() {
            return Err("COP between different types: it copies bytes".to_owned());
        }
        let length = to.fitting(length)?;
        if length > from.room() {
            return Err("COP beyond the end of its source".to_owned());
        }
        self.prescan.other(&to.place);
        let text = match length {
            0 => return Ok(()),
            1 if from.kind == Kind::Bool => {
                format!("MATH {} = {}", to.element(0), from.element(0))
            }
            1 => format!("MOVE {} to={}", from.element(0), to.element(0)),
            _ => format!("COPY {} to={}", from.slice(0, length), to.slice(0, length)),
        };
        self.push(when.clone(), text, vec![to.place]);
        Ok(())
    }

    /// FLL: one value into several elements.
    fn fill(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<(), String> {
        let length = fixed(operand(instruction, 2)?)?;
        if let Some(result) = self.clear_structure(instruction, when, length) {
            return result;
        }
        let value = LogixFormula::of(&self.value(operand(instruction, 0)?)?)?;
        let to = self.run(operand(instruction, 1)?)?;
        let length = to.fitting(length)?;
        let is_constant = value.reads.is_empty();
        let is_same = value.bits == to.kind.bits().unwrap_or(32) && to.kind == Kind::Dint;
        let fits = match (&to.kind, value.text.parse::<i64>()) {
            (Kind::Dint | Kind::Real, Ok(_)) => true,
            (Kind::Int, Ok(value)) => i16::try_from(value).is_ok(),
            (Kind::Sint, Ok(value)) => i8::try_from(value).is_ok(),
            (Kind::Real, Err(_)) => true,
            _ => is_same,
        };
        if to.kind.plain().is_none() || !fits || (to.kind == Kind::Bool) {
            return Err("FLL of another type than its array".to_owned());
        }
        if !is_constant && value.reads.len() > 1 {
            return Err("FLL of an element with a moving index".to_owned());
        }
        self.prescan.other(&to.place);
        let text = match length {
            0 => return Ok(()),
            1 => format!("MOVE {} to={}", value.text, to.element(0)),
            _ => format!("FILL {} to={}", value.text, to.slice(0, length)),
        };
        self.push(when.clone(), text, vec![to.place]);
        Ok(())
    }

    /// The control structure of an instruction, and its length.
    fn control(&mut self, text: &str, length: &str) -> Result<ArrayControl, String> {
        let control = self.written(text, &Kind::Struct("control".to_owned()))?;
        self.memory.variables[control.variable].is_read = true;
        if control.kind != Kind::Struct("control".to_owned()) || !control.dimensions.is_empty() {
            return Err(format!("`{text}` is no CONTROL"));
        }
        if matches!(control.index, Index::Moving(_)) {
            return Err("a CONTROL with a moving index".to_owned());
        }
        let given = fixed(length).ok().or_else(|| self.memory.preset(&control, "LEN"));
        let length = given.filter(|length| *length > 0);
        let length = length.ok_or("an array instruction whose length is not in the file")?;
        Ok(ArrayControl { text: control.text, length })
    }

    /// FFL: loads a value at the rising edge.
    fn load(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<(), String> {
        let value = LogixFormula::of(&self.value(operand(instruction, 0)?)?)?;
        let fifo = self.run(operand(instruction, 1)?)?;
        let control = self.control(operand(instruction, 2)?, operand(instruction, 3)?)?;
        if control.length > fifo.count || fifo.kind.plain().is_none() || fifo.kind == Kind::Bool {
            return Err("FFL beyond the end of its array".to_owned());
        }
        if fifo.kind != Kind::Dint && !(fifo.kind == Kind::Real && value.bits == 32) {
            return Err("FFL into another type than DINT or REAL".to_owned());
        }
        let c = &control.text;
        self.prescan.text(self.scope, format!("SET {c}.en"));
        self.prescan.other(&fifo.place);
        let writes = vec![TouchedPlace::of(c), fifo.place.clone()];
        let edge = self.edge_of(when, &format!("{c}.en"));
        let place = match fifo.first {
            0 => format!("{c}.pos"),
            first => format!("{c}.pos + {first}"),
        };
        let mut room = edge.clone();
        room.push(self.term(RungCondition::compare(
            &format!("{c}.pos"),
            "<",
            &control.length.to_string(),
            vec![TouchedPlace::of(&format!("{c}.pos"))],
        )));
        let room = self.kept(room, "load");
        let array = &fifo.array;
        let field = &fifo.field;
        self.push(
            vec![room.clone()],
            format!("MATH {array}[{place}]{field} = {}", value.text),
            writes.clone(),
        );
        self.push(vec![room], format!("ADD {c}.pos 1 to={c}.pos"), writes.clone());
        self.fifo_bits(when, &control, &writes);
        self.follow(when, &format!("{c}.en"), &writes);
        Ok(())
    }

    /// FFU: unloads a value at the rising edge, and moves the others up.
    fn unload(&mut self, instruction: &RllInstruction, when: &Terms) -> Result<(), String> {
        let fifo = self.run(operand(instruction, 0)?)?;
        let target = operand(instruction, 1)?.to_owned();
        let control = self.control(operand(instruction, 2)?, operand(instruction, 3)?)?;
        if control.length > fifo.count || !matches!(fifo.kind, Kind::Dint | Kind::Real) {
            return Err("FFU of another array than of DINTs or REALs".to_owned());
        }
        let c = control.text.clone();
        self.prescan.text(self.scope, format!("SET {c}.eu"));
        self.prescan.other(&fifo.place);
        let writes = vec![TouchedPlace::of(&c), fifo.place.clone()];
        let edge = self.edge_of(when, &format!("{c}.eu"));
        let edge = self.kept(edge, "unload");
        let is_empty = RungCondition::compare(
            &format!("{c}.pos"),
            "<=",
            "0",
            vec![TouchedPlace::of(&format!("{c}.pos"))],
        );
        let is_empty = self.kept(vec![self.term(is_empty)], "empty");
        let filled = Term { condition: is_empty.condition.clone().opposite(), at: is_empty.at };
        self.store(&target, LogixFormula::whole(0), &vec![edge.clone(), is_empty])?;
        let first = fifo.first_value();
        let full = vec![edge, filled];
        self.store(&target, first, &full)?;
        if control.length > 1 {
            let (from, to) = (fifo.slice(1, control.length - 1), fifo.slice(0, control.length - 1));
            self.push(full.clone(), format!("COPY {from} to={to}"), writes.clone());
        }
        let last = fifo.element(control.length - 1);
        self.push(full.clone(), format!("MOVE 0 to={last}"), writes.clone());
        self.push(full, format!("SUB {c}.pos 1 to={c}.pos"), writes.clone());
        self.fifo_bits(when, &control, &writes);
        self.follow(when, &format!("{c}.eu"), &writes);
        Ok(())
    }

    /// DN and EM of a FIFO.
    fn fifo_bits(&mut self, when: &Terms, control: &ArrayControl, writes: &[TouchedPlace]) {
        let c = &control.text;
        let length = control.length;
        self.push(when.clone(), format!("MATH {c}.dn = {c}.pos >= {length}"), writes.to_vec());
        self.push(when.clone(), format!("MATH {c}.em = {c}.pos <= 0"), writes.to_vec());
    }

    /// BSL and BSR: bits of an array of DINTs move by one at the rising edge.
    fn shift(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
        is_left: bool,
    ) -> Result<(), String> {
        let array = self.run(operand(instruction, 0)?)?;
        let control = self.control(operand(instruction, 1)?, operand(instruction, 3)?)?;
        let source = self.read(operand(instruction, 2)?, &Kind::Bool)?;
        let words = control.length.div_ceil(32);
        if array.kind != Kind::Dint || source.kind != Kind::Bool {
            return Err("a bit shift of another array than of DINTs".to_owned());
        }
        if words > SHIFT_WORDS_MAX || words > array.count.max(1) {
            return Err("a bit shift beyond the end of its array".to_owned());
        }
        let c = control.text.clone();
        for text in [format!("RST {c}.en"), format!("RST {c}.dn"), format!("MOVE 0 to={c}.pos")] {
            self.prescan.text(self.scope, text);
        }
        let writes = vec![TouchedPlace::of(&c), array.place.clone()];
        let edge = self.edge_of(when, &format!("{c}.en"));
        let edge = vec![self.kept(edge, "shift")];
        let copy = self.own_tag("in", "bit");
        let bit = contact_on(&source);
        let bit = self.term(bit);
        self.push(vec![bit], format!("OUT {copy}"), vec![TouchedPlace::of(&copy)]);
        let last = control.length - 1;
        let (out, top) = if is_left { (last, last % 32) } else { (0, last % 32) };
        let word = |at: u32| array.element(at);
        let text = format!("MATH {c}.ul = ({} >> {}) & 1", word(out / 32), out % 32);
        self.push(edge.clone(), text, writes.clone());
        let order: Vec<u32> =
            if is_left { (0..words).rev().collect() } else { (0..words).collect() };
        for at in order {
            let own = word(at);
            let text = match (is_left, at) {
                (true, 0) => format!("MATH {own} = ({own} << 1) | {copy}"),
                (true, at) => format!("MATH {own} = ({own} << 1) | ({} >>> 31)", word(at - 1)),
                (false, at) if at + 1 < words => {
                    format!("MATH {own} = ({own} >>> 1) | ({} << 31)", word(at + 1))
                }
                (false, _) => {
                    let mask = !(1_u32 << top) as i32;
                    format!("MATH {own} = (({own} >>> 1) & ({mask})) | ({copy} << {top})")
                }
            };
            self.push(edge.clone(), text, writes.clone());
        }
        self.push(edge.clone(), format!("MOVE {} to={c}.pos", control.length), writes.clone());
        self.follow(when, &format!("{c}.en"), &writes);
        self.follow(when, &format!("{c}.dn"), &writes);
        let off = self.whole(when.clone()).opposite();
        let off = self.term(off);
        self.push(vec![off], format!("MOVE 0 to={c}.pos"), writes);
        Ok(())
    }

    /// A bit of a structure follows the condition.
    fn follow(&mut self, when: &Terms, bit: &str, writes: &[TouchedPlace]) {
        let on = self.whole(when.clone());
        let off = self.term(on.clone().opposite());
        let on = self.term(on);
        self.push(vec![on], format!("SET {bit}"), writes.to_vec());
        self.push(vec![off], format!("RST {bit}"), writes.to_vec());
    }

    /// The rising edge of a condition, by the bit that remembers it.
    fn edge_of(&mut self, when: &Terms, bit: &str) -> Terms {
        let mut edge = when.clone();
        edge.push(self.term(RungCondition::bit(bit).opposite()));
        edge
    }

    /// A condition in a bit of its own.
    fn kept(&mut self, when: Terms, what: &str) -> Term {
        let bit = self.own_tag(what, "bit");
        self.push(when, format!("OUT {bit}"), vec![TouchedPlace::of(&bit)]);
        self.term(RungCondition::bit(bit))
    }
}

/// A control structure.
struct ArrayControl {
    text: String,
    length: u32,
}

/// A length that the file gives.
fn fixed(text: &str) -> Result<u32, String> {
    let value = whole(text).and_then(|value| u32::try_from(value).ok());
    value.ok_or_else(|| format!("a length that is no constant: `{text}`"))
}
