//! The powers of an instruction's legs, by the legs' names.
//!
//! `mod` collects them for `instructions` and `arrays`.

pub use rungd_engine::isa::LegName;
use rungd_engine::ops::LegPowers;

/// The powers of an instruction's legs.
#[derive(Clone, Copy)]
pub(super) struct Legs<'a>(pub &'a [(LegName, LegPowers)]);

impl Legs<'_> {
    pub fn leg(self, name: LegName) -> LegPowers {
        let leg = self.0.iter().find(|(n, _)| *n == name);
        leg.expect("the resolver gives every leg").1
    }

    pub fn when(self) -> LegPowers {
        self.leg(LegName::When)
    }
}
