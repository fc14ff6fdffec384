//! An L5X file as plain data: what the translation needs of the XML.
//!
//! Made by [`read`]. Names and texts are as in the file; whether a name exists is decided later.

use roxmltree::Node;

use super::data::{self, Datum};
use crate::xml_document;

/// A file.
#[derive(Debug, Default)]
pub(crate) struct L5xFile {
    /// `TargetType`: `Controller`, `Program`, `Routine`, `AddOnInstructionDefinition` …
    pub(crate) target: String,
    /// The name of what was exported.
    pub(crate) name: String,
    /// `SoftwareRevision`.
    pub(crate) revision: String,
    pub(crate) doc: String,
    pub(crate) types: Vec<TypeDefinition>,
    pub(crate) modules: Vec<Module>,
    pub(crate) instructions: Vec<InstructionDefinition>,
    pub(crate) tags: Vec<TagDefinition>,
    pub(crate) programs: Vec<ProgramDefinition>,
    pub(crate) tasks: Vec<TaskDefinition>,
}

/// A user-defined type.
#[derive(Debug)]
pub(crate) struct TypeDefinition {
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) is_string: bool,
    pub(crate) members: Vec<MemberDefinition>,
}

/// A member of a type, a parameter or local tag of an Add-On Instruction.
#[derive(Clone, Debug, Default)]
pub(crate) struct MemberDefinition {
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) dimensions: Vec<u32>,
    pub(crate) doc: String,
    /// `Input`, `Output`, `InOut`; empty for a member or a local tag.
    pub(crate) usage: String,
    pub(crate) is_required: bool,
    /// `AliasFor`, of a parameter.
    pub(crate) alias: Option<String>,
    /// `DefaultData`, of a local tag.
    pub(crate) data: Option<Datum>,
}

/// A tag.
#[derive(Clone, Debug, Default)]
pub(crate) struct TagDefinition {
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) dimensions: Vec<u32>,
    pub(crate) doc: String,
    pub(crate) alias: Option<String>,
    pub(crate) data: Option<Datum>,
}

/// The tags of a module's connections.
#[derive(Debug)]
pub(crate) struct Module {
    pub(crate) name: String,
    pub(crate) parent: String,
    /// The address at the parent's port.
    pub(crate) slot: String,
    pub(crate) catalog: String,
    pub(crate) tags: Vec<ModuleTag>,
}

/// A tag of a connection.
#[derive(Debug)]
pub(crate) struct ModuleTag {
    /// `I`, `O` or `C`.
    pub(crate) letter: char,
    pub(crate) data: Datum,
}

/// An Add-On Instruction.
#[derive(Debug)]
pub(crate) struct InstructionDefinition {
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) is_encoded: bool,
    pub(crate) parameters: Vec<MemberDefinition>,
    pub(crate) locals: Vec<MemberDefinition>,
    pub(crate) routines: Vec<RoutineDefinition>,
}

/// A program.
#[derive(Debug)]
pub(crate) struct ProgramDefinition {
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) main: Option<String>,
    pub(crate) is_disabled: bool,
    pub(crate) tags: Vec<TagDefinition>,
    pub(crate) routines: Vec<RoutineDefinition>,
}

/// A routine.
#[derive(Debug)]
pub(crate) struct RoutineDefinition {
    pub(crate) name: String,
    pub(crate) doc: String,
    /// `RLL`, `ST`, `FBD`, `SFC`.
    pub(crate) language: String,
    pub(crate) rungs: Vec<RungDefinition>,
    /// The number of lines, sheets or steps of another language.
    pub(crate) size: usize,
}

/// A rung.
#[derive(Debug)]
pub(crate) struct RungDefinition {
    pub(crate) text: String,
    pub(crate) comment: String,
    /// Its state of editing: `N` is a rung of the running program.
    pub(crate) state: String,
}

/// A task.
#[derive(Debug)]
pub(crate) struct TaskDefinition {
    pub(crate) name: String,
    /// `CONTINUOUS`, `PERIODIC`, `EVENT`.
    pub(crate) kind: String,
    /// In ms.
    pub(crate) rate: f64,
    pub(crate) priority: i32,
    pub(crate) is_inhibited: bool,
    pub(crate) programs: Vec<String>,
}

