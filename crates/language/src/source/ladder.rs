//! A ladder file as written: blocks, tags and templates, in file order.
//!
//! [`read`] takes the file's text and returns a [`Ladder`] for the resolver. A part that cannot be
//! read is left out and reported as an error finding: with such a finding the ladder is incomplete.
//! No name is looked up here.

use super::file_kind;
use super::finding::{Code, Finding};
use super::key::{BLOCK_NAME, key};
use super::lost::LostText;
use super::reader::{self, Table, Text};
use super::record;
pub use super::record::WrittenRecord;
use super::room::LoadRoom;
use super::rung::{self, USE, read_arguments};
pub(crate) use super::rung::{Entry, Use, WrittenBranch, WrittenLeg, WrittenRung, WrittenStage};
use super::shape::TableShape;
use super::slot::{DeclaredKind, Slot};
use super::span::{FileId, Located, Span};
use super::tag::{self, TagTypes};
pub use super::tag::{FieldOfTag, WrittenTag};
use super::template;
pub use super::template::{Parameter, Template};

/// One ladder file. `R` is the type of its rungs: plain rungs (`WrittenRung`), or rungs and uses of
/// templates as written (`Entry`).
#[derive(Clone, Debug)]
pub struct Ladder<R = WrittenRung> {
    /// `[ladder] name`.
    pub name: Option<Text>,
    /// `[ladder] doc`.
    pub doc: Option<String>,
    /// `[ladder] allow`.
    pub allow: Vec<Text>,
    /// `[ladder] devices`: field devices that a controller file will have.
    pub devices: Vec<Text>,
    /// `[ladder] order`.
    pub order: Option<Located<Vec<Text>>>,
    /// Records, in file order.
    pub records: Vec<WrittenRecord>,
    /// `[tags]`, in file order.
    pub tags: Vec<WrittenTag>,
    /// Programs, tasks and subroutines, in file order.
    pub blocks: Vec<WrittenBlock<R>>,
    /// Templates, in file order.
    pub templates: Vec<Template>,
    /// The missing parts, if the file is not completely TOML.
    pub lost: Option<LostText>,
}

impl Default for Ladder<Entry> {
    fn default() -> Self {
        Ladder {
            name: None,
            doc: None,
            allow: Vec::new(),
            devices: Vec::new(),
            order: None,
            records: Vec::new(),
            tags: Vec::new(),
            blocks: Vec::new(),
            templates: Vec::new(),
            lost: None,
        }
    }
}

/// The header of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BlockForm {
    Program,
    Task,
    Subroutine,
}

/// A Program, Task or subroutine.
#[derive(Clone, Debug)]
pub struct WrittenBlock<R = WrittenRung> {
    /// Its header.
    pub form: BlockForm,
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `doc`.
    pub doc: Option<String>,
    /// `autostart`, of a Program.
    pub autostart: Option<Located<bool>>,
    /// `use`: the template that gives the block its rungs and stages.
    pub body: Option<Use>,
    /// Its own rungs.
    pub rungs: Vec<R>,
    /// Its stages.
    pub stages: Vec<WrittenStage<R>>,
}

const DEVICE_NAMES: &str = r#"{"items":{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}}"#;

/// Reads a ladder file. All files of a load share one `LoadRoom`. The ladder is `None` if the text
/// cannot be read, or may be a different kind of file.
pub fn read(
    room: &mut LoadRoom,
    source: &str,
    file: FileId,
) -> (Option<Ladder<Entry>>, Vec<Finding>) {
    let (ladder, findings) = reader::document_within(room, source, file, |mut root| {
        if let Some(finding) = file_kind::of_test_root(&root, "a ladder file") {
            root.find(finding);
            return None;
        }
        if file_kind::is_controller_root(&root) {
            let finding = controller_file(&mut root);
            root.find(finding);
            return None;
        }
        if is_unclear(&root) {
            return None;
        }
        Some(read_root(root))
    });
    (ladder.flatten(), findings)
}

/// Whether a file with missing parts may be of a different kind.
fn is_unclear(root: &Table<'_>) -> bool {
    let own = ["ladder", "record", "tags", "program", "task", "subroutine", "template"];
    root.doc().lost().is_some() && !own.iter().any(|key| root.has(key))
}

/// The keys of a ladder file.
pub fn shape() -> TableShape {
    reader::shape(|root| drop(read_root(root)))
}

fn controller_file(root: &mut Table<'_>) -> Finding {
    let span = root.key_span("ladder").unwrap_or(root.span());
    let names = if root.has("ladder") {
        root.strings(key("ladder", "The files that a controller file names."))
    } else {
        None
    };
    let names = names.map_or(Vec::new(), |names| names.value);
    let finding =
        Finding::new(Code::Controller, span, "this is a controller file, not a ladder file");
    let all = names.iter().map(|name| &*name.text).collect::<Vec<_>>().join(" ");
    match names.len() {
        1 => finding.help(format!("give the ladder that it names: `{all}`")),
        2.. => finding.help(format!("give the ladders that it names: `{all}`")),
        0 => finding.help("`rungd run` and `rungd check` read it"),
    }
}

