//! Random expressions for MATH.

use super::pool::Pool;

/// Whether an expression must be an integer, as operators on bits need.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Integer,
    Any,
}

impl Pool {
    pub fn math(&mut self) -> String {
        let target = match self.rng.weighted(&[25, 25, 50]) {
            0 => self.written_bit(),
            1 => self.indexed("R"),
            _ => self.written_word(),
        };
        let mut target = self.name_without_comma(&target);
        if self.rng.chance(12)
            && let Some(element) = self.math_element(&["D", "V", "C", "R"], Pool::index)
        {
            target = element;
        }
        let depth = 1 + self.rng.below(4);
        format!("MATH {target} = {}", self.formula(depth, Wanted::Any))
    }

    fn index(&mut self) -> String {
        self.formula(1, Wanted::Integer)
    }

    /// The areas of suitable arrays.
    fn areas(wanted: Wanted) -> &'static [&'static str] {
        match wanted {
            Wanted::Integer => &["D", "V", "C", "X"],
            Wanted::Any => &["D", "V", "C", "X", "R", "R"],
        }
    }

    /// A name for the address that an expression can contain.
    fn name_without_comma(&mut self, address: &str) -> String {
        let name = self.name(address);
        if name.contains([',', '[']) { address.to_string() } else { name }
    }

    /// A compare with an expression on at least one side, or of two bits.
    pub fn computed_compare(&mut self) -> String {
        let operator = *self.rng.pick(&["==", "!=", "<", "<=", ">", ">="]);
        if self.rng.chance(12) {
            return format!("{} {operator} {}", self.plain_bit(), self.plain_bit());
        }
        self.in_contact = true;
        let computed = self.contact_side();
        let other = match self.rng.chance(50) {
            true => self.contact_side(),
            false => {
                let other = self.any_value();
                if other.contains([',', '-', '[']) { "3".to_string() } else { other }
            }
        };
        self.in_contact = false;
        match self.rng.chance(50) {
            true => format!("{computed} {operator} {other}"),
            false => format!("{other} {operator} {computed}"),
        }
    }

    /// A bit of an array whose index is an expression.
    pub fn computed_bit(&mut self) -> Option<String> {
        self.in_contact = true;
        let bit = self.math_element(&["C", "X"], Pool::index);
        self.in_contact = false;
        bit
    }

    fn plain_bit(&mut self) -> String {
        let bit = self.bit();
        if bit.contains([',', '-', '[']) { "$On".to_string() } else { bit }
    }

    /// An expression that is more than a bit.
    fn contact_side(&mut self) -> String {
        let depth = 1 + self.rng.below(3);
        match self.rng.weighted(&[20, 55, 25]) {
            0 => format!("-({})", self.formula(depth, Wanted::Any)),
            1 => {
                let signs = ["+", "-", "*", "/", "%", "+", "-", "**"];
                self.joined(depth, Wanted::Any, &signs)
            }
            _ => self.called(depth, Wanted::Any),
        }
    }

    fn formula(&mut self, depth: usize, wanted: Wanted) -> String {
        if depth == 0 {
            return self.formula_leaf(wanted);
        }
        let any = usize::from(wanted == Wanted::Any);
        // Contacts have no operators on bits, compares, `&&` and `||`.
        let math = usize::from(!self.in_contact);
        let weights = [15, 10, 30, 12 * math, 12 * math, 6 * math, 9, 6 * any, 4 * any];
        match self.rng.weighted(&weights) {
            0 => self.formula_leaf(wanted),
            1 => {
                let signs = ["-", "-", "!", "~"];
                let sign = *self.rng.pick(&signs[..if self.in_contact { 2 } else { 4 }]);
                let inner = if sign == "~" { Wanted::Integer } else { wanted };
                format!("{sign}({})", self.formula(depth - 1, inner))
            }
            2 => self.joined(depth, wanted, &["+", "-", "*", "/", "%", "+", "-", "*", "**"]),
            3 => self.joined(depth, Wanted::Integer, &["&", "|", "^", "<<", ">>", ">>>"]),
            4 => self.joined(depth, Wanted::Any, &["<", "<=", ">", ">=", "==", "!="]),
            5 => self.joined(depth, Wanted::Any, &["&&", "||"]),
            6 => self.called(depth, wanted),
            7 => {
                let name = *self.rng.pick(&[
                    "toreal", "sqrt", "exp", "ln", "log10", "sin", "cos", "tan", "asin", "acos",
                    "atan",
                ]);
                format!("{name}({})", self.formula(depth - 1, Wanted::Any))
            }
            _ => {
                let count = if self.rng.chance(50) { 2 } else { 5 };
                let name = if count == 2 { "atan2" } else { "scale" };
                format!("{name}({})", self.arguments(count, depth, Wanted::Any))
            }
        }
    }

    /// Two parts with an operator. The parts have parentheses, but sometimes not if the operator
    /// allows that.
    fn joined(&mut self, depth: usize, wanted: Wanted, signs: &[&str]) -> String {
        let sign = *self.rng.pick(signs);
        let (left, right) = (self.formula(depth - 1, wanted), self.formula(depth - 1, wanted));
        let plain = ["+", "-", "*", "/", "%", "**", "&&", "||", "&", "|", "^"].contains(&sign);
        if plain && self.rng.chance(50) {
            let space = if self.in_contact || self.rng.chance(60) { " " } else { "" };
            let text = format!("{left}{space}{sign}{space}{right}");
            // Next to operators on bits, a real must be in parentheses.
            return if ["&", "|", "^", "&&", "||"].contains(&sign) {
                format!("({text})")
            } else {
                text
            };
        }
        format!("(({left}) {sign} ({right}))")
    }

    fn arguments(&mut self, count: usize, depth: usize, wanted: Wanted) -> String {
        let one = |_| self.formula(depth - 1, wanted);
        (0..count).map(one).collect::<Vec<_>>().join(", ")
    }

    fn called(&mut self, depth: usize, wanted: Wanted) -> String {
        let some = 1 + self.rng.below(4);
        let (name, count) = *self.rng.pick(&[
            ("abs", 1),
            ("min", some),
            ("max", some),
            ("sum", some),
            ("clamp", 3),
            ("round", 1),
            ("floor", 1),
            ("ceil", 1),
            ("trunc", 1),
            ("if", 3),
        ]);
        let is_rounding = ["round", "floor", "ceil", "trunc"].contains(&name);
        let inner = if is_rounding { Wanted::Any } else { wanted };
        let mut arguments = self.arguments(count, depth, inner);
        if ["min", "max", "sum"].contains(&name)
            && self.rng.chance(50)
            && let Some(array) = self.math_array(Pool::areas(wanted))
        {
            arguments = match self.rng.below(3) {
                0 => array,
                1 => format!("{array}, {arguments}"),
                _ => format!("{arguments}, {array}"),
            };
        }
        format!("{name}({arguments})")
    }

    fn formula_leaf(&mut self, wanted: Wanted) -> String {
        let any = usize::from(wanted == Wanted::Any);
        if self.rng.chance(8)
            && let Some(element) = self.math_element(Pool::areas(wanted), Pool::index)
        {
            return element;
        }
        if self.rng.chance(4)
            && let Some(member) = self.math_member(Pool::index)
        {
            return member;
        }
        match self.rng.weighted(&[45, 15, 25, 15 * any, 20 * any]) {
            0 => {
                let address = self.written_word();
                self.name_without_comma(&address)
            }
            1 => {
                let bit = self.bit();
                if bit.contains([',', '-', '[']) { "$On".to_string() } else { bit }
            }
            2 => {
                let number = self.number();
                let text = self.integer_text(number);
                if number < 0 { format!("({text})") } else { text }
            }
            3 => {
                let address = self.indexed("R");
                self.name_without_comma(&address)
            }
            _ => {
                let reals = ["0.5", "1.25", "3.0", "1e3", "2.5e-7", "1e30", "100.0", "0.0"];
                self.rng.pick(&reals).to_string()
            }
        }
    }
}
