//! Function blocks and functions of a PLCopen file, whose bodies are ladders, as templates.
//!
//! Called by `project`, before the programs. What an instance of a block keeps are the template's
//! own tags; what it gets by reference is a parameter. A function keeps nothing: its template sets
//! its variables to their initial values first, where it would see those of the last call.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::body::{BlockOutputName, BodyPlace, UnitBlock, UnitInput};
use super::document::{DeclaredVariable, ProgramUnit, UnitBody, VariableUse, WrittenType};
use super::elements::{ElementBody, LadderElement, SensedEdge};
use super::memory::{BlockMember, BlockMembers};
use super::passes::translated;
use super::project::{ProjectWork, language, plain_rung};
use super::types::{IecType, VariableKind, resolved};
use crate::model::{ProjectRung, ProjectTag, ProjectTemplate, RungBody};
use crate::names::legal;

impl ProjectWork<'_> {
    /// Translates the function blocks and functions, each behind those that it uses.
    pub(super) fn templates(&mut self) -> Vec<ProjectTemplate> {
        let file = self.file;
        let is_unit =
            |unit: &&ProgramUnit| matches!(unit.kind.as_str(), "functionBlock" | "function");
        let all: Vec<&ProgramUnit> = file.units.iter().filter(is_unit).collect();
        let mut order = UnitOrder::of(&all, |unit| self.used(unit));
        let mut templates = Vec::new();
        while let Some(at) = order.next() {
            let unit = all[at];
            let UnitBody::Ladder(elements) = &unit.body else {
                let why = format!("its body is in {}", language(unit));
                if let UnitBody::Chart(chart) = &unit.body {
                    self.refused_chart(unit, chart, &format!("a function block: {why}"));
                }
                self.units.insert(unit.name.to_lowercase(), Err(why));
                continue;
            };
            match unfit(unit, elements) {
                Some(why) => self.refuse(unit, why),
                None => templates.push(self.template(unit, elements)),
            }
        }
        for at in order.rest() {
            self.refuse(all[at], "it uses itself, through others too");
        }
        templates
    }

    /// The function blocks and functions that a unit uses, in small letters.
    fn used(&self, unit: &ProgramUnit) -> Vec<String> {
        let declared = unit.variables.iter().filter_map(|variable| {
            let kind = resolved(&variable.kind, &self.file.types);
            if let WrittenType::Derived(name) = kind { Some(name.to_lowercase()) } else { None }
        });
        let mut used: Vec<String> = declared.collect();
        if let UnitBody::Ladder(elements) = &unit.body {
            let blocks = elements.iter().filter_map(|element| element.body.block());
            let functions = blocks.filter(|block| block.instance.is_none());
            used.extend(functions.map(|block| block.kind.to_lowercase()));
        }
        used
    }

    /// A unit that is not translated.
    fn refuse(&mut self, unit: &ProgramUnit, why: &str) {
        let what = if unit.kind == "function" { "function" } else { "function block" };
        if let UnitBody::Ladder(elements) = &unit.body {
            self.refused(unit, elements, &format!("a {what}: {why}"));
        }
        self.units.insert(unit.name.to_lowercase(), Err(why.to_owned()));
    }

    /// A unit with a ladder as a template.
    fn template(&mut self, unit: &ProgramUnit, elements: &[LadderElement]) -> ProjectTemplate {
        // A template has names of its own; those of global variables stay free for them.
        let names = self.memory.names.clone();
        let renamed = names.renamed.len();
        let scope = self.memory.scope(&unit.name, &unit.variables, &self.file.types);
        let result = unit.result.as_ref().filter(|_| unit.kind == "function");
        let result =
            result.and_then(|kind| self.memory.result(scope, &unit.name, kind, &self.file.types));
        self.count_calls(scope, elements);
        let place = BodyPlace { scope, prefix: "own", title: &unit.name, is_template: true };
        let mut done = translated(self.memory, &self.units, elements, place);
        self.outcome.rungs.extend(done.outcomes);
        let changed = self.memory.names.renamed[renamed..].to_vec();
        self.memory.names = names;
        self.memory.names.renamed.extend(changed);
        let mut tags = self.memory.scopes[scope].tags.clone();
        let parameters = self.interface(unit, scope, result);
        tags.retain(|own| parameters.iter().all(|parameter| parameter.name != own.name));
        for tag in &mut tags {
            // A template's own tags have no addresses.
            tag.at = None;
        }
        if unit.kind == "function" {
            let inputs = self.inputs(unit);
            let own = tags.iter().filter(|tag| !inputs.contains(&tag.name));
            let stale: Vec<&ProjectTag> = own.filter(|tag| is_stale(tag, &done.rungs)).collect();
            if !stale.is_empty() {
                let resets = stale.into_iter().map(reset).collect();
                done.rungs.insert(0, plain_rung("begin", "$On", resets));
            }
        }
        ProjectTemplate {
            name: legal(&unit.name),
            doc: if unit.doc.is_empty() { unit.name.clone() } else { unit.doc.clone() },
            parameters,
            tags,
            rungs: filled(done.rungs),
        }
    }

    /// The tags of the inputs of a unit.
    fn inputs(&self, unit: &ProgramUnit) -> Vec<String> {
        let known = self.units.get(&unit.name.to_lowercase()).and_then(|unit| unit.as_ref().ok());
        known.map_or_else(Vec::new, |unit| {
            unit.inputs.iter().map(|input| input.tag.clone()).collect()
        })
    }

    /// Declares what can be given to a unit and read of it; its parameters.
    fn interface(
        &mut self,
        unit: &ProgramUnit,
        scope: usize,
        result: Option<BlockMember>,
    ) -> Vec<ProjectTag> {
        let mut block = UnitBlock {
            template: legal(&unit.name),
            inputs: Vec::new(),
            result,
            outputs: Vec::new(),
            is_open: !self.memory.scopes[0].tags.is_empty(),
        };
        let mut members = BlockMembers::default();
        let mut parameters = Vec::new();
        let is_function = unit.kind == "function";
        let mut missing = (is_function && block.result.is_none())
            .then(|| "its result is no plain value".to_owned());
        for declared in &unit.variables {
            let Some(id) = self.memory.variable(scope, &declared.name) else { continue };
            let variable = &self.memory.variables[id];
            let tag = variable.name.clone();
            let is_reference = declared.usage == VariableUse::InOut;
            let is_input = declared.usage == VariableUse::Input;
            let is_output = declared.usage == VariableUse::Output;
            let VariableKind::Plain(kind) = variable.kind else {
                let is_own = is_function && declared.usage != VariableUse::External;
                if is_reference || is_input || is_own {
                    let what = if is_reference || is_input { "input" } else { "variable" };
                    missing = Some(format!("its {what} {} is no plain value", declared.name));
                }
                continue;
            };
            let name = declared.name.clone();
            if is_reference {
                parameters.push(reference(declared, &tag, kind));
            }
            if is_input || is_reference {
                let (tag, is_written) = (tag.clone(), variable.is_written);
                block.inputs.push(UnitInput { name, tag, kind, is_reference, is_written });
            } else if is_output {
                block.outputs.push(BlockOutputName { name, tag: tag.clone(), kind });
            }
            if is_input || is_output {
                members.members.insert(declared.name.to_lowercase(), BlockMember { tag, kind });
            }
        }
        let key = unit.name.to_lowercase();
        self.memory.blocks.insert(key.clone(), members);
        self.units.insert(key, missing.map_or(Ok(block), Err));
        parameters
    }
}

