//! Rules and their state: one step of the device.
//!
//! A rule moves one input: it pulses, or follows a bit with delays; only while another bit is ON;
//! upside down if so wished. That no two rules move one input, and that their times make sense,
//! was seen to when the controller file was resolved. No clock: pulses are reckoned from the time
//! given, so a step that comes late shifts nothing that follows.

use super::follower::Follower;
use crate::io::simulated::settings::{Motion, Rule};
use crate::isa::Bit;

/// All rules with their state.
#[derive(Clone, Debug)]
pub struct Device {
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    rule: Rule,
    /// Since when the rule moves; nothing while it rests.
    started_ms: Option<u64>,
    follower: Follower,
    /// The input as given last; nothing before the first step.
    given: Option<bool>,
}

impl Device {
    /// A device at rest.
    pub fn new(rules: &[Rule]) -> Device {
        let part = |rule: &Rule| Part {
            rule: rule.clone(),
            started_ms: None,
            follower: Follower::default(),
            given: None,
        };
        Device { parts: rules.iter().map(part).collect() }
    }

    /// A device with these rules: one that is as it was goes on where it is.
    pub fn going_on(&self, rules: &[Rule]) -> Device {
        let mut device = Device::new(rules);
        for part in &mut device.parts {
            let known = |before: &&Part| {
                let (a, b) = (&before.rule, &part.rule);
                (a.input, a.motion, a.while_on, a.invert)
                    == (b.input, b.motion, b.while_on, b.invert)
            };
            if let Some(before) = self.parts.iter().find(known) {
                *part = before.clone();
            }
        }
        device
    }

    /// The inputs that change at this time, which never goes back; at the first step every
    /// input of a rule.
    pub fn step(&mut self, now_ms: u64, read: impl Fn(Bit) -> bool) -> Vec<(u32, bool)> {
        let changes = self.parts.iter_mut().filter_map(|part| {
            let on = part.step(now_ms, &read);
            let changed = part.given.replace(on) != Some(on);
            changed.then_some((part.rule.input, on))
        });
        changes.collect()
    }
}

impl Part {
    fn step(&mut self, now_ms: u64, read: &impl Fn(Bit) -> bool) -> bool {
        if !self.rule.while_on.is_none_or(read) {
            self.started_ms = None;
            self.follower = Follower::default();
            return self.rule.invert;
        }
        let started_ms = *self.started_ms.get_or_insert(now_ms);
        let on = match self.rule.motion {
            Motion::Pulse { width_ms, every_ms, offset_ms } => {
                let since_first = (now_ms - started_ms).checked_sub(offset_ms.into());
                since_first.is_some_and(|ms| ms % u64::from(every_ms.max(1)) < width_ms.into())
            }
            Motion::Follow { bit, after_ms, release_ms } => {
                self.follower.step(now_ms, read(bit), after_ms, release_ms)
            }
        };
        on != self.rule.invert
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::BitSpace;
    use crate::source::span::Span;
    use proptest::prelude::*;

    const MOTOR: Bit = Bit::Space(BitSpace::Y, 1);
    const ENABLE: Bit = Bit::Space(BitSpace::C, 7);

    fn pulse(width_ms: u32, every_ms: u32, offset_ms: u32) -> Rule {
        let motion = Motion::Pulse { width_ms, every_ms, offset_ms };
        Rule { input: 0, motion, while_on: None, invert: false, span: Span::default() }
    }

    fn follow(after_ms: u32, release_ms: u32) -> Rule {
        let motion = Motion::Follow { bit: MOTOR, after_ms, release_ms };
        Rule { input: 0, motion, while_on: None, invert: false, span: Span::default() }
    }

    /// One step a millisecond from 0; a bit is ON where its line has a `#`. The input's line.
    fn line(rule: Rule, motor: &str, enable: &str) -> String {
        let mut device = Device::new(&[rule]);
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
        let mut device = Device::new(&[pulse(100, 1000, 0)]);
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
        let mut device = Device::new(&rules);
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
            let mut device = Device::new(&[pulse, follow(after_ms, release_ms)]);
            for (now_ms, bit) in nows.into_iter().zip(bits) {
                device.step(now_ms, |_| bit);
            }
        }
    }
}
