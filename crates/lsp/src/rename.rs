//! Renames a declaration in all files of the project and its tests.
//!
//! A rename must change nothing but names, so it is tried on copies of the texts first. Every word
//! must keep its meaning, the errors must stay the same, and retentive memory must keep as many
//! elements as before. Otherwise the rename is refused, with the reason.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Result, bail};
use lsp_types::{
    PrepareRenameResponse, RenameParams, TextDocumentPositionParams, TextEdit, Uri, WorkspaceEdit,
};

use super::file::{EditorFile, NumberedFile};
use super::judge::{JudgedRoot, judge};
use super::names::{Declaration, Meaning, ProjectNames};
use super::navigate::{part_at, places_of};
use super::project::{Project, is_library, named_files};
use super::slots::{DeclaredKind, FileKind};
use super::uri::uri_of;
use super::workspace::{Cursor, Workspace};
use rungd_config::load::OpenTexts;
use rungd_language::source::atom::is_name;
use rungd_language::source::finding::{Code, Finding, Severity};

/// The place and the present text of the name at a position, if it can be renamed.
pub(super) fn prepare(
    workspace: &mut Workspace,
    params: TextDocumentPositionParams,
) -> Result<Option<PrepareRenameResponse>> {
    let Some(cursor) = workspace.cursor(&params) else { return Ok(None) };
    let (span, declared) = renamed(&cursor)?;
    let (range, placeholder) = (cursor.file().place(span), declared.name.clone());
    Ok(Some(PrepareRenameResponse::RangeWithPlaceholder { range, placeholder }))
}

/// The declaration at a cursor, and the place of its name there.
fn renamed(cursor: &Cursor) -> Result<(Range<usize>, &Declaration)> {
    let (span, at) = match part_at(cursor) {
        Some((span, Meaning::Declared(at))) => (span, at),
        Some((_, Meaning::Address(address))) => {
            bail!("`{address}` is an address: give it a name under [tags] first")
        }
        Some((_, Meaning::Member | Meaning::Status)) => {
            bail!("this name belongs to rungd: it cannot be renamed")
        }
        Some((_, Meaning::Unknown)) => bail!("nothing of this name is declared"),
        None => bail!("there is no name here"),
    };
    let declared = &cursor.project.names.all[at];
    if is_library(&cursor.project.files[declared.file].path) {
        bail!("`{}` belongs to the library of rungd", declared.name);
    }
    if declared.kind == DeclaredKind::Program && declared.name == "Main" {
        bail!("the Program `Main` cannot be renamed: every ladder needs it");
    }
    Ok((span, declared))
}

/// The edits of a rename.
pub(super) fn rename(
    workspace: &mut Workspace,
    params: RenameParams,
) -> Result<Option<WorkspaceEdit>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position) else { return Ok(None) };
    let (_, declared) = renamed(&cursor)?;
    let new = params.new_name.trim();
    check_name(declared, new)?;
    let project = &cursor.project;
    let Some((_, meaning)) = part_at(&cursor) else { return Ok(None) };
    let mut places: BTreeMap<usize, Vec<Range<usize>>> = BTreeMap::new();
    for (number, span) in places_of(project, meaning) {
        places.entry(number).or_default().push(span);
    }
    let changed = changed_files(project, &places, new);
    joined_here(project, &places)?;
    same_meanings(project, &changed, new)?;
    same_judgement(workspace, project, &changed)?;
    // The protocol defines the type.
    #[allow(clippy::mutable_key_type)]
    let mut edits: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for (number, spans) in places {
        let file = &project.files[number];
        let Some(uri) = uri_of(&file.path) else { bail!("a file of the library names it") };
        let edit = |span| TextEdit::new(file.place(span), new.to_owned());
        edits.insert(uri, spans.into_iter().map(edit).collect());
    }
    Ok(Some(WorkspaceEdit::new(edits)))
}

/// Refuses an invalid name. A name consists of letters, digits and `_`; the name of a block, rung
/// or device may also contain `-`; the name of a test is any text without quotes.
fn check_name(declared: &Declaration, new: &str) -> Result<()> {
    let hyphens = match declared.kind {
        DeclaredKind::Tag
        | DeclaredKind::OwnTag
        | DeclaredKind::Parameter
        | DeclaredKind::Use
        | DeclaredKind::Record
        | DeclaredKind::Field
        | DeclaredKind::Template => false,
        DeclaredKind::Program
        | DeclaredKind::Task
        | DeclaredKind::Subroutine
        | DeclaredKind::Stage
        | DeclaredKind::Rung
        | DeclaredKind::Device => true,
        DeclaredKind::Test => {
            let is_plain = !new.is_empty() && !new.contains(['"', '\'', '\\', '\n', '\r']);
            return if is_plain { Ok(()) } else { bail!("a name is a text without quotes") };
        }
    };
    if is_name(new) || (hyphens && is_name(&new.replace('-', "_"))) {
        return Ok(());
    }
    let also = if hyphens { ", `_` and `-`" } else { " and `_`" };
    bail!("`{new}` is no name: a name begins with a letter and has only letters, digits{also}")
}

