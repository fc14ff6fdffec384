//! The meaning of a string or a key in its file, derived from its path.
//!
//! `words` uses it to find the names in a text, `complete` to propose texts for a place.

use super::outline::{KeyPair, Outline};
use rungd_config::controller;
use rungd_lab::testing;
use rungd_language::source::shape::TableShape;
use rungd_language::source::{file_kind, ladder};

/// The kind of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum FileKind {
    Ladder,
    Controller,
    Test,
}

impl FileKind {
    /// The kind of a file, by its name and its keys.
    pub fn of(path: &str, outline: &Outline) -> FileKind {
        if path.ends_with(".test.toml") {
            return FileKind::Test;
        }
        let roots = outline.root_keys();
        let ladder_is_table = is_root_table(outline, "ladder");
        match file_kind::has_controller_keys(|key| roots.contains(key), ladder_is_table) {
            true => FileKind::Controller,
            false => FileKind::Ladder,
        }
    }

    /// The keys that a file of this kind may have.
    pub fn shape(self) -> TableShape {
        match self {
            FileKind::Ladder => ladder::shape(),
            FileKind::Controller => controller::shape(),
            FileKind::Test => testing::shape(),
        }
    }

    /// Whether a file is for other programs, such as `Cargo.toml`. Editors send all TOML files.
    pub fn is_of_others(outline: &Outline) -> bool {
        let roots = outline.root_keys();
        let is_table = |key: &str| is_root_table(outline, key);
        !roots.is_empty() && !file_kind::has_keys(|key| roots.contains(key), is_table)
    }
}

/// Whether a key of the root is a table, written as a header or as dotted keys.
fn is_root_table(outline: &Outline, key: &str) -> bool {
    outline.headers.iter().any(|header| header.path == key)
        || outline.pairs_in(0).any(|pair| pair.key_below(&[key]).is_some())
}

/// The kind of a declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum DeclaredKind {
    /// A tag.
    Tag,
    /// A Program.
    Program,
    /// A Task.
    Task,
    /// A subroutine.
    Subroutine,
    /// A Stage.
    Stage,
    /// A rung.
    Rung,
    /// A template.
    Template,
    /// A parameter of a template.
    Parameter,
    /// A tag of a template.
    OwnTag,
    /// A record.
    Record,
    /// A field of a record.
    Field,
    /// A use of a template.
    Use,
    /// A field device.
    Device,
    /// A test.
    Test,
}

/// What a value stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    /// The name of a declaration here.
    Declares(DeclaredKind),
    /// Contacts.
    Contacts,
    /// An instruction.
    Instruction,
    /// An argument for a template: contacts or a name.
    Argument,
    /// The name of a template.
    Template,
    /// Names of warnings.
    Allow,
    /// Names of blocks.
    Block,
    /// The path of a file.
    File,
    /// The path of a ladder of a device's own side, which is none of the project's.
    DeviceLadder,
    /// The name of a field device.
    Device,
    /// An address.
    Address,
    /// A type of a tag or parameter.
    Type,
    /// The name of one bit or word, or a range.
    Operand,
    /// Contacts whose compares may contain sums.
    Condition,
    /// One side of a device's map: a point of the device, or a name of the program.
    Point,
    /// A step of a test.
    Step,
    /// A text that contains parameters of a template in braces.
    Placeholders,
    /// A text or a number without names in it.
    Other,
}

/// What the value of a pair stands for.
pub(super) fn of_value(outline: &Outline, kind: FileKind, pair: &KeyPair) -> Slot {
    let object = outline.objects[pair.object].kind.as_str();
    of_path(kind, object, &pair.names())
}

/// What a value stands for, by the kind of its object and its keys below the object.
pub(super) fn of_path(kind: FileKind, object: &str, keys: &[&str]) -> Slot {
    match kind {
        FileKind::Ladder => of_ladder(object, keys),
        FileKind::Controller => of_controller(object, keys),
        FileKind::Test => of_test(object, keys),
    }
}

fn of_ladder(object: &str, keys: &[&str]) -> Slot {
    let last = object.rsplit('.').next().unwrap_or_default();
    match (last, keys) {
        ("template", ["tags", _, "alarm" | "group" | "doc"]) => Slot::Placeholders,
        ("" | "template", ["tags", _, "ack"]) => Slot::Operand,
        ("", ["ladder", "order"]) => Slot::Block,
        ("", ["ladder", "devices"]) => Slot::Device,
        (_, ["allow"]) | ("", ["ladder", "allow"]) => Slot::Allow,
        ("" | "template", ["tags", _, "at"]) => Slot::Address,
        ("" | "template", ["tags" | "parameters", _, "type"]) => Slot::Type,
        ("record", ["fields", _, "type"]) => Slot::Type,
        ("record", ["name"]) => Slot::Declares(DeclaredKind::Record),
        ("template", ["parameters", _, "default"]) => Slot::Operand,
        ("program", ["name"]) => Slot::Declares(DeclaredKind::Program),
        ("task", ["name"]) => Slot::Declares(DeclaredKind::Task),
        ("subroutine", ["name"]) => Slot::Declares(DeclaredKind::Subroutine),
        ("stage", ["name"]) => Slot::Declares(DeclaredKind::Stage),
        ("rung", ["name"]) => Slot::Declares(DeclaredKind::Rung),
        ("template", ["name"]) => Slot::Declares(DeclaredKind::Template),
        (_, ["use"]) => Slot::Template,
        (_, ["with", _]) => Slot::Argument,
        (_, ["when"] | ["leg", _]) => Slot::Contacts,
        (_, ["do"]) => Slot::Instruction,
        _ => Slot::Other,
    }
}

