//! Operands: the text of Logix as a constant, or as a place of rungd.

use super::data::Datum;
use super::expression::{self, OperandReader};
use super::formula::{LogixFormula, ValueType};
use super::initial;
use super::memory::{LogixMemory, PartType};
use super::path::{self, PathPart, TagPath};
use super::types::{Kind, LogixStructure, TypeOrigin};
use super::undeclared::{GuessedType, UnknownMember, learned_element};
use crate::condition::TouchedPlace;

/// Deepest nesting of indexes, and longest chain of aliases.
const DEPTH_MAX: usize = 8;

/// An operand.
#[derive(Clone, Debug)]
pub(crate) enum Operand {
    /// A whole number.
    Whole(i64),
    /// A number with a point.
    Real(f32),
    /// A part of a tag.
    ProjectTag(LocatedOperand),
}

/// How an index is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Index {
    /// No array is on the way.
    None,
    /// A number.
    Fixed(u32),
    /// A text of rungd: a word, or an expression of words.
    Moving(String),
}

/// A part of a tag.
#[derive(Clone, Debug)]
pub(crate) struct LocatedOperand {
    /// As rungd writes it; of a structure its record.
    pub(crate) text: String,
    /// The type of the value; `Bool` for a bit of a word.
    pub(crate) kind: Kind,
    /// The numbers of elements, if it is a whole array.
    pub(crate) dimensions: Vec<u32>,
    /// What it depends on: the place itself first.
    pub(crate) reads: Vec<TouchedPlace>,
    pub(crate) index: Index,
    /// If it is a bit of a word: the word, and its type.
    pub(crate) word: Option<Box<LogixWordBit>>,
    /// The variable, and the members' names with dots.
    pub(crate) variable: usize,
    pub(crate) path: String,
    /// The numbers of elements of all arrays that have an index.
    pub(crate) passed: Vec<u32>,
}

/// A bit of a word.
#[derive(Clone, Debug)]
pub(crate) struct LogixWordBit {
    pub(crate) word: LocatedOperand,
    /// Its number: a number, or a text of rungd.
    pub(crate) bit: String,
    pub(crate) is_fixed: bool,
}

impl LocatedOperand {
    /// The place itself.
    pub(crate) fn place(&self) -> TouchedPlace {
        self.reads[0].clone()
    }

    /// How many elements lie from it to the end of the innermost array of a member; without limit
    /// for the elements of a tag.
    pub(crate) fn within(&self) -> u32 {
        match (&self.index, self.passed.last()) {
            (Index::Fixed(at), Some(size)) if !self.path.is_empty() && *size > 0 => {
                size - at % size
            }
            _ => u32::MAX,
        }
    }
}

/// The walk along a path.
struct Walk {
    variable: usize,
    kind: Kind,
    dimensions: Vec<u32>,
    /// The dimensions of all arrays that have an index.
    passed: Vec<u32>,
    index: Index,
    reads: Vec<TouchedPlace>,
    path: String,
    /// The record that has the member, with the member's field.
    owner: Option<FieldOwner>,
    /// Whether the type is only taken from the use.
    is_guessed: bool,
}

/// A member in a path.
struct MemberStep<'p> {
    name: &'p str,
    rest: &'p [PathPart],
    guess: &'p GuessedType,
}

struct FieldOwner {
    path: String,
    kind: Kind,
    field: String,
}

impl LogixMemory {
    /// An operand. `guess`: the type of a tag that the file does not declare.
    ///
    /// # Errors
    /// The reason why rungd cannot name it.
    pub(crate) fn operand(
        &mut self,
        scope: usize,
        text: &str,
        guess: &Kind,
    ) -> Result<Operand, String> {
        if let Some(value) = path::whole(text) {
            return Ok(Operand::Whole(value));
        }
        if let Some(value) = path::real(text) {
            return Ok(Operand::Real(value));
        }
        self.locate(scope, text, guess).map(Operand::ProjectTag)
    }

    /// A part of a tag.
    ///
    /// # Errors
    /// The reason why rungd cannot name it.
    pub(crate) fn locate(
        &mut self,
        scope: usize,
        text: &str,
        guess: &Kind,
    ) -> Result<LocatedOperand, String> {
        let path = path::parse(text).ok_or_else(|| format!("`{text}` names no tag"))?;
        let guess = GuessedType { kind: guess.clone(), is_sure: false };
        self.located(scope, path, &guess, 0)
    }

