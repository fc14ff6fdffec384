//! The steps of a chart as variables: `Start.X` and `Start.T`.
//!
//! Declared by `project` with the variables of a program, so that every ladder of the program can
//! name them. A step is a record with the field `X`; with `T` too, if something asks how long it
//! has been active.

use std::collections::HashSet;

use super::document::{VariableUse, WrittenType};
use super::elements::{Connection, ElementBody, LadderElement};
use super::graph::{LadderGraph, inputs};
use super::memory::{IecVariable, PlcopenMemory};
use super::sfc_elements::{
    ActionBody, NamedBody, SfcAction, SfcBody, SfcChart, SfcStep, TransitionCondition, condition_at,
};
use super::types::{IecType, StepTag, StructField, VariableKind};
use crate::model::ProjectTag;

impl PlcopenMemory {
    /// Declares the steps of a chart in the scope of its program.
    pub(super) fn steps(&mut self, scope: usize, chart: &SfcChart) {
        let timed = timed(chart);
        for (at, step) in chart.steps.iter().enumerate() {
            let is_timed =
                timed.names.contains(&step.name.to_lowercase()) || timed.steps.contains(&step.id);
            let tag = self.step(scope, step, is_timed);
            debug_assert_eq!(self.scopes[scope].steps.len(), at);
            self.scopes[scope].steps.push(tag);
        }
    }

    fn step(&mut self, scope: usize, step: &SfcStep, is_timed: bool) -> Result<StepTag, String> {
        let name = &step.name;
        if step.is_macro {
            return Err(format!("`{name}` is a macro step"));
        }
        if name.is_empty() {
            return Err("a step without a name".to_owned());
        }
        let own = self.scopes[scope].own(name);
        if let Some(id) = own {
            let is_step = self.variables[id].usage == VariableUse::Step;
            let what = if is_step { "two steps are" } else { "a step and a variable are" };
            return Err(format!("{what} called `{name}`"));
        }
        let field = |name: &str, kind: IecType| StructField {
            name: name.to_lowercase(),
            field: name.to_owned(),
            kind,
        };
        let mut fields = vec![field("X", IecType::Bool)];
        fields.extend(is_timed.then(|| field("T", IecType::Time)));
        let record = if is_timed { "TimedSfcStep" } else { "SfcStep" };
        let tags = fields.iter().map(|field| ProjectTag {
            name: field.field.clone(),
            kind: field.kind.plain().to_owned(),
            doc: match field.kind == IecType::Bool {
                true => "The step is active".to_owned(),
                false => "How long it has been active, in ms".to_owned(),
            },
            ..ProjectTag::default()
        });
        let record = self.record(&WrittenType::Derived(record.to_owned()), tags.collect());
        let tag = self.names.take(name);
        self.scopes[scope].tags.push(ProjectTag {
            name: tag.clone(),
            kind: record,
            initial: step.is_initial.then(|| "{ X = true }".to_owned()),
            doc: if tag == *name { String::new() } else { format!("`{name}` in the original") },
            ..ProjectTag::default()
        });
        let original = format!("{}/{name}", self.scopes[scope].name);
        let variable = IecVariable {
            original,
            kind: VariableKind::Struct(fields),
            name: tag.clone(),
            address: None,
            usage: VariableUse::Step,
            is_guessed: false,
            difference: None,
            is_read: false,
            is_written: true,
        };
        self.add(scope, name, variable);
        Ok(StepTag { name: tag, is_timed })
    }
}

/// The steps whose time something asks for.
struct TimedSteps {
    /// By name, in small letters.
    names: HashSet<String>,
    /// By id: those with actions that are limited or delayed.
    steps: HashSet<u64>,
}

