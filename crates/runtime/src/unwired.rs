//! The latest values of X inputs, 64 at a time, as drivers without a wiring set them.
//!
//! A leaf module: the link reads them from the exchange, and the machine sets them in step 2.

/// Up to 64 inputs in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnwiredInputs {
    /// The number of the first one.
    pub first: u32,
    /// The values; the lowest bit is that of the first input.
    pub values: u64,
    /// 1 for each input that has its value from here; a field device sets the others.
    pub given: u64,
}

impl UnwiredInputs {
    /// The 64 inputs from `first` on, none of them given.
    pub fn from_first(first: u32) -> UnwiredInputs {
        UnwiredInputs { first, values: 0, given: 0 }
    }

    /// Gives an input, which is one of these 64, its value.
    pub fn give(&mut self, x: u32, on: bool) {
        let bit = 1 << (x - self.first);
        self.given |= bit;
        self.values = if on { self.values | bit } else { self.values & !bit };
    }

    /// Those of them that no field device writes. `moved`: the inputs that devices write, 64 to a
    /// word, from X0 on.
    pub fn not_moved(self, moved: &[u64]) -> UnwiredInputs {
        let by_devices = moved.get(self.first as usize / 64).copied().unwrap_or(0);
        UnwiredInputs { given: self.given & !by_devices, ..self }
    }

    /// Each given input: its number, and its value.
    pub fn each(self) -> impl Iterator<Item = (u32, bool)> {
        let mut left = self.given;
        std::iter::from_fn(move || {
            let at = left.trailing_zeros();
            // Clears the lowest bit; none is left at 0.
            left &= left.checked_sub(1)?;
            Some((self.first + at, self.values >> at & 1 != 0))
        })
    }
}
