//! The numbers of an instruction, and the neighbours that an author might have written by mistake.

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{OperandKind, Real, duration};
pub use rungd_language::resolve::program::{ConstantForm, Value};

/// The steps from a constant to its neighbours, and the range of the neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConstantStep {
    /// The step, or the least one of [`NeighbourDistance::Tenth`]; for a number of ms, the scan
    /// period.
    pub step: i32,
    /// The distance of the neighbours.
    distance: NeighbourDistance,
    /// Whether 0 is a third neighbour.
    to_zero: bool,
    /// The minimum constant at this place.
    pub least: i32,
    /// The maximum constant at this place.
    pub most: i32,
    /// Whether it is a number of ms.
    pub is_time: bool,
}

/// The distance of a constant to its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NeighbourDistance {
    /// A step.
    Step,
    /// A tenth of the constant in whole steps, at least one. A test that waits for a time seldom
    /// knows it to the scan.
    Tenth,
}

impl ConstantStep {
    /// The step for a count.
    pub fn count(least: i32, most: i32) -> ConstantStep {
        let distance = NeighbourDistance::Step;
        ConstantStep { step: 1, distance, to_zero: false, least, most, is_time: false }
    }

    /// The step for a duration.
    pub fn time(period: ScanPeriod, least: i32) -> ConstantStep {
        let step = i32::try_from(period.ms_up()).unwrap_or(i32::MAX);
        let distance = NeighbourDistance::Tenth;
        ConstantStep { step, distance, to_zero: false, least, most: i32::MAX, is_time: true }
    }

    /// The step for the preset of a timer or counter.
    pub fn of_preset(self) -> ConstantStep {
        ConstantStep { distance: NeighbourDistance::Tenth, to_zero: true, ..self }
    }

    /// The distance of a constant to its neighbours.
    pub fn distance(self, n: i32) -> i32 {
        match self.distance {
            NeighbourDistance::Step => self.step,
            NeighbourDistance::Tenth => {
                let tenth = i32::try_from(n.unsigned_abs() / 10).unwrap_or(i32::MAX);
                (tenth - tenth % self.step).max(self.step)
            }
        }
    }

    /// Whether no value that is stored at this place lies between a constant and its neighbours.
    pub fn is_next(self, n: i32) -> bool {
        n % self.step == 0 && self.distance(n) == self.step
    }

    /// The step for a number among the operands of an instruction. `to_bits`: FILL writes bits.
    pub fn of(
        kind: OperandKind,
        written: Option<ConstantForm>,
        period: ScanPeriod,
        to_bits: bool,
    ) -> ConstantStep {
        if let OperandKind::Value(least, most) = kind {
            return ConstantStep::count(least, most);
        }
        if to_bits && kind == OperandKind::Filling {
            return ConstantStep::count(0, 1);
        }
        if kind == OperandKind::Interval {
            // 0 and less mean every scan, as does every interval up to the period.
            return ConstantStep::time(period, 1);
        }
        match kind == OperandKind::Duration || written == Some(ConstantForm::Duration) {
            true => ConstantStep::time(period, 0),
            false => ConstantStep::count(i32::MIN, i32::MAX),
        }
    }

    /// The neighbours of a constant: the greater one, then the smaller one, then 0.
    pub fn neighbours(self, value: Value) -> Vec<(Direction, Value)> {
        match value {
            Value::Const(n, written) => {
                let by = self.distance(n);
                let is_new = self.to_zero && n != 0 && n.unsigned_abs() != by.unsigned_abs();
                let all = [
                    (Direction::More, n.checked_add(by)),
                    (Direction::Less, n.checked_sub(by)),
                    (Direction::Zero, is_new.then_some(0)),
                ];
                let fits = |n: &i32| (self.least..=self.most).contains(n);
                let all = all.into_iter().filter_map(|(to, n)| Some((to, n.filter(fits)?)));
                all.map(|(to, n)| (to, Value::Const(n, written))).collect()
            }
            Value::Real(real) => {
                near(real).into_iter().map(|(to, real)| (to, Value::Real(real))).collect()
            }
            Value::Word(_) | Value::Element(_) => Vec::new(),
        }
    }

    /// A constant as a text.
    pub fn text(self, value: Value) -> String {
        match value {
            Value::Const(n, _) if self.is_time && n >= 0 => duration::print(n),
            Value::Const(n, _) => n.to_string(),
            Value::Real(real) => real.to_string(),
            Value::Word(word) => word.to_string(),
            Value::Element(element) => element.to_string(),
        }
    }
}

/// Where the neighbour of a constant lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Direction {
    /// The neighbour is greater.
    More,
    /// The neighbour is smaller.
    Less,
    /// The neighbour is 0.
    Zero,
}

/// The neighbours of a real: they differ by 1 % of it; for 0, they differ by 1.
pub(super) fn near(real: Real) -> Vec<(Direction, Real)> {
    let number = f64::from(real);
    let step = if number == 0.0 { 1.0 } else { number.abs() / 100.0 };
    let both = [(Direction::More, number + step), (Direction::Less, number - step)];
    let both = both.into_iter().map(|(to, number)| (to, Real::stored(number).real));
    both.filter(|(_, near)| *near != real).collect()
}