fn timed(chart: &SfcChart) -> TimedSteps {
    let mut names = HashSet::new();
    let ladders = chart.ladders().flatten().flat_map(texts);
    let durations =
        chart.blocks.iter().flat_map(|block| &block.actions).map(|one| one.duration.as_str());
    for text in ladders.chain(chart.texts()).chain(durations) {
        let lower = text.to_lowercase();
        let is_part = |c: char| !(c.is_alphanumeric() || c == '_' || c == '.');
        let words = lower.split(is_part).filter_map(|word| word.strip_suffix(".t"));
        names.extend(words.map(str::to_owned));
    }
    let by_time = |qualifier: &str| matches!(qualifier, "L" | "D");
    let blocks = chart
        .blocks
        .iter()
        .filter(|block| block.actions.iter().any(|action| by_time(&action.qualifier)));
    let steps = blocks.flat_map(|block| &block.input).map(|line| line.id).collect();
    TimedSteps { names, steps }
}

/// The texts of an element that can name a step.
fn texts(element: &LadderElement) -> Vec<&str> {
    match &element.body {
        ElementBody::Contact { variable: text, .. }
        | ElementBody::Coil { variable: text, .. }
        | ElementBody::InVariable { expression: text, .. }
        | ElementBody::OutVariable { expression: text, .. }
        | ElementBody::InOutVariable { expression: text, .. } => vec![text],
        ElementBody::Block(block) => {
            block.outputs.iter().filter_map(|pin| pin.expression.as_deref()).collect()
        }
        ElementBody::LeftRail
        | ElementBody::RightRail
        | ElementBody::Connector { .. }
        | ElementBody::Continuation { .. }
        | ElementBody::Comment(_)
        | ElementBody::Condition(_)
        | ElementBody::Other { .. } => Vec::new(),
    }
}

/// The names that the ladders and action blocks of a chart write, in small letters.
pub(super) fn written(chart: &SfcChart) -> Vec<String> {
    let actions = chart.blocks.iter().flat_map(|block| &block.actions);
    let actions = actions.filter_map(named);
    let ladders = chart.ladders().skip(1).flatten().filter_map(|element| {
        if let ElementBody::Coil { variable: name, .. }
        | ElementBody::OutVariable { expression: name, .. } = &element.body
        {
            Some(name.trim().to_lowercase())
        } else {
            None
        }
    });
    actions.chain(ladders).collect()
}

/// The elements of a chart that are executed: what leads to its transitions, and the ladders of
/// actions that a step names.
pub(super) fn executed(chart: &SfcChart) -> Vec<&LadderElement> {
    let mut found = Vec::new();
    let lines = chart.transitions.iter().filter_map(|one| {
        if let TransitionCondition::Lines(lines) = &one.condition { Some(lines) } else { None }
    });
    leading(&chart.ladder, lines.flatten(), &mut found);
    for NamedBody { name, body } in chart.bodies_of_conditions() {
        if let SfcBody::Ladder(elements) = body
            && let Ok(at) = condition_at(elements, name)
        {
            leading(elements, inputs(&elements[at]).into_iter(), &mut found);
        }
    }
    let actions = chart.blocks.iter().flat_map(|block| &block.actions);
    let names: HashSet<String> = actions.clone().filter_map(named).collect();
    let bodies = chart.actions.iter().filter(|one| names.contains(&one.name.to_lowercase()));
    let inline = actions.filter_map(|action| {
        if let ActionBody::Inline(body) = &action.body { Some(body) } else { None }
    });
    for body in bodies.map(|one| &one.body).chain(inline) {
        if let SfcBody::Ladder(elements) = body {
            found.extend(elements);
        }
    }
    found
}

/// The name that an action has in the file, in small letters.
fn named(action: &SfcAction) -> Option<String> {
    if let ActionBody::Named(name) = &action.body { Some(name.to_lowercase()) } else { None }
}

/// The elements from which lines come.
fn leading<'e>(
    elements: &'e [LadderElement],
    lines: impl Iterator<Item = &'e Connection>,
    found: &mut Vec<&'e LadderElement>,
) {
    let graph = LadderGraph::of(elements);
    let mut seen = HashSet::new();
    let mut waiting: Vec<&Connection> = lines.collect();
    while let Some(line) = waiting.pop() {
        let Ok(at) = graph.source(line) else { continue };
        if seen.insert(at) {
            found.push(&elements[at]);
            waiting.extend(inputs(&elements[at]));
            if let ElementBody::Continuation { name } = &elements[at].body {
                waiting.extend(graph.continued(name).unwrap_or_default());
            }
        }
    }
}
