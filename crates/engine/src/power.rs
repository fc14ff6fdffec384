//! Powers: bits read directly or as their opposites, one by one or ANDed.
//!
//! A leaf module. `lower` makes powers of contacts; operations read their legs as powers.

/// A bit to be read directly or as its opposite; encoded as twice the cell, plus 1 for the
/// opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Power(pub u32);

impl Power {
    /// The bit, read directly.
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

/// A leg as an instruction reads it: two powers, both ON when the leg is ON; a leg of one power has
/// this power twice. So the last AND of a leg needs no operation.
pub type LegPowers = Powers<2>;

impl LegPowers {
    /// The leg of one power.
    pub fn of(power: Power) -> LegPowers {
        Powers::new([power, power])
    }
}

/// Powers to be ANDed, as a loop reads them: the cells, and separately the opposites.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Powers<const N: usize> {
    pub(super) cells: [u32; N],
    /// 1 for a cell read as its opposite, else 0.
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

    /// All powers.
    pub fn each(self) -> [Power; N] {
        std::array::from_fn(|at| Power(self.cells[at] << 1 | u32::from(self.opposites[at])))
    }
}
