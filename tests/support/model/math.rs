//! A second implementation of MATH: evaluates recursively, in wide integers.

use super::exec::Sim;
use super::place::{Area, Loc};
use super::program::{Array, Target};

#[derive(Clone, Debug)]
pub enum Expr {
    Integer(i128),
    Real(f64),
    At(Loc),
    /// An element, with its index.
    Element(Array, Box<Expr>),
    /// A whole array, as an argument.
    Whole(Array),
    Unary(char, Box<Expr>),
    Binary(String, Box<Expr>, Box<Expr>),
    Call(String, Vec<Expr>),
}

#[derive(Clone, Copy, Debug)]
pub enum Number {
    Integer(i128),
    Real(f64),
}

const MIN: i128 = i64::MIN as i128;
const MAX: i128 = i64::MAX as i128;

const DIVIDE: usize = 10;
const OVERFLOW: usize = 11;
const RANGE: usize = 12;

/// Whether an expression is real by its own operands.
fn is_real(expr: &Expr) -> bool {
    match expr {
        Expr::Integer(_) | Expr::Unary('!' | '~', _) => false,
        Expr::Real(_) => true,
        Expr::At(loc) => loc.area == Area::R,
        Expr::Element(array, _) | Expr::Whole(array) => array.first.area == Area::R,
        Expr::Unary(_, inner) => is_real(inner),
        Expr::Binary(sign, left, right) => {
            let arithmetic = ["+", "-", "*", "/", "%", "**"].contains(&sign.as_str());
            arithmetic && (is_real(left) || is_real(right))
        }
        Expr::Call(name, arguments) => match name.as_str() {
            "round" | "floor" | "ceil" | "trunc" => false,
            "abs" | "min" | "max" | "sum" | "clamp" => arguments.iter().any(is_real),
            "if" => is_real(&arguments[1]) || is_real(&arguments[2]),
            _ => true,
        },
    }
}

impl Number {
    fn is_true(self) -> bool {
        match self {
            Number::Integer(n) => n != 0,
            Number::Real(real) => real != 0.0,
        }
    }

    pub fn real(self) -> f64 {
        match self {
            Number::Integer(n) => n as f64,
            Number::Real(real) => real,
        }
    }

    fn integer(self) -> i128 {
        match self {
            Number::Integer(n) => n,
            Number::Real(real) => panic!("{real} where only integers stand"),
        }
    }
}

