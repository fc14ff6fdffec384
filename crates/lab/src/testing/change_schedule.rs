//! When the changes of a random run happen: for each change, the scan of its next occurrence.
//!
//! Whether a change happens in a scan is drawn independently of all other scans. So the number of
//! scans up to its next occurrence has a geometric distribution, and one number is drawn for each
//! occurrence instead of one for each scan. Called by `random_run`.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::suite::Chance;
use rungd_base::random::SplitMix64;

/// The next occurrence of each change.
pub(super) struct ChangeSchedule {
    /// The scan and the index of each change; the earliest comes first, in a scan the lowest index.
    next: BinaryHeap<Reverse<(u64, usize)>>,
    /// For each change, the logarithm of the probability that it does not happen in a scan.
    stays: Vec<f64>,
}

impl ChangeSchedule {
    /// The first occurrences, from scan 0 on.
    pub fn new(chances: impl Iterator<Item = Chance>, random: &mut SplitMix64) -> ChangeSchedule {
        let stays: Vec<f64> =
            chances.map(|Chance(millionths)| libm::log1p(-f64::from(millionths) / 1e6)).collect();
        let mut schedule = ChangeSchedule { next: BinaryHeap::new(), stays };
        for change in 0..schedule.stays.len() {
            schedule.draw(change, 0, random);
        }
        schedule
    }

    /// The next change that happens in this scan, and later ones after it; `None`: no more. Scans
    /// are asked for in ascending order.
    pub fn due(&mut self, scan: u64, random: &mut SplitMix64) -> Option<usize> {
        let Reverse((at, change)) = *self.next.peek()?;
        if at != scan {
            return None;
        }
        self.next.pop();
        self.draw(change, scan + 1, random);
        Some(change)
    }

    /// Draws the next occurrence of a change, in scan `from` at the earliest.
    fn draw(&mut self, change: usize, from: u64, random: &mut SplitMix64) {
        // Above 0, and up to 1.
        let uniform = ((random.next() >> 11) + 1) as f64 / (1_u64 << 53) as f64;
        // A change that happens in every scan has the logarithm of 0, and a gap of 0.
        let gap = libm::floor(libm::log(uniform) / self.stays[change]);
        self.next.push(Reverse((from.saturating_add(gap as u64), change)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scans in which a change of this chance happens.
    fn occurrences(chance: u32, scans: u64) -> Vec<u64> {
        let mut random = SplitMix64(7);
        let mut schedule = ChangeSchedule::new([Chance(chance)].into_iter(), &mut random);
        (0..scans).filter(|scan| schedule.due(*scan, &mut random).is_some()).collect()
    }

    #[test]
    fn a_change_happens_as_often_as_its_chance_says() {
        for chance in [100, 1_000, 10_000, 250_000, 500_000, 900_000, 999_999] {
            let scans = 2_000_000;
            let probability = f64::from(chance) / 1e6;
            let expected = scans as f64 * probability;
            let deviation = (expected * (1.0 - probability)).sqrt();
            let count = occurrences(chance, scans).len() as f64;
            assert!((count - expected).abs() <= 5.0 * deviation + 1.0, "{chance}: {count}");
        }
    }

    #[test]
    fn the_distances_between_changes_have_a_geometric_distribution() {
        let scans = 1_000_000;
        let all = occurrences(300_000, scans);
        let distances: Vec<u64> = all.windows(2).map(|two| two[1] - two[0]).collect();
        for distance in 1..12_u64 {
            let count = distances.iter().filter(|d| **d == distance).count() as f64;
            let probability = 0.3 * 0.7_f64.powi(distance as i32 - 1);
            let expected = distances.len() as f64 * probability;
            let deviation = (expected * (1.0 - probability)).sqrt();
            assert!((count - expected).abs() <= 5.0 * deviation, "{distance}: {count}");
        }
    }

    #[test]
    fn a_certain_change_happens_in_every_scan_and_changes_of_a_scan_keep_their_order() {
        assert_eq!(occurrences(1_000_000, 1_000).len(), 1_000);
        let mut random = SplitMix64(1);
        let chances = [Chance(1_000_000), Chance(500_000), Chance(1_000_000)];
        let mut schedule = ChangeSchedule::new(chances.into_iter(), &mut random);
        for scan in 0..1_000 {
            let mut changes = Vec::new();
            while let Some(change) = schedule.due(scan, &mut random) {
                changes.push(change);
            }
            assert!(changes == [0, 2] || changes == [0, 1, 2], "{changes:?}");
        }
    }
}
