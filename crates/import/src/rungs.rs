//! Rungs of the steps of a foreign rung.
//!
//! Called by the readers, for each rung of the original. A foreign rung evaluates a contact once,
//! when the evaluation comes to it; an instruction in the middle of the rung does not change what
//! was evaluated before it. In rungd the contacts of a rung are evaluated when the rung begins,
//! those of a branch when the branch begins, and those of the next rung behind it. So a condition
//! that an instruction in between changes is kept in a bit of its own ([`settled`]). What remains
//! may be evaluated at any time, and neighbours with the same first contacts share a rung
//! ([`rungs`]).

use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{
    Action, ActionForm, ProjectBranch, ProjectLeg, ProjectRung, ProjectTag, RungBody, RungStep,
    Term, UseArgument,
};
use crate::names::GivenNames;

/// Deepest nesting of a condition in one rung; what is deeper gets a bit of its own.
const DEPTH_MAX: usize = 6;
/// Most contacts of one element of `when`.
const SIZE_MAX: usize = 16;

/// Where the rungs of a foreign rung belong.
pub struct ForeignRung<'n> {
    /// The name of the first rung, in kebab-case.
    pub name: String,
    /// The comment of the original.
    pub doc: String,
    /// The beginning of the names of bits that keep a condition: `Main_r3`.
    pub prefix: String,
    /// The names of the project.
    pub names: &'n mut GivenNames,
    /// Gets the bits that keep a condition.
    pub tags: &'n mut Vec<ProjectTag>,
}

/// The rungs that execute the steps.
pub fn rungs(steps: Vec<RungStep>, mut place: ForeignRung<'_>) -> Vec<ProjectRung> {
    let steps = settled(steps, &mut place);
    let mut rungs: Vec<ProjectRung> = Vec::new();
    let mut at = 0;
    while at < steps.len() {
        let (body, next) = match steps[at].action.form {
            ActionForm::Do(_) => ladder(&steps, at),
            ActionForm::Use { .. } | ActionForm::Legs { .. } => (single(&steps[at]), at + 1),
        };
        let name = match &steps[at].action.form {
            ActionForm::Use { name, .. } => name.clone(),
            ActionForm::Do(_) | ActionForm::Legs { .. } if rungs.is_empty() => place.name.clone(),
            ActionForm::Do(_) | ActionForm::Legs { .. } => {
                format!("{}-{}", place.name, rungs.len() + 1)
            }
        };
        let doc = if rungs.is_empty() { std::mem::take(&mut place.doc) } else { String::new() };
        rungs.push(ProjectRung { name: Some(name), doc, body });
        at = next;
    }
    rungs
}

/// The steps with bits for conditions that change before they are used.
fn settled(steps: Vec<RungStep>, place: &mut ForeignRung<'_>) -> Vec<RungStep> {
    let mut kept: Vec<KeptTerm> = Vec::new();
    for (at, step) in steps.iter().enumerate() {
        for term in &step.when {
            let is_changed =
                |before: &RungStep| term.condition.is_changed_by(&before.action.writes);
            let changes = steps.get(term.at..at).is_some_and(|steps| steps.iter().any(is_changed));
            let is_large = term.condition.depth() > DEPTH_MAX || term.condition.size() > SIZE_MAX;
            let is_kept = kept.iter().any(|kept| kept.term == *term);
            if (changes || is_large) && !is_kept {
                let bit = place.names.fresh(&format!("{}_{}", place.prefix, kept.len() + 1));
                place.tags.push(ProjectTag {
                    name: bit.clone(),
                    kind: "bit".to_owned(),
                    doc: format!("{}: a condition of the rung, kept", place.name),
                    is_own: true,
                    ..ProjectTag::default()
                });
                kept.push(KeptTerm { term: term.clone(), bit });
            }
        }
    }
    if kept.is_empty() {
        return steps;
    }
    let mut settled = Vec::new();
    for (at, mut step) in steps.into_iter().enumerate() {
        for kept in kept.iter().filter(|kept| kept.term.at == at) {
            settled.extend(kept.steps(place));
        }
        for term in &mut step.when {
            if let Some(kept) = kept.iter().find(|kept| kept.term == *term) {
                *term = Term { condition: RungCondition::bit(&kept.bit), at: kept.term.at };
            }
        }
        settled.push(step);
    }
    settled
}

/// A term that has a bit of its own.
struct KeptTerm {
    term: Term,
    bit: String,
}

