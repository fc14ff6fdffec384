//! An Add-On Instruction as a template.
//!
//! The data of an instance is a structure: the template gets each of its tags as a parameter, and
//! so what an instance keeps lies in the instance's tags, as in Logix.

use std::collections::{HashMap, HashSet};

use super::call_book::{CallBook, OwnInstruction, OwnParameter, OwnPart, OwnReference};
use super::document::{InstructionDefinition, L5xFile, TagDefinition};
use super::memory::{LogixMemory, LogixVariable};
use super::prescan::Prescan;
use super::rll;
use super::routine::{RoutineText, RoutineWork, parts_of, translated};
use super::translate::BlockNature;
use crate::model::{Fate, ProjectRung, ProjectTag, ProjectTemplate, RungBody, RungOutcome};

/// What the translation of an Add-On Instruction gives.
pub(crate) struct TranslatedInstruction {
    pub(crate) own: Result<OwnInstruction, String>,
    pub(crate) templates: Vec<ProjectTemplate>,
    pub(crate) outcomes: Vec<RungOutcome>,
}

/// The parameters of Add-On Instructions that get one argument several times.
pub(super) fn shared(file: &L5xFile) -> HashSet<String> {
    let own = file.instructions.iter().flat_map(|one| &one.routines);
    let all = file.programs.iter().flat_map(|one| &one.routines).chain(own);
    let mut uses: HashMap<String, Vec<String>> = HashMap::new();
    for rung in all.flat_map(|routine| &routine.rungs) {
        let Ok(series) = rll::parse(&rung.text) else { continue };
        for instruction in rll::instructions(&series) {
            let is_it =
                |one: &&InstructionDefinition| one.name.eq_ignore_ascii_case(&instruction.name);
            let Some(definition) = file.instructions.iter().find(is_it) else { continue };
            let required = definition.parameters.iter().filter(|one| one.is_required);
            let names = std::iter::once("own").chain(required.map(|one| one.name.as_str()));
            for (name, argument) in names.zip(&instruction.operands) {
                let name = format!("{}/{name}", definition.name).to_lowercase();
                uses.entry(argument.to_lowercase()).or_default().push(name);
            }
        }
    }
    uses.into_values().filter(|names| names.len() > 1).flatten().collect()
}

/// Translates an Add-On Instruction.
pub(crate) fn own_instruction(
    memory: &mut LogixMemory,
    calls: &mut CallBook,
    definition: &InstructionDefinition,
) -> TranslatedInstruction {
    let refused = |why: &str, outcomes| TranslatedInstruction {
        own: Err(why.to_owned()),
        templates: Vec::new(),
        outcomes,
    };
    if definition.is_encoded {
        return refused("its logic is encoded", Vec::new());
    }
    let scope = own_scope(memory, definition);
    calls.logic.push(scope);
    let is_logic =
        |name: &str| definition.routines.iter().find(|one| one.name.eq_ignore_ascii_case(name));
    let Some(logic) = is_logic("Logic") else { return refused("it has no logic", Vec::new()) };
    let mut prescan = Prescan::default();
    let mut work = RoutineWork { memory, calls, prescan: &mut prescan, scope };
    let text = RoutineText {
        place: format!("{}/{}", definition.name, logic.name),
        prefix: definition.name.clone(),
        routine: logic,
        nature: BlockNature::ProjectTemplate,
    };
    let done = translated(&mut work, text);
    let outcomes = [done.outcomes, other_routines(definition)].concat();
    if !matches!(logic.language.as_str(), "RLL" | "") {
        return refused(&format!("its logic is in {}", logic.language), outcomes);
    }
    if is_logic("EnableInFalse").is_some() {
        return refused("it has a routine EnableInFalse", outcomes);
    }
    let interface = match interface(memory, scope) {
        Ok(interface) => interface,
        Err(why) => return refused(&why, outcomes),
    };
    let home = memory.scopes[scope].home;
    let is_parameter = |tag: &ProjectTag| interface.tags.iter().any(|one| one.name == tag.name);
    let own_tags: Vec<ProjectTag> =
        memory.homes[home].iter().filter(|tag| !is_parameter(tag)).cloned().collect();
    let name = memory.names.take(&definition.name);
    let mut template = ProjectTemplate {
        name: name.clone(),
        doc: definition.doc.clone(),
        parameters: interface.tags.iter().map(parameter_of).collect(),
        tags: own_tags,
        rungs: done.rungs,
    };
    let mut templates = Vec::new();
    let prescan_template = prescan_template(memory, &prescan, scope, &template);
    let prescan_name = prescan_template.as_ref().map(|template| template.name.clone());
    templates.extend(prescan_template);
    fill_empty(&mut template);
    templates.insert(0, template);
    let parameter = |parameter: &super::document::MemberDefinition| OwnParameter {
        name: parameter.name.clone(),
        usage: parameter.usage.clone(),
        is_required: parameter.is_required,
    };
    let own = OwnInstruction {
        template: name,
        prescan: prescan_name,
        parameters: definition.parameters.iter().map(parameter).collect(),
        parts: interface.parts,
        references: interface.references,
    };
    TranslatedInstruction { own: Ok(own), templates, outcomes }
}

