//! The mutants of a ladder: each contains one small mistake that its author might have made. A
//! suite of tests is good if it fails for each mutant.
//!
//! `rungd mutate` runs the suite for each mutant. This module changes the resolved program and
//! `[retain]`, never a text; the result is lowered as any other program. It runs nothing, and does
//! not judge.
//!
//! Two kinds of changes are not made: changes that no test could show (a duration changed by less
//! than a scan, `$On` inverted, a level instead of `rise()` on a leg that only reacts to edges),
//! and changes with the same effect as a different mutant. `initial`, limits and texts are not
//! changed. A change in a template is made in all its uses. Files of the library are not
//! changed, unless all rungs of the program are in the library.

mod contacts;
mod formula;
mod ground;
mod instructions;
mod kind;
mod mutation;
mod repeats;
mod retained;
#[cfg(test)]
mod tests;
mod values;
mod word_bits;

pub use kind::MutantKind;
pub use mutation::RungIndex;

use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::Arc;

use super::suite::TestProgram;
use ground::{FoundMutation, Ground};
use mutation::{Mutation, without_lone_groups};
use retained::RetainedEntry;
use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::Controller;
use rungd_language::resolve::program::{Program, ProgramPart, Rung};
use rungd_language::source::span::{SourceFile, Span};

/// A ladder with one mistake.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// The kind of the change.
    pub kind: MutantKind,
    /// The place of the change, in a file of the load.
    pub span: Span,
    /// The name of the rung: `Main, rung count-bottles`, `Drain.Open, rung 3, branch 1`; for a
    /// template, the rung in its first use.
    pub rung: String,
    /// The change in one line, with both texts: ``contact `!jam` is `jam` ``.
    pub what: String,
    /// Its number among the mutants of its kind at its place.
    pub(super) variant: u32,
    change: MutantChange,
    /// Whether the uses have different constants at this place.
    differs: bool,
}

/// The change that makes a mutant.
#[derive(Clone, Debug)]
enum MutantChange {
    /// The mutations in all uses of a template, the last one in the program first.
    Rungs(Vec<(RungIndex, Mutation)>),
    /// The entry of `[retain]` at the place of the mutant is left out.
    RetainOut,
}

/// All mutants of a program under test: of its rungs, then of `[retain]`.
pub fn mutants_of(test_program: &TestProgram, period: ScanPeriod) -> Vec<Mutant> {
    let mut all = mutants(&test_program.program, &test_program.files, period);
    let entries = retained::retained(&test_program.controller, &test_program.files);
    all.extend(entries.into_iter().map(|RetainedEntry { span, what }| Mutant {
        kind: MutantKind::RetainOut,
        span,
        variant: 0,
        rung: "[retain]".to_owned(),
        what,
        change: MutantChange::RetainOut,
        differs: false,
    }));
    all
}

/// All mutants of the rungs of a program, in file order. `files`: the loaded files; places
/// refer to them by
/// index. `period`: the scan period, by which durations are changed.
pub fn mutants(program: &Program, files: &[SourceFile], period: ScanPeriod) -> Vec<Mutant> {
    let ground = Ground::new(program, files, period);
    let mut mutants: Vec<Mutant> = Vec::new();
    let mut by_place: HashMap<(MutantKind, Span, u32), usize> = HashMap::new();
    for (part, rung, index) in rungs(program) {
        for found in found(&ground, part, rung) {
            if !ground.is_under_test(found.place) {
                continue;
            }
            match by_place.get(&(found.kind, found.place, found.variant)) {
                Some(at) => {
                    let mutant = &mut mutants[*at];
                    mutant.differs |= mutant.what != found.what;
                    if let MutantChange::Rungs(mutations) = &mut mutant.change {
                        mutations.push((index, found.mutation));
                    }
                }
                None => {
                    by_place.insert((found.kind, found.place, found.variant), mutants.len());
                    mutants.push(Mutant {
                        kind: found.kind,
                        span: found.place,
                        variant: found.variant,
                        rung: name(part, index.rung, rung, found.branch),
                        what: found.what,
                        change: MutantChange::Rungs(vec![(index, found.mutation)]),
                        differs: false,
                    });
                }
            }
        }
    }
    for mutant in &mut mutants {
        let MutantChange::Rungs(mutations) = &mut mutant.change else { continue };
        mutations.sort_by_key(|(index, mutation)| Reverse((*index, mutation.order())));
        mutant.what += &match mutations.len() {
            0 | 1 => String::new(),
            places if mutant.differs => format!(" (similar at {places} places)"),
            places => format!(" (at {places} places)"),
        };
    }
    mutants.sort_by_key(|mutant| (mutant.span.file, mutant.span.start));
    mutants
}

