//! The offset of local time from UTC: updated by a thread that may read files, read by the scan
//! thread without waiting.
//!
//! One atomic word holds the offset, and its next change (summer time) if that change is near. So
//! the change comes at the right second, regardless of the time of the next update.

use std::sync::atomic::{AtomicU64, Ordering};

/// Offsets are signed and below 1.6 days, as those of every time zone.
const OFFSET_BITS: u32 = 18;
const OFFSET_MAX: i32 = (1 << (OFFSET_BITS - 1)) - 1;
/// The time of the change, modulo 8 years; the change is at most an hour away.
const CHANGE_BITS: u32 = 64 - 2 * OFFSET_BITS;

/// Local time less UTC, in seconds; 0 at first.
#[derive(Debug, Default)]
pub struct UtcOffset(AtomicU64);

/// A change of the offset.
#[derive(Clone, Copy, Debug)]
pub struct OffsetChange {
    /// Its time, in seconds since 1970 (UTC).
    pub at_s: i64,
    /// The offset from that time on, in seconds.
    pub offset_s: i32,
}

impl UtcOffset {
    /// Sets the offset, and its next change if that change is near.
    pub fn set(&self, offset_s: i32, change: Option<OffsetChange>) {
        let change = change.unwrap_or(OffsetChange { at_s: 0, offset_s });
        let packed = |offset_s: i32| {
            let offset_s = i64::from(offset_s.clamp(-OFFSET_MAX, OFFSET_MAX));
            offset_s as u64 & ((1 << OFFSET_BITS) - 1)
        };
        let time = change.at_s as u64 & ((1 << CHANGE_BITS) - 1);
        let after = packed(change.offset_s);
        let word = time << (2 * OFFSET_BITS) | after << OFFSET_BITS | packed(offset_s);
        self.0.store(word, Ordering::Relaxed);
    }

    /// The local time at a time of the wall clock, both in seconds since 1970.
    pub fn local_s(&self, wall_s: i64) -> i64 {
        let word = self.0.load(Ordering::Relaxed);
        let offset = |shift: u32| (word << (64 - OFFSET_BITS - shift)) as i64 >> (64 - OFFSET_BITS);
        // The sign of the time since the change, modulo 8 years.
        let since = (wall_s as u64).wrapping_sub(word >> (2 * OFFSET_BITS));
        let changed = ((since << (2 * OFFSET_BITS)) as i64) >= 0;
        wall_s.saturating_add(offset(if changed { OFFSET_BITS } else { 0 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_utc_offset_is_initially_zero() {
        assert_eq!(UtcOffset::default().local_s(1_795_000_000), 1_795_000_000);
    }

    #[test]
    fn the_utc_offset_is_added_at_any_time() {
        let offset = UtcOffset::default();
        for by in [0, 20_700, -43_200, 93_599, -89_999, 1, -1] {
            offset.set(by, None);
            for wall_s in [-1, 0, 1, 1 << 27, 1 << 28, 1_795_000_000, i64::from(u32::MAX) + 5] {
                assert_eq!(offset.local_s(wall_s), wall_s + i64::from(by), "{by} at {wall_s}");
            }
        }
    }

    #[test]
    fn an_offset_change_takes_effect_at_its_second() {
        let offset = UtcOffset::default();
        for change_s in [1_774_746_000, 1_792_890_000, (7 << 28) + 2, (7 << 28) - 2, 0] {
            offset.set(3600, Some(OffsetChange { at_s: change_s, offset_s: 7200 }));
            for s in 1..=3600 {
                assert_eq!(offset.local_s(change_s - s), change_s - s + 3600);
                assert_eq!(offset.local_s(change_s + s - 1), change_s + s - 1 + 7200);
            }
            offset.set(-3600, Some(OffsetChange { at_s: change_s, offset_s: -7200 }));
            assert_eq!(offset.local_s(change_s - 1), change_s - 1 - 3600);
            assert_eq!(offset.local_s(change_s), change_s - 7200);
        }
    }
}
