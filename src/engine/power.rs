//! Powers: bits that are read as they are or as their opposites, one by one or ANDed.
//!
//! A leaf. `lower` makes them of contacts; operations read their legs by them.

/// A bit to be read as it is or as its opposite: twice the cell, plus 1 for the opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Power(pub u32);

impl Power {
    /// The bit as it is.
    pub fn of(cell: u32) -> Power {
        Power(cell << 1)
    }

    /// Its opposite.
    pub fn opposite(self) -> Power {
        Power(self.0 ^ 1)
    }

    /// The cell it reads.
    pub fn cell(self) -> u32 {
        self.0 >> 1
    }

    /// Whether it reads the opposite.
    pub fn is_opposite(self) -> bool {
        self.0 & 1 == 1
    }
}

/// What an instruction reads of a leg: two powers, both ON where the leg is; of a leg that comes
/// down to one power, that one twice. So the last AND of a leg is no operation of its own.
pub type Leg = Powers<2>;

impl Leg {
    /// The leg that is just this power.
    pub fn of(power: Power) -> Leg {
        Powers::new([power, power])
    }
}

/// Powers to be ANDed, as a loop reads them: cells, and apart from them which are opposites.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Powers<const N: usize> {
    pub(super) cells: [u32; N],
    /// 1 where the opposite is meant.
    pub(super) opposites: [u8; N],
}

impl<const N: usize> Powers<N> {
    /// These powers.
    pub fn new(powers: [Power; N]) -> Powers<N> {
        Powers {
            cells: powers.map(Power::cell),
            opposites: powers.map(|p| u8::from(p.is_opposite())),
        }
    }

    /// Each of them.
    pub fn each(self) -> [Power; N] {
        std::array::from_fn(|at| Power(self.cells[at] << 1 | u32::from(self.opposites[at])))
    }
}