impl Mutant {
    /// The program with the mistake, and its settings.
    pub fn apply(&self, test_program: &TestProgram) -> MutatedProgram {
        let TestProgram { program, controller, .. } = test_program;
        match &self.change {
            MutantChange::Rungs(_) => {
                let program = self.apply_to(program);
                MutatedProgram { program, controller: Arc::clone(controller) }
            }
            MutantChange::RetainOut => {
                let mut program = Program::clone(program);
                retained::forget_stages(self.span, controller, &mut program);
                let controller = retained::settings_without(self.span, controller);
                MutatedProgram { program, controller }
            }
        }
    }

    /// The program with the mistake in its rungs.
    pub(super) fn apply_to(&self, program: &Program) -> Program {
        let mut mutated = program.clone();
        for (index, mutation) in self.mutations() {
            mutation.make(&mut mutated, *index);
        }
        for index in self.changed_contacts() {
            put_groups_right(index.rung_of(&mut mutated));
        }
        mutated
    }

    /// The program without and with the mistake, both without contacts that repeat other contacts
    /// of their rung; `None`: the rungs of the mistake have no such contacts. `mutated`: the
    /// program of [`Mutant::apply`].
    pub fn without_repeats(&self, original: &Program, mutated: &Program) -> Option<[Program; 2]> {
        let repeats = |program, index: RungIndex| {
            repeats::leave_out_repeats(&mut index.rung_in(program).clone())
        };
        let mut changed = self.changed_contacts();
        if !changed.any(|index| repeats(original, index) || repeats(mutated, index)) {
            return None;
        }
        let mut both = [original.clone(), mutated.clone()];
        for (index, program) in self.changed_contacts().flat_map(|index| [(index, 0), (index, 1)]) {
            repeats::leave_out_repeats(index.rung_of(&mut both[program]));
        }
        Some(both)
    }

    fn mutations(&self) -> &[(RungIndex, Mutation)] {
        match &self.change {
            MutantChange::Rungs(mutations) => mutations,
            MutantChange::RetainOut => &[],
        }
    }

    /// The rungs with the mistake, the last one in the program first, if it is in contacts alone.
    pub(super) fn of_contacts_alone(&self) -> Option<Vec<RungIndex>> {
        let mut rungs: Vec<RungIndex> = self.changed_contacts().collect();
        let is_alone = !rungs.is_empty() && rungs.len() == self.mutations().len();
        rungs.dedup();
        is_alone.then_some(rungs)
    }

    /// The rungs whose contacts it changes.
    fn changed_contacts(&self) -> impl Iterator<Item = RungIndex> {
        let of_contacts = |(index, mutation): &(RungIndex, Mutation)| {
            matches!(mutation, Mutation::Contact(..)).then_some(*index)
        };
        self.mutations().iter().filter_map(of_contacts)
    }
}

/// A program with a mistake, and its settings.
pub struct MutatedProgram {
    /// The program.
    pub program: Program,
    /// The settings.
    pub controller: Arc<Controller>,
}

fn put_groups_right(rung: &mut Rung) {
    rung.legs.iter_mut().for_each(|leg| without_lone_groups(&mut leg.contacts));
    rung.branches.iter_mut().for_each(|branch| without_lone_groups(&mut branch.contacts));
}

/// All rungs, with their places.
fn rungs(program: &Program) -> impl Iterator<Item = (ProgramPart<'_>, &Rung, RungIndex)> {
    program.parts().flat_map(|part| {
        let block = part.block.id.0 as usize;
        let stage =
            part.stage.and_then(|stage| part.block.stages.iter().position(|s| s.id == stage.id));
        let rungs = part.rungs.iter().enumerate();
        rungs
            .map(move |(rung, rung_content)| (part, rung_content, RungIndex { block, stage, rung }))
    })
}

/// The mutations of one rung.
fn found(ground: &Ground, part: ProgramPart, rung: &Rung) -> Vec<FoundMutation> {
    let mut found = instructions::rung_mutations(ground, rung);
    found.extend(contacts::contacts(ground, rung));
    found.extend(instructions::instructions(ground, part, rung));
    found
}

/// The name of a rung. `at`: its index in its part.
fn name(part: ProgramPart, at: usize, rung: &Rung, branch: Option<usize>) -> String {
    let element = match part.stage {
        Some(stage) => format!("{}.{}", part.block.name, stage.name),
        None => part.block.name.clone(),
    };
    let rung = match &rung.name {
        Some(name) => name.clone(),
        None => (at + 1).to_string(),
    };
    let branch = branch.map(|branch| format!(", branch {branch}")).unwrap_or_default();
    format!("{element}, rung {rung}{branch}")
}
