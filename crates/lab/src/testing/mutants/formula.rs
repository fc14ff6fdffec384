//! The mutations of expressions, of MATH and of contacts: their operators, functions, signs,
//! constants and bits of words.
//!
//! A resolved expression has no places, so the text around it is parsed again. Its parts
//! are in the same order, unless it names whole arrays; then the place is the whole instruction.

use std::collections::HashMap;
use std::ops::Range;

use rungd_engine::isa::{Bit, Function};
use rungd_language::resolve::formula::{
    Binary, Formula, FormulaInteger, FormulaPart, NumberType, Unary,
};
use rungd_language::resolve::program::ComputedContact;
pub use rungd_language::resolve::program::{ConstantForm, Instruction, Value};
use rungd_language::source::contact::WrittenContact;
use rungd_language::source::contact_parser;
use rungd_language::source::contact_side::CompareSide;
pub use rungd_language::source::expression::{self, ExpressionPartKind};
use rungd_language::source::instruction;
use rungd_language::source::span::Span;

use super::ground::{ExchangedText, FoundMutation, Ground, change_of_constant};
use super::kind::MutantKind;
use super::mutation::{FormulaEdit, FormulaOf, InstructionIndex, Mutation};
use super::values::{ConstantStep, Direction, near};
use super::word_bits::{other_bit_of_word, with_number};

/// All mutations of a MATH; none for other instructions.
pub(super) fn formulas(
    ground: &Ground,
    instruction: &Instruction,
    index: InstructionIndex,
) -> Vec<FoundMutation> {
    let Some(calculation) = &instruction.calculation else { return Vec::new() };
    let whole = ground.place(instruction.span);
    let text = ground.text(whole);
    let parsed = instruction::parse(text, whole, &mut Vec::new())
        .and_then(|instruction| instruction.formula);
    let (written, written_index) = match &parsed {
        Some(parsed) => (Some(&parsed.expression), parsed.index.as_ref()),
        None => (None, None),
    };
    let indexes = calculation.index.iter().map(|index| (FormulaOf::Index, index, written_index));
    let mut found = Vec::new();
    let value = (FormulaOf::Value, &calculation.value, written);
    for (which, formula, written) in indexes.chain([value]) {
        let written = written.filter(|written| is_alike(formula, written));
        let change = |edit| Mutation::Formula(index, which, edit);
        let branch = index.branch.map(|at| at + 1);
        let place = FormulaPlace { whole, branch, variant: 0 };
        found.extend(
            FormulaSearch::new(ground, place, FormulaText { formula, written }, &change).all(),
        );
    }
    found
}

/// The place of a contact, and the number of its branch, from 1.
#[derive(Clone, Copy)]
pub(super) struct ContactSite {
    pub span: Span,
    pub branch: Option<usize>,
}

/// All mutations of the expressions of a contact; `change` makes the mutation to a new contact.
pub(super) fn of_contact(
    ground: &Ground,
    computed: &ComputedContact,
    site: ContactSite,
    change: &dyn Fn(ComputedContact) -> Mutation,
) -> Vec<FoundMutation> {
    let ContactSite { span, branch } = site;
    let whole = ground.place(span);
    let parsed = contact_parser::parse(ground.text(whole), whole).ok();
    let written = match &parsed {
        Some(WrittenContact::Compare(left, _, right, _)) => [written(left), written(right)],
        Some(WrittenContact::Indexed(indexed)) => [Some(&indexed.expression), None],
        Some(_) | None => [None, None],
    };
    let mut found = Vec::new();
    for (side, (formula, written)) in computed.formulas().zip(written).enumerate() {
        let written = written.filter(|written| is_alike(formula, written));
        let changed = |edit: FormulaEdit| {
            let mut computed = computed.clone();
            if let Some(formula) = computed.formulas_mut().nth(side) {
                edit.make(&mut formula.parts);
            }
            change(computed)
        };
        let place = FormulaPlace { whole, branch, variant: side as u32 * SIDE_VARIANTS };
        found.extend(
            FormulaSearch::new(ground, place, FormulaText { formula, written }, &changed).all(),
        );
    }
    found
}

/// The numbers of variants from one side of a compare to the other.
const SIDE_VARIANTS: u32 = 1 << 20;

fn written(side: &CompareSide) -> Option<&expression::Expression> {
    match side {
        CompareSide::Atom(_) => None,
        CompareSide::Computed(computed) => Some(&computed.expression),
    }
}

