//! What can go wrong where an instruction or a contact computes: a division by zero, a result that
//! is limited, an index outside of its array.
//!
//! Called by `probes`, which evaluates each condition right before the instruction, while its rung
//! is ON. A condition is a part of the instruction's own expression, so no second rule says what a
//! mishap is; what `&&`, `||` and `if` leave out is left out here too. Results of functions of
//! reals and the limits of binary64 are not asked about.

use rungd_engine::isa::function::ResultType;
use rungd_engine::isa::{Function, Mnemonic, NumberMap, Real, Word};
use rungd_language::resolve::array::{Array, ArrayElement};
use rungd_language::resolve::formula::{
    Binary, Formula, FormulaInteger, FormulaPart, NumberType, Unary, type_of, type_of_array,
};
use rungd_language::resolve::instruction::{FormulaTarget, OperandValue, WordPlace};
use rungd_language::resolve::program::{Address, Contact, Instruction, Program, TagMeaning, Value};

/// A kind of mishap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RungMishap {
    /// A divisor is 0.
    DividesByZero,
    /// A result is beyond the range of its word.
    Saturates,
    /// A result is beyond `min` or `max` of its tag.
    LeavesLimits,
    /// An index is outside of its array.
    IndexOutside,
}

impl RungMishap {
    /// What it is about.
    pub(super) fn word(self) -> &'static str {
        match self {
            RungMishap::DividesByZero => "divisor",
            RungMishap::Saturates => "range of the word",
            RungMishap::LeavesLimits => "min and max",
            RungMishap::IndexOutside => "index",
        }
    }
}

/// The condition of a mishap: not 0 if it happens.
pub(crate) struct MishapCondition {
    pub mishap: RungMishap,
    pub condition: Formula,
}

/// The limits of tags, as cells.
pub(super) struct TagRanges(NumberMap<Word, CellLimits>);

#[derive(Clone, Copy)]
struct CellLimits {
    min: Option<i32>,
    max: Option<i32>,
}

impl TagRanges {
    pub fn of(program: &Program) -> TagRanges {
        let mut all = NumberMap::default();
        for tag in &program.tags {
            let TagMeaning::Address(Address::Word(word)) = tag.meaning else { continue };
            let (min, max) = (tag.min.map(|(min, _)| min), tag.max.map(|(max, _)| max));
            if min.is_some() || max.is_some() {
                all.insert(word, CellLimits { min, max });
            }
        }
        TagRanges(all)
    }
}

/// The mishaps of an instruction, each once.
pub(super) fn of_instruction(
    instruction: &Instruction,
    ranges: &TagRanges,
) -> Vec<MishapCondition> {
    let mut found = Found::default();
    for formula in instruction.formulas() {
        found.visit(formula);
    }
    for operand in &instruction.operands.0 {
        if let OperandValue::Element(element) | OperandValue::Value(Value::Element(element)) =
            operand.value
        {
            found.index(element);
        }
    }
    if let Some((word, value)) = stored(instruction, &mut found) {
        found.stored(word, &value, ranges);
    }
    found.all()
}

/// The mishaps of contacts, each once.
pub(crate) fn of_contacts(contacts: &[Contact]) -> Vec<MishapCondition> {
    let mut found = Found::default();
    contacts.iter().for_each(|contact| found.contact(contact));
    found.all()
}

/// The word that an instruction computes, and its value.
fn stored(instruction: &Instruction, found: &mut Found) -> Option<(Word, Formula)> {
    let operands = &instruction.operands;
    let value = |name: &str| operands.get::<Value>(name).map(|value| value.value.formula());
    let mnemonic = instruction.mnemonic;
    if mnemonic == Mnemonic::Math {
        let calculation = instruction.calculation.as_deref()?;
        let word = match operands.required("target") {
            FormulaTarget::Word(word) => word,
            FormulaTarget::Array(array) => {
                found.outside(calculation.index.clone()?, array);
                first_word(array)?
            }
            FormulaTarget::Bit(_) => return None,
        };
        return Some((word, calculation.value.clone()));
    }
    let sum = |sign| Some(both(value("a")?, sign, value("b")?));
    let value = match () {
        () if mnemonic == Mnemonic::Add => sum(Binary::Add)?,
        () if mnemonic == Mnemonic::Sub => sum(Binary::Subtract)?,
        () if mnemonic == Mnemonic::Move => value("a")?,
        () => return None,
    };
    Some((word_of(operands.get("to")?.value)?, value))
}

fn word_of(place: WordPlace) -> Option<Word> {
    match place {
        WordPlace::Word(word) => Some(word),
        WordPlace::Element(element) => first_word(element.array),
    }
}

/// Element 0: all elements have one range, and the limits of one tag.
fn first_word(array: Array) -> Option<Word> {
    match array.element(0) {
        Address::Word(word) => Some(word),
        Address::Bit(_) | Address::Structure(_) => None,
    }
}

/// The conditions so far, by mishap.
#[derive(Default)]
struct Found(Vec<MishapCondition>);