impl Sim<'_> {
    /// Evaluates the expression and stores the result.
    pub fn math(&mut self, target: &Target, expr: &Expr) {
        let found = match target {
            Target::At(loc) => Some(*loc),
            Target::Element(array, index) => self.selected(*array, index),
        };
        if found.is_none() {
            self.wrong_index();
        }
        let value = self.number(expr);
        let Some(target) = found else { return };
        if target.area == Area::R {
            let single = self.single(value.real());
            return self.memory.put_real(target, single.real() as f32);
        }
        let (low, high) = target.range();
        let is_bit = (low, high) == (0, 1);
        if is_bit {
            return self.memory.put_bit(target, value.is_true());
        }
        let whole = match value {
            Number::Integer(n) => n,
            Number::Real(real) => real.trunc() as i128,
        };
        if whole < i128::from(low) || whole > i128::from(high) {
            self.note(OVERFLOW);
        }
        let limited = whole.clamp(i128::from(low), i128::from(high));
        self.memory.put(target, limited as i64);
    }

    fn selected(&mut self, array: Array, index: &Expr) -> Option<Loc> {
        let index = self.number(index).integer();
        array.element(i64::try_from(index).unwrap_or(-1))
    }

    fn note(&mut self, bit: usize) {
        if self.quiet {
            return;
        }
        self.memory.put_bit(Loc::whole(Area::St, bit), true);
    }

    fn limited(&mut self, value: i128) -> Number {
        if !(MIN..=MAX).contains(&value) {
            self.note(OVERFLOW);
        }
        Number::Integer(value.clamp(MIN, MAX))
    }

    fn finite(&mut self, value: f64) -> Number {
        if value.is_finite() {
            // -0 is 0.
            return Number::Real(if value == 0.0 { 0.0 } else { value });
        }
        self.note(OVERFLOW);
        Number::Real(if value > 0.0 { f64::MAX } else { f64::MIN })
    }

    fn single(&mut self, value: f64) -> Number {
        let single = value as f32;
        if single.is_infinite() {
            self.note(OVERFLOW);
        }
        let single = single.clamp(f32::MIN, f32::MAX);
        Number::Real(if single == 0.0 { 0.0 } else { f64::from(single) })
    }

    pub fn is_true(&mut self, expr: &Expr) -> bool {
        self.number(expr).is_true()
    }

    fn number(&mut self, expr: &Expr) -> Number {
        let truth = |on: bool| Number::Integer(i128::from(on));
        match expr {
            Expr::Integer(n) => Number::Integer(*n),
            Expr::Real(real) => Number::Real(*real),
            Expr::At(loc) => self.at(*loc),
            Expr::Element(array, index) => match self.selected(*array, index) {
                Some(loc) => self.at(loc),
                None => {
                    self.wrong_index();
                    if is_real(expr) { Number::Real(0.0) } else { Number::Integer(0) }
                }
            },
            Expr::Whole(array) => panic!("{array:?} where one value stands"),
            Expr::Unary(sign, inner) => match (sign, self.number(inner)) {
                ('!', value) => truth(!value.is_true()),
                ('~', value) => Number::Integer(i128::from(!(value.integer() as i32))),
                (_, Number::Integer(n)) => self.limited(-n),
                (_, Number::Real(real)) => self.finite(-real),
            },
            Expr::Binary(sign, left, right) if sign == "&&" => {
                let on = self.number(left).is_true() && self.number(right).is_true();
                truth(on)
            }
            Expr::Binary(sign, left, right) if sign == "||" => {
                let on = self.number(left).is_true() || self.number(right).is_true();
                truth(on)
            }
            Expr::Binary(sign, left, right) => {
                let (left, right) = (self.number(left), self.number(right));
                match (left, right) {
                    (Number::Integer(a), Number::Integer(b)) => self.integers(sign, a, b),
                    _ => self.reals(sign, left.real(), right.real()),
                }
            }
            Expr::Call(name, arguments) if name == "if" => {
                let taken = if self.number(&arguments[0]).is_true() { 1 } else { 2 };
                let value = self.number(&arguments[taken]);
                if is_real(expr) { Number::Real(value.real()) } else { value }
            }
            Expr::Call(name, arguments) => {
                let values: Vec<Number> = arguments.iter().map(|of| self.number(of)).collect();
                self.call(name, &values, is_real(expr))
            }
        }
    }

    fn integers(&mut self, sign: &str, a: i128, b: i128) -> Number {
        let shift = (0..32).contains(&b);
        let low = a as i32;
        let value = match sign {
            "+" => a + b,
            "-" => a - b,
            "*" => a * b,
            "/" | "%" if b == 0 => {
                self.note(DIVIDE);
                0
            }
            "/" => a / b,
            "%" => a % b,
            "**" => return self.integer_power(a, b),
            "<<" => {
                if shift {
                    i128::from(low << b)
                } else {
                    0
                }
            }
            ">>" => i128::from(if shift { low >> b } else { low >> 31 }),
            ">>>" => {
                if shift {
                    i128::from(((low as u32) >> b) as i32)
                } else {
                    0
                }
            }
            "&" => i128::from(low & b as i32),
            "|" => i128::from(low | b as i32),
            "^" => i128::from(low ^ b as i32),
            "==" => i128::from(a == b),
            "!=" => i128::from(a != b),
            "<" => i128::from(a < b),
            "<=" => i128::from(a <= b),
            ">" => i128::from(a > b),
            _ => i128::from(a >= b),
        };
        self.limited(value)
    }

    fn integer_power(&mut self, a: i128, n: i128) -> Number {
        if n < 0 {
            self.note(if a == 0 { DIVIDE } else { RANGE });
            return Number::Integer(0);
        }
        let mut power = 1;
        // After 200 steps a power repeats itself every second step.
        for _ in 0..if n > 200 { 200 + n % 2 } else { n } {
            power = self.limited(power * a).integer();
        }
        Number::Integer(power)
    }

    fn reals(&mut self, sign: &str, a: f64, b: f64) -> Number {
        let truth = |on: bool| Number::Integer(i128::from(on));
        match sign {
            "+" => self.finite(a + b),
            "-" => self.finite(a - b),
            "*" => self.finite(a * b),
            "/" | "%" if b == 0.0 => {
                self.note(DIVIDE);
                Number::Real(0.0)
            }
            "/" => self.finite(a / b),
            "%" => self.finite(a % b),
            "**" if a == 0.0 && b < 0.0 => {
                self.note(DIVIDE);
                Number::Real(0.0)
            }
            "**" if a < 0.0 && b.fract() != 0.0 => {
                self.note(RANGE);
                Number::Real(0.0)
            }
            "**" => self.single(a.powf(b)),
            "==" => truth(a == b),
            "!=" => truth(a != b),
            "<" => truth(a < b),
            "<=" => truth(a <= b),
            ">" => truth(a > b),
            ">=" => truth(a >= b),
            _ => panic!("`{sign}` of a real"),
        }
    }

    fn call(&mut self, name: &str, values: &[Number], real: bool) -> Number {
        let typed = |n: Number| if real { Number::Real(n.real()) } else { n };
        let values: Vec<Number> = values.iter().map(|value| typed(*value)).collect();
        let less = |a: Number, b: Number| match (a, b) {
            (Number::Integer(a), Number::Integer(b)) => a < b,
            _ => a.real() < b.real(),
        };
        let first = values[0];
        match name {
            "abs" if less(first, typed(Number::Integer(0))) => match first {
                Number::Integer(n) => self.limited(-n),
                Number::Real(value) => Number::Real(-value),
            },
            "abs" => first,
            "min" => values.into_iter().reduce(|a, b| if less(b, a) { b } else { a }).unwrap(),
            "max" => values.into_iter().reduce(|a, b| if less(a, b) { b } else { a }).unwrap(),
            "sum" => {
                let add = |a: Number, b: Number| match (a, b) {
                    (Number::Integer(a), Number::Integer(b)) => self.integers("+", a, b),
                    _ => self.reals("+", a.real(), b.real()),
                };
                values.into_iter().reduce(add).unwrap()
            }
            "clamp" => {
                let (low, high) = (values[1], values[2]);
                let limited = if less(high, first) { high } else { first };
                if less(limited, low) { low } else { limited }
            }
            "round" | "floor" | "ceil" | "trunc" => self.rounded(name, first),
            "scale" => self.scaled(&values),
            _ => self.function(name, &values),
        }
    }

    fn rounded(&mut self, name: &str, value: Number) -> Number {
        let Number::Real(real) = value else { return value };
        let whole = match name {
            "round" => real.round(),
            "floor" => real.floor(),
            "ceil" => real.ceil(),
            _ => real.trunc(),
        };
        self.limited(whole as i128)
    }

    fn scaled(&mut self, v: &[Number]) -> Number {
        let mut step = |sign, a: Number, b: Number| self.reals(sign, a.real(), b.real());
        let run = step("-", v[0], v[1]);
        let rise = step("-", v[4], v[3]);
        let product = step("*", run, rise);
        let width = step("-", v[2], v[1]);
        let quotient = step("/", product, width);
        step("+", v[3], quotient)
    }

    fn function(&mut self, name: &str, values: &[Number]) -> Number {
        let x = values[0].real();
        let inside = match name {
            "sqrt" => x >= 0.0,
            "ln" | "log10" => x > 0.0,
            "asin" | "acos" => (-1.0..=1.0).contains(&x),
            _ => true,
        };
        if !inside {
            self.note(RANGE);
            return Number::Real(0.0);
        }
        let value = match name {
            "toreal" => return Number::Real(x),
            "sqrt" => return Number::Real(x.sqrt()),
            "exp" => x.exp(),
            "ln" => x.ln(),
            "log10" => x.log10(),
            "sin" => x.sin(),
            "cos" => x.cos(),
            "tan" => x.tan(),
            "asin" => x.asin(),
            "acos" => x.acos(),
            "atan" => x.atan(),
            "atan2" => x.atan2(values[1].real()),
            _ => panic!("there is no function `{name}`"),
        };
        self.single(value)
    }
}
