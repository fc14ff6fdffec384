//! Document symbols and folding: programs, stages, rungs, tags and tests of a file, as a tree.

use anyhow::Result;
use lsp_types::{
    DocumentSymbol, DocumentSymbolParams, DocumentSymbolResponse, FoldingRange, FoldingRangeKind,
    FoldingRangeParams, SymbolKind,
};

use super::file::EditorFile;
use super::names::is_of_key;
use super::slots::{DeclaredKind, Slot, of_path};
use super::words::FileWordRole;
use super::workspace::Workspace;

/// The symbols of a file.
pub(super) fn symbols(
    workspace: &mut Workspace,
    params: DocumentSymbolParams,
) -> Result<Option<DocumentSymbolResponse>> {
    let Some(file) = workspace.file(&params.text_document.uri) else { return Ok(None) };
    Ok(Some(DocumentSymbolResponse::Nested(tree(&file))))
}

/// The symbols of a file: below each object the objects in it, and its tags and parameters.
fn tree(file: &EditorFile) -> Vec<DocumentSymbol> {
    let outline = &file.outline;
    let mut children: Vec<Vec<DocumentSymbol>> = outline.objects.iter().map(|_| vec![]).collect();
    for word in &file.words.all {
        if let FileWordRole::Declares(kind) = word.role
            && is_of_key(kind)
        {
            let extent = outline.pairs[word.pair].extent();
            let doc = outline.value_below(word.pair, "doc");
            let doc = doc.map(|doc| file.slice(doc.inner.clone()).to_owned());
            let name = file.slice(word.span.clone()).to_owned();
            let mut symbol = symbol(file, name, kind_of(kind), extent);
            symbol.detail = doc;
            symbol.selection_range = file.place(word.span.clone());
            children[word.object].push(symbol);
        }
    }
    // An object comes before the objects in it.
    let in_order = |mut all: Vec<DocumentSymbol>| {
        all.sort_by_key(|symbol| (symbol.range.start, symbol.range.end));
        all
    };
    for (at, object) in outline.objects.iter().enumerate().skip(1).rev() {
        let below = in_order(std::mem::take(&mut children[at]));
        let last = object.kind.rsplit('.').next().unwrap_or_default();
        let Slot::Declares(kind) = of_path(file.kind, &object.kind, &["name"]) else {
            children[object.parent].extend(below);
            continue;
        };
        let value = |key: &str| {
            let value = outline.value(at, &[key])?;
            Some((file.slice(value.inner.clone()).to_owned(), value.inner.clone()))
        };
        let named = value("name");
        let name = match &named {
            Some((name, _)) if !name.is_empty() => name.clone(),
            Some(_) | None => shown(file, at, last),
        };
        let doc = value("doc").map(|(doc, _)| doc);
        let mut symbol = symbol(file, name, kind_of(kind), object.extent.clone());
        symbol.detail = doc;
        if let Some((_, span)) = named {
            symbol.selection_range = file.place(span);
        }
        symbol.children = (!below.is_empty()).then_some(below);
        children[object.parent].push(symbol);
    }
    in_order(std::mem::take(&mut children[0]))
}

/// The title of a rung without a name: its first instruction, or the template that it uses.
fn shown(file: &EditorFile, object: usize, last: &str) -> String {
    let outline = &file.outline;
    let does = outline.value(object, &["do"]).or_else(|| outline.value(object, &["use"]));
    match does {
        Some(value) if !value.inner.is_empty() => file.slice(value.inner.clone()).to_owned(),
        Some(_) | None => last.to_owned(),
    }
}

#[allow(deprecated)] // The field must be given.
fn symbol(
    file: &EditorFile,
    name: String,
    kind: SymbolKind,
    extent: std::ops::Range<usize>,
) -> DocumentSymbol {
    let range = file.place(extent);
    DocumentSymbol {
        name,
        detail: None,
        kind,
        tags: None,
        deprecated: None,
        range,
        selection_range: lsp_types::Range::new(range.start, range.start),
        children: None,
    }
}

/// The icon of a declaration.
pub(super) fn kind_of(kind: DeclaredKind) -> SymbolKind {
    match kind {
        DeclaredKind::Tag | DeclaredKind::OwnTag => SymbolKind::VARIABLE,
        DeclaredKind::Parameter => SymbolKind::TYPE_PARAMETER,
        DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Subroutine => SymbolKind::MODULE,
        DeclaredKind::Stage => SymbolKind::CLASS,
        DeclaredKind::Rung => SymbolKind::FUNCTION,
        DeclaredKind::Template => SymbolKind::INTERFACE,
        DeclaredKind::Use => SymbolKind::OBJECT,
        DeclaredKind::Device => SymbolKind::PACKAGE,
        DeclaredKind::Record => SymbolKind::STRUCT,
        DeclaredKind::Field => SymbolKind::FIELD,
        DeclaredKind::Test => SymbolKind::METHOD,
    }
}

/// The parts that can be folded: tables, and values of several lines.
pub(super) fn folding(
    workspace: &mut Workspace,
    params: FoldingRangeParams,
) -> Result<Option<Vec<FoldingRange>>> {
    let Some(file) = workspace.file(&params.text_document.uri) else { return Ok(None) };
    let outline = &file.outline;
    let tables = outline.objects.iter().skip(1).map(|object| object.extent.clone());
    let values = outline.pairs.iter().map(|pair| pair.extent());
    let mut folds: Vec<FoldingRange> = tables
        .chain(values)
        .filter_map(|extent| {
            let place = file.place(extent);
            (place.start.line < place.end.line).then(|| FoldingRange {
                start_line: place.start.line,
                end_line: place.end.line,
                kind: Some(FoldingRangeKind::Region),
                ..FoldingRange::default()
            })
        })
        .collect();
    folds.sort_by_key(|fold| (fold.start_line, fold.end_line));
    folds.dedup_by_key(|fold| fold.start_line);
    Ok(Some(folds))
}
