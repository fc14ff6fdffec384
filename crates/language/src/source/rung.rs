//! Rungs and uses of templates as written, and the stages that contain them.
//!
//! Called by the readers of blocks (`ladder`) and of templates (`template`). A table of a `rung`
//! array is a rung or a use. The rungs of a template take the place of a use; the resolver finds
//! the template and applies the arguments.

use super::contact::WrittenContact;
use super::contact_parser;
use super::finding::{Code, Finding};
use super::fix::{FixEdit, advise, pair, possible};
use super::instruction::{self, WrittenInstruction};
use super::key::{BLOCK_NAME, Key, NOT_EMPTY, key};
use super::reader::{Table, Text};
use super::slot::{DeclaredKind, KeySlot, Slot};
use super::span::{Located, Span};

/// A Stage. `R` is the type of its rungs: plain rungs (`WrittenRung`), or rungs and uses as written
/// (`Entry`).
#[derive(Clone, Debug)]
pub struct WrittenStage<R = WrittenRung> {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `doc`.
    pub doc: Option<String>,
    /// Its rungs.
    pub rungs: Vec<R>,
}

/// An entry of a `rung` array.
#[derive(Clone, Debug)]
pub enum Entry {
    /// A rung.
    Rung(WrittenRung),
    /// The rungs of a template.
    Use(Use),
}

/// A use of a template.
#[derive(Clone, Debug)]
pub struct Use {
    /// The place of its header.
    pub span: Span,
    /// `name`; if the use is the body of a Program, the Program's name.
    pub name: Option<Text>,
    /// `use`: the name of the template.
    pub template: Option<Text>,
    /// `with`, in file order: the names of parameters, each with its value as text, even for a
    /// number without quotes. `None` for a value of a wrong type, which is reported.
    pub arguments: Vec<(Text, Option<Text>)>,
    /// `allow`.
    pub allow: Vec<Text>,
}

/// A rung.
#[derive(Clone, Debug)]
pub struct WrittenRung {
    /// From its header to the end of its last value.
    pub extent: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `doc`.
    pub doc: Option<String>,
    /// `allow`.
    pub allow: Vec<Text>,
    /// `when`.
    pub when: Option<WrittenLeg>,
    /// `leg.*`, in file order.
    pub legs: Vec<WrittenLeg>,
    /// `do`.
    pub body: Vec<WrittenInstruction>,
    /// Its branches.
    pub branches: Vec<WrittenBranch>,
}

/// A series of contacts.
#[derive(Clone, Debug)]
pub struct WrittenLeg {
    /// The key: `when`, or the name after `leg.`.
    pub key: Text,
    /// The place of its array.
    pub span: Span,
    /// The readable elements.
    pub contacts: Vec<WrittenContact>,
}

/// A branch of a rung.
#[derive(Clone, Debug)]
pub struct WrittenBranch {
    /// The place of its header.
    pub span: Span,
    /// Its contacts.
    pub contacts: Vec<WrittenContact>,
    /// `do`.
    pub body: Vec<WrittenInstruction>,
}

const RUNG_NAME: &str = r#"{"pattern":"^([a-z0-9]+(-[a-z0-9]+)*|[A-Za-z][A-Za-z0-9_]*)$"}"#;
const LEGS: &str =
    r#"{"minProperties":1,"propertyNames":{"enum":["up","dn","rst","en","data","clk"]}}"#;
/// A JSON Schema of a rung: `when`, `leg` or `use`.
const ONE_KIND_OF_LEGS: &str = r#"{"oneOf":[{"required":["when"]},{"required":["leg"]},
            {"required":["use","name"]},{"required":["todo"]}],
            "anyOf":[{"required":["do"]},{"required":["branch"]},{"required":["use"]},
            {"required":["todo"]}]}"#;
const UNTRANSLATED: Key =
    key("todo", "Why an import could not translate the rung that belongs here.");
const WAS: Key = key("was", "The rung in the language from which it was imported.");
pub(super) const USE: Key =
    key("use", "The name of a template; its rungs are inserted here.").holds(Slot::Template);
pub(super) const WITH: Key =
    key("with", "The arguments of the template, by the names of its parameters.");
const ARGUMENT: Key = key(
    "*",
    "An argument: contacts, a name or a constant, depending on the type of the parameter.",
)
.holds(Slot::Argument)
.named(KeySlot::Parameter);

/// Reads the rungs and uses of a table.
pub(super) fn read_entries(table: &mut Table<'_>, rung: Key) -> Vec<Entry> {
    table.tables(rung, "a rung").into_iter().map_while(read_entry_in_time).collect()
}

