//! The meaning of a string or a key in its file, by its path: the reader of the file says it.
//!
//! `words` uses it to find the names in a text, `complete` to propose texts for a place.

use std::cell::OnceCell;

use super::outline::{KeyPair, Outline};
use rungd_config::controller;
use rungd_lab::testing;
use rungd_language::source::shape::TableShape;
pub(super) use rungd_language::source::slot::{DeclaredKind, KeySlot, Slot};
use rungd_language::source::{file_kind, ladder};

thread_local! {
    /// The keys of each kind of file, once they are needed.
    static SHAPES: [OnceCell<TableShape>; 3] = const { [const { OnceCell::new() }; 3] };
}

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
        let read = || match self {
            FileKind::Ladder => ladder::shape(),
            FileKind::Controller => controller::shape(),
            FileKind::Test => testing::shape(),
        };
        SHAPES.with(|shapes| shapes[self as usize].get_or_init(read).clone())
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

/// What the value of a pair stands for.
pub(super) fn of_value(outline: &Outline, kind: FileKind, pair: &KeyPair) -> Slot {
    let object = outline.objects[pair.object].kind.as_str();
    of_path(kind, object, &pair.names())
}

/// What a value stands for, by the kind of its object and its keys below the object.
pub(super) fn of_path(kind: FileKind, object: &str, keys: &[&str]) -> Slot {
    kind.shape().key(path(object, keys)).map_or(Slot::Other, |key| key.value)
}

/// What key number `at` of a pair stands for: a name, or a word of the file format.
pub(super) fn of_key(outline: &Outline, kind: FileKind, pair: &KeyPair, at: usize) -> KeySlot {
    let object = outline.objects[pair.object].kind.as_str();
    of_key_path(kind, object, &pair.names()[..=at])
}

/// What the last of these keys stands for, by the kind of its object.
fn of_key_path(kind: FileKind, object: &str, keys: &[&str]) -> KeySlot {
    kind.shape().key(path(object, keys)).map_or(KeySlot::Word, |key| key.named)
}

/// What any other key behind these keys stands for.
pub(super) fn of_next_key(kind: FileKind, object: &str, keys: &[&str]) -> KeySlot {
    of_key_path(kind, object, &[keys, &[""]].concat())
}

/// The keys from the root on.
fn path<'p>(object: &'p str, keys: &'p [&'p str]) -> impl Iterator<Item = &'p str> + Clone {
    object.split('.').filter(|part| !part.is_empty()).chain(keys.iter().copied())
}

/// Whether an object of a test file belongs to its observer.
pub(super) fn is_of_observer(kind: FileKind, object: &str) -> bool {
    kind == FileKind::Test && object.starts_with("observer.")
}
