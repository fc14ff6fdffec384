//! The names in a file: every word of a contact, an instruction, a step or a key that can be a
//! name, with its place and its role there.
//!
//! [`FileWords::of`] uses no parser that could fail: `source` also splits an incomplete text into
//! words. `names` finds the meaning of a word.

use std::collections::HashSet;
use std::ops::Range;

use super::outline::{KeyPair, KeyPart, Outline, OutlineValue, TableObject};
use super::slots::{DeclaredKind, FileKind, KeySlot, Slot, of_key, of_value};
use rungd_engine::isa::{Function, Mnemonic, OperandKind, OperandRole, OperandSpec};
use rungd_lab::testing::{StepNames, step_form};
use rungd_language::resolve::{is_type_name, placeholders};
use rungd_language::source::instruction::{OperandWord, assignment, operand_words, words};
use rungd_language::source::name_reader::{ExpressionUse, TextWordKind, words_in};

/// A word of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FileWord {
    /// Its place.
    pub span: Range<usize>,
    /// Its role there.
    pub role: FileWordRole,
    /// For a field or member behind an index, the name before that: `recipe` of `recipe[3].target`.
    pub array: Option<Range<usize>>,
    /// The object that contains it.
    pub object: usize,
    /// The pair that contains it.
    pub pair: usize,
}

/// The role of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileWordRole {
    /// It declares something.
    Declares(DeclaredKind),
    /// A bit or word is read.
    Reads,
    /// A bit, word or structure is written.
    Writes,
    /// Something is named: by a controller file, a test, an argument.
    Names,
    /// A block is started, stopped or ordered.
    Block,
    /// A stage of the block is entered or left.
    Stage,
    /// A template is used.
    Template,
    /// The type of a tag or parameter, which may be a record.
    Type,
    /// A parameter of the template that is used here.
    Parameter,
    /// A field device is named in a step of a test or in a list.
    Device,
    /// A file.
    File,
    /// A ladder of a device's own side.
    DeviceLadder,
    /// The mnemonic of an instruction.
    Mnemonic(Mnemonic),
    /// A function of MATH and of contacts.
    Function(Function),
    /// The name of a warning.
    Warning,
    /// A parameter in the braces of a text.
    Placeholder,
}

/// All words of a file, in the order of the text.
#[derive(Debug, Default)]
pub(super) struct FileWords {
    /// The words.
    pub all: Vec<FileWord>,
}

impl FileWords {
    /// The words of a file.
    pub fn of(text: &str, outline: &Outline, kind: FileKind) -> FileWords {
        let parts = parts(text, outline);
        let mut reader = WordReader { text, words: Vec::new(), object: 0, pair: 0, parts };
        for (number, pair) in outline.pairs.iter().enumerate() {
            (reader.object, reader.pair) = (pair.object, number);
            reader.keys(outline, kind, pair);
        }
        for value in &outline.values {
            let pair = &outline.pairs[value.pair];
            (reader.object, reader.pair) = (pair.object, value.pair);
            let slot = of_value(outline, kind, pair);
            if slot != Slot::Point || !reader.is_point(outline, value) {
                reader.value(value, slot);
            }
        }
        reader.words.sort_by_key(|word| (word.span.start, word.span.end));
        FileWords { all: reader.words }
    }

    /// The word at a byte, or directly before it.
    pub fn at(&self, offset: usize) -> Option<&FileWord> {
        let behind = self.all.partition_point(|word| word.span.start <= offset);
        let near = self.all[..behind].iter().rev().take(4);
        near.filter(|word| offset <= word.span.end).min_by_key(|word| word.span.len())
    }
}

struct WordReader<'t> {
    text: &'t str,
    words: Vec<FileWord>,
    object: usize,
    pair: usize,
    /// The parts of simulated devices: the device's object, and the name.
    parts: HashSet<(usize, &'t str)>,
}

/// The parts of the devices of a file.
fn parts<'t>(text: &'t str, outline: &Outline) -> HashSet<(usize, &'t str)> {
    let objects = outline.objects.iter().enumerate();
    let parts = objects.filter(|(_, object)| object.kind == "device.part");
    let named = |(at, object): (usize, &TableObject)| {
        let name = outline.value(at, &["name"])?;
        Some((object.parent, &text[name.inner.clone()]))
    };
    parts.filter_map(named).collect()
}