    fn located(
        &mut self,
        scope: usize,
        path: TagPath,
        guess: &GuessedType,
        depth: usize,
    ) -> Result<LocatedOperand, String> {
        if depth > DEPTH_MAX {
            return Err(format!("`{}`: aliases or indexes nest too deeply", path.base));
        }
        let own = match &path.program {
            Some(program) => self
                .program_scope(program)
                .ok_or_else(|| format!("the file does not contain the program {program}"))?,
            None => scope,
        };
        let mut path = path;
        let known = self.known(own, &path.base);
        if let Some(alias) = known.and_then(|id| self.variables[id].alias.clone()) {
            let target = path::parse(&alias).ok_or_else(|| format!("the alias `{alias}`"))?;
            let own_kind = known.map(|id| self.variables[id].kind.clone());
            let sure = own_kind.filter(|kind| path.parts.is_empty() && kind.plain().is_some());
            let guess = &sure.map_or_else(|| guess.clone(), GuessedType::sure);
            let parts = [target.parts, path.parts].concat();
            return self.located(own, TagPath { parts, ..target }, guess, depth + 1);
        }
        let id = match known {
            Some(id) => id,
            None => self.undeclared(own, &mut path, guess)?,
        };
        let mut walk = self.walk(id);
        let all = path.parts;
        let mut at = 0;
        while let Some(part) = all.get(at) {
            at += 1;
            let is_last = at == all.len();
            match part {
                PathPart::Member(name) => {
                    let member = MemberStep { name, rest: &all[at..], guess };
                    at += self.enter(&mut walk, &member)?;
                }
                PathPart::Index(texts) => self.element(&mut walk, scope, texts, depth)?,
                PathPart::Bit(number) if is_last => {
                    return self.bit(walk, *number);
                }
                PathPart::MovingBit(text) if is_last => {
                    return self.moving_bit(walk, scope, text, depth);
                }
                PathPart::Bit(_) | PathPart::MovingBit(_) => {
                    return Err(format!("`{}`: a bit has no parts", path.base));
                }
            }
        }
        let is_guessed = walk.is_guessed;
        let located = self.finish(walk)?;
        if is_guessed && located.kind != Kind::Bool {
            self.note_guess(&located);
        }
        Ok(located)
    }

    /// The walk that begins at a variable.
    fn walk(&self, id: usize) -> Walk {
        let variable = &self.variables[id];
        Walk {
            variable: id,
            kind: variable.kind.clone(),
            dimensions: variable.dimensions.clone(),
            passed: Vec::new(),
            index: Index::None,
            reads: Vec::new(),
            path: String::new(),
            owner: None,
            is_guessed: variable.is_guessed && !matches!(variable.kind, Kind::Struct(_)),
        }
    }

    /// Remembers that the type of a number is a guess.
    fn note_guess(&mut self, located: &LocatedOperand) {
        let original = &self.variables[located.variable].original;
        let dot = if located.path.is_empty() { "" } else { "." };
        let name = format!("{original}{dot}{}", located.path);
        self.guesses.insert(format!("`{name}` is not declared: taken as a DINT"));
    }

    /// Goes into a member. Returns how many parts behind its name belong to it.
    fn enter(&mut self, walk: &mut Walk, step: &MemberStep<'_>) -> Result<usize, String> {
        let MemberStep { name, rest, guess } = step;
        let original = self.variables[walk.variable].original.clone();
        let Kind::Struct(kind) = &walk.kind else {
            return Err(format!("`{original}`: a value without parts has no `{name}`"));
        };
        if !walk.dimensions.is_empty() {
            return Err(format!("`{original}`: an array without an index has no `{name}`"));
        }
        if self.types.is_text(&walk.kind) {
            return Err(format!("`{original}`: rungd has no texts"));
        }
        let structure = self.types.structure(kind);
        let is_open = structure.is_none_or(|one| one.origin == TypeOrigin::Use);
        let element = if is_open { learned_element(name, rest)? } else { None };
        let taken = usize::from(element.is_some());
        let (name, rest) = (element.as_deref().unwrap_or(name), &rest[taken..]);
        let is_it = |one: &LogixStructure| {
            one.members.iter().find(|member| member.name.eq_ignore_ascii_case(name)).cloned()
        };
        let member = match (structure.and_then(is_it), structure) {
            (Some(member), Some(structure)) if structure.has_bits_of(&member) => {
                let words = format!("`{}.{}` and the members", structure.name, member.name);
                self.guesses.insert(format!("{words} for its bits have places of their own"));
                member
            }
            (Some(member), _) => member,
            (None, Some(structure)) if !is_open => {
                return Err(format!("`{original}`: the type {} has no `{name}`", structure.name));
            }
            (None, _) => {
                let next = rest.first();
                self.learn_member(&UnknownMember { structure: kind, name, next, guess })?
            }
        };
        walk.is_guessed = member.is_guessed;
        walk.owner = member.is_field().then(|| FieldOwner {
            path: walk.path.clone(),
            kind: walk.kind.clone(),
            field: member.field.clone(),
        });
        if !walk.path.is_empty() {
            walk.path.push('.');
        }
        walk.path += &member.name;
        walk.kind = member.kind;
        walk.dimensions = member.dimensions;
        Ok(taken)
    }