/// The files of a project with the new name in some places.
fn changed_files(
    project: &Project,
    places: &BTreeMap<usize, Vec<Range<usize>>>,
    new: &str,
) -> Vec<Arc<EditorFile>> {
    let changed = |(number, file): (usize, &Arc<EditorFile>)| match places.get(&number) {
        None => file.clone(),
        Some(spans) => {
            let mut text = file.text.to_string();
            for span in spans.iter().rev() {
                text.replace_range(span.clone(), new);
            }
            Arc::new(file.with_text(text.into()))
        }
    };
    project.files.iter().enumerate().map(changed).collect()
}

/// Refuses a rename in a ladder that a test joins with a ladder outside of the project: the ladder
/// outside may use the name, and the rename would miss it.
fn joined_here(project: &Project, places: &BTreeMap<usize, Vec<Range<usize>>>) -> Result<()> {
    let is_changed =
        |path: &PathBuf| project.number(path).is_some_and(|at| places.contains_key(&at));
    for test in project.files.iter().filter(|file| file.kind == FileKind::Test) {
        let named = named_files(test);
        let outside = named.iter().find(|path| !is_library(path) && project.number(path).is_none());
        if let Some(outside) = outside.filter(|_| named.iter().any(is_changed)) {
            bail!(
                "{} tests this ladder together with {}, which is not in this project: write a \
                 controller file that names both",
                test.path.display(),
                outside.display()
            );
        }
    }
    Ok(())
}

/// Refuses a rename that would change the meaning of a word.
fn same_meanings(project: &Project, changed: &[Arc<EditorFile>], new: &str) -> Result<()> {
    let names = ProjectNames::of(changed);
    for (number, (before, after)) in project.files.iter().zip(changed).enumerate() {
        if before.words.all.len() != after.words.all.len() {
            bail!("with `{new}` the file would be read differently");
        }
        for (word, renamed) in before.words.all.iter().zip(&after.words.all) {
            let meant = project.names.parts(NumberedFile { number, file: before }, word);
            let means = names.parts(NumberedFile { number, file: after }, renamed);
            let is_same = meant.len() == means.len()
                && meant.iter().zip(&means).all(|(old, new)| old.meaning == new.meaning);
            if !is_same {
                let line = before.place(word.span.clone()).start.line + 1;
                let path = before.path.display();
                bail!("`{new}` would mean something else at {path}:{line}");
            }
        }
    }
    Ok(())
}

/// Refuses a rename that would change the errors of a file or the number of retained elements.
fn same_judgement(
    workspace: &Workspace,
    project: &Project,
    changed: &[Arc<EditorFile>],
) -> Result<()> {
    let before: Vec<(PathBuf, Arc<str>)> = workspace.library.open_texts().collect();
    let on_disk = changed.iter().filter(|file| !is_library(&file.path));
    let after = on_disk.map(|file| (file.path.clone(), file.text.clone()));
    let after: Vec<(PathBuf, Arc<str>)> = before.iter().cloned().chain(after).collect();
    let (before, after) = (OpenTexts::new(before), OpenTexts::new(after));
    let others = project.files.iter().filter_map(|file| match file.kind {
        FileKind::Test => Some(JudgedRoot::Test(file.path.clone())),
        FileKind::Controller if file.path != project.root => {
            Some(JudgedRoot::Controller(file.path.clone()))
        }
        FileKind::Controller | FileKind::Ladder => None,
    });
    for root in std::iter::once(JudgedRoot::of(project)).chain(others) {
        let (was, is) = (judge(0, &root, &before), judge(0, &root, &after));
        let errors = |judgement: &super::judge::Judgement| {
            let errors =
                judgement.findings.iter().filter(|finding| finding.severity() == Severity::Error);
            let mut codes: Vec<Code> = errors.map(|finding| finding.code).collect();
            codes.sort_unstable();
            codes
        };
        if errors(&was) != errors(&is) {
            let known = |finding: &&Finding| {
                was.findings
                    .iter()
                    .any(|old| (old.code, &old.message) == (finding.code, &finding.message))
            };
            let mut new =
                is.findings.iter().filter(|finding| finding.severity() == Severity::Error);
            let new = new.clone().find(|finding| !known(finding)).or_else(|| new.next());
            let why = new.map_or_else(String::new, |finding| {
                let file = is.files.get(finding.span.file.0 as usize);
                let file = file.map_or("", |file| file.name.as_str());
                format!(": {} ({file})", finding.message)
            });
            bail!("the new name is refused{why}");
        }
        if was.retained != is.retained {
            bail!("retentive memory would keep different tags: see `tags` of [retain]");
        }
    }
    Ok(())
}
