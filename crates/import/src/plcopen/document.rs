//! A PLCopen file as plain data: what the translation needs of the XML.
//!
//! Made by [`read`]. Names and texts are as in the file; whether a name exists is decided later.
//! The elements of ladder bodies are read by `elements`.

use roxmltree::Node;

use super::elements::{LadderElement, element};
use super::sfc_elements::{SfcChart, chart};
use super::xml::{XmlElement, attribute, child, content, is, is_true, text};
use crate::xml_document;

/// A file.
#[derive(Debug, Default)]
pub(super) struct PlcopenFile {
    pub(super) name: String,
    /// The program that wrote it.
    pub(super) product: String,
    pub(super) types: Vec<NamedType>,
    pub(super) units: Vec<ProgramUnit>,
    pub(super) globals: Vec<DeclaredVariable>,
    pub(super) tasks: Vec<DeclaredTask>,
    /// The instances of programs that belong to no task.
    pub(super) free: Vec<ProgramInstance>,
}

/// A data type with a name.
#[derive(Debug)]
pub(super) struct NamedType {
    pub(super) name: String,
    pub(super) kind: WrittenType,
}

/// A type, as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum WrittenType {
    /// `BOOL`, `INT` …
    Elementary(String),
    /// The name of a data type or a function block.
    Derived(String),
    Array {
        element: Box<WrittenType>,
        /// The lower and the upper limit of each dimension.
        limits: Vec<[i64; 2]>,
    },
    Struct(Vec<DeclaredVariable>),
    /// What rungd has nothing for: enumerations, pointers, subranges.
    Other(String),
}

/// What a variable is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VariableUse {
    Local,
    Input,
    Output,
    InOut,
    External,
    Global,
    /// A step of a chart.
    Step,
}

/// A declared variable.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DeclaredVariable {
    pub(super) name: String,
    pub(super) kind: WrittenType,
    /// `%IX0.0`.
    pub(super) address: Option<String>,
    pub(super) initial: Option<InitialValue>,
    pub(super) doc: String,
    pub(super) usage: VariableUse,
    pub(super) is_retained: bool,
}

/// An initial value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum InitialValue {
    Simple(String),
    /// The elements, each as often as it is repeated.
    Array(Vec<InitialValue>),
    /// The members, by name.
    Struct(Vec<InitialMember>),
}

/// The initial value of a member.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InitialMember {
    pub(super) name: String,
    pub(super) value: InitialValue,
}

/// A program, function block or function.
#[derive(Debug)]
pub(super) struct ProgramUnit {
    pub(super) name: String,
    /// `program`, `functionBlock`, `function`.
    pub(super) kind: String,
    pub(super) doc: String,
    pub(super) variables: Vec<DeclaredVariable>,
    /// The type of a function's result.
    pub(super) result: Option<WrittenType>,
    pub(super) body: UnitBody,
    /// Actions and transitions beside the body, by their languages.
    pub(super) others: Vec<String>,
}

/// The body of a unit.
#[derive(Debug)]
pub(super) enum UnitBody {
    Ladder(Vec<LadderElement>),
    Chart(Box<SfcChart>),
    /// Another language, with the number of its lines or elements.
    Other {
        language: String,
        size: usize,
    },
}

/// A task.
#[derive(Debug)]
pub(super) struct DeclaredTask {
    pub(super) name: String,
    /// As a literal, `T#20ms`, or in seconds.
    pub(super) interval: Option<String>,
    /// The variable that starts it.
    pub(super) single: Option<String>,
    pub(super) instances: Vec<ProgramInstance>,
}

/// An instance of a program.
#[derive(Clone, Debug)]
pub(super) struct ProgramInstance {
    pub(super) name: String,
    pub(super) unit: String,
}

/// The elements that are parts of ladders and charts.
const PARTS: [&str; 8] =
    ["contact", "coil", "block", "inVariable", "outVariable", "step", "transition", "action"];
/// Deepest nesting of a type.
const TYPE_DEPTH_MAX: usize = 8;
/// Most elements of an initial value.
const INITIAL_MAX: usize = 4096;

