//! Numbers of random programs, for the generators and their tests.

use rungd_base::random::SplitMix64;

/// A number below a limit.
pub fn below(random: &mut SplitMix64, limit: u64) -> u64 {
    random.next() % limit
}
