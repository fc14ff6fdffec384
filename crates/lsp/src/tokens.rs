//! Semantic tokens: the kind of each name, and whether a bit is ON in the running controller.
//!
//! The legend: `variable` is a bit or word, `function` a mnemonic or a function of MATH,
//! `namespace` a block or device, `property` a Stage or member, `parameter` a parameter of a
//! template, `class` a template, `event` a rung or test. The modifiers `on` and `off` show the
//! value of a bit in the live view.

use anyhow::Result;
use lsp_types::{
    SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokens,
    SemanticTokensFullOptions, SemanticTokensLegend, SemanticTokensOptions, SemanticTokensParams,
    SemanticTokensResult, WorkDoneProgressOptions,
};

use super::file::NumberedFile;
use super::names::Meaning;
use super::operands::named;
use super::project::Project;
use super::slots::{DeclaredKind, FileKind};
use super::uri::path_of;
use super::words::{FileWord, FileWordRole};
use super::workspace::Workspace;
pub use rungd_client::operator::protocol::BitOrNumber;

/// The types of tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NameToken {
    Variable,
    Function,
    Namespace,
    Property,
    Parameter,
    Class,
    Event,
}

/// The types in the protocol, in the order of [`NameToken`].
const KINDS: [SemanticTokenType; 7] = [
    SemanticTokenType::VARIABLE,
    SemanticTokenType::FUNCTION,
    SemanticTokenType::NAMESPACE,
    SemanticTokenType::PROPERTY,
    SemanticTokenType::PARAMETER,
    SemanticTokenType::CLASS,
    SemanticTokenType::EVENT,
];

const DECLARATION: u32 = 1;
const ON: u32 = 2;
const OFF: u32 = 4;

/// The options for tokens that the server sends at the start.
pub(super) fn options() -> SemanticTokensOptions {
    let modifiers = vec![
        SemanticTokenModifier::DECLARATION,
        SemanticTokenModifier::new("on"),
        SemanticTokenModifier::new("off"),
    ];
    SemanticTokensOptions {
        legend: SemanticTokensLegend { token_types: KINDS.to_vec(), token_modifiers: modifiers },
        full: Some(SemanticTokensFullOptions::Bool(true)),
        range: None,
        work_done_progress_options: WorkDoneProgressOptions::default(),
    }
}

/// The tokens of a file.
pub(super) fn tokens(
    workspace: &mut Workspace,
    params: SemanticTokensParams,
) -> Result<Option<SemanticTokensResult>> {
    let Some(path) = path_of(&params.text_document.uri) else { return Ok(None) };
    let Some(project) = workspace.project(&path) else { return Ok(None) };
    let Some(number) = project.number(&path) else { return Ok(None) };
    let file = &project.files[number];
    let live = workspace.live.values(&project.root).filter(|_| file.kind == FileKind::Ladder);
    let mut data = Vec::new();
    let (mut last, mut end) = (lsp_types::Position::default(), 0);
    for word in &file.words.all {
        let value = || {
            let named = named(&project, NumberedFile { number, file }, word)?;
            Some(live.as_ref()?.get(&named.operand)?.held())
        };
        let state = match live.as_ref().and_then(|_| value()) {
            Some(BitOrNumber::Bit(true)) => ON,
            Some(BitOrNumber::Bit(false)) => OFF,
            Some(BitOrNumber::Word(_) | BitOrNumber::Real(_)) | None => 0,
        };
        for (span, kind) in parts(&project, NumberedFile { number, file }, word) {
            let place = file.place(span.clone());
            if span.start < end || span.is_empty() || place.start.line != place.end.line {
                continue;
            }
            let declares = matches!(word.role, FileWordRole::Declares(_));
            let is_same_line = place.start.line == last.line;
            data.push(SemanticToken {
                delta_line: place.start.line - last.line,
                delta_start: place.start.character - if is_same_line { last.character } else { 0 },
                length: place.end.character - place.start.character,
                token_type: kind as u32,
                token_modifiers_bitset: state | if declares { DECLARATION } else { 0 },
            });
            (last, end) = (place.start, span.end);
        }
    }
    Ok(Some(SemanticTokensResult::Tokens(SemanticTokens { result_id: None, data })))
}

/// The parts of a word that have a token.
fn parts(
    project: &Project,
    file: NumberedFile,
    word: &FileWord,
) -> Vec<(std::ops::Range<usize>, NameToken)> {
    let one = |kind| vec![(word.span.clone(), kind)];
    match word.role {
        FileWordRole::Mnemonic(_) | FileWordRole::Function(_) => one(NameToken::Function),
        FileWordRole::Block | FileWordRole::Device => one(NameToken::Namespace),
        FileWordRole::Stage => one(NameToken::Property),
        FileWordRole::Template => one(NameToken::Class),
        FileWordRole::Parameter | FileWordRole::Placeholder => one(NameToken::Parameter),
        FileWordRole::Declares(kind) => one(kind_of(kind)),
        FileWordRole::File | FileWordRole::DeviceLadder | FileWordRole::Warning => Vec::new(),
        FileWordRole::Reads | FileWordRole::Writes | FileWordRole::Names | FileWordRole::Type => {
            let parts = project.names.parts(file, word);
            let kind = |meaning| match meaning {
                Meaning::Declared(at) => Some(kind_of(project.names.all[at].kind)),
                Meaning::Member => Some(NameToken::Property),
                Meaning::Address(_) | Meaning::Status => Some(NameToken::Variable),
                Meaning::Unknown => None,
            };
            parts.into_iter().filter_map(|part| Some((part.span, kind(part.meaning)?))).collect()
        }
    }
}

fn kind_of(kind: DeclaredKind) -> NameToken {
    match kind {
        DeclaredKind::Tag | DeclaredKind::OwnTag | DeclaredKind::Use => NameToken::Variable,
        DeclaredKind::Program
        | DeclaredKind::Task
        | DeclaredKind::Subroutine
        | DeclaredKind::Device => NameToken::Namespace,
        DeclaredKind::Stage | DeclaredKind::Field => NameToken::Property,
        DeclaredKind::Template | DeclaredKind::Record => NameToken::Class,
        DeclaredKind::Parameter => NameToken::Parameter,
        DeclaredKind::Rung | DeclaredKind::Test => NameToken::Event,
    }
}