/// The template of what the prescan does with an instance; `None` if that is nothing.
fn prescan_template(
    memory: &mut LogixMemory,
    prescan: &Prescan,
    scope: usize,
    template: &ProjectTemplate,
) -> Option<ProjectTemplate> {
    let home = memory.scopes[scope].home;
    let tags: Vec<&ProjectTag> = memory.homes[home].iter().collect();
    let begun = prescan.texts(scope, &tags);
    (!begun.is_empty()).then(|| ProjectTemplate {
        name: memory.names.fresh(&format!("{}_prescan", template.name)),
        doc: format!("What Logix does with {} before its first scan.", template.name),
        parameters: template.parameters.clone(),
        tags: Vec::new(),
        rungs: vec![always("prescan", "$On", begun)],
    })
}

/// Gives a template without a rung one that does nothing.
fn fill_empty(template: &mut ProjectTemplate) {
    if template.rungs.iter().all(|rung| rung.body == RungBody::Comment) {
        template.rungs.push(always("nothing", "$Off", vec!["STOP".to_owned()]));
    }
}

/// A rung with one contact.
fn always(name: &str, contact: &str, body: Vec<String>) -> ProjectRung {
    let body = RungBody::Ladder { when: vec![contact.to_owned()], body, branches: Vec::new() };
    ProjectRung { name: Some(name.to_owned()), doc: String::new(), body }
}

/// The rungs of the routines that are not the logic: Prescan, Postscan, EnableInFalse.
fn other_routines(definition: &InstructionDefinition) -> Vec<RungOutcome> {
    let others = definition.routines.iter().filter(|one| !one.name.eq_ignore_ascii_case("Logic"));
    let rungs = others.flat_map(|routine| {
        let name = &routine.name;
        routine.rungs.iter().enumerate().map(move |(number, rung)| RungOutcome {
            place: format!("{}/{name}", definition.name),
            number,
            text: rung.text.clone(),
            parts: parts_of(&rung.text),
            fate: Fate::Todo(format!("the routine {name} of an Add-On Instruction")),
        })
    });
    rungs.collect()
}

/// The scope of the logic: the parameters and local tags are members of the instance.
fn own_scope(memory: &mut LogixMemory, definition: &InstructionDefinition) -> usize {
    let mut tags = vec![TagDefinition {
        name: "own".to_owned(),
        kind: definition.name.clone(),
        doc: format!("The data of an instance of {}", definition.name),
        ..TagDefinition::default()
    }];
    for member in definition.parameters.iter().chain(&definition.locals) {
        let is_reference = member.usage == "InOut";
        let alias = member.alias.clone().unwrap_or_else(|| format!("own.{}", member.name));
        tags.push(TagDefinition {
            name: member.name.clone(),
            kind: member.kind.clone(),
            dimensions: member.dimensions.clone(),
            doc: member.doc.clone(),
            alias: (!is_reference).then_some(alias),
            data: None,
        });
    }
    memory.scope(&definition.name, false, &tags)
}

/// The parameters of the template.
struct Interface {
    tags: Vec<ProjectTag>,
    parts: Vec<OwnPart>,
    references: Vec<OwnReference>,
}

fn interface(memory: &LogixMemory, scope: usize) -> Result<Interface, String> {
    let mut interface = Interface { tags: Vec::new(), parts: Vec::new(), references: Vec::new() };
    let mut ids: Vec<usize> = memory.scopes[scope].variables.values().copied().collect();
    ids.sort_unstable();
    let home = &memory.homes[memory.scopes[scope].home];
    for id in ids {
        let variable: &LogixVariable = &memory.variables[id];
        for (path, parameter) in memory.parts_of(id) {
            let Some(tag) = home.iter().find(|tag| tag.name == parameter) else { continue };
            let is_plain = ["bit", "int", "real"].contains(&tag.kind.as_str());
            if tag.count.is_some() && !is_plain {
                return Err("it has an array of structures".to_owned());
            }
            interface.tags.push(tag.clone());
            let part = OwnPart { path, parameter };
            match variable.original.ends_with("/own") {
                true => interface.parts.push(part),
                false => interface.references.push(OwnReference {
                    name: variable.original.rsplit('/').next().unwrap_or_default().to_owned(),
                    kind: variable.kind.clone(),
                    part,
                }),
            }
        }
    }
    Ok(interface)
}

/// The parameter for a tag.
fn parameter_of(tag: &ProjectTag) -> ProjectTag {
    let kind = match (tag.count.is_some(), tag.kind.as_str()) {
        (true, _) => "array",
        (false, "bit") => "output",
        (false, "int") => "int-out",
        (false, "real") => "real-out",
        (false, record) => record,
    };
    ProjectTag { kind: kind.to_owned(), count: None, initial: None, ..tag.clone() }
}