impl<'t> WordReader<'t> {
    fn push(&mut self, span: Range<usize>, role: FileWordRole) {
        if !span.is_empty() {
            let (object, pair) = (self.object, self.pair);
            self.words.push(FileWord { span, role, array: None, object, pair });
        }
    }

    /// Adds the names among the keys of a pair. The outer keys are skipped: they are keys of an
    /// earlier pair or header, too.
    fn keys(&mut self, outline: &Outline, kind: FileKind, pair: &KeyPair) {
        for (at, KeyPart { span, .. }) in pair.keys.iter().enumerate().skip(pair.outer) {
            match of_key(outline, kind, pair, at) {
                KeySlot::Declares(declared) => {
                    self.push(span.clone(), FileWordRole::Declares(declared))
                }
                KeySlot::Parameter => self.push(span.clone(), FileWordRole::Parameter),
                KeySlot::Operand => self.contacts(span.clone(), FileWordRole::Names),
                KeySlot::Field => {
                    self.behind(span.clone(), tag_around(outline, pair, at));
                }
                KeySlot::Word => {}
            }
        }
    }

    /// Adds the name of a field or member of a tag or array whose name is at `array`.
    fn behind(&mut self, span: Range<usize>, array: Option<Range<usize>>) {
        let (object, pair) = (self.object, self.pair);
        if array.is_some() && !span.is_empty() {
            self.words.push(FileWord { span, role: FileWordRole::Names, array, object, pair });
        }
    }

    /// Whether one side of a device's map is a point of the device: `coil 0`, `belt.scale` of a
    /// part `belt`.
    fn is_point(&self, outline: &Outline, value: &OutlineValue) -> bool {
        let text = &self.text[value.inner.clone()];
        let device = outline.objects[self.object].parent;
        let is_part = |(part, _)| self.parts.contains(&(device, part));
        text.contains(' ') || text.split_once('.').is_some_and(is_part)
    }

    fn value(&mut self, value: &OutlineValue, slot: Slot) {
        let whole = value.inner.clone();
        if !value.is_string {
            return;
        }
        match slot {
            Slot::Declares(declared) => self.push(whole, FileWordRole::Declares(declared)),
            Slot::Contacts | Slot::Condition => self.contacts(whole, FileWordRole::Reads),
            Slot::Argument | Slot::Operand | Slot::Point => {
                self.contacts(whole, FileWordRole::Names)
            }
            Slot::Address => self.contacts(whole, FileWordRole::Names),
            Slot::Instruction => self.instruction(whole),
            Slot::Step => self.step(whole),
            Slot::Template => self.push(whole, FileWordRole::Template),
            Slot::Allow => self.push(whole, FileWordRole::Warning),
            Slot::Block => self.push(whole, FileWordRole::Block),
            Slot::File => self.push(whole, FileWordRole::File),
            Slot::DeviceLadder => self.push(whole, FileWordRole::DeviceLadder),
            Slot::Device => self.push(whole, FileWordRole::Device),
            Slot::Placeholders => self.placeholders(whole),
            Slot::Type if is_type_name(&self.text[whole.clone()]) => {}
            Slot::Type => self.push(whole, FileWordRole::Type),
            Slot::Initial | Slot::Other => {}
        }
    }

    /// The words in braces of a text.
    fn placeholders(&mut self, place: Range<usize>) {
        for word in placeholders(&self.text[place.clone()]) {
            self.push(place.start + word.start..place.start + word.end, FileWordRole::Placeholder);
        }
    }

    /// The names in contacts, conditions and operands.
    fn contacts(&mut self, place: Range<usize>, role: FileWordRole) {
        self.names(place, ExpressionUse::Contact, role);
    }

    /// The names and functions of a text.
    fn names(&mut self, place: Range<usize>, used: ExpressionUse, role: FileWordRole) {
        let moved = |part: Range<usize>| place.start + part.start..place.start + part.end;
        for word in words_in(&self.text[place.clone()], used) {
            let role = match word.kind {
                TextWordKind::Name => role,
                TextWordKind::Function(function) => FileWordRole::Function(function),
                TextWordKind::Number | TextWordKind::Called => continue,
            };
            let (span, array) = (moved(word.place), word.array.map(moved));
            let (object, pair) = (self.object, self.pair);
            self.words.push(FileWord { span, role, array, object, pair });
        }
    }

