//! The grammar of MATH and of expressions: the target, and the expression behind the `=`.
//!
//! Called by `instruction`, and by `side_parser` for contacts. This is the shunting-yard
//! algorithm: an operator waits on a stack until an operator follows that binds less tightly. So
//! no input makes this code recurse. The nesting of parentheses, calls and operators with one
//! operand is limited nevertheless, because deeper expressions are not readable.

use super::expression::{
    Binary, Expression, ExpressionPart, ExpressionPartKind, Unary, WrittenFormula,
};
use super::expression_lexer::{ExpressionToken, ExpressionUse, lex};
use super::expression_rules::{OperandRoot, OperandTerm, OperatorUse};
use super::finding::{Code, Finding};
use super::fix::{Help, advise, possible, text as fix, write};
use super::foreign_signs;
use super::indexed::INDEX;
use super::math_target;
use super::span::{Located, Span};
use rungd_engine::isa::decimal_comma;

/// Maximum nesting depth of parentheses, calls and operators with one operand.
const DEPTH_MAX: usize = 32;

type ExpressionResult<T> = Result<T, Finding>;

/// Parses the text after `MATH`; `span` is its place. Adds errors and warnings to `findings`.
pub(super) fn parse_formula(
    text: &str,
    span: Span,
    findings: &mut Vec<Finding>,
) -> Option<WrittenFormula> {
    let mut warnings = Vec::new();
    let parsed = math_target::split(text, span).and_then(|split| {
        let math_target::SplitFormula { target, index, bit, begin: at } = split;
        let part = |(from, to): (usize, usize)| (&text[from..to], span.part(from, to));
        let index = index.map(|index| {
            let (text, place) = part(index);
            parse(text, place, ExpressionUse::Math, &mut warnings)
        });
        let index = index.transpose()?;
        let (text, place) = part((at, text.len()));
        let expression = parse(text, place, ExpressionUse::Math, &mut warnings)?;
        Ok(WrittenFormula { target, index, bit, expression })
    });
    findings.append(&mut warnings);
    parsed.map_err(|finding| findings.push(finding)).ok()
}

/// Parses an expression; `span` is its place.
///
/// # Errors
/// The first mistake in it.
pub(super) fn parse(
    text: &str,
    span: Span,
    used: ExpressionUse,
    warnings: &mut Vec<Finding>,
) -> ExpressionResult<Expression> {
    let tokens = lex(text, span, used)?;
    let mut parser = ExpressionParser {
        text,
        span,
        parts: Vec::with_capacity(tokens.len()),
        operands: Vec::new(),
        waiting: Vec::new(),
        depth: 0,
        warnings,
    };
    let mut wants_operand = true;
    for (at, (token, place)) in tokens.iter().enumerate() {
        let behind = tokens.get(at + 1);
        wants_operand = if wants_operand {
            parser.begin(token, *place, behind.map(|(token, _)| token))?
        } else {
            parser.go_on(
                token,
                *place,
                behind.map(|(value, span)| Located { value, span: *span }),
            )?
        };
    }
    if wants_operand {
        return Err(parser.missing(parser.end()));
    }
    parser.finish()
}

/// An operator or an open bracket that waits for the tokens behind it.
enum WaitingOperator {
    Unary(Unary, Span),
    Binary(Binary, Span),
    Group(Span),
    Call {
        name: Located<String>,
        arguments: u32,
        open: Span,
    },
    /// The index of an element.
    Index {
        name: Located<String>,
        open: Span,
    },
}

struct ExpressionParser<'a> {
    text: &'a str,
    span: Span,
    parts: Vec<ExpressionPart>,
    operands: Vec<OperandTerm>,
    waiting: Vec<WaitingOperator>,
    /// Number of waiting brackets and operators with one operand.
    depth: usize,
    warnings: &'a mut Vec<Finding>,
}

