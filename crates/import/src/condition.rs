//! Conditions: what the contacts of a foreign rung say, as contacts of rungd.
//!
//! Made by the readers, printed for `when` by [`RungCondition::contacts`]. A condition knows the
//! places that it reads, so that `rungs` can see whether an instruction in between changes it.

/// A place in memory without its indexes: `recipe.target` for `recipe[2].target`. Two places
/// overlap if one is a part of the other.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TouchedPlace(String);

impl TouchedPlace {
    /// The place that a text of rungd names: `recipe[step + 1].target.3`.
    pub fn of(text: &str) -> TouchedPlace {
        let mut depth = 0;
        let is_outside = |c: &char| {
            match c {
                '[' => depth += 1,
                ']' => depth -= 1,
                _ => return depth == 0,
            }
            false
        };
        TouchedPlace(text.chars().filter(is_outside).collect())
    }

    /// The whole memory: what something may write that is not looked into.
    pub fn everything() -> TouchedPlace {
        TouchedPlace(String::new())
    }

    /// Whether one of them is a part of the other.
    pub fn overlaps(&self, other: &TouchedPlace) -> bool {
        let (short, long) = match self.0.len() <= other.0.len() {
            true => (&self.0, &other.0),
            false => (&other.0, &self.0),
        };
        let rest = long.strip_prefix(short.as_str());
        short.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }
}

/// A condition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RungCondition {
    /// Always ON, or always OFF.
    Constant(bool),
    /// A contact: a bit.
    Bit {
        /// As rungd writes it.
        text: String,
        /// What its value depends on, the words of its index too.
        reads: Vec<TouchedPlace>,
    },
    /// A contact: a compare.
    Compare {
        /// As rungd writes its sides and the operator: `a + 1 >= b`.
        text: String,
        /// The opposite: `a + 1 < b`.
        opposite: String,
        /// What its value depends on.
        reads: Vec<TouchedPlace>,
    },
    /// The opposite of a condition.
    Not(Box<RungCondition>),
    /// A series.
    All(Vec<RungCondition>),
    /// Parallel branches.
    Any(Vec<RungCondition>),
}

impl RungCondition {
    /// A contact on a bit whose value depends on nothing else.
    pub fn bit(text: impl Into<String>) -> RungCondition {
        let text = text.into();
        let reads = vec![TouchedPlace::of(&text)];
        RungCondition::Bit { text, reads }
    }

    /// A compare of two sides by one of `==`, `!=`, `<`, `<=`, `>`, `>=`.
    pub fn compare(
        left: &str,
        operator: &str,
        right: &str,
        reads: Vec<TouchedPlace>,
    ) -> RungCondition {
        let opposite = match operator {
            "==" => "!=",
            "!=" => "==",
            "<" => ">=",
            "<=" => ">",
            ">" => "<=",
            _ => "<",
        };
        RungCondition::Compare {
            text: format!("{left} {operator} {right}"),
            opposite: format!("{left} {opposite} {right}"),
            reads,
        }
    }

    /// Its opposite.
    pub fn opposite(self) -> RungCondition {
        match self {
            RungCondition::Constant(is_on) => RungCondition::Constant(!is_on),
            RungCondition::Compare { text, opposite, reads } => {
                RungCondition::Compare { text: opposite, opposite: text, reads }
            }
            RungCondition::Not(inner) => *inner,
            RungCondition::Bit { .. } | RungCondition::All(_) | RungCondition::Any(_) => {
                RungCondition::Not(Box::new(self))
            }
        }
    }

    /// A series of conditions, in its shortest form.
    pub fn all(parts: impl IntoIterator<Item = RungCondition>) -> RungCondition {
        let mut series = Vec::new();
        for part in parts {
            match part {
                RungCondition::Constant(true) => {}
                RungCondition::All(inner) => series.extend(inner),
                RungCondition::Constant(false)
                | RungCondition::Bit { .. }
                | RungCondition::Compare { .. }
                | RungCondition::Not(_)
                | RungCondition::Any(_) => series.push(part),
            }
        }
        match series.len() {
            0 => RungCondition::Constant(true),
            1 => series.remove(0),
            _ => RungCondition::All(series),
        }
    }

    /// Parallel conditions, in their shortest form.
    pub fn any(parts: impl IntoIterator<Item = RungCondition>) -> RungCondition {
        let mut branches = Vec::new();
        for part in parts {
            match part {
                RungCondition::Constant(true) => return part,
                RungCondition::Any(inner) => branches.extend(inner),
                RungCondition::Constant(false)
                | RungCondition::Bit { .. }
                | RungCondition::Compare { .. }
                | RungCondition::Not(_)
                | RungCondition::All(_) => branches.push(part),
            }
        }
        match branches.len() {
            0 => RungCondition::Constant(false),
            1 => branches.remove(0),
            _ => RungCondition::Any(branches),
        }
    }

