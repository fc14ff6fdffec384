//! The rules of `[[simulated-device]]`: parts of a plant, each between a bit and an input.
//!
//! A pulse is a part of kind `pulse`; a rule that follows a bit is a part of kind `delay`. A rule
//! has no points: it reads the bits that drive it from an image, and its part's output is an input
//! of the controller. A step ticks each part once, at the given time, so a late step does not shift
//! later steps. A part is at rest while the rule's `while` bit is OFF. A rule can invert its input.
//! Rules have no clock.
//!
//! `controller` has made sure that no two rules move the same input, and that their times are
//! valid.

use super::part::PartState;
use super::settings::{Delays, Motion, PartSettings, Rule};
use rungd_engine::isa::Bit;

/// All rules with their state.
#[derive(Clone, Debug)]
pub struct RuleSet {
    moved: Vec<Moved>,
}

/// An input, and the part that moves it.
#[derive(Clone, Debug)]
struct Moved {
    rule: Rule,
    part: PartState,
    /// The input's value in the last step; `None` before the first step.
    given: Option<bool>,
}

impl RuleSet {
    /// A device at rest.
    pub fn new(rules: &[Rule]) -> RuleSet {
        let moved =
            |rule: &Rule| Moved { rule: rule.clone(), part: at_rest(rule.motion), given: None };
        RuleSet { moved: rules.iter().map(moved).collect() }
    }

    /// A device with these rules. A rule that has not changed continues from its present state.
    pub fn going_on(&self, rules: &[Rule]) -> RuleSet {
        let mut device = RuleSet::new(rules);
        for moved in &mut device.moved {
            let known = |before: &&Moved| {
                let (a, b) = (&before.rule, &moved.rule);
                (a.input, a.motion, a.while_on, a.invert)
                    == (b.input, b.motion, b.while_on, b.invert)
            };
            if let Some(before) = self.moved.iter().find(known) {
                *moved = before.clone();
            }
        }
        device
    }

    /// The inputs that change at this time; at the first step, the inputs of all rules. The time
    /// never goes back.
    pub fn step(&mut self, now_ms: u64, read: impl Fn(Bit) -> bool) -> Vec<(u32, bool)> {
        let changes = self.moved.iter_mut().filter_map(|moved| {
            let on = moved.step(now_ms, &read);
            let changed = moved.given.replace(on) != Some(on);
            changed.then_some((moved.rule.input, on))
        });
        changes.collect()
    }
}

fn at_rest(motion: Motion) -> PartState {
    PartState::new(&match motion {
        Motion::Pulse { width_ms, every_ms, offset_ms } => {
            PartSettings::Pulse { width_ms, every_ms, offset_ms }
        }
        Motion::Follow { after_ms, release_ms, .. } => {
            PartSettings::Delay { delays: Delays { after_ms, release_ms }, invert: false }
        }
    })
}

