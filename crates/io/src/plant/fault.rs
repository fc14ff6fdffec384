//! Faults on demand: they falsify the value of a point.
//!
//! Each fault has a point that turns it on; while that point is OFF, the fault changes nothing.
//! Noise is computed from a seed: the same times give the same noise.

use std::collections::VecDeque;

use super::settings::{FaultEffect, FaultSettings, PointId};
use rungd_base::random::SplitMix64;

/// The point that a fault falsifies: a command before the parts move, or a report after they have
/// moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Falsifies {
    /// A point that drives a part.
    Command,
    /// A point with which a part reports.
    Report,
}

/// A fault with its state.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub falsifies: Falsifies,
    when: usize,
    point: usize,
    effect: FaultEffect,
    /// The time at which it was turned on; `None` while it is off.
    since_ms: Option<u64>,
    /// The value of a stuck point; the deviation of a noisy point.
    held: i32,
    random: SplitMix64,
    /// The last values of a late point; the oldest first.
    past: VecDeque<i32>,
}

impl Fault {
    /// A fault that is off; `None` for an effect that falsifies no point.
    pub fn new(
        settings: &FaultSettings,
        seed: u64,
        is_command: impl Fn(PointId) -> bool,
    ) -> Option<Fault> {
        let point = match settings.effect {
            FaultEffect::Fixed { point, .. }
            | FaultEffect::Stuck { point }
            | FaultEffect::Bouncing { point, .. }
            | FaultEffect::Noisy { point, .. }
            | FaultEffect::Late { point, .. } => point,
            FaultEffect::Lost => return None,
        };
        Some(Fault {
            falsifies: match is_command(point) {
                true => Falsifies::Command,
                false => Falsifies::Report,
            },
            when: settings.when.0 as usize,
            point: point.0 as usize,
            effect: settings.effect,
            since_ms: None,
            held: 0,
            random: SplitMix64(seed),
            past: VecDeque::new(),
        })
    }

    /// Whether it acts in a tick. It does while it is on; a fault that delays always acts.
    pub fn acts(&self, values: &[i32]) -> bool {
        values[self.when] != 0 || matches!(self.effect, FaultEffect::Late { .. })
    }

    /// Falsifies its point in this tick.
    pub fn tick(&mut self, now_ms: u64, values: &mut [i32], before: &[i32]) {
        let mut value = values[self.point];
        if let FaultEffect::Late { by_ms, .. } = self.effect {
            value = self.late(value, by_ms);
        }
        if values[self.when] == 0 {
            self.since_ms = None;
            return;
        }
        let is_new = self.since_ms.is_none();
        let since_ms = *self.since_ms.get_or_insert(now_ms);
        let is_due = |every_ms: u32| (now_ms - since_ms).is_multiple_of(every_ms.max(1).into());
        match self.effect {
            FaultEffect::Fixed { value: fixed, .. } => value = fixed,
            FaultEffect::Stuck { .. } => {
                if is_new {
                    self.held = before[self.point];
                }
                value = self.held;
            }
            FaultEffect::Bouncing { every_ms, .. } => {
                if is_due(every_ms) {
                    self.held = (self.random.next() >> 63) as i32;
                }
                value = self.held;
            }
            FaultEffect::Noisy { every_ms, amplitude, .. } => {
                if is_due(every_ms) {
                    let span = 2 * u64::from(amplitude) + 1;
                    let off = (self.random.next() % span) as i64 - i64::from(amplitude);
                    self.held = off as i32;
                }
                value = value.saturating_add(self.held);
            }
            FaultEffect::Late { .. } | FaultEffect::Lost => {}
        }
        values[self.point] = value;
    }

    /// Stores a value, and returns the value of `by_ms` ago. During the first `by_ms`, returns the
    /// first value.
    fn late(&mut self, value: i32, by_ms: u32) -> i32 {
        if self.past.is_empty() {
            self.past.extend(std::iter::repeat_n(value, by_ms as usize));
        }
        self.past.push_back(value);
        self.past.pop_front().unwrap_or(value)
    }
}
