//! Go to definition, and find references: the declaration of a name, and all words that mean it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lsp_types::{
    DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams, GotoDefinitionParams,
    GotoDefinitionResponse, Location, ReferenceParams, Uri,
};

use super::device_sides::{self, SideName};
use super::file::NumberedFile;
use super::names::Meaning;
use super::project::{Project, is_library, named_file};
use super::uri::uri_of;
use super::words::FileWordRole;
use super::workspace::{Cursor, Workspace, location};
use rungd_config::load::library;

/// The part of a name at a cursor.
pub(super) fn part_at(cursor: &Cursor) -> Option<(Range<usize>, Meaning)> {
    let word = cursor.word()?;
    let parts = cursor.project.names.parts(cursor.numbered(), word);
    let at = cursor.offset;
    let within = parts.iter().find(|part| part.span.start <= at && at <= part.span.end);
    within.map(|part| (part.span.clone(), part.meaning))
}

/// All places of words with this meaning, as (number of the file, bytes). The declaration is
/// included.
pub(super) fn places_of(project: &Project, meaning: Meaning) -> Vec<(usize, Range<usize>)> {
    let mut places = Vec::new();
    for (number, file) in project.files.iter().enumerate() {
        for word in &file.words.all {
            let parts = project.names.parts(NumberedFile { number, file }, word);
            let same = parts.into_iter().filter(|part| part.meaning == meaning);
            places.extend(same.map(|part| (number, part.span)));
        }
    }
    places
}

/// The declaration of the name at the cursor, also in the own ladder of a field device; for the
/// name of a file, the file.
pub(super) fn definition(
    workspace: &mut Workspace,
    params: GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position_params) else {
        return Ok(None);
    };
    if let Some(path) = file_at(&cursor) {
        let start = Location::new(shown(workspace, &path)?, lsp_types::Range::default());
        return Ok(Some(GotoDefinitionResponse::Scalar(start)));
    }
    let (project, at) = match (device_sides::at_cursor(&cursor), part_at(&cursor)) {
        (Some(SideName { project, at, .. }), _) => (project, at),
        (None, Some((_, Meaning::Declared(at)))) => (&*cursor.project, at),
        (None, Some(_) | None) => return Ok(None),
    };
    let declared = &project.names.all[at];
    let file = &project.files[declared.file];
    let place = file.place(declared.span.clone());
    let location = Location::new(shown(workspace, &file.path)?, place);
    Ok(Some(GotoDefinitionResponse::Scalar(location)))
}

/// The file that the word at the cursor names, if that file exists.
fn file_at(cursor: &Cursor) -> Option<PathBuf> {
    let word = cursor
        .word()
        .filter(|word| matches!(word.role, FileWordRole::File | FileWordRole::DeviceLadder))?;
    let path = named_file(cursor.file(), cursor.file().slice(word.span.clone()));
    (is_library(&path) || path.is_file()).then_some(path)
}

/// The URI under which an editor can open a file. A file of the library is written to disk for
/// this.
fn shown(workspace: &Workspace, path: &Path) -> Result<Uri> {
    let own = match path.to_str().and_then(library::named) {
        Some(Ok(file)) => Some(workspace.jobs.scratch().library(file)?),
        Some(Err((message, help))) => bail!("{message}: {help}"),
        None => None,
    };
    uri_of(own.as_deref().unwrap_or(path)).context("this file is not on disk")
}

/// All uses of the name at the cursor, in all files of the project.
pub(super) fn references(
    workspace: &mut Workspace,
    params: ReferenceParams,
) -> Result<Option<Vec<Location>>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position) else { return Ok(None) };
    let Some((_, meaning)) = part_at(&cursor) else { return Ok(None) };
    let with_declaration = params.context.include_declaration;
    let project = &cursor.project;
    let mut places = match is_one_thing(meaning) {
        true => places_of(project, meaning),
        false => Vec::new(),
    };
    if let Meaning::Declared(at) = meaning {
        let declared = &project.names.all[at];
        let own = (declared.file, declared.span.clone());
        places.retain(|place| with_declaration || *place != own);
    }
    let found =
        places.into_iter().filter_map(|(number, range)| location(&project.files[number], range));
    Ok(Some(found.collect()))
}

/// All uses of the name at the cursor, in the same file.
pub(super) fn highlights(
    workspace: &mut Workspace,
    params: DocumentHighlightParams,
) -> Result<Option<Vec<DocumentHighlight>>> {
    let Some(cursor) = workspace.cursor(&params.text_document_position_params) else {
        return Ok(None);
    };
    let Some((_, meaning)) = part_at(&cursor) else { return Ok(None) };
    let file = cursor.file();
    let mut places = Vec::new();
    for word in file.words.all.iter().filter(|_| is_one_thing(meaning)) {
        let kind = match word.role {
            FileWordRole::Writes | FileWordRole::Declares(_) => DocumentHighlightKind::WRITE,
            FileWordRole::Reads
            | FileWordRole::Names
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
            | FileWordRole::Placeholder => DocumentHighlightKind::READ,
        };
        let parts = cursor.project.names.parts(cursor.numbered(), word);
        let same = parts.into_iter().filter(|part| part.meaning == meaning);
        places.extend(
            same.map(|part| DocumentHighlight { range: file.place(part.span), kind: Some(kind) }),
        );
    }
    Ok(Some(places))
}

/// Whether all words with this meaning stand for the same thing.
fn is_one_thing(meaning: Meaning) -> bool {
    match meaning {
        Meaning::Declared(_) | Meaning::Address(_) => true,
        Meaning::Member | Meaning::Status | Meaning::Unknown => false,
    }
}
