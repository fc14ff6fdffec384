//! The operands that a ladder names, in the form that a running controller accepts.
//!
//! `live_targets` uses them to order values; `hints` and `tokens` use them to show the values. A
//! name within a template has no value: it stands for a different operand in each use.

use std::ops::Range;

use super::file::{EditorFile, NumberedFile};
use super::names::Meaning;
use super::outline::OutlineValue;
use super::project::Project;
use super::slots::{DeclaredKind, FileKind, Slot, of_value};
use super::tag_facts::TagFacts;
use super::words::{FileWord, FileWordRole};
use rungd_engine::isa::{Address, Structure, Word as WordAddress};

/// A word that names an operand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedWord {
    /// Its place.
    pub span: Range<usize>,
    /// The operand whose value is shown for it; for a structure, its accumulator.
    pub operand: String,
    /// Whether it is a time, in ms.
    pub is_time: bool,
    /// Whether it is written there.
    pub is_written: bool,
}

/// The operand that a word names.
pub(super) fn named(
    project: &Project,
    numbered: NumberedFile,
    word: &FileWord,
) -> Option<NamedWord> {
    let file = numbered.file;
    let is_written = match word.role {
        FileWordRole::Writes => true,
        FileWordRole::Reads | FileWordRole::Names => false,
        FileWordRole::Declares(_)
        | FileWordRole::Block
        | FileWordRole::Stage
        | FileWordRole::Template
        | FileWordRole::Type
        | FileWordRole::Parameter
        | FileWordRole::Device
        | FileWordRole::File
        | FileWordRole::DeviceLadder
        | FileWordRole::Mnemonic(_)
        | FileWordRole::Function(_)
        | FileWordRole::Warning
        | FileWordRole::Placeholder => return None,
    };
    let text = file.slice(word.span.clone());
    let parts = project.names.parts(numbered, word);
    let mut last = None;
    for part in &parts {
        if let Meaning::Declared(at) = part.meaning {
            if last.is_none() && project.names.template_around(at).is_some() {
                return None;
            }
            last = Some(at);
        }
    }
    let has_member = parts.last().is_some_and(|part| part.meaning == Meaning::Member);
    let structure = match (last, parts.first()?.meaning) {
        (Some(at), _) => declared_structure(project, at)?,
        (None, Meaning::Address(address)) => structure_of(address),
        (None, Meaning::Status) => None,
        (None, Meaning::Declared(_) | Meaning::Member | Meaning::Unknown) => return None,
    };
    let is_whole = match parts.first()?.meaning {
        Meaning::Address(address) => matches!(address, Address::Structure(_)),
        Meaning::Declared(_) | Meaning::Member | Meaning::Status | Meaning::Unknown => !has_member,
    };
    let before = match &word.array {
        Some(array) => {
            let between = file.slice(array.end..word.span.start);
            let digits = between.strip_prefix('[').and_then(|text| text.strip_suffix("]."));
            digits.filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))?;
            file.slice(array.start..word.span.start)
        }
        None => "",
    };
    let mut operand = format!("{before}{text}{}", index_behind(file, word)?);
    if let Some(whole_structure) = structure.filter(|_| is_whole) {
        operand = format!("{operand}.{}", whole_structure.acc_name());
    }
    let is_time = matches!(structure, Some(Structure::Timer(_))) && operand.ends_with(".Acc");
    Some(NamedWord { span: word.span.clone(), operand, is_time, is_written })
}

/// The operand at a byte, as `rungd why` is given it; for a structure, its Done bit.
pub(super) fn asked(project: &Project, numbered: NumberedFile, offset: usize) -> Option<String> {
    let file = numbered.file;
    let word = file.words.at(offset)?;
    if file.kind == FileKind::Test {
        return None;
    }
    let named = named(project, numbered, word)?;
    let text = file.slice(word.span.clone());
    Some(match named.operand.strip_prefix(text) {
        Some(".Acc") => format!("{text}.Done"),
        Some(".ACC") => format!("{text}.DN"),
        Some(_) | None => named.operand,
    })
}

/// The constant index after a word; empty without an index, `None` if the index is not constant.
pub(super) fn index_behind<'f>(file: &'f EditorFile, word: &FileWord) -> Option<&'f str> {
    let behind = file.text.get(word.span.end..).unwrap_or_default();
    if !behind.starts_with('[') {
        return Some("");
    }
    let end = behind.find(']')?;
    let is_number = end > 1 && behind[1..end].bytes().all(|byte| byte.is_ascii_digit());
    is_number.then_some(&behind[..=end])
}

/// The structure that a declared name stands for; `Some(None)` for a bit or word, `None` for a name
/// without a value.
fn declared_structure(project: &Project, at: usize) -> Option<Option<Structure>> {
    let declared = &project.names.all[at];
    match declared.kind {
        DeclaredKind::Tag | DeclaredKind::OwnTag if project.names.record_of(at).is_some() => {
            return None;
        }
        DeclaredKind::Tag | DeclaredKind::OwnTag | DeclaredKind::Field => {}
        DeclaredKind::Program
        | DeclaredKind::Task
        | DeclaredKind::Stage
        | DeclaredKind::Device
        | DeclaredKind::Use => return Some(None),
        DeclaredKind::Rung
        | DeclaredKind::Subroutine
        | DeclaredKind::Template
        | DeclaredKind::Parameter
        | DeclaredKind::Record
        | DeclaredKind::Test => return None,
    }
    let facts = TagFacts::of(declared, &project.files[declared.file]);
    if facts.text("value").is_some() {
        return None;
    }
    if facts.text("type").is_none() {
        facts.text("at")?;
    }
    Some(facts.element().and_then(structure_of))
}