fn read_root(mut root: Table<'_>) -> Ladder<Entry> {
    let mut ladder = Ladder { lost: root.doc().lost(), ..Ladder::default() };
    if let Some(mut head) = root.table(key("ladder", "What the file is."), "`[ladder]`") {
        ladder.name = head.string(key("name", "Shown in the log; the file's name if not given."));
        ladder.doc = head.string(key("doc", "What the program is for.")).map(|doc| doc.text);
        ladder.order = head.strings(
            key("order", "The scan order: every Program and Task once.").holds(Slot::Block),
        );
        ladder.allow = head
            .strings(
                key("allow", "Names of warnings that are silenced in this file.")
                    .holds(Slot::Allow),
            )
            .map_or(Vec::new(), |allow| allow.value);
        ladder.devices = head
            .strings(
                key("devices", "Names of field devices that a controller file has.")
                    .limited(DEVICE_NAMES)
                    .holds(Slot::Device),
            )
            .map_or(Vec::new(), |names| names.value);
        head.finish();
    }
    let records = key("record", "Named lists of fields: types of tags.");
    let records = root.tables(records, "a record").into_iter();
    ladder.records = records.map(record::read).collect();
    let tags = key("tags", "Names of memory and of addresses, and named constants.");
    ladder.tags = tag::read_all(&mut root, tags, TagTypes::Ladder);
    let programs = root
        .tables(key("program", "Programs, scanned in file order; `Main` always runs."), "a program")
        .into_iter();
    ladder.blocks = programs.map(|table| read_block(table, BlockForm::Program)).collect();
    let tasks = root
        .tables(
            key("task", "Tasks, scanned after the programs while ENTASK enables them."),
            "a task",
        )
        .into_iter();
    ladder.blocks.extend(tasks.map(|table| read_block(table, BlockForm::Task)));
    let subroutines = key("subroutine", "Rungs that CALL executes, from any number of places.");
    let subroutines = root.tables(subroutines, "a subroutine").into_iter();
    ladder.blocks.extend(subroutines.map(|table| read_block(table, BlockForm::Subroutine)));
    ladder.blocks.sort_by_key(|block| block.span.start);
    let templates = key("template", "Rungs or stages to be used many times.");
    let templates = root.tables(templates, "a template").into_iter();
    ladder.templates = templates.map(template::read).collect();
    root.finish();
    ladder
}

fn read_block(mut table: Table<'_>, form: BlockForm) -> WrittenBlock<Entry> {
    let declared = match form {
        BlockForm::Program => DeclaredKind::Program,
        BlockForm::Task => DeclaredKind::Task,
        BlockForm::Subroutine => DeclaredKind::Subroutine,
    };
    let name = key("name", "Its name.").limited(BLOCK_NAME).declares(declared);
    let name = table.required_string(name);
    let doc = table.string(key("doc", "What it does.")).map(|doc| doc.text);
    let program = form == BlockForm::Program;
    let autostart = if program {
        table.boolean(key("autostart", "Runs from the first scan on."))
    } else {
        None
    };
    let (rungs, stages) = match form {
        BlockForm::Program => (
            key("rung", "Its own rungs, before its stages in every scan."),
            key("stage", "Its stages; the first is the initial one."),
        ),
        BlockForm::Task => {
            (key("rung", "Its rungs."), key("stage", "A task contains no stages.").refused())
        }
        BlockForm::Subroutine => (
            key("rung", "Its rungs, executed by each CALL."),
            key("stage", "A subroutine contains no stages.").refused(),
        ),
    };
    let body = if program { read_body(&mut table, name.as_ref()) } else { None };
    let rungs = rung::read_entries(&mut table, rungs);
    let mut stages = table.tables(stages, "a stage");
    if !program && let Some(stage) = stages.first() {
        let what = if form == BlockForm::Task { "task" } else { "subroutine" };
        let message = format!("a {what} contains no stages");
        let finding = Finding::new(Code::StageInTask, stage.span(), message);
        table.find(finding.help(format!(
            "make it a `[[program]]`, which RUN starts and EXIT ends, or give the {what} rungs",
        )));
        stages.clear();
    }
    let stages = rung::read_stages(stages);
    let span = table.span();
    table.finish();
    WrittenBlock { form, span, name, doc, autostart, body, rungs, stages }
}

/// Reads the use that is a Program's body.
fn read_body(table: &mut Table<'_>, name: Option<&Text>) -> Option<Use> {
    let (template, arguments) = (table.string(USE), read_arguments(table));
    if !table.has("use") {
        if let Some(span) = table.key_span("with") {
            let finding = Finding::new(Code::TemplateRule, span, "`with` without `use`");
            table.find(finding.help("name the template: `use = \"Flush\"`").or_omit());
        }
        return None;
    }
    if let Some(span) = table.key_span("rung").or(table.key_span("stage")) {
        let message = "a program with `use` has only the rungs and stages of the template";
        let finding = Finding::new(Code::TemplateRule, span, message);
        table.find(finding.help("put them into the template, or into a program of their own"));
    }
    let (name, allow) = (name.cloned(), Vec::new());
    Some(Use { span: table.span(), name, template, arguments, allow })
}