/// Reads a file.
///
/// # Errors
/// It is no XML, no project of PLCopen, or has more than any program.
pub(super) fn read(text: &str) -> Result<PlcopenFile, String> {
    let document = xml_document::parsed(text, &PARTS)?;
    let root = document.root_element();
    if root.tag_name().name() != "project" {
        return Err(format!("no PLCopen project: its root is `{}`", root.tag_name().name()));
    }
    let header = child(root, "fileHeader");
    let value = |name: &str| header.map_or_else(String::new, |header| attribute(header, name));
    let units = below(root, &["types", "pous", "pou"]);
    let mut file = PlcopenFile {
        name: child(root, "contentHeader").map_or_else(String::new, |node| attribute(node, "name")),
        product: format!("{} {}", value("productName"), value("productVersion")).trim().to_owned(),
        types: below(root, &["types", "dataTypes", "dataType"]).into_iter().map(named).collect(),
        units: units.into_iter().map(unit).collect(),
        ..PlcopenFile::default()
    };
    instances(root, &mut file);
    Ok(file)
}

/// Global variables, tasks and instances, wherever in the file they stand.
fn instances(root: XmlElement<'_, '_>, file: &mut PlcopenFile) {
    for node in root.descendants().filter(Node::is_element) {
        let in_unit = || node.ancestors().any(|one| is(one, "interface"));
        match node.tag_name().name() {
            "globalVars" if !in_unit() => file.globals.extend(variables(node, VariableUse::Global)),
            "task" if node.parent().is_some_and(|parent| is(parent, "resource")) => {
                file.tasks.push(DeclaredTask {
                    name: attribute(node, "name"),
                    interval: node.attribute("interval").map(str::to_owned),
                    single: node.attribute("single").map(str::to_owned),
                    instances: program_instances(node),
                });
            }
            "resource" => file.free.extend(program_instances(node)),
            _ => {}
        }
    }
}

fn program_instances(node: XmlElement<'_, '_>) -> Vec<ProgramInstance> {
    let found = node.children().filter(|child| is(*child, "pouInstance"));
    let instance = |node: XmlElement<'_, '_>| {
        let unit = match node.has_attribute("typeName") {
            true => attribute(node, "typeName"),
            false => attribute(node, "type"),
        };
        let name = attribute(node, "name");
        // CODESYS names the program only.
        let unit = if unit.is_empty() { name.clone() } else { unit };
        ProgramInstance { name, unit }
    };
    found.map(instance).collect()
}

/// The elements at the end of a path.
fn below<'d, 'i>(node: XmlElement<'d, 'i>, path: &[&str]) -> Vec<XmlElement<'d, 'i>> {
    let mut found = vec![node];
    for name in path {
        found = found
            .into_iter()
            .flat_map(|node| node.children().filter(|child| is(*child, name)).collect::<Vec<_>>())
            .collect();
    }
    found
}

fn documentation(node: XmlElement<'_, '_>) -> String {
    child(node, "documentation").map_or_else(String::new, text)
}

fn named(node: XmlElement<'_, '_>) -> NamedType {
    let kind = child(node, "baseType").and_then(|base| base.first_element_child());
    NamedType {
        name: attribute(node, "name"),
        kind: kind.map_or(WrittenType::Other("nothing".to_owned()), |kind| written(kind, 0)),
    }
}

/// The type that an element says.
fn written(node: XmlElement<'_, '_>, depth: usize) -> WrittenType {
    let name = node.tag_name().name();
    if depth > TYPE_DEPTH_MAX {
        return WrittenType::Other("a type that nests too deeply".to_owned());
    }
    match name {
        "derived" => WrittenType::Derived(attribute(node, "name")),
        "array" => {
            let limits = node.children().filter(|child| is(*child, "dimension"));
            let limit =
                |node: XmlElement<'_, '_>, name: &str| attribute(node, name).parse::<i64>().ok();
            let limits: Option<Vec<[i64; 2]>> =
                limits.map(|node| Some([limit(node, "lower")?, limit(node, "upper")?])).collect();
            let element = child(node, "baseType").and_then(|base| base.first_element_child());
            match (limits, element) {
                (Some(limits), Some(element)) => {
                    let element = Box::new(written(element, depth + 1));
                    WrittenType::Array { element, limits }
                }
                _ => WrittenType::Other("an array whose limits are no numbers".to_owned()),
            }
        }
        "struct" => {
            let members = node.children().filter(|child| is(*child, "variable"));
            let member = |node| variable(node, VariableUse::Local, depth + 1);
            WrittenType::Struct(members.map(member).collect())
        }
        "enum" | "pointer" | "subrangeSigned" | "subrangeUnsigned" => {
            WrittenType::Other(name.to_owned())
        }
        _ => WrittenType::Elementary(name.to_uppercase()),
    }
}

