//! The names that a program declares: their length and their form.
//!
//! `declare` and `template` check them; every file that keeps or prints a name shortens it with
//! [`kept`].

use crate::source::atom::is_name_letter;
use crate::source::finding::{Code, Finding};
use crate::source::fix::possible;
use crate::source::ladder::BlockForm;
use crate::source::reader::Text;
use crate::source::renaming::plain;
use crate::source::span::Span;
use rungd_engine::isa::address_text::reads_as_address;
use rungd_engine::isa::{BlockBit, Structure, instruction, since};

/// The kind of thing that a name is declared for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum NameRole {
    Tag,
    Block(BlockForm),
    Stage,
    Device,
    Template,
    Parameter,
    Use,
    Record,
    Field,
}

impl NameRole {
    fn words(self) -> &'static str {
        match self {
            NameRole::Tag => "tag",
            NameRole::Block(BlockForm::Program) => "program",
            NameRole::Block(BlockForm::Task) => "task",
            NameRole::Block(BlockForm::Subroutine) => "subroutine",
            NameRole::Stage => "stage",
            NameRole::Device => "device",
            NameRole::Template => "template",
            NameRole::Parameter => "parameter",
            NameRole::Use => "use",
            NameRole::Record => "record",
            NameRole::Field => "field",
        }
    }
}

/// Maximum number of characters of a name; records with a name have room for this number.
pub const NAME_MAX: usize = 128;

/// A name as the program keeps it: cut to [`NAME_MAX`] characters.
pub(super) fn kept(name: &str) -> String {
    name.chars().take(NAME_MAX).collect()
}

/// Whether a tag, a use, a Program and a record can have this name.
pub fn is_free(name: &str) -> bool {
    let text = Text { text: name.to_owned(), span: Span::default(), exact: true };
    forbidden(&text, NameRole::Tag).is_none()
}

/// Whether a field of a record can have this name.
pub fn is_free_field(name: &str) -> bool {
    let text = Text { text: name.to_owned(), span: Span::default(), exact: true };
    forbidden(&text, NameRole::Field).is_none()
}

/// The finding for an invalid name, or a name that already has a different meaning.
pub(super) fn forbidden(name: &Text, role: NameRole) -> Option<Finding> {
    let text = name.text.as_str();
    let what = role.words();
    let find = |message: String| Some(Finding::new(Code::ForbiddenName, name.span, message));
    if text.len() > NAME_MAX {
        let finding = find(format!("this name of a {what} has {} characters", text.len()))?;
        return Some(finding.help(format!("a name has at most {NAME_MAX}")));
    }
    let hyphen = match role {
        NameRole::Block(_) | NameRole::Stage | NameRole::Device | NameRole::Template => true,
        NameRole::Tag
        | NameRole::Parameter
        | NameRole::Use
        | NameRole::Record
        | NameRole::Field => false,
    };
    let letters = |c: char| is_name_letter(c) || (hyphen && c == '-');
    if !text.starts_with(|c: char| c.is_ascii_alphabetic()) || !text.chars().all(letters) {
        let marks = if hyphen { "`_` and `-`" } else { "and `_`" };
        let finding = find(format!("`{text}` cannot be the name of a {what}"))?;
        let help = format!(
            "a {what}'s name is a letter, then letters, digits {marks} (no spaces, no accents)"
        );
        return Some(finding.help(help).fix(possible(plain(text, what))));
    }
    // A template's name is used only in `use`, so it cannot be taken for an address or instruction.
    if role == NameRole::Template {
        return None;
    }
    // A field's name always stands behind the name of its tag.
    if role == NameRole::Field {
        return member_as_field(name);
    }
    let newly = |version: Option<&str>| version.map_or(String::new(), |v| format!(", since {v}"));
    if reads_as_address(text) {
        let since = newly(since::address(text));
        let finding = find(format!("`{text}` reads as an address{since}"))?;
        let finding = finding.help("take a name that says what it is for");
        return Some(finding.fix(possible(format!("{what}_{}", text.to_lowercase()))));
    }
    if instruction::Mnemonic::from_name(text).is_some() || since::mnemonic(text).is_some() {
        let since = newly(since::mnemonic(text));
        let finding = find(format!("`{text}` is the name of an instruction{since}"))?;
        let finding = finding.help("take a name that says what it is for");
        let lower = text.to_lowercase();
        return Some(finding.fixes([lower.clone(), format!("{what}_{lower}")].map(possible)));
    }
    if matches!(text, "rise" | "fall") {
        let finding = find(format!("`{text}` is a word of the language: `{text}(bit)`"))?;
        return Some(finding.fix(possible(format!("{what}_{text}"))));
    }
    if role == NameRole::Stage && BlockBit::from_name(text).is_some() {
        let finding = find(format!("`.{text}` is a bit of the block itself"))?;
        return Some(finding.fix(possible(format!("{what}_{text}"))));
    }
    None
}

/// The finding for a field that has the name of a member: `over.Acc` could mean both.
fn member_as_field(name: &Text) -> Option<Finding> {
    let structures = [Structure::Timer(0), Structure::Counter(0), Structure::Sensaphone(0)];
    let is_member = |structure: &Structure| structure.members().contains(&name.text.as_str());
    structures.iter().any(is_member).then(|| {
        let message = format!("`.{}` is a member of structures", name.text);
        let finding = Finding::new(Code::ForbiddenName, name.span, message);
        let finding = finding.help("take a name that says what it is for");
        finding.fix(possible(format!("field_{}", name.text.to_lowercase())))
    })
}
