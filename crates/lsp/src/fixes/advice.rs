//! The advice that a help can give, and the titles of the code actions for it.
//!
//! `help` and `sentences` extract advice from a help; `change` turns it into changes of a text.

use std::ops::Range;

use super::super::file::EditorFile;

/// One piece of advice in a help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Advice {
    /// Write `text` at the place of the finding, or in its table, or in the declaration of `tag`.
    Write { text: String, tag: Option<String>, lead: AdviceLead },
    /// Declare this under `[tags]`.
    Declare(String),
    /// Write these lines; `instead`: a key that they replace.
    Lines { lines: Vec<String>, instead: Option<String> },
    /// Delete the text at the place of the finding.
    Delete,
    /// Remove this sign from the place of the finding.
    Drop(String),
    /// Add this row to the map of a device.
    Row(String),
    /// Write this pair under the header of a table.
    Under { table: String, text: String },
    /// Add a table with this header and this first line.
    Table { header: String, line: String },
    /// Remove this key, or the table with this header.
    Remove(String),
    /// Declare a tag, add the instruction `before` (if any) in a rung before, and write `text` at
    /// the place of the finding.
    Here { declare: String, before: Option<String>, text: String },
}

/// How a help introduces a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AdviceLead {
    /// The text is the meant one.
    Told,
    /// The text means the same as the present text.
    AsRead,
    /// The text is the nearest name; the text after that name can be wrong, too.
    Spelling,
    /// The text is one of several, or shows a form.
    Example,
}

impl Advice {
    /// How the help introduces the text of the advice.
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

    /// Whether it is one of several texts that can be meant.
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
