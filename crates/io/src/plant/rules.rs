//! The rules of `[[simulated-device]]`: parts of a plant, each between some bits and an input.
//!
//! A rule has no plant around it: the commands of its part come from the bits of an image, and the
//! part's output is an input of the controller. A step ticks each part once, at the given time, so
//! a late step does not shift later steps. Rules have no clock.
//!
//! `controller` has made sure that no two rules move the same input, and that their times are
//! valid.

use super::part::PartState;
use super::settings::InputRule;
use rungd_engine::isa::Bit;

/// All rules with their state.
#[derive(Clone, Debug)]
pub struct RuleSet {
    moved: Vec<Moved>,
}

/// An input, and the part that moves it.
#[derive(Clone, Debug)]
struct Moved {
    rule: InputRule,
    part: PartState,
    /// The part's commands, and its output.
    points: Vec<i32>,
    /// The input's value in the last step; `None` before the first step.
    given: Option<bool>,
}

impl RuleSet {
    /// A device at rest.
    pub fn new(rules: &[InputRule]) -> RuleSet {
        let moved = |rule: &InputRule| Moved {
            rule: rule.clone(),
            part: PartState::new(&rule.part),
            points: vec![0; rule.commands.len() + 1],
            given: None,
        };
        RuleSet { moved: rules.iter().map(moved).collect() }
    }

    /// A device with these rules. A rule that has not changed continues from its present state.
    pub fn going_on(&self, rules: &[InputRule]) -> RuleSet {
        let mut device = RuleSet::new(rules);
        for moved in &mut device.moved {
            let known = |before: &&Moved| before.rule.is_like(&moved.rule);
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

impl Moved {
    fn step(&mut self, now_ms: u64, read: &impl Fn(Bit) -> bool) -> bool {
        for (point, command) in self.points.iter_mut().zip(&self.rule.commands) {
            *point = command.is_none_or(|command| read(command.bit)).into();
        }
        self.part.tick(now_ms, &mut self.points);
        self.points.last().is_some_and(|out| *out != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::settings::{Delays, PartSettings, RuleCommand};
    use proptest::prelude::*;
    use rungd_engine::isa::BitSpace;
    use rungd_language::source::span::Span;

    const MOTOR: Bit = Bit::Space(BitSpace::Y, 1);
    const ENABLE: Bit = Bit::Space(BitSpace::C, 7);

    fn command(bit: Bit) -> Option<RuleCommand> {
        Some(RuleCommand { bit, span: Span::default() })
    }

    fn pulse(width_ms: u32, every_ms: u32, offset_ms: u32) -> InputRule {
        let part = PartSettings::Pulse { width_ms, every_ms, offset_ms, invert: false };
        InputRule { input: 0, part, commands: vec![None], span: Span::default() }
    }

    fn follow(after_ms: u32, release_ms: u32) -> InputRule {
        let delays = Delays { after_ms, release_ms };
        let part = PartSettings::Delay { delays, invert: false };
        InputRule { input: 0, part, commands: vec![command(MOTOR), None], span: Span::default() }
    }

    /// The rule with its last command, that of `while`, driven by `ENABLE`.
    fn enabled(mut rule: InputRule) -> InputRule {
        rule.commands.pop();
        rule.commands.push(command(ENABLE));
        rule
    }

    fn inverted(mut rule: InputRule) -> InputRule {
        if let PartSettings::Pulse { invert, .. } | PartSettings::Delay { invert, .. } =
            &mut rule.part
        {
            *invert = true;
        }
        rule
    }

    /// Steps a rule once per millisecond from 0, and returns its input's values as a line. `#` is
    /// ON, in the bits' lines too.
    fn line(rule: InputRule, motor: &str, enable: &str) -> String {
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
    fn a_pulse_repeats_at_its_interval_and_offset() {
        assert_eq!(line(pulse(2, 5, 0), "............", ""), "##...##...##");
        assert_eq!(line(pulse(2, 5, 3), "............", ""), "...##...##..");
        assert_eq!(line(pulse(5, 5, 0), "............", ""), "############");
        assert_eq!(line(pulse(0, 5, 0), "............", ""), "............");
    }

    #[test]
    fn a_while_condition_cuts_a_pulse_and_restarts_its_phase() {
        let rule = enabled(pulse(2, 5, 1));
        let (enable, input) = ("..########.##.######", "...##...##..#..##...");
        assert_eq!(line(rule, "", enable), input);
    }

    #[test]
    fn a_follower_delays_both_edges() {
        let (motor, input) = (".#.##.#####...#....#.....", "........##########.......");
        assert_eq!(line(follow(2, 3), motor, ""), input);
    }

    #[test]
    fn invert_swaps_on_and_off() {
        let rule = inverted(follow(0, 0));
        assert_eq!(line(rule, "..##..", ""), "##..##");
        let rule = inverted(enabled(pulse(1, 2, 0)));
        assert_eq!(line(rule, "", "..####.."), "##.#.###");
    }

    #[test]
    fn a_while_condition_resets_a_follower_at_once() {
        let rule = enabled(follow(2, 2));
        let motor = "############";
        assert_eq!(line(rule, motor, "######.#####"), "..####...###");
    }

    #[test]
    fn a_late_step_does_not_shift_later_pulses() {
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
    fn every_rule_drives_only_its_own_input() {
        let rules =
            [InputRule { input: 3, ..follow(0, 0) }, InputRule { input: 9, ..pulse(1, 2, 1) }];
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
            let pulse = enabled(pulse(width_ms, every_ms, after_ms));
            let pulse = if invert { inverted(pulse) } else { pulse };
            let mut device = RuleSet::new(&[pulse, follow(after_ms, release_ms)]);
            for (now_ms, bit) in nows.into_iter().zip(bits) {
                device.step(now_ms, |_| bit);
            }
        }
    }
}
