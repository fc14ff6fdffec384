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
