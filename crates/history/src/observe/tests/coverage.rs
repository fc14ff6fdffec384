//! The walk as coverage uses it: the states of every contact, the powers of every leg.

use std::collections::BTreeMap;

use super::tape::tape;
use crate::observe::leaves::{legs, states};
use crate::observe::subject::Subject;
use crate::observe::walk::{WalkedProgram, Witness, walk};
use rungd_engine::{Engine, Image, ScanStep};
use rungd_runtime::TapeEntry;

/// For each part: whether every contact was OFF, and was ON; the same for the legs.
struct Coverage<'s> {
    subject: &'s Subject,
    contacts: BTreeMap<u32, Vec<[bool; 2]>>,
    legs: BTreeMap<u32, [bool; 2]>,
    instructions: u32,
}

impl Witness for Coverage<'_> {
    fn part(&mut self, part: u32, _: u32, image: &Image) {
        let on = states(self.subject, part, image);
        let seen = self.contacts.entry(part).or_insert_with(|| vec![[false; 2]; on.len()]);
        for (seen, on) in seen.iter_mut().zip(&on) {
            seen[usize::from(*on)] = true;
        }
        for leg in legs(self.subject, part).0 {
            let power = leg.logic.is_on(&|at| on[at]);
            self.legs.entry(part).or_default()[usize::from(power)] = true;
        }
    }

    fn after(&mut self, deed: ScanStep, _: u32, _: &Image) {
        let is_instruction = self.subject.site(deed).is_some_and(|site| site.instruction.is_some());
        self.instructions += u32::from(is_instruction);
    }
}

#[test]
fn coverage_lists_the_observed_states_of_contacts_and_legs() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["X0", "!X1 | X2"]
        do = ["OUT Y0"]
        [[program.rung]]
        when = ["Y0"]
        do = ["OUT Y1", "OUT Y2"]
        "#,
    );
    plc.scan(&[]);
    plc.scan(&[("X0", 1)]);
    plc.cut();
    let mut coverage = Coverage {
        subject: &plc.subject,
        contacts: BTreeMap::new(),
        legs: BTreeMap::new(),
        instructions: 0,
    };
    let outputs = ["Y0", "Y1", "Y2"].map(|name| plc.cell(name));
    let slice = plc.subject.seen.slice(&outputs);
    let mut engine = Engine::new(slice.program.clone());
    for entry in &plc.sections[0].entries {
        let TapeEntry::Call(call) = entry else { continue };
        walk(
            WalkedProgram { subject: &plc.subject, slice: &slice },
            &mut engine,
            *call,
            &mut coverage,
        );
    }
    let first = &coverage.contacts[&0];
    assert_eq!(first[..], [[true, true], [true, false], [true, false]]);
    assert_eq!(coverage.legs[&0], [true, true]);
    // The second rung reads the bit that the first rung has written.
    assert_eq!(coverage.contacts[&1], [[true, true]]);
    assert_eq!(coverage.instructions, 6);
}
