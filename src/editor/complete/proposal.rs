//! What is offered: proposals that fit what is typed, the best first, as items of the protocol.

use std::collections::HashSet;
use std::ops::Range;

use lsp_types::{
    ClientCapabilities, CompletionItem, CompletionItemKind, CompletionList, CompletionTextEdit,
    Documentation, InsertTextFormat, MarkupContent, MarkupKind, TextEdit,
};

use crate::editor::file::EditorFile;

/// The most items of an answer; an editor asks again when more is typed.
const ITEMS_MAX: usize = 1_000;

/// What an editor can do with items.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::editor) struct ItemAbilities {
    /// It knows snippets.
    snippets: bool,
    /// It shows Markdown.
    markdown: bool,
}

impl ItemAbilities {
    /// Of an editor.
    pub fn of(client: &ClientCapabilities) -> ItemAbilities {
        let document = client.text_document.as_ref();
        let item = document.and_then(|of| of.completion.as_ref()?.completion_item.as_ref());
        let formats = item.and_then(|of| of.documentation_format.as_ref());
        ItemAbilities {
            snippets: item.and_then(|of| of.snippet_support).unwrap_or(false),
            markdown: formats.is_some_and(|of| of.contains(&MarkupKind::Markdown)),
        }
    }
}

/// Something that could be written.
#[derive(Debug)]
pub(super) struct Proposal {
    /// As shown, and as compared with what is typed.
    pub label: String,
    /// Its symbol.
    pub kind: CompletionItemKind,
    /// A few words beside it.
    pub detail: String,
    /// Its explanation, as Markdown.
    pub doc: String,
    /// What is written, if not the label.
    pub text: Option<String>,
    /// As `text`, with `$1` where the next words belong.
    pub snippet: Option<String>,
    /// Those of lower ranks stand first.
    pub rank: u8,
    /// Its place among those of its rank, before the order of their labels.
    pub order: usize,
}

impl Proposal {
    /// A proposal whose label is written.
    pub fn new(label: impl Into<String>, kind: CompletionItemKind, rank: u8) -> Proposal {
        let (detail, doc) = (String::new(), String::new());
        Proposal {
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

    /// With a few words beside it.
    pub fn detail(self, detail: impl Into<String>) -> Proposal {
        Proposal { detail: detail.into(), ..self }
    }

    /// With an explanation.
    pub fn doc(self, doc: impl Into<String>) -> Proposal {
        Proposal { doc: doc.into(), ..self }
    }

    /// With another text, and a snippet of it.
    pub fn writes(self, text: impl Into<String>, snippet: Option<String>) -> Proposal {
        Proposal { text: Some(text.into()), snippet, ..self }
    }
}

/// The proposals for what is typed.
#[derive(Debug)]
pub(super) struct Proposals {
    /// What is typed of the word.
    pub typed: String,
    all: Vec<Proposal>,
    seen: HashSet<String>,
    /// Whether there may be others when more is typed.
    pub is_incomplete: bool,
    /// The signs beside letters and digits that the rest of the word may have behind the cursor.
    pub signs: &'static str,
}

impl Proposals {
    /// None yet.
    pub fn of(typed: &str) -> Proposals {
        let (all, seen) = (Vec::new(), HashSet::new());
        let typed = typed.to_owned();
        Proposals { typed, all, seen, is_incomplete: false, signs: "_-" }
    }

    /// Whether a label has what is typed in it, in this order.
    pub fn fits(&self, label: &str) -> bool {
        let mut rest = label.chars();
        self.typed.chars().all(|c| rest.any(|of| of.eq_ignore_ascii_case(&c)))
    }

    /// Adds a proposal that fits; of those with one label the first.
    pub fn add(&mut self, proposal: Proposal) {
        if self.fits(&proposal.label) && self.seen.insert(proposal.label.clone()) {
            self.all.push(proposal);
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Keeps some.
    pub fn retain(&mut self, keeps: impl FnMut(&Proposal) -> bool) {
        self.all.retain(keeps);
    }

    /// The items.
    pub fn items(mut self, place: &ItemPlace) -> CompletionList {
        let typed = self.typed.to_ascii_lowercase();
        let key = |of: &Proposal| {
            let begins = of.label.to_ascii_lowercase().starts_with(&typed);
            (!begins, of.rank, of.order, of.label.clone())
        };
        self.all.sort_by_cached_key(key);
        self.is_incomplete |= self.all.len() > ITEMS_MAX;
        self.all.truncate(ITEMS_MAX);
        let items = self.all.into_iter().map(|of| place.item(of)).collect();
        CompletionList { is_incomplete: self.is_incomplete, items }
    }
}

/// Where items are written, and for which editor.
pub(super) struct ItemPlace<'f> {
    /// The file.
    pub file: &'f EditorFile,
    /// The bytes that an item replaces.
    pub range: Range<usize>,
    /// What stands around each: quotes that are not typed yet.
    pub wrap: (&'static str, &'static str),
    /// Whether a comma stands behind each.
    pub comma: bool,
    /// What the editor can do.
    pub can: ItemAbilities,
}

impl ItemPlace<'_> {
    fn item(&self, of: Proposal) -> CompletionItem {
        let (before, behind) = self.wrap;
        let comma = if self.comma { ", " } else { "" };
        let plain = of.text.unwrap_or_else(|| of.label.clone());
        let snippet = of.snippet.filter(|_| self.can.snippets);
        let is_snippet = snippet.is_some();
        let text = format!("{before}{}{behind}{comma}", snippet.unwrap_or(plain));
        let kind = if self.can.markdown { MarkupKind::Markdown } else { MarkupKind::PlainText };
        let doc = Some(of.doc).filter(|doc| !doc.is_empty());
        let edit = TextEdit::new(self.file.place(self.range.clone()), text);
        CompletionItem {
            sort_text: Some(format!("{:02}{:04}{}", of.rank, of.order, of.label)),
            filter_text: Some(of.label.clone()),
            label: of.label,
            kind: Some(of.kind),
            detail: Some(of.detail).filter(|detail| !detail.is_empty()),
            documentation: doc
                .map(|value| Documentation::MarkupContent(MarkupContent { kind, value })),
            insert_text_format: is_snippet.then_some(InsertTextFormat::SNIPPET),
            text_edit: Some(CompletionTextEdit::Edit(edit)),
            ..CompletionItem::default()
        }
    }
}
