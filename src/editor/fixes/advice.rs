//! What a help can advise, and the titles of actions that do so.
//!
//! `help` and `sentences` read advices out of a help, `change` makes changes of a text of them.

use std::ops::Range;

use super::super::file::EditorFile;

/// An advice of a help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Advice {
    /// To write this in the place of what is there, or into its table; perhaps of another tag.
    Write { text: String, tag: Option<String>, lead: AdviceLead },
    /// To declare this under `[tags]`.
    Declare(String),
    /// To write these lines; `instead`: a key that goes.
    Lines { lines: Vec<String>, instead: Option<String> },
    /// To delete what the finding is about.
    Delete,
    /// To take this sign out of it.
    Drop(String),
    /// To add this row to the map of a device.
    Row(String),
    /// To write this pair under the header of a table.
    Under { table: String, text: String },
    /// To add a table with this header and its first line.
    Table { header: String, line: String },
    /// To take this key, or the table with this header, away.
    Remove(String),
    /// To declare a tag, perhaps to execute an instruction before, and to write this here.
    Here { declare: String, before: Option<String>, text: String },
}

/// How a help says that a text is to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AdviceLead {
    /// It is what is meant.
    Told,
    /// It says what the text says already.
    AsRead,
    /// It is the nearest name: what is behind it can be wrong too.
    Spelling,
    /// It is one of several, or shows a form.
    Example,
}

impl Advice {
    /// How the help leads to its text.
    pub fn lead(&self) -> AdviceLead {
        match self {
            Advice::Write { lead, .. } => *lead,
            Advice::Here { before: None, .. } => AdviceLead::AsRead,
            Advice::Declare(_)
            | Advice::Lines { .. }
            | Advice::Delete
            | Advice::Drop(_)
            | Advice::Row(_)
            | Advice::Under { .. }
            | Advice::Table { .. }
            | Advice::Remove(_)
            | Advice::Here { .. } => AdviceLead::Told,
        }
    }

    /// Whether it is one of several that can be meant.
    pub fn is_choice(&self) -> bool {
        matches!(self.lead(), AdviceLead::Spelling | AdviceLead::Example)
    }

    /// The title of the action; `changed`: the place that it changes.
    pub fn title(&self, file: &EditorFile, changed: Range<usize>) -> String {
        match self {
            Advice::Write { text, tag: None, .. } => format!("Write `{text}`"),
            Advice::Here { declare, text, .. } => {
                format!("Declare `{declare}` and write `{text}`")
            }
            Advice::Write { text, tag: Some(tag), .. } => format!("Write `{text}` in tag `{tag}`"),
            Advice::Declare(text) => format!("Declare `{text}` under [tags]"),
            Advice::Lines { lines, .. } => format!("Write `{}`", lines.join("`, `")),
            Advice::Delete => {
                let text = file.slice(changed).trim().lines().next().unwrap_or_default();
                format!("Delete `{}`", text.chars().take(40).collect::<String>())
            }
            Advice::Drop(sign) | Advice::Remove(sign) => format!("Take `{sign}` away"),
            Advice::Row(row) => format!("Add the row `{row}`"),
            Advice::Under { table, text } => format!("Write `{text}` under `[{table}]`"),
            Advice::Table { header, line } => format!("Add `{header}` with `{line}`"),
        }
    }
}
