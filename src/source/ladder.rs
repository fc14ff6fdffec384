//! A ladder file as written: blocks, stages, rungs and tags, in file order.
//!
//! [`read`] takes the file's text and returns a [`Ladder`] for the resolver. A part that cannot be
//! read is left out and reported as an error finding: with such a finding the ladder is incomplete.
//! No name is looked up here.

use super::contact::Contact;
use super::contact_parser;
use super::file_kind;
use super::finding::{Code, Finding};
use super::instruction::{self, Instruction};
use super::key::{BLOCK_NAME, Key, NOT_EMPTY, key};
use super::reader::{self, Constant, NamedTable, Table, Text};
use super::room::Room;
use super::shape::Shape;
use super::span::{FileId, Located, Span};

/// The number of elements of an array.
const COUNT: (i64, i64) = (2, 4096);

/// One ladder file.
#[derive(Clone, Debug, Default)]
pub struct Ladder {
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
    /// `[tags]`, in file order.
    pub tags: Vec<Tag>,
    /// Programs and tasks, in file order.
    pub blocks: Vec<Block>,
}

/// A tag.
#[derive(Clone, Debug, Default)]
pub struct Tag {
    /// Its name.
    pub name: Text,
    /// `at`.
    pub at: Option<Text>,
    /// `count`, of an array.
    pub count: Option<Located<i64>>,
    /// `type`.
    pub kind: Option<Text>,
    /// `value`.
    pub value: Option<Located<Constant>>,
    /// `doc`.
    pub doc: Option<String>,
    /// `initial`, one value.
    pub initial: Option<Located<Constant>>,
    /// `initial`, a list.
    pub initials: Option<Located<Vec<Located<Constant>>>>,
    /// `min`.
    pub min: Option<Located<Constant>>,
    /// `max`.
    pub max: Option<Located<Constant>>,
    /// `alarm`.
    pub alarm: Option<Text>,
    /// `log`.
    pub log: Option<Text>,
    /// `spare`.
    pub spare: Option<Located<bool>>,
    /// Whether the tag has `at`, `type` or `value`, even an unreadable one.
    pub has_meaning: bool,
}

impl Tag {
    /// A tag whose mistake is reported at its declaration.
    fn unreadable(name: Text) -> Tag {
        Tag { name, has_meaning: true, ..Tag::default() }
    }
}

/// Whether a block is a Program or a Task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BlockForm {
    Program,
    Task,
}

/// A Program or Task.
#[derive(Clone, Debug)]
pub struct Block {
    /// Program or Task.
    pub form: BlockForm,
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `autostart`, of a Program.
    pub autostart: Option<Located<bool>>,
    /// Its own rungs.
    pub rungs: Vec<Rung>,
    /// Its stages.
    pub stages: Vec<Stage>,
}

/// A Stage.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// Its rungs.
    pub rungs: Vec<Rung>,
}

/// A rung.
#[derive(Clone, Debug)]
pub struct Rung {
    /// From its header to the end of its last value.
    pub extent: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `allow`.
    pub allow: Vec<Text>,
    /// `when`.
    pub when: Option<Leg>,
    /// `leg.*`, in file order.
    pub legs: Vec<Leg>,
    /// `do`.
    pub body: Vec<Instruction>,
    /// Its branches.
    pub branches: Vec<Branch>,
}

/// A series of contacts.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The key: `when`, or the name after `leg.`.
    pub key: Text,
    /// The place of its array.
    pub span: Span,
    /// The readable elements.
    pub contacts: Vec<Contact>,
}

/// A branch of a rung.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The place of its header.
    pub span: Span,
    /// Its contacts.
    pub contacts: Vec<Contact>,
    /// `do`.
    pub body: Vec<Instruction>,
}

/// The name of a tag; the grammar in `docs/language.md`.
const TAG_NAME: &str = r#"{"propertyNames":{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}}"#;
const TAG_TYPES: &str = r#"{"enum":["bit","int","word","real","timer","counter","sensaphone"]}"#;
const DEVICE_NAMES: &str = r#"{"items":{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}}"#;
const RUNG_NAME: &str = r#"{"pattern":"^[a-z0-9]+(-[a-z0-9]+)*$"}"#;
const LEGS: &str =
    r#"{"minProperties":1,"propertyNames":{"enum":["up","dn","rst","en","data","clk"]}}"#;
