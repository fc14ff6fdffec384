//! Suites of one ladder, which are judged together.
//!
//! Called by `mutation`, which judges the mutants, and by `cli`, which groups test files. Suites of
//! one ladder may have different controller files, periods and plants; the mutants of the rungs are
//! the same, and an entry of `[retain]` is the same if it has the same text.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::mutants::{Mutant, MutantKind, mutants_of};
use super::suite::Suite;
use rungd_language::source::span::Span;

/// A mutant, and the first test that failed for it.
#[derive(Clone, Debug)]
pub struct JudgedMutant {
    /// The kind of its change.
    pub kind: MutantKind,
    /// The file of its change, as it was named.
    pub file: String,
    /// The line of its change, from 1.
    pub line: u32,
    /// The column of its change, from 1, in characters.
    pub column: u32,
    /// The name of its rung.
    pub rung: String,
    /// The change in one line.
    pub what: String,
    /// The test that fails; `None`: it has survived.
    pub killed_by: Option<FailingTest>,
}

/// A test that fails for a mutant.
#[derive(Clone, Debug)]
pub struct FailingTest {
    /// The index of its suite among those that are judged together.
    pub suite: usize,
    /// Its name.
    pub name: String,
}

/// A mutant of a ladder, for each of its suites.
pub(super) struct JointMutant {
    /// The suites in which it can be made; at least one.
    pub of_suites: Vec<MutantOfSuite>,
}

/// A mutant of the ladder of one suite.
pub(super) struct MutantOfSuite {
    /// The index of the suite.
    pub suite: usize,
    pub mutant: Mutant,
}

impl JointMutant {
    pub fn kind(&self) -> MutantKind {
        self.of_suites[0].mutant.kind
    }

    /// The result for it.
    pub fn judged(&self, suites: &[&Suite], killed_by: Option<FailingTest>) -> JudgedMutant {
        let MutantOfSuite { suite, mutant } = &self.of_suites[0];
        let files = &suites[*suite].programs[0].files;
        let file = files.get(mutant.span.file.0 as usize);
        let (line, column) = file.map_or((1, 1), |file| file.line_column(mutant.span.start));
        JudgedMutant {
            kind: mutant.kind,
            file: file.map(|file| file.name.clone()).unwrap_or_default(),
            line,
            column,
            rung: mutant.rung.clone(),
            what: mutant.what.clone(),
            killed_by,
        }
    }
}

/// What makes mutants of several suites the same one.
#[derive(PartialEq, Eq, Hash)]
struct MutantKey {
    kind: MutantKind,
    /// The file and place; for an entry of `[retain]`, which each suite may have in a file of its
    /// own, `None`.
    place: Option<(PathBuf, Span)>,
    variant: u32,
    what: String,
}

impl MutantKey {
    fn of(mutant: &Mutant, suite: &Suite) -> MutantKey {
        let Mutant { kind, span, variant, .. } = *mutant;
        let place = || {
            let file = suite.programs[0].files.get(span.file.0 as usize)?;
            Some((identity(&file.name), Span { file: Default::default(), ..span }))
        };
        let place = if kind == MutantKind::RetainOut { None } else { place() };
        MutantKey { kind, place, variant, what: mutant.what.clone() }
    }
}

/// The mutants of the ladder of suites: those of the first suite, then those of the others that it
/// does not have.
pub(super) fn joint_mutants(suites: &[&Suite]) -> Vec<JointMutant> {
    let Some(first) = suites.first() else { return Vec::new() };
    let period = first.programs[0].controller.period;
    let mut all: Vec<JointMutant> = Vec::new();
    let mut known: HashMap<MutantKey, usize> = HashMap::new();
    for (at, suite) in suites.iter().enumerate() {
        for mutant in mutants_of(&suite.programs[0], period) {
            let number = *known.entry(MutantKey::of(&mutant, suite)).or_insert(all.len());
            let of_suite = MutantOfSuite { suite: at, mutant };
            match all.get_mut(number) {
                Some(joint) => joint.of_suites.push(of_suite),
                None => all.push(JointMutant { of_suites: vec![of_suite] }),
            }
        }
    }
    all
}

/// The groups of suites that test one ladder: the indices of each group, in order.
pub fn of_one_ladder(suites: &[&Suite]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<Vec<PathBuf>, usize> = HashMap::new();
    for (at, suite) in suites.iter().enumerate() {
        let group = *known.entry(ladder(suite)).or_insert(groups.len());
        match groups.get_mut(group) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    groups
}

/// The files of a suite's ladder. The first file of a load has the settings.
fn ladder(suite: &Suite) -> Vec<PathBuf> {
    let files = suite.programs[0].files.iter().skip(1);
    let mut files: Vec<PathBuf> = files.map(|file| identity(&file.name)).collect();
    files.sort_unstable();
    files
}

/// The path of a file without links; the name itself for a file of the library.
fn identity(name: &str) -> PathBuf {
    Path::new(name).canonicalize().unwrap_or_else(|_| name.into())
}
