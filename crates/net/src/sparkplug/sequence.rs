//! The numbers of messages: 0 to 255, then 0 again.

/// A counter of messages: `seq` since a birth, or `bdSeq` of births.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence(u8);

impl Sequence {
    /// Reads the number of a message; `None`: it is above 255.
    pub fn of(number: u64) -> Option<Sequence> {
        u8::try_from(number).ok().map(Sequence)
    }

    /// The number, for a message.
    pub fn number(self) -> u64 {
        self.0.into()
    }

    /// The next number.
    #[must_use]
    pub fn next(self) -> Sequence {
        Sequence(self.0.wrapping_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_number_wraps_from_255_to_0() {
        assert_eq!(Sequence::of(255).map(|last| last.next().number()), Some(0));
        assert_eq!(Sequence::default().next().number(), 1);
        assert_eq!(Sequence::of(256), None);
    }
}