/// The elements of which a file may have so many that they are counted.
const PARTS: [&str; 4] = ["Rung", "Tag", "LocalTag", "Member"];

/// Reads a file.
///
/// # Errors
/// It is no XML, or no export of Logix, or has more than any program.
pub(crate) fn read(text: &str) -> Result<L5xFile, String> {
    let document = xml_document::parsed(text, &PARTS)?;
    let root = document.root_element();
    if !root.has_tag_name("RSLogix5000Content") {
        return Err(format!("no L5X file: its root is `{}`", root.tag_name().name()));
    }
    let controller = child(root, "Controller").unwrap_or(root);
    let mut file = L5xFile {
        target: attribute(root, "TargetType"),
        name: attribute(root, "TargetName"),
        revision: attribute(root, "SoftwareRevision"),
        doc: description(controller),
        types: items(controller, "DataTypes", "DataType").map(data_type).collect(),
        modules: items(controller, "Modules", "Module").map(module).collect(),
        instructions: items(
            controller,
            "AddOnInstructionDefinitions",
            "AddOnInstructionDefinition",
        )
        .map(instruction)
        .collect(),
        tags: items(controller, "Tags", "Tag").map(tag).collect(),
        programs: items(controller, "Programs", "Program").map(program).collect(),
        tasks: items(controller, "Tasks", "Task").map(task).collect(),
    };
    let encoded = items(controller, "AddOnInstructionDefinitions", "EncodedData");
    file.instructions.extend(
        encoded.map(|node| InstructionDefinition { is_encoded: true, ..instruction(node) }),
    );
    if file.name.is_empty() {
        file.name = attribute(controller, "Name");
    }
    Ok(file)
}

type Xml<'d, 'i> = Node<'d, 'i>;

fn child<'d, 'i>(node: Xml<'d, 'i>, name: &str) -> Option<Xml<'d, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The elements of a list: `<Tags><Tag/>…</Tags>`.
fn items<'d: 'i, 'i>(
    node: Xml<'d, 'i>,
    list: &'static str,
    item: &'static str,
) -> impl Iterator<Item = Xml<'d, 'i>> {
    let lists = node.children().filter(move |child| child.has_tag_name(list));
    lists.flat_map(move |list| list.children().filter(move |child| child.has_tag_name(item)))
}

fn attribute(node: Xml<'_, '_>, name: &str) -> String {
    node.attribute(name).unwrap_or_default().trim().to_owned()
}

fn is_true(node: Xml<'_, '_>, name: &str) -> bool {
    node.attribute(name).is_some_and(|value| value.eq_ignore_ascii_case("true"))
}

/// The text of an element, all of its pieces.
fn text(node: Xml<'_, '_>) -> String {
    node.descendants().filter(Node::is_text).filter_map(|piece| piece.text()).collect()
}

fn description(node: Xml<'_, '_>) -> String {
    child(node, "Description").map_or_else(String::new, localized)
}

/// The text of a description: directly, or its first translation.
fn localized(node: Xml<'_, '_>) -> String {
    let direct: String = node.children().filter_map(|piece| piece.text()).collect();
    let direct = direct.trim().to_owned();
    match direct.is_empty() {
        false => direct,
        true => {
            let first = node.children().find(Node::is_element);
            first.map_or_else(String::new, |first| text(first).trim().to_owned())
        }
    }
}

fn dimensions(text: &str) -> Vec<u32> {
    let numbers = text.split([' ', ',']).filter_map(|number| number.parse::<u32>().ok());
    numbers.filter(|number| *number > 0).collect()
}

fn data_type(node: Xml<'_, '_>) -> TypeDefinition {
    let is_shown = |member: &Xml<'_, '_>| !is_true(*member, "Hidden");
    TypeDefinition {
        name: attribute(node, "Name"),
        doc: description(node),
        is_string: attribute(node, "Family") == "StringFamily",
        members: items(node, "Members", "Member").filter(is_shown).map(member).collect(),
    }
}