fn variables(node: XmlElement<'_, '_>, usage: VariableUse) -> Vec<DeclaredVariable> {
    let is_retained = is_true(node, "retain") || is_true(node, "persistent");
    let declared = node.children().filter(|child| is(*child, "variable"));
    declared.map(|node| DeclaredVariable { is_retained, ..variable(node, usage, 0) }).collect()
}

fn variable(node: XmlElement<'_, '_>, usage: VariableUse, depth: usize) -> DeclaredVariable {
    let kind = child(node, "type").and_then(|kind| kind.first_element_child());
    DeclaredVariable {
        name: attribute(node, "name"),
        kind: kind.map_or(WrittenType::Other("nothing".to_owned()), |kind| written(kind, depth)),
        address: node.attribute("address").map(|text| text.trim().to_owned()),
        initial: child(node, "initialValue")
            .and_then(|value| value.first_element_child())
            .map(|value| initial(value, 0)),
        doc: documentation(node),
        usage,
        is_retained: false,
    }
}

fn initial(node: XmlElement<'_, '_>, depth: usize) -> InitialValue {
    let inner = |node: XmlElement<'_, '_>| match node.first_element_child() {
        Some(value) if depth < TYPE_DEPTH_MAX => initial(value, depth + 1),
        _ => InitialValue::Simple(String::new()),
    };
    let values = node.children().filter(|child| is(*child, "value"));
    match node.tag_name().name() {
        "arrayValue" => {
            let mut elements = Vec::new();
            for value in values {
                let count = attribute(value, "repetitionValue").parse::<usize>().unwrap_or(1);
                let count = count.min(INITIAL_MAX.saturating_sub(elements.len()));
                elements.extend(std::iter::repeat_n(inner(value), count));
            }
            InitialValue::Array(elements)
        }
        "structValue" => {
            let member = |value: XmlElement<'_, '_>| InitialMember {
                name: attribute(value, "member"),
                value: inner(value),
            };
            InitialValue::Struct(values.map(member).collect())
        }
        _ => InitialValue::Simple(attribute(node, "value")),
    }
}

fn unit(node: XmlElement<'_, '_>) -> ProgramUnit {
    let mut all = Vec::new();
    for list in child(node, "interface").iter().flat_map(|interface| interface.children()) {
        let usage = match list.tag_name().name() {
            "inputVars" => VariableUse::Input,
            "outputVars" => VariableUse::Output,
            "inOutVars" => VariableUse::InOut,
            "externalVars" => VariableUse::External,
            "localVars" | "tempVars" => VariableUse::Local,
            _ => continue,
        };
        all.extend(variables(list, usage));
    }
    let others = ["actions", "transitions"].into_iter().flat_map(|list| {
        let list = child(node, list);
        let one = |node: XmlElement<'_, '_>| {
            format!("{} {}", node.tag_name().name(), attribute(node, "name"))
        };
        list.map_or_else(Vec::new, |list| {
            list.children().filter(Node::is_element).map(one).collect::<Vec<_>>()
        })
    });
    ProgramUnit {
        name: attribute(node, "name"),
        kind: attribute(node, "pouType"),
        doc: documentation(node),
        variables: all,
        result: child(node, "interface")
            .and_then(|interface| child(interface, "returnType"))
            .and_then(|kind| kind.first_element_child())
            .map(|kind| written(kind, 0)),
        body: child(node, "body").map_or_else(no_body, |content| body(content, node)),
        others: others.collect(),
    }
}

fn no_body() -> UnitBody {
    UnitBody::Other { language: "no language".to_owned(), size: 0 }
}

fn body(node: XmlElement<'_, '_>, unit: XmlElement<'_, '_>) -> UnitBody {
    let Some(content) = content(node) else { return no_body() };
    let language = content.tag_name().name();
    let size = match language {
        "ST" | "IL" => text(content).lines().filter(|line| !line.trim().is_empty()).count(),
        _ => content.children().filter(Node::is_element).count(),
    };
    match language {
        "LD" => {
            UnitBody::Ladder(content.children().filter(Node::is_element).map(element).collect())
        }
        "SFC" => UnitBody::Chart(Box::new(chart(content, unit))),
        _ => UnitBody::Other { language: language.to_owned(), size },
    }
}