/// Reads the stages of a table.
pub(super) fn read_stages(stages: Vec<Table<'_>>) -> Vec<WrittenStage<Entry>> {
    stages.into_iter().map(read_stage).collect()
}

/// Reads the arguments of a use.
pub(super) fn read_arguments(table: &mut Table<'_>) -> Vec<(Text, Option<Text>)> {
    table.table(WITH, "`with`").map_or(Vec::new(), |mut with| with.scalars(ARGUMENT))
}

fn read_stage(mut table: Table<'_>) -> WrittenStage<Entry> {
    let name = key("name", "Its name, unique in its program.").limited(BLOCK_NAME);
    let name = table.required_string(name.declares(DeclaredKind::Stage));
    let doc = table.string(key("doc", "What it does.")).map(|doc| doc.text);
    let rungs = read_entries(&mut table, key("rung", "Its rungs, executed while the stage is ON."));
    let span = table.span();
    table.finish();
    WrittenStage { span, name, doc, rungs }
}

/// Reads a rung or a use; `None` if the load must end.
fn read_entry_in_time(table: Table<'_>) -> Option<Entry> {
    (!table.doc().is_over()).then(|| match table.has("use") {
        true => Entry::Use(read_use(table)),
        false => Entry::Rung(read_rung(table)),
    })
}

fn read_use(mut table: Table<'_>) -> Use {
    table.call("a use");
    let template_use = Use {
        span: table.span(),
        name: table.required_string(key("name", "The name of this use.")),
        template: table.string(USE),
        arguments: read_arguments(&mut table),
        allow: read_allow(&mut table),
    };
    table.string(key("doc", "Why it is there."));
    let own = ["when", "leg", "do", "branch"].into_iter().find(|key| table.has(key));
    match own.and_then(|key| Some((key, table.key_span(key)?))) {
        Some((key, span)) => {
            let message = format!("a use has no `{key}`: its rungs are the template's");
            let finding = Finding::new(Code::TemplateRule, span, message);
            let finding = finding.help("its arguments belong in `with`; or write a rung");
            table.find(finding.or_omit());
        }
        None => table.finish(),
    }
    template_use
}

fn read_allow(table: &mut Table<'_>) -> Vec<Text> {
    let allow = key("allow", "Names of warnings that are silenced here.").holds(Slot::Allow);
    table.strings(allow).map_or(Vec::new(), |allow| allow.value)
}

fn read_rung(mut table: Table<'_>) -> WrittenRung {
    let (span, extent) = (table.span(), table.extent());
    table.together(ONE_KIND_OF_LEGS);
    let name = key("name", "A name in kebab-case, unique in its block.").limited(RUNG_NAME);
    let name = table.string(name.declares(DeclaredKind::Rung));
    let doc = table.string(key("doc", "Why the rung is there.")).map(|doc| doc.text);
    let allow = read_allow(&mut table);
    if let (None, Some(span)) = (table.string(USE), table.key_span("with")) {
        let finding = Finding::new(Code::TemplateRule, span, "`with` without `use`");
        table.find(finding.help("name the template: `use = \"…\"`").or_omit());
    }
    read_arguments(&mut table);
    let contacts = key("when", "Contacts in series; `|` is a parallel branch.");
    let when = read_when(&mut table, contacts.limited(NOT_EMPTY));
    let legs = match table
        .table(key("leg", "The legs of an instruction that has several.").limited(LEGS), "`leg`")
    {
        Some(mut legs) => legs.string_arrays(
            key("*", "The contacts of this leg, in series.")
                .limited(NOT_EMPTY)
                .holds(Slot::Contacts),
            "leg.",
        ),
        None => Vec::new(),
    };
    let legs: Vec<WrittenLeg> =
        legs.into_iter().map(|(key, texts)| read_leg(&table, key, texts)).collect();
    let is_todo = check_legs(&mut table);
    let instructions = key("do", "Instructions, executed in order with the rung's power.");
    let body = read_body(&mut table, instructions);
    let branches: Vec<WrittenBranch> = table
        .tables(
            key("branch", "Further contacts after the rung's own, with instructions."),
            "a branch",
        )
        .into_iter()
        .map(read_branch)
        .collect();
    if !table.has("do") && branches.is_empty() && !is_todo {
        table.find(no_instruction("a rung", span));
    }
    table.finish();
    WrittenRung { extent, name, doc, allow, when, legs, body, branches }
}