fn member(node: Xml<'_, '_>) -> MemberDefinition {
    let kind = attribute(node, "DataType");
    let size = match node.has_attribute("Dimension") {
        true => attribute(node, "Dimension"),
        false => attribute(node, "Dimensions"),
    };
    MemberDefinition {
        name: attribute(node, "Name"),
        kind: if kind == "BIT" { "BOOL".to_owned() } else { kind },
        dimensions: dimensions(&size),
        doc: description(node),
        usage: attribute(node, "Usage"),
        is_required: is_true(node, "Required"),
        alias: node.attribute("AliasFor").map(str::to_owned),
        data: data::decorated(node, "DefaultData"),
    }
}

fn tag(node: Xml<'_, '_>) -> TagDefinition {
    TagDefinition {
        name: attribute(node, "Name"),
        kind: attribute(node, "DataType"),
        dimensions: dimensions(&attribute(node, "Dimensions")),
        doc: description(node),
        alias: node.attribute("AliasFor").map(str::to_owned),
        data: data::decorated(node, "Data"),
    }
}

fn module(node: Xml<'_, '_>) -> Module {
    let port = items(node, "Ports", "Port").find(|port| is_true(*port, "Upstream"));
    let mut tags = Vec::new();
    for part in node.descendants().filter(Node::is_element) {
        let letter = match part.tag_name().name() {
            "InputTag" => 'I',
            "OutputTag" => 'O',
            "ConfigTag" => 'C',
            _ => continue,
        };
        tags.extend(data::decorated(part, "Data").map(|data| ModuleTag { letter, data }));
    }
    Module {
        name: attribute(node, "Name"),
        parent: attribute(node, "ParentModule"),
        slot: port.map_or_else(String::new, |port| attribute(port, "Address")),
        catalog: attribute(node, "CatalogNumber"),
        tags,
    }
}

fn instruction(node: Xml<'_, '_>) -> InstructionDefinition {
    InstructionDefinition {
        name: attribute(node, "Name"),
        doc: description(node),
        is_encoded: false,
        parameters: items(node, "Parameters", "Parameter").map(member).collect(),
        locals: items(node, "LocalTags", "LocalTag").map(member).collect(),
        routines: items(node, "Routines", "Routine").map(routine).collect(),
    }
}

fn program(node: Xml<'_, '_>) -> ProgramDefinition {
    ProgramDefinition {
        name: attribute(node, "Name"),
        doc: description(node),
        main: node.attribute("MainRoutineName").map(str::to_owned),
        is_disabled: is_true(node, "Disabled"),
        tags: items(node, "Tags", "Tag").map(tag).collect(),
        routines: items(node, "Routines", "Routine").map(routine).collect(),
    }
}

fn routine(node: Xml<'_, '_>) -> RoutineDefinition {
    let rungs: Vec<RungDefinition> = items(node, "RLLContent", "Rung").map(rung).collect();
    let other = node.children().filter(|child| child.tag_name().name().ends_with("Content"));
    let other = other.filter(|child| !child.has_tag_name("RLLContent"));
    RoutineDefinition {
        name: attribute(node, "Name"),
        doc: description(node),
        language: attribute(node, "Type"),
        size: other.map(|content| content.children().filter(Node::is_element).count()).sum(),
        rungs,
    }
}

fn rung(node: Xml<'_, '_>) -> RungDefinition {
    RungDefinition {
        text: child(node, "Text").map_or_else(String::new, localized),
        comment: child(node, "Comment").map_or_else(String::new, localized),
        state: attribute(node, "Type"),
    }
}

fn task(node: Xml<'_, '_>) -> TaskDefinition {
    let rate = match node.has_attribute("Rate") {
        true => attribute(node, "Rate"),
        false => attribute(node, "Period"),
    };
    TaskDefinition {
        name: attribute(node, "Name"),
        kind: attribute(node, "Type").to_uppercase(),
        rate: rate.parse().unwrap_or(0.0),
        priority: attribute(node, "Priority").parse().unwrap_or(0),
        is_inhibited: is_true(node, "InhibitTask"),
        programs: items(node, "ScheduledPrograms", "ScheduledProgram")
            .map(|program| attribute(program, "Name"))
            .collect(),
    }
}
