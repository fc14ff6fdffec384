//! `[observer]` of a test file: tags and rungs as in a ladder.
//!
//! Called by `testing` for the keys of a test file, and for each program that the observer
//! observes. No name is looked up here; `resolve::observer` does that.

use super::key::key;
use super::ladder::{BlockForm, Entry, Ladder, WrittenBlock};
use super::reader::{self, Table};
use super::rung;
use super::span::{FileId, Located};
use super::tag::{self, TagTypes};

/// Reads the observer of a test file: a ladder with its tags and with one block, which has its
/// rungs. `None`: the file has no observer.
pub fn read(root: &mut Table<'_>) -> Option<Ladder<Entry>> {
    let about = "Rungs with tags of their own, executed behind each scan.";
    let mut table = root.table(key("observer", about), "`[observer]`")?;
    let tags = key("tags", "Tags of the observer: none of the ladder's.");
    let tags = tag::read_all(&mut table, tags, TagTypes::Observer);
    let rungs = key("rung", "Rungs as in a ladder; they write tags of the observer only.");
    let rungs = rung::read_entries(&mut table, rungs);
    let span = table.span();
    table.finish();
    let block = WrittenBlock {
        form: BlockForm::Program,
        span,
        name: None,
        doc: None,
        autostart: Some(Located { value: true, span }),
        body: None,
        rungs,
        stages: Vec::new(),
    };
    Some(Ladder { tags, blocks: vec![block], ..Ladder::default() })
}

/// The observer of a text, with its places in `file`; the mistakes of the text were reported when
/// it was read first.
pub fn again(text: &str, file: FileId) -> Option<Ladder<Entry>> {
    reader::document(text, file, |mut root| read(&mut root)).0.flatten()
}