/// Whether the resolved and the written expression have the same parts.
fn is_alike(formula: &Formula, written: &expression::Expression) -> bool {
    let is_same = |(part, written): (&FormulaPart, &ExpressionPartKind)| match (part, written) {
        (FormulaPart::Unary(a, _), ExpressionPartKind::Unary(b)) => a == b,
        (FormulaPart::Binary(a, _), ExpressionPartKind::Binary(b, _)) => a == b,
        (FormulaPart::Call(function, ..), ExpressionPartKind::Call(name, _)) => {
            function.spec().name == name.value
        }
        (FormulaPart::Element(_), ExpressionPartKind::Element(_)) => true,
        (
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Word(_)
            | FormulaPart::Bit(_),
            kind,
        ) => {
            matches!(
                kind,
                ExpressionPartKind::Integer(_)
                    | ExpressionPartKind::Duration(_)
                    | ExpressionPartKind::Real(_)
                    | ExpressionPartKind::Name(_)
            )
        }
        (
            FormulaPart::Unary(..)
            | FormulaPart::Binary(..)
            | FormulaPart::Call(..)
            | FormulaPart::Element(_),
            _,
        ) => false,
    };
    let kinds = written.parts.iter().map(|part| &part.kind);
    formula.parts.len() == written.parts.len() && formula.parts.iter().zip(kinds).all(is_same)
}

/// The part of an expression that a mutation changes.
struct PartSite {
    kind: MutantKind,
    /// Its index in the expression.
    at: usize,
    /// The number of the change among those of the same kind at this part.
    variant: u32,
}

/// The place of an expression.
#[derive(Clone, Copy)]
struct FormulaPlace {
    /// The instruction or contact around it.
    whole: Span,
    /// The number of its branch, from 1.
    branch: Option<usize>,
    /// The number of its first variant.
    variant: u32,
}

/// An expression, resolved and as written; `None`: its parts have no places.
#[derive(Clone, Copy)]
struct FormulaText<'g> {
    formula: &'g Formula,
    written: Option<&'g expression::Expression>,
}

struct FormulaSearch<'g, 'a> {
    ground: &'g Ground<'a>,
    place: FormulaPlace,
    formula: &'g Formula,
    written: Option<&'g expression::Expression>,
    /// For each part, the first part of its operands, or itself.
    starts: Vec<usize>,
    /// The mutation that makes an edit.
    change: &'g dyn Fn(FormulaEdit) -> Mutation,
    found: Vec<FoundMutation>,
}

impl<'g, 'a> FormulaSearch<'g, 'a> {
    fn new(
        ground: &'g Ground<'a>,
        place: FormulaPlace,
        FormulaText { formula, written }: FormulaText<'g>,
        change: &'g dyn Fn(FormulaEdit) -> Mutation,
    ) -> Self {
        let starts = FormulaPart::starts(&formula.parts);
        FormulaSearch { ground, place, formula, written, starts, change, found: Vec::new() }
    }

    fn all(mut self) -> Vec<FoundMutation> {
        let borders = borders(&self.formula.parts, &self.starts);
        for (at, part) in self.formula.parts.iter().enumerate() {
            match *part {
                FormulaPart::Integer(n) => self.integer(at, n, borders.get(&at).copied()),
                FormulaPart::Real(real) => {
                    for (to, new) in near(real) {
                        let texts = ExchangedText { old: &real.to_string(), new: &new.to_string() };
                        self.constant(at, to, texts, FormulaPart::Real(new));
                    }
                }
                FormulaPart::Unary(sign, number_type) => self.sign(at, sign, number_type),
                FormulaPart::Binary(operator, number_type) => {
                    self.operator(at, operator, number_type);
                    self.terms(at, operator);
                }
                FormulaPart::Call(function, count, number_type) => {
                    if let Some(other) = other_function(function) {
                        let texts =
                            ExchangedText { old: function.spec().name, new: other.spec().name };
                        self.exchanged(at, texts, FormulaPart::Call(other, count, number_type));
                    }
                }
                FormulaPart::Bit(bit) => self.other_bit(at, bit),
                FormulaPart::Word(_) | FormulaPart::Element(_) => {}
            }
        }
        self.found
    }

    /// Exchanges a bit of a word for another bit of the same word.
    fn other_bit(&mut self, at: usize, bit: Bit) {
        let Some(other) = other_bit_of_word(bit) else { return };
        let whole = self.ground.text(self.place.whole);
        let what = match self.written {
            Some(_) => {
                let (old, new) = (self.text(at), with_number(self.text(at), bit, other));
                format!("`{old}` is `{new}` in `{whole}`")
            }
            None => format!("a bit of a word is its bit {} in `{whole}`", other.number),
        };
        let site = PartSite { kind: MutantKind::WordBit, at, variant: 0 };
        self.push(site, what, FormulaEdit::Part(at, FormulaPart::Bit(Bit::InWord(other))));
    }