/// The structure that an address names, or whose accumulator it is.
fn structure_of(address: Address) -> Option<Structure> {
    match address {
        Address::Structure(structure) | Address::Word(WordAddress::Acc(structure)) => {
            Some(structure)
        }
        Address::Word(WordAddress::Pre(_) | WordAddress::Space(..)) | Address::Bit(_) => None,
    }
}

/// A value of a ladder that names operands.
#[derive(Clone, Copy, Debug)]
pub(super) struct NamingValue<'f> {
    /// The value.
    pub value: &'f OutlineValue,
    /// What is written there.
    pub slot: Slot,
}

/// The values of a ladder that name operands. The first is the value at a byte, or the next value
/// after it.
pub(super) fn values(file: &EditorFile, from: usize) -> impl Iterator<Item = NamingValue<'_>> {
    let values = &file.outline.values;
    let first = values.partition_point(|value| value.span.end < from);
    values[first..].iter().filter_map(|value| {
        let slot = of_value(&file.outline, file.kind, &file.outline.pairs[value.pair]);
        let names = matches!(slot, Slot::Contacts | Slot::Instruction | Slot::Argument);
        (names && value.is_string).then_some(NamingValue { value, slot })
    })
}

/// The words of a value.
pub(super) fn words<'f>(file: &'f EditorFile, value: &OutlineValue) -> &'f [FileWord] {
    let all = &file.words.all;
    let first = all.partition_point(|word| word.span.start < value.inner.start);
    let end = all.partition_point(|word| word.span.start < value.inner.end);
    &all[first..end.max(first)]
}

#[cfg(test)]
mod tests {
    use super::super::lines::ColumnUnit;
    use super::super::project::Library;
    use super::*;
    use std::path::Path;

    fn told(text: &str) -> Vec<String> {
        let path = Path::new("/no such folder/a.toml");
        let mut library = Library::new(ColumnUnit::Utf8);
        library.open(path, text.into());
        let project = library.project(path).unwrap();
        let file = &project.files[0];
        let of = |word: &FileWord| {
            let named = named(&project, NumberedFile { number: 0, file }, word)?;
            let time = if named.is_time { " (time)" } else { "" };
            let written = if named.is_written { " written" } else { "" };
            Some(format!("{}{time}{written}", named.operand))
        };
        values(file, 0).flat_map(|naming| words(file, naming.value)).filter_map(of).collect()
    }

    #[test]
    fn structures_are_read_by_accumulator_and_arrays_by_constant_index() {
        let text = "[tags]\nlate = { type = \"timer\" }\nlot = { at = \"CT3\" }\n\
                    r = { type = \"int\", count = 9 }\nfull = { value = 12 }\n\
                    [[program]]\nname = \"Main\"\n[[program.rung]]\n\
                    when = [\"late.Done | late.Acc > full\", \"r[3] > r[i]\", \"$On & X0\"]\n\
                    do = [\"TMR late preset=T1.Acc\", \"CNT lot preset=D0\", \"CTU N2 preset=1\"]\n\
                    [[program]]\nname = \"Drain\"\n[[program.stage]]\nname = \"Open\"\n\
                    [[program.stage.rung]]\nwhen = [\"Drain.Open & Drain.Running\", \"nothing\"]\n\
                    do = [\"RUN Drain\", \"JMP Open\"]\n";
        let wanted = [
            "late.Done",
            "late.Acc (time)",
            "r[3]",
            "$On",
            "X0",
            "late.Acc (time) written",
            "T1.Acc (time)",
            "lot.Acc written",
            "D0",
            "N2.ACC written",
            "Drain.Open",
            "Drain.Running",
        ];
        assert_eq!(told(text), wanted);
    }

    #[test]
    fn a_name_within_a_template_stands_for_one_operand_per_use() {
        let text = "[tags]\neye = { at = \"X0\" }\n[[template]]\nname = \"P\"\n\
                    [template.parameters]\nmotor = { type = \"output\" }\n[template.tags]\n\
                    late = { type = \"timer\" }\n[[template.rung]]\n\
                    when = [\"eye\", \"late.Done\"]\n\
                    do = [\"OUT motor\"]\n[[program]]\nname = \"Main\"\n[[program.rung]]\n\
                    use = \"P\"\nname = \"p1\"\nwith = { motor = \"Y1\" }\n[[program.rung]]\n\
                    when = [\"p1.late.Done\", \"p1.late.Acc > 1s\"]\ndo = [\"OUT Y2\"]\n";
        assert_eq!(told(text), ["eye", "Y1", "p1.late.Done", "p1.late.Acc (time)", "Y2 written"]);
    }
}
