//! Templates as written: parameters, tags, and rungs or stages, to be used many times.
//!
//! Called by the reader of ladder files. No name is looked up here, and no rung is expanded.

use super::fix::{pair, propose, write};
use super::key::{BLOCK_NAME, key};
use super::reader::{NamedTable, Table, Text};
use super::rung::{self, Entry, WrittenStage};
use super::slot::{DeclaredKind, KeySlot, Slot};
use super::span::Span;
use super::tag::{self, TagTypes, WrittenTag};

/// A template.
#[derive(Clone, Debug)]
pub struct Template {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `[template.parameters]`, in file order.
    pub parameters: Vec<Parameter>,
    /// `[template.tags]`, in file order: each use has its own tags.
    pub tags: Vec<WrittenTag>,
    /// Its rungs and uses.
    pub rungs: Vec<Entry>,
    /// Its stages; a template with stages is the body of a Program.
    pub stages: Vec<WrittenStage<Entry>>,
    /// `doc`.
    pub doc: Option<String>,
}

/// A parameter.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its name.
    pub name: Text,
    /// `type`; `None` if it is missing or unreadable, which is reported.
    pub kind: Option<Text>,
    /// `default` as text, even for a number without quotes.
    pub default: Option<Text>,
    /// `doc`.
    pub doc: Option<String>,
}

/// The types of parameters; a record's name is a type too.
const TYPES: &str = r#"{"anyOf":[{"enum":["contact","bit","int","real","duration","output",
    "int-out","real-out","timer","counter","sensaphone","array"]},
    {"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}]}"#;
/// The name of a parameter; its grammar is in `docs/language.md`.
const NAME: &str = r#"{"propertyNames":{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}}"#;

/// Reads a template.
pub(super) fn read(mut table: Table<'_>) -> Template {
    let template = Template {
        span: table.span(),
        name: table.required_string(
            key("name", "Its name.").limited(BLOCK_NAME).declares(DeclaredKind::Template),
        ),
        parameters: read_parameters(&mut table),
        tags: tag::read_all(
            &mut table,
            key("tags", "Tags; each use has its own."),
            TagTypes::Template,
        ),
        rungs: rung::read_entries(&mut table, key("rung", "Its rungs, in the place of a use.")),
        stages: {
            let stages = key("stage", "Its stages: then it is the body of a program.");
            rung::read_stages(table.tables(stages, "a stage"))
        },
        doc: table.string(key("doc", "What it does.")).map(|doc| doc.text),
    };
    table.finish();
    template
}

fn read_parameters(table: &mut Table<'_>) -> Vec<Parameter> {
    let parameters =
        key("parameters", "Its parameters: names for the arguments of a use.").limited(NAME);
    let Some(mut parameters) = table.table(parameters, "`[template.parameters]`") else {
        return Vec::new();
    };
    let any = key("*", "A parameter: a name for an argument.")
        .named(KeySlot::Declares(DeclaredKind::Parameter));
    let help = |name: &str, value: &str| match value.as_bytes() {
        [b'[', ..] => tag::above(name),
        [b'"', ..] => write(pair(format!("{name} = {{ type = {value} }}"))),
        _ => propose(pair(format!("{name} = {{ type = \"int\", default = {value} }}"))),
    };
    let entries = parameters.entries(any, "a parameter", help);
    entries.into_iter().map(read_parameter).collect()
}

fn read_parameter(NamedTable { name, table }: NamedTable<'_>) -> Parameter {
    let Some(mut table) = table else {
        return Parameter { name, kind: None, default: None, doc: None };
    };
    let kind =
        key("type", "The kind of argument that it accepts.").limited(TYPES).holds(Slot::Type);
    let parameter = Parameter {
        name,
        kind: table.required_string(kind),
        default: table
            .scalar(key("default", "Its value if a use does not give it.").holds(Slot::Operand)),
        doc: table.string(key("doc", "What it is.")).map(|doc| doc.text),
    };
    table.finish();
    parameter
}