/// Reads `todo` and `was`, and reports them. Returns whether the rung has a `todo`.
fn read_todo(table: &mut Table<'_>) -> bool {
    let (todo, was) = (table.string(UNTRANSLATED), table.string(WAS));
    let Some(todo) = todo else { return table.has("todo") };
    let message = format!("a rung was not translated: {}", todo.text);
    let help = match was {
        Some(was) => format!("the original is {}; write the rung in its place", was.text),
        None => "write the rung in its place".to_owned(),
    };
    table.find(Finding::new(Code::ImportedTodo, todo.span, message).help(help));
    true
}

/// Reports legs of two kinds, and a rung without legs; returns whether it stands for one that was
/// not translated. Other rungs have no `todo`, so nothing is looked up for them.
fn check_legs(table: &mut Table<'_>) -> bool {
    let finding = match (table.has("when"), table.key_span("leg")) {
        (true, Some(leg)) => {
            let message = "a rung has `when` or `leg.*`, not both";
            let when = table.key_span("when").unwrap_or(leg);
            Finding::new(Code::MixedLegs, leg, message)
                .related(when, "`when` is here")
                .help("`when` is for instructions with one leg; `leg.*` names the legs of others")
                .fix(possible(FixEdit::Remove("when")))
        }
        (false, None) if read_todo(table) => return true,
        (false, None) => Finding::new(Code::MixedLegs, table.span(), "a rung without contacts")
            .help(advise(
                "a rung that is always ON says so: `{}`",
                [pair("when = [\"$On\"]").possible()],
            )),
        _ => return false,
    };
    table.find(finding);
    false
}

fn read_branch(mut table: Table<'_>) -> WrittenBranch {
    let span = table.span();
    table.together(r#"{"required":["when","do"]}"#);
    let when = key("when", "Contacts in series after the rung's own.");
    let contacts =
        read_when(&mut table, when.limited(NOT_EMPTY)).map_or(Vec::new(), |leg| leg.contacts);
    if !table.has("when") {
        let finding = Finding::new(Code::MixedLegs, span, "a branch without contacts");
        let help = "a branch adds contacts to the rung's: `when = [\"X1\"]`; to do more with the \
                    rung's own, put it in the rung's `do`";
        table.find(finding.help(help).fix(pair("when = [\"X1\"]").possible()));
    }
    let instructions = key("do", "Instructions, executed in order.");
    let body = read_body(&mut table, instructions.limited(NOT_EMPTY));
    if !table.has("do") {
        table.find(no_instruction("a branch", span));
    }
    table.finish();
    WrittenBranch { span, contacts, body }
}

fn no_instruction(what: &str, span: Span) -> Finding {
    let finding = Finding::new(Code::NoInstruction, span, format!("{what} that drives nothing"));
    let instruction = pair("do = [\"OUT C0\"]").possible();
    finding.help("give it an instruction: `do = [\"OUT …\"]`").fix(instruction)
}

fn read_when(table: &mut Table<'_>, when: Key) -> Option<WrittenLeg> {
    let key_span = table.key_span("when");
    let (texts, key_span) = (table.strings(when.holds(Slot::Contacts))?, key_span?);
    let key = Text { text: "when".to_owned(), span: key_span, exact: true };
    Some(read_leg(table, key, texts))
}

fn read_leg(table: &Table<'_>, key: Text, texts: Located<Vec<Text>>) -> WrittenLeg {
    if texts.value.is_empty() && !table.doc().has_finding_in(texts.span) {
        let finding = Finding::new(Code::EmptyLeg, texts.span, "a leg without contacts");
        let ends = ["[\"$On\"]", "[\"$Off\"]"].map(possible);
        table.find(finding.help(advise("always ON is `{}`, always OFF is `{}`", ends)));
    }
    let mut contacts = Vec::new();
    for text in &texts.value {
        if !table.doc().is_plain(text, Code::ContactSyntax, "a contact or instruction") {
            continue;
        }
        match contact_parser::parse(&text.text, text.span) {
            Ok(contact) => contacts.push(contact),
            Err(finding) => table.find(finding),
        }
    }
    WrittenLeg { key, span: texts.span, contacts }
}

fn read_body(table: &mut Table<'_>, body: Key) -> Vec<WrittenInstruction> {
    let Some(texts) = table.strings(body.holds(Slot::Instruction)) else { return Vec::new() };
    let unread = table.doc().has_finding_in(texts.span);
    if texts.value.is_empty() && !table.has("branch") && !unread {
        table.find(no_instruction(table.place(), texts.span));
    }
    let mut body = Vec::new();
    let mut findings = Vec::new();
    for text in &texts.value {
        if table.doc().is_plain(text, Code::InstructionSyntax, "a contact or instruction") {
            body.extend(instruction::parse(&text.text, text.span, &mut findings));
        }
    }
    findings.into_iter().for_each(|finding| table.find(finding));
    body
}
