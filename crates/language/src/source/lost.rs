//! The missing parts of files that are not completely TOML, and the findings that they may cause.
//!
//! [`super::mend`] makes a [`LostText`] for each file. The reader and the loads pass it to
//! [`LostTexts`], which drops the findings that may only be caused by missing parts. A wrong
//! finding while a person types is worse than a finding that appears a moment later.

use std::collections::HashSet;
use std::ops::Range;

use super::finding::{Finding, Severity};
use super::lost_tables::{LostTables, TableRange};
use super::rests_on::RestsOn;
use super::span::FileId;
use super::statements::plain_key;

/// The missing parts of one file.
#[derive(Clone, Debug, Default)]
pub struct LostText {
    /// The tables with missing parts, in order.
    tables: Vec<TableRange>,
    /// The same tables, each extended to all tables of its block or device.
    groups: Vec<TableRange>,
    /// All words of the lost text: each of them may declare a name.
    words: HashSet<String>,
    /// Whether the lost text may declare a name that is not one of these words.
    hides_names: bool,
}

impl LostText {
    /// The missing parts of a text; `places` are their places.
    pub(super) fn of(tables: &LostTables, source: &str, places: &[Range<usize>]) -> LostText {
        let (groups, words) = (tables.lossy_groups(), HashSet::new());
        let mut lost = LostText { tables: tables.lossy(), groups, words, hides_names: false };
        for place in places {
            let text = &source[place.clone()];
            lost.hides_names |= !is_readable(text);
            lost.add_words(text);
        }
        // A name, or the template that makes a table a use, may be cut in the middle.
        lost.hides_names |= ["name", "use"].iter().any(|key| lost.words.contains(*key));
        // A table with missing parts may not declare its name: a part of a plant without its kind,
        // for example.
        for place in tables.lossy_names() {
            lost.add_words(&source[place.start as usize..place.end as usize]);
        }
        lost
    }

    fn add_words(&mut self, text: &str) {
        for word in words(text) {
            self.words.extend(word.split('-').map(str::to_owned));
            self.words.insert(word.to_owned());
        }
    }

    /// Records that a header is lost, with all names that its table may declare.
    pub(super) fn lose_header(&mut self) {
        self.hides_names = true;
    }

    /// Whether the lost text may declare any name.
    pub(super) fn hides_names(&self) -> bool {
        self.hides_names
    }

    /// Whether the lost text may declare a name, perhaps with one changed character. In that case,
    /// the longer half of the name is a word of the lost text.
    fn may_declare(&self, name: &str) -> bool {
        let half = name.len().saturating_sub(1) / 2;
        let longer = (half.max(1)..=name.len()).filter(|at| name.is_char_boundary(*at));
        let mut heads = longer.map(|end| &name[..end]);
        let shorter = (0..=name.len() - half).filter(|at| name.is_char_boundary(*at));
        let mut tails = shorter.map(|start| &name[start..]);
        let has = |part: &str| !part.is_empty() && self.words.contains(part);
        heads.any(has) || tails.any(has)
    }
}

/// Whether a lost text begins with a readable key, or is the element of an array.
fn is_readable(text: &str) -> bool {
    let text = text.trim_start();
    // If a `}` has no `{`, the end of the key may be lost too.
    let is_cut = text.matches('}').count() > text.matches('{').count();
    text.starts_with(['{', '"']) || plain_key(text).is_some() && !is_cut
}

fn has_at(tables: &[TableRange], place: u32) -> bool {
    let behind = tables.partition_point(|table| table.start <= place);
    behind.checked_sub(1).is_some_and(|at| place < tables[at].end)
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_apart = |c: char| !c.is_alphanumeric() && c != '_' && c != '-';
    text.split(is_apart).filter(|word| !word.is_empty())
}

/// The missing parts of the files of a load.
#[derive(Clone, Debug, Default)]
pub struct LostTexts {
    files: Vec<(FileId, LostText)>,
    /// Whether a file with settings is among them.
    settings: bool,
}

impl LostTexts {
    /// Adds a ladder file.
    pub fn add(&mut self, file: FileId, lost: Option<LostText>) {
        self.files.extend(lost.map(|lost| (file, lost)));
    }

    /// Adds a controller file or a test file.
    pub fn add_settings(&mut self, file: FileId, lost: Option<LostText>) {
        self.settings |= lost.is_some();
        // The name of a ladder file may be lost, and with it all names that the ladder file
        // declares.
        self.add(
            file,
            lost.map(|lost| LostText {
                hides_names: lost.hides_names || has_at(&lost.tables, 0),
                ..lost
            }),
        );
    }

    /// Adds the files of a different part of the load.
    pub fn add_all(&mut self, others: &LostTexts) {
        self.settings |= others.settings;
        self.files.extend(others.files.iter().cloned());
    }

    /// Whether nothing is missing.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Keeps only the findings that are right whatever the missing parts contain. Needs findings
    /// whose places are in files.
    pub fn keep_sure(&self, findings: &mut Vec<Finding>) {
        if !self.files.is_empty() {
            findings.retain(|finding| self.is_sure(finding));
        }
    }

    fn is_sure(&self, finding: &Finding) -> bool {
        if finding.severity() == Severity::Warning && self.has_word("allow") {
            return false;
        }
        match finding.code.rests_on() {
            RestsOn::Itself => true,
            RestsOn::Names => self.has_names(finding),
            RestsOn::Table => {
                self.has_names(finding) && self.has_whole(finding, |lost| &lost.tables)
            }
            RestsOn::Group => {
                self.has_names(finding) && self.has_whole(finding, |lost| &lost.groups)
            }
            RestsOn::Settings => !self.settings,
            RestsOn::Everything => false,
        }
    }

    fn has_word(&self, word: &str) -> bool {
        self.files.iter().any(|(_, lost)| lost.words.contains(word))
    }

    fn may_declare(&self, name: &str) -> bool {
        self.files.iter().any(|(_, lost)| lost.may_declare(name))
    }

    /// Whether the place of a finding lies in none of the `lossy` tables of its file.
    fn has_whole(&self, finding: &Finding, lossy: fn(&LostText) -> &[TableRange]) -> bool {
        let place = finding.span;
        let mut of_file = self.files.iter().filter(|(file, _)| *file == place.file);
        !of_file.any(|(_, lost)| has_at(lossy(lost), place.start))
    }

    /// Whether the lost texts can declare none of a finding's names.
    fn has_names(&self, finding: &Finding) -> bool {
        if self.files.iter().any(|(_, lost)| lost.hides_names) {
            return false;
        }
        // A message contains only a part of a long name.
        let mut quoted = finding.message.split('`').skip(1).step_by(2);
        !finding.message.contains('…')
            && !quoted.any(|name| words(name).any(|word| self.may_declare(word)))
    }
}