impl KeptTerm {
    /// The steps that evaluate it: one, or several if it is large.
    fn steps(&self, place: &mut ForeignRung<'_>) -> Vec<RungStep> {
        let mut steps = Vec::new();
        let condition = reduced(self.term.condition.clone(), &mut steps, place);
        steps.push(keep(condition, &self.bit));
        steps
    }
}

/// The step that puts a condition into a bit.
fn keep(condition: RungCondition, bit: &str) -> RungStep {
    RungStep {
        when: vec![Term { condition, at: 0 }],
        action: Action {
            form: ActionForm::Do(format!("OUT {bit}")),
            writes: vec![TouchedPlace::of(bit)],
        },
    }
}

/// A condition that is small enough for a rung; larger parts of it get bits, in `steps`.
fn reduced(
    condition: RungCondition,
    steps: &mut Vec<RungStep>,
    place: &mut ForeignRung<'_>,
) -> RungCondition {
    let is_small = condition.depth() <= DEPTH_MAX / 2 && condition.size() <= SIZE_MAX;
    let parts = match condition {
        condition if is_small => return condition,
        RungCondition::Not(inner) => return reduced(*inner, steps, place).opposite(),
        RungCondition::All(ref parts) | RungCondition::Any(ref parts) => parts.clone(),
        RungCondition::Constant(_) | RungCondition::Bit { .. } | RungCondition::Compare { .. } => {
            return condition;
        }
    };
    let is_series = matches!(condition, RungCondition::All(_));
    let mut small = Vec::new();
    for part in parts {
        let part = reduced(part, steps, place);
        let is_bit = matches!(part, RungCondition::Bit { .. } | RungCondition::Compare { .. });
        small.push(if is_bit { part } else { own_bit(part, steps, place) });
    }
    while small.len() > SIZE_MAX {
        let rest = small.split_off(SIZE_MAX);
        let first = joined(small, is_series);
        small = vec![own_bit(first, steps, place)];
        small.extend(rest);
    }
    joined(small, is_series)
}

fn joined(parts: Vec<RungCondition>, is_series: bool) -> RungCondition {
    if is_series { RungCondition::all(parts) } else { RungCondition::any(parts) }
}

/// A new bit for a condition.
fn own_bit(
    condition: RungCondition,
    steps: &mut Vec<RungStep>,
    place: &mut ForeignRung<'_>,
) -> RungCondition {
    let bit = place.names.fresh(&format!("{}_part", place.prefix));
    place.tags.push(ProjectTag {
        name: bit.clone(),
        kind: "bit".to_owned(),
        doc: format!("{}: a part of the rung's condition", place.name),
        ..ProjectTag::default()
    });
    steps.push(keep(condition, &bit));
    RungCondition::bit(bit)
}

/// The contacts of a series of terms.
fn contacts(terms: &[Term]) -> Vec<String> {
    RungCondition::all(terms.iter().map(|term| term.condition.clone())).contacts()
}

/// One rung for the instructions from a step on that begin with the same contacts, and the index
/// of the next step.
fn ladder(steps: &[RungStep], at: usize) -> (RungBody, usize) {
    let mut common = &steps[at].when[..];
    let mut next = at + 1;
    while let Some(step) = steps.get(next) {
        let equal = common.iter().zip(&step.when).take_while(|(one, other)| one == other).count();
        let fits = matches!(step.action.form, ActionForm::Do(_))
            && (equal > 0 || (common.is_empty() && step.when.is_empty()))
            && !(step.when.len() == equal && has_branch(&steps[at..next], equal));
        if !fits {
            break;
        }
        common = &common[..equal];
        next += 1;
    }
    let (mut body, mut branches) = (Vec::new(), Vec::<ProjectBranch>::new());
    // Equal contacts that were evaluated at another time are another branch.
    let mut before: &[Term] = &[];
    for step in &steps[at..next] {
        let ActionForm::Do(text) = &step.action.form else { continue };
        let rest = &step.when[common.len()..];
        match (rest.is_empty(), branches.last_mut()) {
            (true, _) => body.push(text.clone()),
            (false, Some(last)) if before == rest => last.body.push(text.clone()),
            (false, _) => {
                branches.push(ProjectBranch { when: contacts(rest), body: vec![text.clone()] });
            }
        }
        before = rest;
    }
    (RungBody::Ladder { when: contacts(common), body, branches }, next)
}

/// Whether one of the steps has more contacts than the common ones.
fn has_branch(steps: &[RungStep], common: usize) -> bool {
    steps.iter().any(|step| step.when.len() > common)
}