impl ExpressionParser<'_> {
    /// The place after the last byte.
    fn end(&self) -> Span {
        Span { start: self.span.end, ..self.span }
    }

    fn error(&self, place: Span, message: impl Into<String>) -> Finding {
        Finding::new(Code::ExpressionSyntax, place, message)
    }

    fn missing(&self, place: Span) -> Finding {
        self.error(place, "a value is missing here")
            .help("a value is a constant, a name, a call or an expression in parentheses")
    }

    /// Reads a token in the place of an operand; returns whether an operand is still required.
    fn begin(
        &mut self,
        token: &ExpressionToken,
        place: Span,
        behind: Option<&ExpressionToken>,
    ) -> ExpressionResult<bool> {
        match token {
            ExpressionToken::Operand(ExpressionPartKind::Name(name))
                if behind == Some(&ExpressionToken::Open) =>
            {
                let name = Located { value: name.clone(), span: place };
                self.wait(WaitingOperator::Call { name, arguments: 0, open: place }, place)?;
                Ok(false)
            }
            ExpressionToken::Operand(ExpressionPartKind::Name(name))
                if behind == Some(&ExpressionToken::Index) =>
            {
                let name = Located { value: name.clone(), span: place };
                self.wait(WaitingOperator::Index { name, open: place }, place)?;
                Ok(false)
            }
            ExpressionToken::Operand(kind) => {
                self.constant_fits(kind, place)?;
                self.operand(ExpressionPart { kind: kind.clone(), span: place });
                Ok(false)
            }
            ExpressionToken::Sign(Binary::Subtract) => {
                self.wait(WaitingOperator::Unary(Unary::Minus, place), place).map(|()| true)
            }
            ExpressionToken::Prefix(operator) => {
                self.wait(WaitingOperator::Unary(*operator, place), place).map(|()| true)
            }
            ExpressionToken::Open => self.wait(WaitingOperator::Group(place), place).map(|()| true),
            ExpressionToken::Close if self.is_empty_call() => self.close(place).map(|()| false),
            ExpressionToken::Sign(Binary::Add) => Err(self
                .error(place, "a value has no `+` before it")
                .help("take the `+` away")
                .fix("")),
            ExpressionToken::Sign(_)
            | ExpressionToken::Close
            | ExpressionToken::Comma
            | ExpressionToken::IndexEnd(_)
            | ExpressionToken::WordBit(_) => Err(self.missing(place)),
            ExpressionToken::Index => Err(self.no_array(place)),
        }
    }

    /// Reads a token behind an operand; returns whether an operand must follow.
    fn go_on(
        &mut self,
        token: &ExpressionToken,
        place: Span,
        behind: Option<Located<&ExpressionToken>>,
    ) -> ExpressionResult<bool> {
        match token {
            ExpressionToken::Sign(operator) => {
                self.settle(|waiting| match waiting.precedence().cmp(&operator.precedence()) {
                    std::cmp::Ordering::Greater => true,
                    std::cmp::Ordering::Equal => *operator != Binary::Power,
                    std::cmp::Ordering::Less => false,
                })?;
                self.waiting.push(WaitingOperator::Binary(*operator, place));
                Ok(true)
            }
            // The `(` behind a function's name.
            ExpressionToken::Open if self.opens_call(place) => Ok(true),
            ExpressionToken::Close => self.close(place).map(|()| false),
            ExpressionToken::Comma => self.argument(place).map(|()| true),
            ExpressionToken::Index if self.opens_index(place) => Ok(true),
            ExpressionToken::Index => Err(self.no_array(place)),
            ExpressionToken::IndexEnd(rest) => {
                let bit = match behind {
                    Some(Located { value: ExpressionToken::WordBit(number), span }) => {
                        Some(Located { value: number.clone(), span })
                    }
                    Some(_) | None => None,
                };
                self.close_index(rest, place, bit).map(|()| false)
            }
            // It was read with the `]` before it.
            ExpressionToken::WordBit(_) => Ok(false),
            ExpressionToken::Operand(_) | ExpressionToken::Open | ExpressionToken::Prefix(_) => {
                Err(self.no_operator(token, place))
            }
        }
    }

    fn no_array(&self, place: Span) -> Finding {
        self.error(place, "an index without an array before it")
            .help("an index stands behind the name of an array: `recipe[step + 1]`")
    }

    /// Whether this `[` opens the innermost waiting index. If so, stores its place.
    fn opens_index(&mut self, place: Span) -> bool {
        if let Some(WaitingOperator::Index { name, open }) = self.waiting.last_mut()
            && *open == name.span
        {
            *open = place;
            return true;
        }
        false
    }

    /// `]`: an index is complete; `rest` is the rest of the name behind it. `bit`: the number of a
    /// bit behind that.
    fn close_index(
        &mut self,
        rest: &str,
        place: Span,
        bit: Option<Located<String>>,
    ) -> ExpressionResult<()> {
        self.settle(|_| true)?;
        let Some(WaitingOperator::Index { mut name, .. }) = self.waiting.pop() else {
            return Err(self.error(place, "`]` closes nothing, or is too early").fix(possible("")));
        };
        self.depth -= 1;
        self.operands.pop();
        let span = name.span.to(place);
        if !rest.is_empty() {
            name.value = format!("{}{INDEX}{rest}", name.value);
        }
        let element = ExpressionPart { kind: ExpressionPartKind::Element(name), span };
        let Some(bit) = bit else {
            self.operand(element);
            return Ok(());
        };
        self.parts.push(element);
        let span = span.to(bit.span);
        self.operand(ExpressionPart { kind: ExpressionPartKind::WordBit(bit), span });
        Ok(())
    }

    fn no_operator(&self, token: &ExpressionToken, place: Span) -> Finding {
        let named = |kind: &ExpressionPartKind, at: Span| {
            let ExpressionPartKind::Name(name) = kind else { return None };
            foreign_signs::of_word(name).map(|sign| write(fix(sign.math).at(at)))
        };
        let before = self.parts.last().and_then(|part| named(&part.kind, part.span));
        let own =
            if let ExpressionToken::Operand(kind) = token { named(kind, place) } else { None };
        let finding = self.error(place, "an operator is missing before this");
        let all = || Help::from("operators are `+ - * / % **` and the like");
        finding.help(own.or(before).unwrap_or_else(all))
    }

    /// Pushes a bracket, or an operator with one operand, onto the waiting stack.
    fn wait(&mut self, waiting: WaitingOperator, place: Span) -> ExpressionResult<()> {
        if self.depth == DEPTH_MAX {
            let message = format!("more than {DEPTH_MAX} levels of parentheses, calls and signs");
            return Err(self.error(place, message).help("give parts of it a MATH of their own"));
        }
        self.depth += 1;
        self.waiting.push(waiting);
        Ok(())
    }

    /// Whether this `(` opens the innermost waiting call. If so, stores its place.
    fn opens_call(&mut self, place: Span) -> bool {
        if let Some(WaitingOperator::Call { name, open, .. }) = self.waiting.last_mut()
            && *open == name.span
        {
            *open = place;
            return true;
        }
        false
    }

    fn is_empty_call(&self) -> bool {
        let last = self.waiting.last();
        let Some(WaitingOperator::Call { name, arguments: 0, open }) = last else { return false };
        *open != name.span
    }

    /// An integer of more than 32 bits is too large; 2147483648 is allowed behind a unary `-`.
    fn constant_fits(&self, kind: &ExpressionPartKind, place: Span) -> ExpressionResult<()> {
        let ExpressionPartKind::Integer(n) = kind else { return Ok(()) };
        let is_negative =
            matches!(self.waiting.last(), Some(WaitingOperator::Unary(Unary::Minus, _)));
        if *n <= i64::from(i32::MAX) + i64::from(is_negative) {
            return Ok(());
        }
        let text = self.text_of(place);
        let message = format!("`{text}` lies outside -2147483648..2147483647");
        let finding = Finding::new(Code::OutOfRange, place, message);
        let real = possible(format!("{text}.0"));
        Err(finding.help(match text.starts_with("0x") {
            true => "numbers are signed, of 32 bits".into(),
            false => advise("constants have 32 bits; a real may be larger: `{}`", [real]),
        }))
    }

    /// Adds a complete operand, and applies to it the operators with one operand before it.
    fn operand(&mut self, part: ExpressionPart) {
        self.operands.push(OperandTerm { span: part.span, root: OperandRoot::Closed });
        self.parts.push(part);
        self.apply_unary();
    }

    fn apply_unary(&mut self) {
        while let Some(WaitingOperator::Unary(operator, sign)) = self.waiting.last() {
            let (operator, sign) = (*operator, *sign);
            self.waiting.pop();
            self.depth -= 1;
            let Some(operand) = self.operands.last_mut() else { return };
            operand.span = sign.to(operand.span);
            operand.root = OperandRoot::Unary(operator);
            self.parts.push(ExpressionPart {
                kind: ExpressionPartKind::Unary(operator),
                span: operand.span,
            });
        }
    }

    /// Applies waiting operators to their two operands, the last operator first, as long as
    /// `is_ready`.
    fn settle(&mut self, is_ready: impl Fn(Binary) -> bool) -> ExpressionResult<()> {
        while let Some(WaitingOperator::Binary(operator, sign)) = self.waiting.last() {
            let (operator, sign) = (*operator, *sign);
            if !is_ready(operator) {
                break;
            }
            self.waiting.pop();
            let (Some(right), Some(left)) = (self.operands.pop(), self.operands.pop()) else {
                break;
            };
            let text = |span: Span| self.text_of(span);
            let said = OperatorUse { operator, sign, left, right };
            let (warning, mistake) = (said.warning(&text), said.mistake(&text));
            self.warnings.extend(warning);
            if let Some(finding) = mistake {
                return Err(finding);
            }
            let span = left.span.to(right.span);
            self.parts
                .push(ExpressionPart { kind: ExpressionPartKind::Binary(operator, sign), span });
            self.operands.push(OperandTerm { span, root: OperandRoot::Binary(operator) });
        }
        Ok(())
    }

    /// `,`: an argument is complete.
    fn argument(&mut self, place: Span) -> ExpressionResult<()> {
        self.settle(|_| true)?;
        if let Some(WaitingOperator::Call { arguments, .. }) = self.waiting.last_mut() {
            *arguments += 1;
            return Ok(());
        }
        if let Some((number, right)) = self.decimal_comma(place) {
            let finding = self.error(number, "a decimal comma in a number");
            return Err(finding.write(right));
        }
        let finding = self.error(place, "a comma outside a call");
        Err(finding.help("a Sensaphone element is written `N0.ACC` here, a real `12.5`"))
    }

    /// The number around a comma, and the same number with a point.
    fn decimal_comma(&self, comma: Span) -> Option<(Span, String)> {
        let is_letter = |c: char| c.is_ascii_alphanumeric();
        let before = self.text_of(Span { end: comma.start, ..self.span });
        let behind = self.text_of(Span { start: comma.end, ..self.span });
        let whole = before.len() - before.trim_end_matches(is_letter).len();
        let fraction = behind.len() - behind.trim_start_matches(is_letter).len();
        let start = comma.start - u32::try_from(whole).ok()?;
        let number = Span { start, end: comma.end + u32::try_from(fraction).ok()?, ..comma };
        Some((number, decimal_comma::corrected(self.text_of(number))?))
    }

    /// `)`: a group or call is complete.
    fn close(&mut self, place: Span) -> ExpressionResult<()> {
        self.settle(|_| true)?;
        match self.waiting.pop() {
            Some(WaitingOperator::Group(open)) => {
                self.depth -= 1;
                let span = open.to(place);
                if let Some(operand) = self.operands.last_mut() {
                    *operand = OperandTerm { span, root: OperandRoot::Closed };
                }
                if let Some(part) = self.parts.last_mut() {
                    part.span = span;
                }
                self.apply_unary();
            }
            Some(WaitingOperator::Call { name, arguments, open }) => {
                self.depth -= 1;
                let arguments = arguments + u32::from(!self.is_blank(open, place));
                let rest = self.operands.len() - (arguments as usize).min(self.operands.len());
                self.operands.truncate(rest);
                let span = name.span.to(place);
                self.operand(ExpressionPart {
                    kind: ExpressionPartKind::Call(name, arguments),
                    span,
                });
            }
            Some(
                WaitingOperator::Unary(..)
                | WaitingOperator::Binary(..)
                | WaitingOperator::Index { .. },
            )
            | None => {
                let finding = self.error(place, "`)` closes nothing, or is too early");
                return Err(finding.fix(possible("")));
            }
        }
        Ok(())
    }

    /// Whether there are only spaces between two brackets.
    fn is_blank(&self, open: Span, close: Span) -> bool {
        self.text_of(Span { start: open.end, end: close.start, ..open }).trim().is_empty()
    }

    fn finish(mut self) -> ExpressionResult<Expression> {
        self.settle(|_| true)?;
        match self.waiting.last() {
            None => Ok(Expression { parts: self.parts }),
            Some(
                WaitingOperator::Group(open)
                | WaitingOperator::Call { open, .. }
                | WaitingOperator::Index { open, .. }
                | WaitingOperator::Unary(_, open)
                | WaitingOperator::Binary(_, open),
            ) => {
                let finding =
                    self.error(self.end(), "`)` is missing").related(*open, "opened here");
                Err(finding.fix(possible(")")))
            }
        }
    }

    fn text_of(&self, span: Span) -> &str {
        let (start, end) = (span.start - self.span.start, span.end - self.span.start);
        self.text.get(start as usize..end as usize).unwrap_or("")
    }
}