fn of_controller(object: &str, keys: &[&str]) -> Slot {
    match (object, keys) {
        ("", ["ladder"]) => Slot::File,
        ("", ["order"] | ["retain", "stages"]) => Slot::Block,
        ("", ["allow"]) => Slot::Allow,
        ("device", ["name"]) => Slot::Declares(DeclaredKind::Device),
        ("device" | "simulated", ["ladder"]) => Slot::DeviceLadder,
        ("simulated", ["device"]) => Slot::Device,
        ("watch", ["always"]) => Slot::Condition,
        ("device.map", ["from" | "to"]) => Slot::Point,
        (
            "device.part",
            ["to" | "in" | "enable" | "of" | "run" | "trip" | "reset" | "feed" | "jam"],
        ) => Slot::Point,
        ("", ["outputs" | "retain" | "modbus-server", _, ..])
        | ("simulated-device", ["input" | "follows" | "while" | "when"])
        | ("", ["web", "write" | "write-service"])
        | ("watch", ["ack"])
        | ("panel.show", ["lamp" | "button" | "hold" | "value" | "bar" | "trend" | "recipe"])
        | ("modbus-server.map", _) => Slot::Operand,
        _ => Slot::Other,
    }
}

/// A place in an observer, as the place of a ladder that it looks like.
struct PlaceAsInLadder<'p> {
    object: &'p str,
    keys: &'p [&'p str],
}

/// The place in an observer; `None`: the object with these keys is no part of one.
fn in_observer<'p>(object: &'p str, keys: &'p [&'p str]) -> Option<PlaceAsInLadder<'p>> {
    match (object, keys) {
        ("", ["observer", keys @ ..]) => Some(PlaceAsInLadder { object, keys }),
        _ => object.strip_prefix("observer.").map(|object| PlaceAsInLadder { object, keys }),
    }
}

/// Whether an object of a test file belongs to its observer.
pub(super) fn is_of_observer(kind: FileKind, object: &str) -> bool {
    kind == FileKind::Test && object.starts_with("observer.")
}

fn of_test(object: &str, keys: &[&str]) -> Slot {
    if let Some(PlaceAsInLadder { object, keys }) = in_observer(object, keys) {
        return of_ladder(object, keys);
    }
    match (object, keys) {
        ("", ["ladder" | "controller"]) => Slot::File,
        ("simulated", ["device"]) => Slot::Device,
        ("simulated", ["ladder"]) => Slot::DeviceLadder,
        ("", ["always"] | ["prove", "assume" | "can"]) => Slot::Condition,
        ("", ["prove", "inputs" | "writable" | "any"]) => Slot::Operand,
        ("interlock", ["outputs"]) => Slot::Operand,
        ("", ["retain", "stages"]) => Slot::Block,
        ("", ["retain", _]) => Slot::Operand,
        ("scenario" | "random", ["name"]) => Slot::Declares(DeclaredKind::Test),
        ("scenario", ["steps"]) => Slot::Step,
        _ => Slot::Other,
    }
}

/// What key number `at` of a pair stands for: a name, or a word of the file format.
pub(super) fn of_key(outline: &Outline, kind: FileKind, pair: &KeyPair, at: usize) -> KeySlot {
    let object = outline.objects[pair.object].kind.as_str();
    of_key_path(kind, object, &pair.names()[..at])
}

/// What a key stands for, by the kind of its object and the keys before it.
pub(super) fn of_key_path(kind: FileKind, object: &str, keys: &[&str]) -> KeySlot {
    if let Some(PlaceAsInLadder { object, keys }) = in_observer(object, keys)
        && kind == FileKind::Test
    {
        return of_key_path(FileKind::Ladder, object, keys);
    }
    let last = object.rsplit('.').next().unwrap_or_default();
    match (kind, last, keys) {
        (FileKind::Ladder, "", ["tags"]) => KeySlot::Declares(DeclaredKind::Tag),
        (FileKind::Ladder, "template", ["tags"]) => KeySlot::Declares(DeclaredKind::OwnTag),
        (FileKind::Ladder, "template", ["parameters"]) => {
            KeySlot::Declares(DeclaredKind::Parameter)
        }
        (FileKind::Ladder, "record", ["fields"]) => KeySlot::Declares(DeclaredKind::Field),
        (FileKind::Ladder, _, ["with"]) => KeySlot::Parameter,
        (FileKind::Ladder, "" | "template", ["tags", _, "initial"]) => KeySlot::Field,
        (FileKind::Ladder, "initial", []) if object.starts_with("tags.") => KeySlot::Field,
        (FileKind::Ladder, "initial", []) if object.starts_with("template.tags.") => KeySlot::Field,
        (FileKind::Test, "scenario" | "random", ["set"])
        | (FileKind::Test, "random", ["change"] | ["events", "write"]) => KeySlot::Operand,
        (FileKind::Ladder | FileKind::Controller | FileKind::Test, ..) => KeySlot::Word,
    }
}

/// What a key stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeySlot {
    /// The name of a declaration here.
    Declares(DeclaredKind),
    /// A parameter of the template that is used here.
    Parameter,
    /// The name of a bit or word.
    Operand,
    /// A field of the record that is the type of the tag around it.
    Field,
    /// A word of the file format.
    Word,
}