/// The rung of a step that stands alone.
fn single(step: &RungStep) -> RungBody {
    let when = contacts(&step.when);
    match &step.action.form {
        ActionForm::Use { template, contact, arguments, .. } => {
            let value =
                RungCondition::all(step.when.iter().map(|term| term.condition.clone())).text();
            let mut all = Vec::new();
            all.extend(contact.map(|name| UseArgument { name: name.to_owned(), value }));
            all.extend(arguments.iter().cloned());
            RungBody::Use { template: template.clone(), arguments: all }
        }
        ActionForm::Legs { leg, others, instruction } => {
            let mut legs = vec![ProjectLeg { name: leg, contacts: when }];
            legs.extend(others.iter().cloned());
            RungBody::Legs { legs, instruction: instruction.clone() }
        }
        ActionForm::Do(text) => {
            RungBody::Ladder { when, body: vec![text.clone()], branches: Vec::new() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn term(text: &str, at: usize) -> Term {
        Term { condition: RungCondition::bit(text), at }
    }

    fn out(bit: &str, when: Vec<Term>) -> RungStep {
        let form = ActionForm::Do(format!("OUT {bit}"));
        RungStep { when, action: Action { form, writes: vec![TouchedPlace::of(bit)] } }
    }

    fn made(steps: Vec<RungStep>) -> Vec<String> {
        let (mut names, mut tags) = (GivenNames::default(), Vec::new());
        let place = ForeignRung {
            name: "r0".to_owned(),
            doc: String::new(),
            prefix: "m".to_owned(),
            names: &mut names,
            tags: &mut tags,
        };
        let text = |rung: ProjectRung| match rung.body {
            RungBody::Ladder { when, body, branches } => {
                let branches = branches.iter().map(|branch| {
                    format!(" [{}: {}]", branch.when.join(", "), branch.body.join(", "))
                });
                let branches: String = branches.collect();
                format!("{}: {}{branches}", when.join(", "), body.join(", "))
            }
            RungBody::Legs { .. }
            | RungBody::Use { .. }
            | RungBody::Comment
            | RungBody::Todo { .. } => format!("{:?}", rung.body),
        };
        rungs(steps, place).into_iter().map(text).collect()
    }

    #[test]
    fn outputs_in_the_middle_of_a_rung_become_branches() {
        let steps = vec![
            out("b", vec![term("a", 0)]),
            out("d", vec![term("a", 0), term("c", 1)]),
            out("e", vec![term("a", 0), term("c", 1)]),
        ];
        assert_eq!(made(steps), ["a: OUT b [c: OUT d, OUT e]"]);
    }

    #[test]
    fn branches_of_outputs_share_what_stands_before_them() {
        let steps = vec![
            out("c", vec![term("a", 0), term("b", 0)]),
            out("e", vec![term("a", 0), term("d", 1)]),
            out("f", vec![term("a", 0)]),
        ];
        assert_eq!(made(steps), ["a:  [b: OUT c] [d: OUT e]", "a: OUT f"]);
    }

    #[test]
    fn equal_contacts_behind_an_instruction_that_changes_them_are_evaluated_anew() {
        let steps = vec![
            out("b", vec![term("a", 0), term("b", 0)]),
            out("c", vec![term("a", 0), term("b", 1)]),
        ];
        assert_eq!(made(steps), ["a:  [b: OUT b] [b: OUT c]"]);
    }

    #[test]
    fn a_contact_that_the_rung_changes_keeps_its_value() {
        let steps = vec![out("a", vec![term("b", 0)]), out("c", vec![term("b", 0), term("a", 0)])];
        assert_eq!(made(steps), ["a: OUT m_1", "b: OUT a [m_1: OUT c]"]);
    }

    #[test]
    fn rungs_without_a_common_contact_stay_apart() {
        let steps = vec![out("a", vec![term("b", 0)]), out("c", vec![term("d", 1)])];
        assert_eq!(made(steps), ["b: OUT a", "d: OUT c"]);
        assert_eq!(made(vec![out("a", vec![]), out("b", vec![])]), ["$On: OUT a, OUT b"]);
    }

    #[test]
    fn a_deep_condition_is_taken_apart() {
        let mut deep = RungCondition::bit("x0_");
        for at in 0..40 {
            let other = RungCondition::bit(format!("y{at}_"));
            deep = match at % 2 {
                0 => RungCondition::any([deep, other]),
                _ => RungCondition::all([deep, other]),
            };
        }
        let steps = vec![out("a", vec![Term { condition: deep, at: 0 }])];
        let made = made(steps);
        assert!(made.len() > 5);
        assert!(made.iter().all(|rung| rung.len() < 300), "{made:#?}");
    }
}