    fn element(
        &mut self,
        walk: &mut Walk,
        scope: usize,
        texts: &[String],
        depth: usize,
    ) -> Result<(), String> {
        let original = self.variables[walk.variable].original.clone();
        if texts.len() != walk.dimensions.len() {
            return Err(format!(
                "`{original}`: {} indexes where {} belong",
                texts.len(),
                walk.dimensions.len()
            ));
        }
        for (text, size) in texts.iter().zip(std::mem::take(&mut walk.dimensions)) {
            let index = match path::whole(text) {
                Some(at) if (0..i64::from(size)).contains(&at) => Index::Fixed(at as u32),
                Some(at) => return Err(format!("`{original}`: index {at} of {size} elements")),
                None if depth > DEPTH_MAX => {
                    return Err(format!("`{original}`: indexes nest too deeply"));
                }
                None => {
                    let formula = expression::index(self, scope, text)?;
                    walk.reads.extend(formula.reads);
                    Index::Moving(formula.text)
                }
            };
            walk.index = combined(&walk.index, index, size);
            walk.passed.push(size);
        }
        Ok(())
    }

    fn bit(&mut self, walk: Walk, number: u32) -> Result<LocatedOperand, String> {
        let original = self.variables[walk.variable].original.clone();
        let word = self.finish(walk)?;
        let bits = word.kind.bits().filter(|_| word.dimensions.is_empty());
        let bits = bits.ok_or_else(|| format!("`{original}`: only an integer has bits"))?;
        if number >= bits {
            return Err(format!("`{original}`: bit {number} of {bits} bits"));
        }
        let text = format!("{}.{number}", word.text);
        let mut reads = word.reads.clone();
        reads[0] = TouchedPlace::of(&text);
        let bit = LogixWordBit { word: word.clone(), bit: number.to_string(), is_fixed: true };
        Ok(LocatedOperand { text, kind: Kind::Bool, reads, word: Some(Box::new(bit)), ..word })
    }

    fn moving_bit(
        &mut self,
        walk: Walk,
        scope: usize,
        text: &str,
        depth: usize,
    ) -> Result<LocatedOperand, String> {
        let original = self.variables[walk.variable].original.clone();
        if depth > DEPTH_MAX {
            return Err(format!("`{original}`: indexes nest too deeply"));
        }
        let word = self.finish(walk)?;
        if word.kind.bits().is_none() || !word.dimensions.is_empty() {
            return Err(format!("`{original}`: only an integer has bits"));
        }
        let formula = expression::index(self, scope, text)?;
        let mut reads = word.reads.clone();
        reads.extend(formula.reads);
        let bit = LogixWordBit { word: word.clone(), bit: formula.text, is_fixed: false };
        Ok(LocatedOperand { kind: Kind::Bool, reads, word: Some(Box::new(bit)), ..word })
    }

    fn finish(&mut self, walk: Walk) -> Result<LocatedOperand, String> {
        let mut sizes = walk.passed.clone();
        sizes.extend(&walk.dimensions);
        let (tag, field) = match &walk.owner {
            Some(owner) => {
                let part = PartType { kind: &owner.kind, dimensions: &walk.passed };
                (self.part(walk.variable, &owner.path, part)?, format!(".{}", owner.field))
            }
            None => {
                let part = PartType { kind: &walk.kind, dimensions: &sizes };
                (self.part_or_name(walk.variable, &walk.path, part)?, String::new())
            }
        };
        let elements: u32 = walk.passed.iter().product();
        let is_record = field.is_empty() && walk.kind.plain().is_none() || !field.is_empty();
        let index = match &walk.index {
            Index::None => String::new(),
            // An array of one plain element is a plain tag.
            Index::Fixed(_) if elements == 1 && !is_record => String::new(),
            Index::Fixed(at) => format!("[{at}]"),
            Index::Moving(text) => format!("[{text}]"),
        };
        let index = if walk.dimensions.is_empty() { index } else { String::new() };
        let text = format!("{tag}{index}{field}");
        let mut reads = vec![TouchedPlace::of(&text)];
        reads.extend(walk.reads);
        Ok(LocatedOperand {
            text,
            kind: walk.kind,
            dimensions: walk.dimensions,
            reads,
            index: walk.index,
            word: None,
            variable: walk.variable,
            path: walk.path,
            passed: walk.passed,
        })
    }