    fn integer(&mut self, at: usize, constant: FormulaInteger, as_border: Option<Direction>) {
        let Ok(n) = i32::try_from(constant.number) else { return };
        let step = match self.is_time(at) {
            true => ConstantStep::time(self.ground.period, 0),
            false => ConstantStep::count(i32::MIN, i32::MAX),
        };
        let value = Value::Const(n, ConstantForm::Integer);
        for (to, new) in step.neighbours(value) {
            if let Value::Const(number, _) = new
                && as_border.filter(|_| step.is_next(n)) != Some(to)
            {
                let texts = ExchangedText { old: &step.text(value), new: &step.text(new) };
                self.constant(
                    at,
                    to,
                    texts,
                    FormulaPart::Integer(FormulaInteger { number: number.into(), ..constant }),
                );
            }
        }
    }

    /// Whether a constant is written as a duration.
    fn is_time(&self, at: usize) -> bool {
        let Some(written) = self.written else { return false };
        let text = self.ground.text(written.parts[at].span);
        rungd_engine::isa::duration::parse(text).is_ok()
    }

    fn sign(&mut self, at: usize, sign: Unary, number_type: NumberType) {
        // A real without its `!` would not be an integer.
        let keeps_type = sign == Unary::Minus || number_type == NumberType::Integer;
        // 2147483648 is allowed only after a `-`.
        let before = at.checked_sub(1).map(|before| self.formula.parts[before]);
        let is_too_great =
            matches!(before, Some(FormulaPart::Integer(n)) if i32::try_from(n.number).is_err());
        if keeps_type && !is_too_great {
            let what = format!("`{}` left out in `{}`", sign.sign(), self.text(at));
            let edit =
                FormulaEdit::Operand { all: self.starts[at]..at + 1, kept: self.starts[at]..at };
            self.push(PartSite { kind: MutantKind::SignOut, at, variant: 0 }, what, edit);
        }
    }

    /// The terms of a sum that can be left out: its right side, and its left side if that is one
    /// term. What is left of `a - b` without its `a` would be `b`, which nobody leaves by mistake.
    fn terms(&mut self, at: usize, operator: Binary) {
        if !matches!(operator, Binary::Add | Binary::Subtract) {
            return;
        }
        let right = self.starts[at - 1]..at;
        let left = self.starts[at]..right.start;
        let all = self.starts[at]..at + 1;
        let is_sum = |at: usize| {
            matches!(self.formula.parts[at], FormulaPart::Binary(Binary::Add | Binary::Subtract, _))
        };
        let mut outs = vec![(right.clone(), left.clone())];
        if operator == Binary::Add && !is_sum(left.end - 1) {
            outs.push((left, right));
        }
        for (variant, (out, kept)) in outs.into_iter().enumerate() {
            if self.is_zero(&out) {
                continue;
            }
            let sum = self.text(at);
            let what = match self.written {
                Some(_) => format!("`{}` left out of `{sum}`", self.text(out.end - 1)),
                None => format!("a term left out of `{sum}`"),
            };
            let site = PartSite { kind: MutantKind::TermOut, at, variant: variant as u32 };
            self.push(site, what, FormulaEdit::Operand { all: all.clone(), kept });
        }
    }

    /// Whether an operand is the constant 0.
    fn is_zero(&self, operand: &Range<usize>) -> bool {
        match self.formula.parts[operand.clone()] {
            [FormulaPart::Integer(n)] => n.number == 0,
            [FormulaPart::Real(real)] => real.number() == 0.0,
            _ => false,
        }
    }

    fn operator(&mut self, at: usize, operator: Binary, number_type: NumberType) {
        // Exchanges without an effect: `x + 0` is `x - 0`, `x * 1` is `x / 1`. A bit is 1 or 0, and
        // `x / 0` gives 0 as `x * 0` does.
        let is_sum = matches!(operator, Binary::Add | Binary::Subtract);
        let is_product = matches!(operator, Binary::Multiply | Binary::Divide);
        let is_neutral = match at.checked_sub(1).map(|before| self.formula.parts[before]) {
            Some(FormulaPart::Integer(FormulaInteger { number, .. })) => {
                number == 0 && is_sum || number == 1 && is_product
            }
            Some(FormulaPart::Bit(_)) => is_product,
            Some(
                FormulaPart::Real(_)
                | FormulaPart::Word(_)
                | FormulaPart::Element(_)
                | FormulaPart::Unary(..)
                | FormulaPart::Binary(..)
                | FormulaPart::Call(..),
            )
            | None => false,
        };
        if !is_neutral {
            let other = other_operator(operator);
            let texts = ExchangedText { old: operator.sign(), new: other.sign() };
            self.exchanged(at, texts, FormulaPart::Binary(other, number_type));
        }
    }

