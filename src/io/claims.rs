//! Which driver moves which input: never two the same.
//!
//! Two writers of one X would each undo the other's value, now and then, unseen. The controller
//! file's cross-check calls [`clashes`] and makes a finding of each.

use std::collections::BTreeMap;

use super::modbus::Image;
use super::simulated::Rule;

/// Who moves an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claimant {
    /// A rule of the simulated device, by its position.
    Rule(usize),
    /// A client of the Modbus server, through its image.
    ModbusImage,
}

/// An input that two move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clash {
    /// Which X.
    pub input: u32,
    /// Who came first: rules in file order, then the image.
    pub first: Claimant,
    /// Who came second.
    pub second: Claimant,
}

/// Every input that is claimed more than once, in order of the later claim.
pub fn clashes(rules: &[Rule], image: &Image) -> Vec<Clash> {
    let of_rules = rules.iter().enumerate().map(|(at, rule)| (rule.input, Claimant::Rule(at)));
    let of_image = image.inputs.into_iter().flat_map(|run| run.to..run.to + run.count);
    let of_image = of_image.map(|x| (x, Claimant::ModbusImage));
    let mut claimed = BTreeMap::new();
    let clash = |(input, second)| {
        let first = *claimed.entry(input).or_insert(second);
        (first != second).then_some(Clash { input, first, second })
    };
    of_rules.chain(of_image).filter_map(clash).collect()
}

#[cfg(test)]
mod tests {
    use super::super::modbus::Run;
    use super::super::simulated::Motion;
    use super::Claimant::{ModbusImage, Rule as OfRule};
    use super::*;

    fn check(inputs: &[u32], image: Option<Run>, expected: &[(u32, Claimant, Claimant)]) {
        let motion = Motion::Pulse { pulse_ms: 1, every_ms: 2, offset_ms: 0 };
        let rule = |&input| Rule { input, motion, only_while: None, invert: false };
        let rules: Vec<Rule> = inputs.iter().map(rule).collect();
        let found = clashes(&rules, &Image { inputs: image, outputs: None });
        let found: Vec<_> = found.iter().map(|c| (c.input, c.first, c.second)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn an_input_has_one_mover() {
        check(&[0, 1, 2], Some(Run { from: 1, to: 3, count: 8 }), &[]);
        check(&[4, 1, 4, 4], None, &[(4, OfRule(0), OfRule(2)), (4, OfRule(0), OfRule(3))]);
        let image = Some(Run { from: 1, to: 3, count: 2 });
        check(&[2, 4, 5], image, &[(4, OfRule(1), ModbusImage)]);
    }
}
