//! The symbol, the few words and the explanation that are shown with a proposal.

use lsp_types::CompletionItemKind;

use crate::names::Declaration;
use crate::project::Project;
use crate::slots::DeclaredKind;
use crate::tag_facts::TagFacts;
use rungd_engine::isa::Spec;

/// The symbol of a declaration.
pub(super) fn symbol(kind: DeclaredKind) -> CompletionItemKind {
    match kind {
        DeclaredKind::Tag | DeclaredKind::OwnTag => CompletionItemKind::VARIABLE,
        DeclaredKind::Parameter => CompletionItemKind::TYPE_PARAMETER,
        DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Subroutine => {
            CompletionItemKind::MODULE
        }
        DeclaredKind::Stage => CompletionItemKind::ENUM_MEMBER,
        DeclaredKind::Rung | DeclaredKind::Test => CompletionItemKind::FUNCTION,
        DeclaredKind::Template => CompletionItemKind::CLASS,
        DeclaredKind::Use => CompletionItemKind::STRUCT,
        DeclaredKind::Device => CompletionItemKind::INTERFACE,
        DeclaredKind::Record => CompletionItemKind::STRUCT,
        DeclaredKind::Field => CompletionItemKind::FIELD,
    }
}

/// A few words about a declaration: its address, its type or its kind.
pub(super) fn detail(declared: &Declaration, project: &Project) -> String {
    let file = &project.files[declared.file];
    let used = || {
        declared.template.as_deref().map(|template| format!(" of {template}")).unwrap_or_default()
    };
    match declared.kind {
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Field => tag_words(&TagFacts::of(declared, file)),
        DeclaredKind::Record => "record".to_owned(),
        DeclaredKind::Program => format!("program{}", used()),
        DeclaredKind::Task => "task".to_owned(),
        DeclaredKind::Subroutine => "subroutine".to_owned(),
        DeclaredKind::Stage => "stage".to_owned(),
        DeclaredKind::Rung => "rung".to_owned(),
        DeclaredKind::Template => "template".to_owned(),
        DeclaredKind::Use => format!("use{}", used()),
        DeclaredKind::Device => "field device".to_owned(),
        DeclaredKind::Test => "test".to_owned(),
    }
}

/// `X0`, `int, 10 elements`, `= 3`, `bit, else X0`.
fn tag_words(facts: &TagFacts) -> String {
    let main = facts.text("at").or(facts.text("type")).map(str::to_owned);
    let value = || facts.text("value").map(|value| format!("= {value}"));
    let mut words: Vec<String> = main.or_else(value).into_iter().collect();
    words.extend(facts.text("count").map(|count| format!("{count} elements")));
    words.extend(facts.text("default").map(|default| format!("else {default}")));
    words.join(", ")
}

/// The explanation of a declaration, with its limits.
pub(super) fn doc(declared: &Declaration, project: &Project) -> String {
    let mut parts: Vec<String> = declared.doc.iter().map(|doc| plain(doc)).collect();
    if matches!(declared.kind, DeclaredKind::Tag | DeclaredKind::OwnTag | DeclaredKind::Field) {
        let facts = TagFacts::of(declared, &project.files[declared.file]);
        let limits = match (facts.text("min"), facts.text("max")) {
            (Some(min), Some(max)) => Some(format!("From {min} to {max}.")),
            (Some(min), None) => Some(format!("At least {min}.")),
            (None, Some(max)) => Some(format!("At most {max}.")),
            (None, None) => None,
        };
        parts.extend(limits);
        parts.extend(facts.text("initial").map(|text| format!("After a cold start {text}.")));
        let terms = [
            facts.text("priority").map(str::to_owned),
            facts.text("group").map(|group| format!("group {group}")),
            facts.text("delay").map(|delay| format!("after {delay}")),
            facts.text("off-delay").map(|delay| format!("until {delay} after it")),
            facts.text("ack").map(|bit| format!("acknowledged by {bit}")),
        ];
        let terms = terms.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let terms = if terms.is_empty() { terms } else { format!(" ({})", plain(&terms)) };
        parts.extend(facts.text("alarm").map(|text| format!("Alarm{terms}: {}", plain(text))));
    }
    parts.join("\n\n")
}

/// A text of a file as Markdown, with the characters escaped that Markdown would read as marks.
fn plain(text: &str) -> String {
    let mut shown = String::new();
    for c in text.chars() {
        if matches!(c, '*' | '_' | '#' | '<' | '[' | '\\') {
            shown.push('\\');
        }
        shown.push(c);
    }
    shown
}

/// The explanation of an instruction.
pub(super) fn instruction_doc(spec: &Spec) -> String {
    let legs: Vec<&str> = spec.legs.iter().map(|leg| leg.key()).collect();
    format!("`{}`\n\n{}\n\nLegs: {}.", spec.form(), spec.summary, legs.join(", "))
}