    /// The words of a place that spaces separate.
    fn words_of(&self, place: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<'t> {
        let start = place.start;
        let words = words(&self.text[place.clone()]).into_iter();
        words.map(move |(at, word)| start + at..start + at + word.len())
    }

    fn instruction(&mut self, place: Range<usize>) {
        let Some(first) = self.words_of(&place).next() else { return };
        let Some(mnemonic) = Mnemonic::from_name(&self.text[first.clone()]) else { return };
        let behind = first.end..place.end;
        let rest = &self.text[behind.clone()];
        self.push(first, FileWordRole::Mnemonic(mnemonic));
        if mnemonic == Mnemonic::Math {
            let equals = assignment(rest).map_or(behind.end, |at| behind.start + at);
            self.names(behind.start..equals, ExpressionUse::Math, FileWordRole::Writes);
            self.names(equals..behind.end, ExpressionUse::Math, FileWordRole::Reads);
            return;
        }
        for OperandWord { value, row, .. } in operand_words(rest, mnemonic.spec()) {
            let value = behind.start + value.start..behind.start + value.end;
            self.contacts(value, row.map_or(FileWordRole::Reads, role));
        }
    }

    fn step(&mut self, place: Range<usize>) {
        let text = &self.text[place.clone()];
        let mut words = self.words_of(&place);
        let Some(first) = words.next() else { return };
        let verb = self.text[first].split(':').next().unwrap_or_default();
        match step_form(verb).map_or(StepNames::Nothing, |step| step.names) {
            StepNames::Condition => {
                let Some(colon) = text.find(':') else { return };
                self.contacts(place.start + colon + 1..place.end, FileWordRole::Reads);
            }
            StepNames::Operand => {
                let operand = words.next();
                operand.into_iter().for_each(|operand| self.contacts(operand, FileWordRole::Names));
            }
            StepNames::Device => {
                words.next().into_iter().for_each(|device| self.push(device, FileWordRole::Device));
            }
            StepNames::Files => words.for_each(|file| self.push(file, FileWordRole::File)),
            StepNames::Nothing => {}
        }
    }
}

/// The name of the tag whose `initial` has a table with key number `at` of this pair.
fn tag_around(outline: &Outline, pair: &KeyPair, at: usize) -> Option<Range<usize>> {
    let outer = outline.objects[pair.object].around.map(|around| &outline.pairs[around].keys);
    let before = if at > 0 { &pair.keys[..at] } else { outer?.as_slice() };
    let [.., tag, _] = before else { return None };
    Some(tag.span.clone())
}

/// What an instruction does with an operand.
fn role(operand: &OperandSpec) -> FileWordRole {
    let is_block = matches!(
        operand.kind,
        OperandKind::Program | OperandKind::Block | OperandKind::Task | OperandKind::Subroutine
    );
    match operand.kind.is_stage() {
        true => FileWordRole::Stage,
        false if is_block => FileWordRole::Block,
        false if operand.role == OperandRole::Reads => FileWordRole::Reads,
        false => FileWordRole::Writes,
    }
}

#[cfg(test)]
mod tests {
    use super::super::outline_reader::read;
    use super::*;

    fn told(text: &str, kind: FileKind) -> Vec<String> {
        let words = FileWords::of(text, &read(text), kind);
        let word = |word: &FileWord| format!("{} {:?}", &text[word.span.clone()], word.role);
        words.all.iter().map(word).collect()
    }