/// A JSON Schema of a rung: either `when` or `leg`.
const ONE_KIND_OF_LEGS: &str = r#"{"oneOf":[{"required":["when"]},{"required":["leg"]}],
            "anyOf":[{"required":["do"]},{"required":["branch"]}]}"#;

/// Reads a ladder file, one of those that share the `Room` of a load. The ladder is `None` if the
/// text is not TOML, or a controller file.
pub fn read(room: &mut Room, source: &str, file: FileId) -> (Option<Ladder>, Vec<Finding>) {
    let (ladder, findings) = reader::document_within(room, source, file, |mut root| {
        if file_kind::is_controller_root(&root) {
            let finding = controller_file(&mut root);
            root.find(finding);
            return None;
        }
        Some(read_root(root))
    });
    (ladder.flatten(), findings)
}

/// The keys of a ladder file.
pub fn shape() -> Shape {
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
    match names.first() {
        Some(name) => finding.help(format!("give the ladder that it names: `{}`", name.text)),
        None => finding.help("`rungd run` and `rungd check` take it"),
    }
}

fn read_root(mut root: Table<'_>) -> Ladder {
    let mut ladder = Ladder::default();
    if let Some(mut head) = root.table(key("ladder", "What the file is."), "`[ladder]`") {
        ladder.name = head.string(key("name", "Shown in the log; else the file's name."));
        ladder.doc = head.string(key("doc", "What the program is for.")).map(|doc| doc.text);
        ladder.order = head.strings(key("order", "The scan order: every Program and Task once."));
        ladder.allow = head
            .strings(key("allow", "Names of warnings that are silenced in this file."))
            .map_or(Vec::new(), |allow| allow.value);
        ladder.devices = head
            .strings(
                key("devices", "Names of field devices that a controller file has.")
                    .limited(DEVICE_NAMES),
            )
            .map_or(Vec::new(), |names| names.value);
        head.finish();
    }
    if let Some(mut tags) = root.table(
        key("tags", "Names of memory and of addresses, and named constants.").limited(TAG_NAME),
        "`[tags]`",
    ) {
        let any = key(
            "*",
            "A tag: a name for an address (`at`), memory (`type`) or a constant (`value`).",
        );
        let help = |name: &str, value: &str| {
            let key = if value.starts_with('"') { "at" } else { "value" };
            format!("write `{name} = {{ {key} = {value} }}`")
        };
        let entries = tags.entries(any, "a tag", help);
        ladder.tags = entries.into_iter().map(read_tag).collect();
    }
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
    ladder.blocks.sort_by_key(|block| block.span.start);
    root.finish();
    ladder
}

