//! The proposals that fit the typed text, the best first, as items of the protocol.

use std::collections::HashSet;
use std::ops::Range;

use lsp_types::{
    ClientCapabilities, CompletionItem, CompletionItemKind, CompletionList, CompletionTextEdit,
    Documentation, InsertTextFormat, MarkupContent, MarkupKind, TextEdit,
};

use crate::file::EditorFile;

/// The maximum number of items of an answer; an editor asks again when the user types more.
const ITEMS_MAX: usize = 1_000;

/// The capabilities of an editor for items.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ItemAbilities {
    /// It supports snippets.
    snippets: bool,
    /// It shows Markdown.
    markdown: bool,
}

impl ItemAbilities {
    /// The capabilities of an editor.
    pub fn of(client: &ClientCapabilities) -> ItemAbilities {
        let document = client.text_document.as_ref();
        let item =
            document.and_then(|document| document.completion.as_ref()?.completion_item.as_ref());
        let formats = item.and_then(|item| item.documentation_format.as_ref());
        ItemAbilities {
            snippets: item.and_then(|item| item.snippet_support).unwrap_or(false),
            markdown: formats.is_some_and(|format| format.contains(&MarkupKind::Markdown)),
        }
    }
}

/// A text that could be written at the cursor.
#[derive(Debug)]
pub(super) struct CompletionProposal {
    /// The text that is shown, and compared with the typed text.
    pub label: String,
    /// Its symbol.
    pub kind: CompletionItemKind,
    /// A few words that are shown beside the label.
    pub detail: String,
    /// Its explanation, as Markdown.
    pub doc: String,
    /// The text to insert, if it is not the label.
    pub text: Option<String>,
    /// The same text as a snippet, with `$1` at the place of the next words.
    pub snippet: Option<String>,
    /// Proposals of lower ranks come first.
    pub rank: u8,
    /// The order among proposals of the same rank; with the same order, the labels decide.
    pub order: usize,
}

impl CompletionProposal {
    /// A proposal that inserts its label.
    pub fn new(label: impl Into<String>, kind: CompletionItemKind, rank: u8) -> CompletionProposal {
        let (detail, doc) = (String::new(), String::new());
        CompletionProposal {
            label: label.into(),
            kind,
            detail,
            doc,
            text: None,
            snippet: None,
            rank,
            order: 0,
        }
    }

    /// The proposal with a few words beside its label.
    pub fn detail(self, detail: impl Into<String>) -> CompletionProposal {
        CompletionProposal { detail: detail.into(), ..self }
    }

    /// The proposal with an explanation.
    pub fn doc(self, doc: impl Into<String>) -> CompletionProposal {
        CompletionProposal { doc: doc.into(), ..self }
    }

    /// The proposal with a different text to insert, and the snippet of that text.
    pub fn writes(self, text: impl Into<String>, snippet: Option<String>) -> CompletionProposal {
        CompletionProposal { text: Some(text.into()), snippet, ..self }
    }
}

/// The proposals for a typed text.
#[derive(Debug)]
pub(super) struct Proposals {
    /// The typed part of the word.
    pub typed: String,
    all: Vec<CompletionProposal>,
    seen: HashSet<String>,
    /// Whether there may be different proposals when more is typed.
    pub is_incomplete: bool,
    /// The signs, besides letters and digits, that the word may contain after the cursor.
    pub signs: &'static str,
}

impl Proposals {
    /// An empty list.
    pub fn of(typed: &str) -> Proposals {
        let (all, seen) = (Vec::new(), HashSet::new());
        let typed = typed.to_owned();
        Proposals { typed, all, seen, is_incomplete: false, signs: "_-" }
    }

    /// Whether a label contains the typed characters in their order.
    pub fn fits(&self, label: &str) -> bool {
        let mut rest = label.chars();
        self.typed.chars().all(|c| rest.any(|typed| typed.eq_ignore_ascii_case(&c)))
    }

    /// Adds a proposal if it fits; of several with the same label, only the first.
    pub fn add(&mut self, proposal: CompletionProposal) {
        if self.fits(&proposal.label) && self.seen.insert(proposal.label.clone()) {
            self.all.push(proposal);
        }
    }

    /// Whether there are no proposals.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Keeps only some of the proposals.
    pub fn retain(&mut self, keeps: impl FnMut(&CompletionProposal) -> bool) {
        self.all.retain(keeps);
    }

    /// The sorted proposals as items.
    pub fn items(mut self, place: &ItemPlace) -> CompletionList {
        let typed = self.typed.to_ascii_lowercase();
        let key = |proposal: &CompletionProposal| {
            let begins = proposal.label.to_ascii_lowercase().starts_with(&typed);
            (!begins, proposal.rank, proposal.order, proposal.label.clone())
        };
        self.all.sort_by_cached_key(key);
        self.is_incomplete |= self.all.len() > ITEMS_MAX;
        self.all.truncate(ITEMS_MAX);
        let items = self.all.into_iter().map(|item| place.item(item)).collect();
        CompletionList { is_incomplete: self.is_incomplete, items }
    }
}

/// Where items are written, and for which editor.
pub(super) struct ItemPlace<'f> {
    /// The file.
    pub file: &'f EditorFile,
    /// The bytes that an item replaces.
    pub range: Range<usize>,
    /// The text around each item: quotes that are not typed yet.
    pub wrap: (&'static str, &'static str),
    /// Whether a comma follows each item.
    pub comma: bool,
    /// The capabilities of the editor.
    pub can: ItemAbilities,
}

impl ItemPlace<'_> {
    fn item(&self, proposal: CompletionProposal) -> CompletionItem {
        let (before, behind) = self.wrap;
        let comma = if self.comma { ", " } else { "" };
        let plain = proposal.text.unwrap_or_else(|| proposal.label.clone());
        let snippet = proposal.snippet.filter(|_| self.can.snippets);
        let is_snippet = snippet.is_some();
        let text = format!("{before}{}{behind}{comma}", snippet.unwrap_or(plain));
        let kind = if self.can.markdown { MarkupKind::Markdown } else { MarkupKind::PlainText };
        let doc = Some(proposal.doc).filter(|doc| !doc.is_empty());
        let edit = TextEdit::new(self.file.place(self.range.clone()), text);
        CompletionItem {
            sort_text: Some(format!("{:02}{:04}{}", proposal.rank, proposal.order, proposal.label)),
            filter_text: Some(proposal.label.clone()),
            label: proposal.label,
            kind: Some(proposal.kind),
            detail: Some(proposal.detail).filter(|detail| !detail.is_empty()),
            documentation: doc
                .map(|value| Documentation::MarkupContent(MarkupContent { kind, value })),
            insert_text_format: is_snippet.then_some(InsertTextFormat::SNIPPET),
            text_edit: Some(CompletionTextEdit::Edit(edit)),
            ..CompletionItem::default()
        }
    }
}