    /// The tag of a part; for a structure without values of its own only a name.
    fn part_or_name(
        &mut self,
        id: usize,
        path: &str,
        part: PartType<'_>,
    ) -> Result<String, String> {
        if let Kind::Struct(name) = part.kind {
            let structure = self.types.structure(name);
            let has_fields = structure.is_some_and(|one| one.members.iter().any(|m| m.is_field()));
            if structure.is_some() && !has_fields {
                return Ok(self.base(id));
            }
        }
        self.part(id, path, part)
    }
}

impl LogixMemory {
    /// The number of elements of the array that a located element belongs to.
    pub(crate) fn total(&self, located: &LocatedOperand) -> u32 {
        let tag = located.text.split(['[', '.']).next().unwrap_or_default();
        let home = self.variables[located.variable].home;
        let tag = self.homes[home].iter().find(|declared| declared.name == tag);
        tag.and_then(|tag| tag.count).unwrap_or(0)
    }

    /// A whole number that the file gives to a member.
    pub(crate) fn preset(&self, located: &LocatedOperand, member: &str) -> Option<u32> {
        let path = match located.path.is_empty() {
            true => member.to_owned(),
            false => format!("{}.{member}", located.path),
        };
        let values = initial::values(self.variables[located.variable].data.as_ref(), &path);
        let at = match located.index {
            Index::Fixed(at) => at as usize,
            Index::None | Index::Moving(_) => 0,
        };
        match values.get(at)? {
            Datum::Value { text, .. } => u32::try_from(path::whole(text)?).ok(),
            Datum::Array { .. } | Datum::Structure { .. } => None,
        }
    }
}

/// An index and one behind it, in an array of `size` elements, as one index.
fn combined(first: &Index, second: Index, size: u32) -> Index {
    match (first, second) {
        (Index::None, second) => second,
        (first, Index::None) => first.clone(),
        (Index::Fixed(first), Index::Fixed(second)) => Index::Fixed(first * size + second),
        (Index::Fixed(0), second) => second,
        (first, Index::Fixed(0)) => Index::Moving(format!("({}) * {size}", shown(first))),
        (first, second) => {
            Index::Moving(format!("({}) * {size} + ({})", shown(first), shown(&second)))
        }
    }
}

fn shown(index: &Index) -> String {
    match index {
        Index::None => "0".to_owned(),
        Index::Fixed(at) => at.to_string(),
        Index::Moving(text) => text.clone(),
    }
}

impl OperandReader for LogixMemory {
    fn formula_of(&mut self, scope: usize, text: &str) -> Result<LogixFormula, String> {
        LogixFormula::of(&self.operand(scope, text, &Kind::Dint)?)
    }
}

impl LogixFormula {
    /// A constant or a tag.
    pub(crate) fn of(operand: &Operand) -> Result<LogixFormula, String> {
        match operand {
            Operand::Whole(value) => Ok(LogixFormula::whole(*value)),
            Operand::Real(value) => Ok(LogixFormula {
                value: ValueType::Real,
                is_atom: *value >= 0.0,
                ..LogixFormula::plain(format!("{value:?}"))
            }),
            Operand::ProjectTag(located) => LogixFormula::tag(located),
        }
    }

    fn tag(located: &LocatedOperand) -> Result<LogixFormula, String> {
        if !located.dimensions.is_empty() {
            return Err(format!("`{}` is a whole array", located.text));
        }
        if located.word.as_ref().is_some_and(|word| !word.is_fixed) {
            return Err("a bit with a moving number in an expression".to_owned());
        }
        let value = match (&located.kind, located.kind.bits()) {
            (Kind::Real, _) => ValueType::Real,
            (Kind::Bool, _) => ValueType::Bool,
            (_, Some(_)) => ValueType::Whole,
            (_, None) => return Err(format!("`{}` has no value of its own", located.text)),
        };
        let bits = located.kind.bits().unwrap_or(32);
        let reads = located.reads.clone();
        Ok(LogixFormula { value, bits, reads, ..LogixFormula::plain(located.text.clone()) })
    }
}
