//! All combinations of values of the inputs.

use crate::model::FreeInput;

/// The combinations of values, numbered from 0: the first input changes fastest.
#[derive(Debug)]
pub(super) struct Combinations {
    inputs: Vec<FreeInput>,
    /// Their number.
    pub count: u32,
}

impl Combinations {
    /// Those of some inputs; `None` if there are more than `most`.
    pub fn of(inputs: &[FreeInput], most: u32) -> Option<Combinations> {
        let mut count: u32 = 1;
        for input in inputs {
            let values = i64::from(input.high) - i64::from(input.low) + 1;
            count = count.checked_mul(u32::try_from(values).ok()?)?;
        }
        (count <= most).then(|| Combinations { inputs: inputs.to_vec(), count })
    }

    /// Puts the values of a combination in `values`.
    pub fn put(&self, mut number: u32, values: &mut Vec<i32>) {
        values.clear();
        for input in &self.inputs {
            let count = input.high.wrapping_sub(input.low).cast_unsigned().wrapping_add(1);
            values.push(input.low.wrapping_add((number % count).cast_signed()));
            number /= count;
        }
    }
}