/// The order of units, each behind those that it uses; else that of the file.
#[derive(Debug, Default)]
struct UnitOrder {
    /// The units that use one, by its name.
    users: HashMap<String, Vec<usize>>,
    names: Vec<String>,
    /// How many units each one still waits for.
    waits: Vec<usize>,
    ready: BTreeSet<usize>,
}

impl UnitOrder {
    fn of(units: &[&ProgramUnit], used: impl Fn(&ProgramUnit) -> Vec<String>) -> UnitOrder {
        let names: Vec<String> = units.iter().map(|unit| unit.name.to_lowercase()).collect();
        let known: HashSet<&String> = names.iter().collect();
        let mut order = UnitOrder::default();
        for (at, unit) in units.iter().enumerate() {
            let others: HashSet<String> =
                used(unit).into_iter().filter(|name| known.contains(name)).collect();
            order.waits.push(others.len());
            if others.is_empty() {
                order.ready.insert(at);
            }
            others.into_iter().for_each(|name| order.users.entry(name).or_default().push(at));
        }
        order.names = names;
        order
    }

    /// The next unit; none, if the rest use each other.
    fn next(&mut self) -> Option<usize> {
        let at = self.ready.pop_first()?;
        // Of two units with one name the first is waited for.
        for user in self.users.remove(&self.names[at]).unwrap_or_default() {
            self.waits[user] -= 1;
            if self.waits[user] == 0 {
                self.ready.insert(user);
            }
        }
        Some(at)
    }