impl Found {
    fn all(self) -> Vec<MishapCondition> {
        let mut joined: Vec<MishapCondition> = Vec::new();
        for one in self.0 {
            match joined.iter_mut().find(|other| other.mishap == one.mishap) {
                Some(other) => {
                    let first = std::mem::take(&mut other.condition);
                    if first != one.condition {
                        other.condition = both(first, Binary::OrElse, one.condition);
                    } else {
                        other.condition = first;
                    }
                }
                None => joined.push(one),
            }
        }
        joined.sort_by_key(|one| one.mishap);
        joined
    }

    fn add(&mut self, mishap: RungMishap, condition: Formula) {
        self.0.push(MishapCondition { mishap, condition });
    }

    fn contact(&mut self, contact: &Contact) {
        match contact {
            Contact::Bit(..) => {}
            Contact::Element(element, _) => self.index(*element),
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => self.contact(inner),
            Contact::All(parts, _) | Contact::Any(parts, _) => {
                parts.iter().for_each(|part| self.contact(part));
            }
            Contact::Compare(a, _, b, _) => {
                for value in [a, b] {
                    if let Value::Element(element) = value {
                        self.index(*element);
                    }
                }
            }
            Contact::Computed(computed, _) => self.visit(&computed.condition()),
        }
    }

    fn index(&mut self, ArrayElement { array, index }: ArrayElement) {
        self.outside(Formula { parts: vec![FormulaPart::Word(index)] }, array);
    }

    fn outside(&mut self, index: Formula, array: Array) {
        let condition = outside(index, array);
        self.add(RungMishap::IndexOutside, condition);
    }

    /// A value that is stored in a word.
    fn stored(&mut self, word: Word, value: &Formula, ranges: &TagRanges) {
        if value.parts.len() == 1 && !matches!(value.parts[0], FormulaPart::Word(_)) {
            return;
        }
        let of = result_type(&value.parts);
        if !word.is_real() {
            let (low, high) = word.range();
            let own = match value.parts[..] {
                [FormulaPart::Word(word)] if !word.is_real() => word.range(),
                [..] => (i32::MIN, i32::MAX),
            };
            let is_within = value.parts.len() == 1 && own.0 >= low && own.1 <= high;
            if !is_within || of == NumberType::Real {
                self.add(RungMishap::Saturates, beyond_range(value, [low, high], of));
            }
        }
        let Some(CellLimits { min, max }) = ranges.0.get(&word).copied() else { return };
        let constant = |cell: i32| match word.is_real() {
            true => FormulaPart::Real(Real::of_cell(cell)),
            false => FormulaPart::Integer(FormulaInteger::new(cell.into())),
        };
        let limit = |sign, cell: Option<i32>| {
            let limit = Formula { parts: vec![constant(cell?)] };
            let of = of.with(type_of(word));
            Some(compare(value.clone(), sign, TypedFormula { formula: limit, of }))
        };
        let all = [limit(Binary::Less, min), limit(Binary::Greater, max)];
        for condition in all.into_iter().flatten() {
            self.add(RungMishap::LeavesLimits, condition);
        }
    }

    /// Looks for mishaps within an expression. What `&&`, `||` and `if` do not evaluate makes none.
    fn visit(&mut self, formula: &Formula) {
        let parts = &formula.parts;
        let starts = FormulaPart::starts(parts);
        let mut open = vec![OpenPart { end: parts.len() - 1, evaluated: Vec::new() }];
        while let Some(OpenPart { end, evaluated }) = open.pop() {
            let ends = operand_ends(parts, &starts, end);
            let operand = |at: usize| of_range(parts, ends[at]);
            let mut guards = vec![Vec::new(); ends.len()];
            match parts[end] {
                FormulaPart::Binary(Binary::Divide | Binary::Remainder, of) => {
                    let zero = TypedFormula { formula: integer(0), of };
                    let condition = compare(operand(1), Binary::Equal, zero);
                    self.add(RungMishap::DividesByZero, guarded(&evaluated, condition));
                }
                FormulaPart::Call(Function::Scale, ..) => {
                    let high = TypedFormula { formula: operand(2), of: NumberType::Real };
                    let condition = compare(operand(1), Binary::Equal, high);
                    self.add(RungMishap::DividesByZero, guarded(&evaluated, condition));
                }
                FormulaPart::Element(array) => {
                    let condition = outside(operand(0), array);
                    self.add(RungMishap::IndexOutside, guarded(&evaluated, condition));
                }
                FormulaPart::Binary(Binary::AndAlso, _) => guards[1].push((operand(0), true)),
                FormulaPart::Binary(Binary::OrElse, _) => guards[1].push((operand(0), false)),
                FormulaPart::Call(Function::If, ..) => {
                    guards[1].push((operand(0), true));
                    guards[2].push((operand(0), false));
                }
                FormulaPart::Integer(_)
                | FormulaPart::Real(_)
                | FormulaPart::Word(_)
                | FormulaPart::Bit(_)
                | FormulaPart::Unary(..)
                | FormulaPart::Binary(..)
                | FormulaPart::Call(..) => {}
            }
            for (end, own) in ends.iter().zip(guards) {
                let own = own.into_iter().map(|(formula, is_on)| truth(formula, is_on));
                let evaluated = evaluated.iter().cloned().chain(own).collect();
                open.push(OpenPart { end: end.last, evaluated });
            }
        }
    }
}