fn read_tag(NamedTable { name, table }: NamedTable<'_>) -> Tag {
    let Some(mut table) = table else { return Tag::unreadable(name) };
    table.together(
        r#"{"oneOf":[{"required":["at"]},{"required":["type"]},{"required":["value"]}]}"#,
    );
    let at = table.string(key("at", "The address: `X0`, `D1`, `CT0`, `CT0.Acc`."));
    let kind = table.string(
        key("type", "What it is; rungd gives it a place in memory, and it has no address.")
            .limited(TAG_TYPES),
    );
    let count = table.integer(key("count", "An array of so many neighbours from `at` on."), COUNT);
    let initial = key(
        "initial",
        "Its value after a cold start; else 0, OFF. An array takes a list too, one for each.",
    );
    let (initial, initials) = table.constants(initial);
    let tag = Tag {
        name,
        at,
        kind,
        count,
        value: table
            .constant(key("value", "A constant: a number, or a duration as `\"2s500ms\"`.")),
        doc: table.string(key("doc", "What it is.")).map(|doc| doc.text),
        initial,
        initials,
        min: table.constant(key(
            "min",
            "A write from outside below this is refused; a write by the ladder is limited to it.",
        )),
        max: table.constant(key(
            "max",
            "A write from outside above this is refused; a write by the ladder is limited to it.",
        )),
        alarm: table.string(key("alarm", "A text: a warning in the log when the bit goes ON.")),
        log: table.string(key("log", "Each change is logged.").limited(r#"{"const":"change"}"#)),
        spare: table.boolean(key("spare", "Unused on purpose: no warning.")),
        has_meaning: ["at", "type", "value"].iter().any(|key| table.has(key)),
    };
    table.finish();
    tag
}

fn read_block(mut table: Table<'_>, form: BlockForm) -> Block {
    let name = table.required_string(key("name", "Its name.").limited(BLOCK_NAME));
    table.string(key("doc", "What it does."));
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
    };
    let rungs = table.tables(rungs, "a rung").into_iter().map_while(read_rung_in_time).collect();
    let mut stages = table.tables(stages, "a stage");
    if !program && let Some(stage) = stages.first() {
        let message = "a task contains no stages";
        let finding = Finding::new(Code::StageInTask, stage.span(), message);
        table.find(finding.help(
            "make it a `[[program]]`, which RUN starts and EXIT ends, or give the task rungs",
        ));
        stages.clear();
    }
    let stages = stages.into_iter().map(read_stage).collect();
    let span = table.span();
    table.finish();
    Block { form, span, name, autostart, rungs, stages }
}

fn read_stage(mut table: Table<'_>) -> Stage {
    let name =
        table.required_string(key("name", "Its name, unique in its program.").limited(BLOCK_NAME));
    table.string(key("doc", "What it does."));
    let rungs = table
        .tables(key("rung", "Its rungs, executed while the stage is ON."), "a rung")
        .into_iter()
        .map_while(read_rung_in_time)
        .collect();
    let span = table.span();
    table.finish();
    Stage { span, name, rungs }
}

/// `None` when the load is to end.
fn read_rung_in_time(table: Table<'_>) -> Option<Rung> {
    (!table.doc().is_over()).then(|| read_rung(table))
}

fn read_rung(mut table: Table<'_>) -> Rung {
    let (span, extent) = (table.span(), table.extent());
    table.together(ONE_KIND_OF_LEGS);
    let name =
        table.string(key("name", "A name in kebab-case, unique in its block.").limited(RUNG_NAME));
    table.string(key("doc", "Why the rung is there."));
    let allow = table
        .strings(key("allow", "Names of warnings that are silenced here."))
        .map_or(Vec::new(), |allow| allow.value);
    let contacts = key("when", "Contacts in series; `|` is a parallel branch.");
    let when = read_when(&mut table, contacts.limited(NOT_EMPTY));
    let legs = match table
        .table(key("leg", "The legs of an instruction that has several.").limited(LEGS), "`leg`")
    {
        Some(mut legs) => legs.string_arrays(
            key("*", "The contacts of this leg, in series.").limited(NOT_EMPTY),
            "leg.",
        ),
        None => Vec::new(),
    };
    let legs: Vec<Leg> =
        legs.into_iter().map(|(key, texts)| read_leg(&table, key, texts)).collect();
    check_legs(&table);
    let instructions = key("do", "Instructions, executed in order with the rung's power.");
    let body = read_body(&mut table, instructions);
    let branches: Vec<Branch> = table
        .tables(
            key("branch", "Further contacts after the rung's own, with instructions."),
            "a branch",
        )
        .into_iter()
        .map(read_branch)
        .collect();
    if !table.has("do") && branches.is_empty() {
        table.find(no_instruction("a rung", span));
    }
    table.finish();
    Rung { extent, name, allow, when, legs, body, branches }
}

fn check_legs(table: &Table<'_>) {
    let finding = match (table.has("when"), table.key_span("leg")) {
        (true, Some(leg)) => {
            let message = "a rung has `when` or `leg.*`, not both";
            let when = table.key_span("when").unwrap_or(leg);
            Finding::new(Code::MixedLegs, leg, message)
                .related(when, "`when` is here")
                .help("`when` is for instructions with one leg; `leg.*` names the legs of others")
        }
        (false, None) => Finding::new(Code::MixedLegs, table.span(), "a rung without contacts")
            .help("a rung that is always ON says so: `when = [\"$On\"]`"),
        _ => return,
    };
    table.find(finding);
}

fn read_branch(mut table: Table<'_>) -> Branch {
    let span = table.span();
    table.together(r#"{"required":["when","do"]}"#);
    let when = key("when", "Contacts in series after the rung's own.");
    let contacts =
        read_when(&mut table, when.limited(NOT_EMPTY)).map_or(Vec::new(), |leg| leg.contacts);
    if !table.has("when") {
        let finding = Finding::new(Code::MixedLegs, span, "a branch without contacts");
        table.find(finding.help(
            "a branch adds contacts to the rung's: `when = [\"X1\"]`; to do more with the rung's \
             own, put it in the rung's `do`",
        ));
    }
    let instructions = key("do", "Instructions, executed in order.");
    let body = read_body(&mut table, instructions.limited(NOT_EMPTY));
    if !table.has("do") {
        table.find(no_instruction("a branch", span));
    }
    table.finish();
    Branch { span, contacts, body }
}

fn no_instruction(what: &str, span: Span) -> Finding {
    let finding = Finding::new(Code::NoInstruction, span, format!("{what} that drives nothing"));
    finding.help("give it an instruction: `do = [\"OUT Y0\"]`")
}

fn read_when(table: &mut Table<'_>, when: Key) -> Option<Leg> {
    let key_span = table.key_span("when");
    let (texts, key_span) = (table.strings(when)?, key_span?);
    let key = Text { text: "when".to_owned(), span: key_span, exact: true };
    Some(read_leg(table, key, texts))
}

fn read_leg(table: &Table<'_>, key: Text, texts: Located<Vec<Text>>) -> Leg {
    if texts.value.is_empty() && !table.doc().has_finding_in(texts.span) {
        let finding = Finding::new(Code::EmptyLeg, texts.span, "a leg without contacts");
        table.find(finding.help("always ON is `[\"$On\"]`, never is `[\"$Off\"]`"));
    }
    let mut contacts = Vec::new();
    for text in &texts.value {
        if !plain(table, text, Code::ContactSyntax) {
            continue;
        }
        match contact_parser::parse(&text.text, text.span) {
            Ok(contact) => contacts.push(contact),
            Err(finding) => table.find(finding),
        }
    }
    Leg { key, span: texts.span, contacts }
}

fn read_body(table: &mut Table<'_>, body: Key) -> Vec<Instruction> {
    let Some(texts) = table.strings(body) else { return Vec::new() };
    let unread = table.doc().has_finding_in(texts.span);
    if texts.value.is_empty() && !table.has("branch") && !unread {
        table.find(no_instruction(table.place(), texts.span));
    }
    let mut body = Vec::new();
    let mut findings = Vec::new();
    for text in &texts.value {
        if plain(table, text, Code::InstructionSyntax) {
            body.extend(instruction::parse(&text.text, text.span, &mut findings));
        }
    }
    findings.into_iter().for_each(|finding| table.find(finding));
    body
}

/// The most bytes of a contact's or an instruction's text.
const TEXT_BYTES_MAX: usize = 64 * 1024;

/// Whether the text is short enough for its parts, and whether the file holds it byte by byte (no
/// escapes); only then does each part have a place. Otherwise adds a finding.
fn plain(table: &Table<'_>, text: &Text, code: Code) -> bool {
    if text.text.len() > TEXT_BYTES_MAX {
        let message = format!("a string of more than {TEXT_BYTES_MAX} bytes");
        let finding = Finding::new(code, text.span, message);
        table.find(
            finding.help("write several strings in the array: a contact or instruction each"),
        );
        return false;
    }
    if !text.exact {
        let finding = Finding::new(code, text.span, "a string with `\\` or several lines");
        table.find(finding.help("nothing here needs an escape: write it plainly, on one line"));
    }
    text.exact
}
