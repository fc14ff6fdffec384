//! The functions of MATH: name, number of arguments, type of the result.
//!
//! The resolver checks calls against this table, `lower` matches every function, and `rungd
//! explain` prints the rows. Behaviour: `docs/semantics.md`, section 8.

/// The type of a function's result, and the type to which it converts its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResultType {
    /// An integer if all arguments are integers; else a real.
    Kept,
    /// An integer; the argument may be an integer or a real.
    Integer,
    /// A real; integer arguments are converted to reals.
    Real,
}

/// One row of the table.
#[derive(Debug)]
pub struct FunctionSpec {
    /// The function.
    pub function: Function,
    /// The name as written.
    pub name: &'static str,
    /// The arguments, as people read them.
    pub arguments: &'static str,
    /// The least number of arguments.
    pub least: u32,
    /// The greatest number of arguments.
    pub most: u32,
    /// The type of the result.
    pub result: ResultType,
    /// Its behaviour, in one sentence.
    pub summary: &'static str,
}

macro_rules! functions {
    ($($function:ident $name:literal $arguments:literal $least:literal..=$most:expr,
       $result:ident $summary:literal;)*) => {
        /// Every function.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Function { $($function),* }

        /// The table, in the order of the language reference.
        pub const FUNCTIONS: &[FunctionSpec] = &[$(FunctionSpec {
            function: Function::$function,
            name: $name,
            arguments: $arguments,
            least: $least,
            most: $most,
            result: ResultType::$result,
            summary: $summary,
        }),*];
    };
}

functions! {
    Abs "abs" "x" 1..=1, Kept "x without its sign.";
    Min "min" "x, y, …" 1..=u32::MAX, Kept "The least of its arguments.";
    Max "max" "x, y, …" 1..=u32::MAX, Kept "The greatest of its arguments.";
    Sum "sum" "x, y, …" 1..=u32::MAX, Kept "The sum of its arguments, from left to right.";
    Clamp "clamp" "x, lo, hi" 3..=3, Kept "x, but at least lo and at most hi; lo if lo > hi.";
    If "if" "c, x, y" 3..=3, Kept "x if c is not 0, else y; only the chosen one is evaluated.";
    Round "round" "x" 1..=1, Integer "The nearest integer, half away from zero.";
    Floor "floor" "x" 1..=1, Integer "The greatest integer that is not above x.";
    Ceil "ceil" "x" 1..=1, Integer "The least integer that is not below x.";
    Trunc "trunc" "x" 1..=1, Integer "The integer part of x.";
    Toreal "toreal" "x" 1..=1, Real "x as a real.";
    Sqrt "sqrt" "x" 1..=1, Real "The square root; x >= 0.";
    Exp "exp" "x" 1..=1, Real "e to the power of x.";
    Ln "ln" "x" 1..=1, Real "The natural logarithm; x > 0.";
    Log10 "log10" "x" 1..=1, Real "The logarithm to the base 10; x > 0.";
    Sin "sin" "x" 1..=1, Real "The sine of x radians.";
    Cos "cos" "x" 1..=1, Real "The cosine of x radians.";
    Tan "tan" "x" 1..=1, Real "The tangent of x radians.";
    Asin "asin" "x" 1..=1, Real "The angle in radians whose sine is x; x from -1 to 1.";
    Acos "acos" "x" 1..=1, Real "The angle in radians whose cosine is x; x from -1 to 1.";
    Atan "atan" "x" 1..=1, Real "The angle in radians whose tangent is x.";
    Atan2 "atan2" "y, x" 2..=2, Real "The angle in radians of the point (x, y).";
    Scale "scale" "x, in_lo, in_hi, out_lo, out_hi" 5..=5, Real
        "x, scaled from the range in_lo to in_hi to the range out_lo to out_hi; not limited.";
}

impl Function {
    /// Whether its arguments may be whole arrays.
    pub fn takes_arrays(self) -> bool {
        matches!(self, Function::Min | Function::Max | Function::Sum)
    }

    /// The table row.
    pub fn spec(self) -> &'static FunctionSpec {
        &FUNCTIONS[self as usize]
    }

    /// The function with this name.
    pub fn from_name(name: &str) -> Option<Function> {
        FUNCTIONS.iter().find(|spec| spec.name == name).map(|spec| spec.function)
    }
}

impl FunctionSpec {
    /// The form in one line: `clamp(x, lo, hi)`.
    pub fn form(&self) -> String {
        format!("{}({})", self.name, self.arguments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_finds_each_function_and_lists_its_arguments() {
        for spec in FUNCTIONS {
            assert_eq!(Function::from_name(spec.name).map(|f| f.spec().name), Some(spec.name));
            let named = spec.arguments.split(", ").filter(|name| *name != "…").count() as u32;
            assert!((spec.least..=spec.most).contains(&named), "{}", spec.name);
        }
        assert_eq!(Function::Clamp.spec().form(), "clamp(x, lo, hi)");
    }
}