    #[test]
    fn words_of_contacts_and_instructions_are_classified() {
        let text = "[[program]]\nname = \"Main\"\n[[program.rung]]\n\
                    when = [\"rise(a & !b.Done)\", \"D0 >= -3s\", \"drain-pump.Running\", \
                    \"r[i] | Z.\"]\n\
                    do = [\"TMR late preset=wait\", \"MATH x = sqrt(a-b) + r[i]\", \"JMP Two\"]\n";
        let wanted = [
            "Main Declares(Program)",
            "a Reads",
            "b.Done Reads",
            "D0 Reads",
            "drain-pump.Running Reads",
            "r Reads",
            "i Reads",
            "Z. Reads",
            "TMR Mnemonic(Tmr)",
            "late Writes",
            "wait Reads",
            "MATH Mnemonic(Math)",
            "x Writes",
            "sqrt Function(Sqrt)",
            "a Reads",
            "b Reads",
            "r Reads",
            "i Reads",
            "JMP Mnemonic(Jmp)",
            "Two Stage",
        ];
        assert_eq!(told(text, FileKind::Ladder), wanted);
    }

    #[test]
    fn words_of_tags_templates_and_uses_are_classified() {
        let text = "tags.eye = { at = \"X0\", doc = \"no name\" }\n[[template]]\nname = \"P\"\n\
                    [template.parameters]\nx = { type = \"bit\" }\n[[program.rung]]\nuse = \"P\"\n\
                    name = \"p1\"\nwith = { x = \"eye & Main.Two\" }\n";
        let wanted = [
            "eye Declares(Tag)",
            "X0 Names",
            "P Declares(Template)",
            "x Declares(Parameter)",
            "P Template",
            "p1 Declares(Rung)",
            "x Parameter",
            "eye Names",
            "Main.Two Names",
        ];
        assert_eq!(told(text, FileKind::Ladder), wanted);
    }

    #[test]
    fn words_of_records_are_classified() {
        let text = "[[record]]\nname = \"Step\"\n[record.fields]\nkind = { type = \"int\" }\n\
                    [tags]\nr = { type = \"Step\" }\n[[program.rung]]\n\
                    when = [\"r[i + a[1]].kind > 2\"]\n";
        let wanted = [
            "Step Declares(Record)",
            "kind Declares(Field)",
            "r Declares(Tag)",
            "Step Type",
            "r Reads",
            "i Reads",
            "a Reads",
            "kind Reads",
        ];
        assert_eq!(told(text, FileKind::Ladder), wanted);
        let text = "[tags]\nr = { type = \"Step\", count = 2, initial = [{ kind = 1 }] }\n\
                    s = { type = \"Step\", initial = { kind = 2 } }\n";
        let fields = ["r Declares(Tag)", "Step Type", "kind Names", "s Declares(Tag)"];
        assert_eq!(told(text, FileKind::Ladder)[..4], fields);
        assert_eq!(told(text, FileKind::Ladder)[4..], ["Step Type", "kind Names"]);
        let text = "always = [\"a - was(b.Acc) < 5 & !was( c )\"]\n";
        assert_eq!(told(text, FileKind::Test), ["a Reads", "b.Acc Reads", "c Reads"]);
    }

    #[test]
    fn words_of_test_and_controller_files_are_classified() {
        let text = "ladder = [\"a.toml\"]\nalways = [\"!(a & b)\"]\n[[scenario]]\nname = \"n\"\n\
                    set = { \"p1.x\" = true, \"r[2]\" = 1 }\n\
                    steps = [\"set a 1\", \"within 2s: b + 1 == 3\", \"lose d\"]\n";
        let wanted = [
            "a.toml File",
            "a Reads",
            "b Reads",
            "n Declares(Test)",
            "p1.x Names",
            "r Names",
            "a Names",
            "b Reads",
            "d Device",
        ];
        assert_eq!(told(text, FileKind::Test), wanted);
        let text = "ladder = [\"a.toml\"]\n[outputs]\non = [\"Y7\", \"Y8..Y9\"]\n\
                    [web]\nwrite = [\"w1\"]\n[[device]]\nname = \"io\"\n\
                    [[panel]]\nname = \"p\"\n\
                    show = [{ lamp = \"l1\" }, { bar = \"b1\", text = \"t\" }]\n";
        let wanted = ["a.toml File", "Y7 Names", "Y8 Names", "Y9 Names", "io Declares(Device)"];
        let wanted = [&wanted[..], &["w1 Names", "l1 Names", "b1 Names"]].concat();
        let found = told(text, FileKind::Controller);
        assert!(wanted.iter().all(|word| found.contains(&(*word).to_owned())), "{found:?}");
    }
}