/// A part of an expression that is still to be visited.
struct OpenPart {
    /// Its last place.
    end: usize,
    /// The conditions under which it is evaluated.
    evaluated: Vec<Formula>,
}

/// The places of an operand.
#[derive(Clone, Copy)]
struct Extent {
    first: usize,
    last: usize,
}

/// The operands of the part at a place, in order. `starts`: see [`FormulaPart::starts`].
fn operand_ends(parts: &[FormulaPart], starts: &[usize], end: usize) -> Vec<Extent> {
    let mut all = Vec::new();
    let mut next = end;
    for _ in 0..parts[end].operand_count() {
        let last = next - 1;
        next = starts[last];
        all.push(Extent { first: next, last });
    }
    all.reverse();
    all
}

fn of_range(parts: &[FormulaPart], Extent { first, last }: Extent) -> Formula {
    Formula { parts: parts[first..=last].to_vec() }
}

/// The type of the value of an expression.
fn result_type(parts: &[FormulaPart]) -> NumberType {
    let Some(last) = parts.last() else { return NumberType::Integer };
    match *last {
        FormulaPart::Integer(_) | FormulaPart::Bit(_) => NumberType::Integer,
        FormulaPart::Real(_) => NumberType::Real,
        FormulaPart::Word(word) => type_of(word),
        FormulaPart::Element(array) => type_of_array(array),
        FormulaPart::Unary(Unary::Minus, of) => of,
        FormulaPart::Unary(Unary::Not | Unary::Complement, _) => NumberType::Integer,
        FormulaPart::Binary(operator, of) => {
            use Binary::{Add, Divide, Multiply, Power, Remainder, Subtract};
            let keeps = matches!(operator, Power | Multiply | Divide | Remainder | Add | Subtract);
            if keeps { of } else { NumberType::Integer }
        }
        FormulaPart::Call(function, _, of) => match function.spec().result {
            ResultType::Kept => of,
            ResultType::Integer => NumberType::Integer,
            ResultType::Real => NumberType::Real,
        },
    }
}

/// The right side of a compare, and the type in which both sides are compared.
struct TypedFormula {
    formula: Formula,
    of: NumberType,
}

fn integer(number: i64) -> Formula {
    Formula { parts: vec![FormulaPart::Integer(FormulaInteger::new(number))] }
}

fn compare(left: Formula, sign: Binary, right: TypedFormula) -> Formula {
    let mut parts = left.parts;
    parts.extend(right.formula.parts);
    parts.push(FormulaPart::Binary(sign, right.of));
    Formula { parts }
}

fn both(left: Formula, operator: Binary, right: Formula) -> Formula {
    let of = result_type(&left.parts).with(result_type(&right.parts));
    compare(left, operator, TypedFormula { formula: right, of })
}

/// 1 if an expression is, or is not, 0.
fn truth(formula: Formula, is_on: bool) -> Formula {
    let of = result_type(&formula.parts);
    let mut parts = formula.parts;
    parts.push(FormulaPart::Unary(Unary::Not, of));
    if is_on {
        parts.push(FormulaPart::Unary(Unary::Not, NumberType::Integer));
    }
    Formula { parts }
}

/// A condition that counts only where these are so.
fn guarded(evaluated: &[Formula], condition: Formula) -> Formula {
    let guards = evaluated.iter().rev().cloned();
    guards.fold(condition, |condition, guard| both(guard, Binary::AndAlso, condition))
}

/// Whether a whole number that a value becomes is beyond a range. A real is truncated before: it is
/// beyond from the next whole number on.
fn beyond_range(value: &Formula, [low, high]: [i32; 2], of: NumberType) -> Formula {
    let limit = |number: i32| TypedFormula { formula: integer(number.into()), of };
    let moved = |by: Binary| match of {
        NumberType::Integer => value.clone(),
        NumberType::Real => compare(value.clone(), by, limit(1)),
    };
    let signs = match of {
        NumberType::Integer => [Binary::Less, Binary::Greater],
        NumberType::Real => [Binary::AtMost, Binary::AtLeast],
    };
    let below = compare(moved(Binary::Add), signs[0], limit(low));
    let above = compare(moved(Binary::Subtract), signs[1], limit(high));
    both(below, Binary::OrElse, above)
}

/// Whether an index is outside of an array.
fn outside(index: Formula, array: Array) -> Formula {
    let last = i32::try_from(array.count - 1).unwrap_or(i32::MAX);
    beyond_range(&index, [0, last], NumberType::Integer)
}