impl Moved {
    fn step(&mut self, now_ms: u64, read: &impl Fn(Bit) -> bool) -> bool {
        let Rule { motion, while_on, invert, .. } = self.rule;
        if !while_on.is_none_or(read) {
            self.part = at_rest(motion);
            return invert;
        }
        let driven = match motion {
            Motion::Pulse { .. } => true,
            Motion::Follow { bit, .. } => read(bit),
        };
        let mut points = [driven.into(), 0];
        self.part.tick(now_ms, &mut points);
        (points[1] != 0) != invert
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rungd_engine::isa::BitSpace;
    use rungd_language::source::span::Span;

    const MOTOR: Bit = Bit::Space(BitSpace::Y, 1);
    const ENABLE: Bit = Bit::Space(BitSpace::C, 7);

    fn pulse(width_ms: u32, every_ms: u32, offset_ms: u32) -> Rule {
        let motion = Motion::Pulse { width_ms, every_ms, offset_ms };
        let [span, follows_at, while_at] = [Span::default(); 3];
        Rule { input: 0, motion, while_on: None, invert: false, span, follows_at, while_at }
    }

    fn follow(after_ms: u32, release_ms: u32) -> Rule {
        let motion = Motion::Follow { bit: MOTOR, after_ms, release_ms };
        let [span, follows_at, while_at] = [Span::default(); 3];
        Rule { input: 0, motion, while_on: None, invert: false, span, follows_at, while_at }
    }

    /// Steps a rule once per millisecond from 0, and returns its input's values as a line. `#` is
    /// ON, in the bits' lines too.
    fn line(rule: Rule, motor: &str, enable: &str) -> String {
        let mut device = RuleSet::new(&[rule]);
        let mut input = None;
        let steps = motor.len().max(enable.len());
        let at = |line: &str, ms: usize| line.as_bytes().get(ms) == Some(&b'#');
        let sample = |ms: usize| {
            let read = |source| at(if source == MOTOR { motor } else { enable }, ms);
            for (x, on) in device.step(ms as u64, read) {
                assert_eq!(x, 0);
                assert_ne!(input.replace(on), Some(on), "a change that is none");
            }
            if input == Some(true) { '#' } else { '.' }
        };
        (0..steps).map(sample).collect()
    }

    #[test]
    fn a_pulse_comes_every_so_often() {
        assert_eq!(line(pulse(2, 5, 0), "............", ""), "##...##...##");
        assert_eq!(line(pulse(2, 5, 3), "............", ""), "...##...##..");
        assert_eq!(line(pulse(5, 5, 0), "............", ""), "############");
        assert_eq!(line(pulse(0, 5, 0), "............", ""), "............");
    }

    #[test]
    fn while_cuts_a_pulse_and_restarts_its_phase() {
        let rule = Rule { while_on: Some(ENABLE), ..pulse(2, 5, 1) };
        let (enable, input) = ("..########.##.######", "...##...##..#..##...");
        assert_eq!(line(rule, "", enable), input);
    }

    #[test]
    fn a_follower_waits_both_ways() {
        let (motor, input) = (".#.##.#####...#....#.....", "........##########.......");
        assert_eq!(line(follow(2, 3), motor, ""), input);
    }

    #[test]
    fn invert_turns_rest_and_motion_round() {
        let rule = Rule { invert: true, ..follow(0, 0) };
        assert_eq!(line(rule, "..##..", ""), "##..##");
        let rule = Rule { invert: true, while_on: Some(ENABLE), ..pulse(1, 2, 0) };
        assert_eq!(line(rule, "", "..####.."), "##.#.###");
    }

    #[test]
    fn while_lets_a_follower_go_at_once_and_start_over() {
        let rule = Rule { while_on: Some(ENABLE), ..follow(2, 2) };
        let motor = "############";
        assert_eq!(line(rule, motor, "######.#####"), "..####...###");
    }

    #[test]
    fn a_late_step_does_not_shift_the_pulses() {
        let mut device = RuleSet::new(&[pulse(100, 1000, 0)]);
        let mut at = |ms| device.step(ms, |_| false);
        assert_eq!(at(50), [(0, true)], "the start is the first step");
        assert_eq!(at(7_200), [(0, false)]);
        assert_eq!(at(8_049), []);
        assert_eq!(at(8_050), [(0, true)]);
        assert_eq!(at(8_149), []);
        assert_eq!(at(8_150), [(0, false)]);
    }

    #[test]
    fn every_rule_has_its_input() {
        let rules = [Rule { input: 3, ..follow(0, 0) }, Rule { input: 9, ..pulse(1, 2, 1) }];
        let mut device = RuleSet::new(&rules);
        assert_eq!(device.step(0, |_| true), [(3, true), (9, false)]);
        assert_eq!(device.step(1, |_| true), [(9, true)]);
        assert_eq!(device.step(1, |_| true), []);
    }

    proptest! {
        #[test]
        fn no_rule_panics_at_any_time(
            times: [u32; 4],
            mut nows: Vec<u64>,
            bits: Vec<bool>,
            invert: bool,
        ) {
            let [width_ms, every_ms, after_ms, release_ms] = times;
            nows.sort_unstable();
            let pulse = pulse(width_ms, every_ms, after_ms);
            let pulse = Rule { invert, while_on: Some(ENABLE), ..pulse };
            let mut device = RuleSet::new(&[pulse, follow(after_ms, release_ms)]);
            for (now_ms, bit) in nows.into_iter().zip(bits) {
                device.step(now_ms, |_| bit);
            }
        }
    }
}