    fn exchanged(&mut self, at: usize, texts: ExchangedText, part: FormulaPart) {
        let ExchangedText { old, new } = texts;
        let what = format!("`{old}` is `{new}` in `{}`", self.text(at));
        self.push(
            PartSite { kind: MutantKind::Operator, at, variant: 0 },
            what,
            FormulaEdit::Part(at, part),
        );
    }

    fn constant(&mut self, at: usize, to: Direction, texts: ExchangedText, new: FormulaPart) {
        let written = self.written.map_or(texts.old, |_| self.text(at));
        let what = change_of_constant(written, texts);
        let what = format!("{what} in `{}`", self.ground.text(self.place.whole));
        self.push(
            PartSite { kind: MutantKind::Number, at, variant: to as u32 },
            what,
            FormulaEdit::Part(at, new),
        );
    }

    fn place(&self, at: usize) -> Span {
        self.written.map_or(self.place.whole, |written| written.parts[at].span)
    }

    fn text(&self, at: usize) -> &str {
        self.ground.text(self.place(at))
    }

    fn push(&mut self, site: PartSite, what: String, edit: FormulaEdit) {
        let PartSite { kind, at, variant } = site;
        // Several parts share one place if their own places are unknown.
        let variant = self.place.variant + variant + 2 * at as u32;
        let mutation = (self.change)(edit);
        let branch = self.place.branch;
        let place = self.place(at);
        self.found.push(FoundMutation { kind, place, variant, what, branch, mutation });
    }
}

/// The integer constants at a compare of integers, each with the direction of the neighbour that
/// has the same effect as the moved border.
fn borders(parts: &[FormulaPart], starts: &[usize]) -> HashMap<usize, Direction> {
    let mut borders = HashMap::new();
    for (at, part) in parts.iter().enumerate() {
        if let FormulaPart::Binary(operator, NumberType::Integer) = part
            && let Some((on_right, on_left)) = beside(*operator)
        {
            let right = starts[at - 1];
            if right + 1 == at {
                borders.insert(right, on_right);
            }
            if starts[at] + 1 == right {
                borders.insert(starts[at], on_left);
            }
        }
    }
    borders
}

/// The neighbours with the same effect as the moved border of an ordering: of a constant on its
/// right side, and of a constant on its left side.
fn beside(operator: Binary) -> Option<(Direction, Direction)> {
    let grows = matches!(operator, Binary::AtLeast | Binary::Less);
    let left_grows = matches!(operator, Binary::AtMost | Binary::Greater);
    let direction = |grows| if grows { Direction::More } else { Direction::Less };
    operator.is_ordering().then(|| (direction(grows), direction(left_grows)))
}

/// The operator that an author might confuse with this one.
fn other_operator(operator: Binary) -> Binary {
    match operator {
        Binary::Power => Binary::Multiply,
        Binary::Multiply => Binary::Divide,
        Binary::Divide | Binary::Remainder => Binary::Multiply,
        Binary::Add => Binary::Subtract,
        Binary::Subtract => Binary::Add,
        Binary::ShiftLeft => Binary::ShiftRight,
        Binary::ShiftRight | Binary::ShiftRightZeros => Binary::ShiftLeft,
        Binary::AtMost => Binary::Less,
        Binary::Less => Binary::AtMost,
        Binary::AtLeast => Binary::Greater,
        Binary::Greater => Binary::AtLeast,
        Binary::Equal => Binary::NotEqual,
        Binary::NotEqual => Binary::Equal,
        Binary::AndAlso => Binary::OrElse,
        Binary::OrElse => Binary::AndAlso,
        Binary::And => Binary::Or,
        Binary::Or | Binary::Xor => Binary::And,
    }
}

/// The function that an author might confuse with this one.
fn other_function(function: Function) -> Option<Function> {
    match function {
        Function::Min => Some(Function::Max),
        Function::Max => Some(Function::Min),
        Function::Floor => Some(Function::Ceil),
        Function::Ceil => Some(Function::Floor),
        Function::Round => Some(Function::Trunc),
        Function::Trunc => Some(Function::Round),
        Function::Sin => Some(Function::Cos),
        Function::Cos => Some(Function::Sin),
        Function::Abs
        | Function::Sum
        | Function::Clamp
        | Function::If
        | Function::Toreal
        | Function::Sqrt
        | Function::Exp
        | Function::Ln
        | Function::Log10
        | Function::Tan
        | Function::Asin
        | Function::Acos
        | Function::Atan
        | Function::Atan2
        | Function::Scale => None,
    }
}
