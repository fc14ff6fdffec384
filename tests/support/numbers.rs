//! A generator of numbers. A test adds the things that it draws from them.

/// The same seed gives the same numbers.
pub struct Numbers(pub u64);

impl Numbers {
    /// The next number below this limit.
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        (self.0 >> 33) % limit
    }
}