    /// The units that use each other.
    fn rest(self) -> impl Iterator<Item = usize> {
        (0..self.waits.len()).filter(move |at| self.waits[*at] > 0)
    }
}

/// Why a function is not translated: what keeps something over a call.
fn unfit(unit: &ProgramUnit, elements: &[LadderElement]) -> Option<&'static str> {
    if unit.kind != "function" {
        return None;
    }
    elements.iter().find_map(|element| match &element.body {
        ElementBody::Contact { variable, modifier, .. }
        | ElementBody::Coil { variable, modifier, .. } => match modifier.edge {
            SensedEdge::None => is_enable(variable).then_some("it names its own EN or ENO"),
            SensedEdge::Rising | SensedEdge::Falling => Some("an edge has no memory in it"),
        },
        ElementBody::Block(block) => {
            let is_edge = |pin: &super::elements::BlockPin| pin.modifier.edge != SensedEdge::None;
            let has_edge = block.inputs.iter().chain(&block.outputs).any(is_edge);
            (has_edge || block.instance.is_some()).then_some("a function block has no memory in it")
        }
        ElementBody::InVariable { expression, .. }
        | ElementBody::OutVariable { expression, .. }
        | ElementBody::InOutVariable { expression, .. } => {
            is_enable(expression).then_some("it names its own EN or ENO")
        }
        ElementBody::LeftRail
        | ElementBody::RightRail
        | ElementBody::Connector { .. }
        | ElementBody::Continuation { .. }
        | ElementBody::Comment(_)
        | ElementBody::Condition(_)
        | ElementBody::Other { .. } => None,
    })
}

fn is_enable(name: &str) -> bool {
    ["EN", "ENO"].iter().any(|own| name.trim().eq_ignore_ascii_case(own))
}

/// The parameter for a variable that a block gets by reference.
fn reference(declared: &DeclaredVariable, tag: &str, kind: IecType) -> ProjectTag {
    let kind = match kind.plain() {
        "bit" => "output",
        "int" => "int-out",
        _ => "real-out",
    };
    ProjectTag {
        name: tag.to_owned(),
        kind: kind.to_owned(),
        doc: declared.doc.clone(),
        ..ProjectTag::default()
    }
}

/// Rungs of a template, which must have one.
fn filled(mut rungs: Vec<ProjectRung>) -> Vec<ProjectRung> {
    if rungs.is_empty() {
        rungs.push(plain_rung("nothing", "$Off", vec!["STOP".to_owned()]));
    }
    rungs
}

/// Whether rungs may show the value that a tag had before: they name it, and not first as the
/// target of an instruction that always stores.
fn is_stale(tag: &ProjectTag, rungs: &[ProjectRung]) -> bool {
    let names = |text: &str| {
        let is_part = |c: char| !c.is_alphanumeric() && c != '_';
        text.split(is_part).filter(|word| *word == tag.name).count()
    };
    for rung in rungs {
        let RungBody::Ladder { when, body, branches } = &rung.body else {
            // A stub, or the use of another template.
            return true;
        };
        if when.iter().any(|contact| names(contact) > 0) {
            return true;
        }
        let is_always = *when == ["$On"];
        if let Some(text) = body.iter().find(|text| names(text) > 0) {
            let stores = (is_always
                && (text.ends_with(&format!(" to={}", tag.name))
                    || text.starts_with(&format!("MATH {} = ", tag.name))))
                || *text == format!("OUT {}", tag.name);
            return !(stores && names(text) == 1);
        }
        let texts = branches.iter().flat_map(|branch| branch.when.iter().chain(&branch.body));
        if texts.into_iter().any(|text| names(text) > 0) {
            return true;
        }
    }
    // Nothing names it; but the result is read by the caller.
    true
}

/// The instruction that gives a tag its initial value.
fn reset(tag: &ProjectTag) -> String {
    match (tag.kind.as_str(), &tag.initial) {
        ("bit", Some(initial)) if initial == "true" => format!("SET {}", tag.name),
        ("bit", _) => format!("RST {}", tag.name),
        (_, Some(initial)) => format!("MOVE {initial} to={}", tag.name),
        (_, None) => format!("MOVE 0 to={}", tag.name),
    }
}