    /// Whether an instruction that writes these places can change it.
    pub fn is_changed_by(&self, written: &[TouchedPlace]) -> bool {
        match self {
            RungCondition::Constant(_) => false,
            RungCondition::Bit { reads, .. } | RungCondition::Compare { reads, .. } => {
                reads.iter().any(|read| written.iter().any(|place| place.overlaps(read)))
            }
            RungCondition::Not(inner) => inner.is_changed_by(written),
            RungCondition::All(parts) | RungCondition::Any(parts) => {
                parts.iter().any(|part| part.is_changed_by(written))
            }
        }
    }

    /// How deep it nests.
    pub fn depth(&self) -> usize {
        match self {
            RungCondition::Constant(_)
            | RungCondition::Bit { .. }
            | RungCondition::Compare { .. } => 0,
            RungCondition::Not(inner) => inner.depth() + 1,
            RungCondition::All(parts) | RungCondition::Any(parts) => {
                parts.iter().map(RungCondition::depth).max().unwrap_or(0) + 1
            }
        }
    }

    /// The number of its contacts.
    pub fn size(&self) -> usize {
        match self {
            RungCondition::Constant(_)
            | RungCondition::Bit { .. }
            | RungCondition::Compare { .. } => 1,
            RungCondition::Not(inner) => inner.size(),
            RungCondition::All(parts) | RungCondition::Any(parts) => {
                parts.iter().map(RungCondition::size).sum()
            }
        }
    }

    /// Its contacts as the elements of `when`; never empty.
    pub fn contacts(&self) -> Vec<String> {
        match self {
            RungCondition::All(parts) => parts.iter().map(RungCondition::text).collect(),
            RungCondition::Constant(_)
            | RungCondition::Bit { .. }
            | RungCondition::Compare { .. }
            | RungCondition::Not(_)
            | RungCondition::Any(_) => vec![self.text()],
        }
    }

    /// It as one contact string.
    pub fn text(&self) -> String {
        match self {
            RungCondition::Constant(true) => "$On".to_owned(),
            RungCondition::Constant(false) => "$Off".to_owned(),
            RungCondition::Bit { text, .. } | RungCondition::Compare { text, .. } => text.clone(),
            RungCondition::Not(inner) => format!("!{}", inner.operand()),
            RungCondition::All(parts) => joined(parts, " & "),
            RungCondition::Any(parts) => joined(parts, " | "),
        }
    }

    /// It beside an operator: in parentheses, if it needs them.
    fn operand(&self) -> String {
        match self {
            RungCondition::All(_) | RungCondition::Any(_) | RungCondition::Compare { .. } => {
                format!("({})", self.text())
            }
            RungCondition::Constant(_) | RungCondition::Bit { .. } | RungCondition::Not(_) => {
                self.text()
            }
        }
    }
}

fn joined(parts: &[RungCondition], operator: &str) -> String {
    let texts = parts.iter().map(|part| match part {
        RungCondition::Compare { text, .. } => text.clone(),
        RungCondition::Constant(_)
        | RungCondition::Bit { .. }
        | RungCondition::Not(_)
        | RungCondition::All(_)
        | RungCondition::Any(_) => part.operand(),
    });
    texts.collect::<Vec<_>>().join(operator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_overlaps_its_parts_and_nothing_else() {
        let overlaps =
            |one: &str, other: &str| TouchedPlace::of(one).overlaps(&TouchedPlace::of(other));
        assert!(overlaps("status", "status.3"));
        assert!(overlaps("recipe[2].target", "recipe[i + a[3]].target"));
        assert!(overlaps("motor", "motor"));
        assert!(!overlaps("motor", "motor2"));
        assert!(!overlaps("t.acc", "t.pre"));
    }

    #[test]
    fn a_condition_is_written_as_contacts() {
        let bit = RungCondition::bit;
        let both = RungCondition::all([bit("a"), bit("b").opposite()]);
        let either = RungCondition::any([both, bit("c")]);
        let all = RungCondition::all([bit("d"), either.clone(), RungCondition::Constant(true)]);
        assert_eq!(all.contacts(), ["d", "(a & !b) | c"]);
        assert_eq!(all.text(), "d & ((a & !b) | c)");
        assert_eq!(either.opposite().text(), "!((a & !b) | c)");
        let compare = RungCondition::compare("x", "<", "3", vec![]);
        assert_eq!(compare.opposite().text(), "x >= 3");
        assert_eq!(RungCondition::all([]).text(), "$On");
    }
}
