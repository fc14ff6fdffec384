//! Inlay hints with the values of the running controller: after each text of contacts the values
//! of its words and of the sides of its compares, after each instruction the values of the operands
//! that it writes and reads.

use anyhow::Result;
use lsp_types::{InlayHint, InlayHintKind, InlayHintLabel, InlayHintParams};

use super::compared::{ConstantSides, LiveText, compared};
use super::file::{EditorFile, NumberedFile};
use super::live_poller::LiveValue;
use super::operands::{NamedWord, NamingValue, named, values, words};
use super::outline::OutlineValue;
use super::slots::{FileKind, Slot};
use super::uri::path_of;
use super::workspace::Workspace;
pub use rungd_client::operator::protocol::BitOrNumber;
use rungd_config::controller::OutputState;
use rungd_lab::testing::time_text;
use rungd_language::resolve::value_texts::with_text;

/// The maximum number of values after one text.
const SHOWN_MAX: usize = 4;

const NS_PER_MS: u64 = 1_000_000;

/// The hints of a part of a file; `None` while the values are unknown.
pub(super) fn hints(
    workspace: &mut Workspace,
    params: InlayHintParams,
) -> Result<Option<Vec<InlayHint>>> {
    let Some(path) = path_of(&params.text_document.uri) else { return Ok(None) };
    let Some(project) = workspace.project(&path) else { return Ok(None) };
    let Some(number) = project.number(&path) else { return Ok(None) };
    let file = &project.files[number];
    if file.kind != FileKind::Ladder {
        return Ok(None);
    }
    let bytes = file.offset(params.range.start)..file.offset(params.range.end);
    workspace.live.shows(&path, bytes.clone());
    let Some(live) = workspace.live.values(&project.root) else { return Ok(None) };
    let shown = values(file, bytes.start).take_while(|naming| naming.value.span.start <= bytes.end);
    let numbered = NumberedFile { number, file };
    let scene = LiveText { project: &project, numbered, live: &live };
    let constants = ConstantSides::new();
    let hint = |naming: NamingValue| {
        let label = label(scene, naming, constants.as_ref())?;
        Some(hint(file, naming.value, label))
    };
    Ok(Some(shown.filter_map(hint).collect()))
}

fn hint(file: &EditorFile, value: &OutlineValue, label: String) -> InlayHint {
    InlayHint {
        position: file.place(value.span.end..value.span.end).start,
        label: InlayHintLabel::String(label),
        kind: Some(InlayHintKind::TYPE),
        text_edits: None,
        tooltip: None,
        padding_left: Some(true),
        padding_right: Some(false),
        data: None,
    }
}

/// The label after a value: `level = 37, late.Acc = 1.2 s`; of a compare with an expression also
/// the values of its sides, `73 > 120`.
fn label(
    scene: LiveText<'_>,
    NamingValue { value, slot }: NamingValue,
    constants: Option<&ConstantSides>,
) -> Option<String> {
    let LiveText { project, numbered, live } = scene;
    let file = numbered.file;
    let mut shown: Vec<String> = Vec::new();
    for word in words(file, value) {
        let Some(word) = named(project, numbered, word) else { continue };
        let Some(value) = live.get(&word.operand) else { continue };
        let is_wanted = match value.memory {
            // The colour of a bit that is only read shows its value.
            BitOrNumber::Bit(_) => slot == Slot::Instruction && word.is_written,
            BitOrNumber::Word(_) | BitOrNumber::Real(_) => true,
        };
        let text = hint_text(&word, value);
        if is_wanted && !shown.contains(&text) && shown.len() < SHOWN_MAX {
            shown.push(text);
        }
    }
    if let Some(constants) = constants.filter(|_| slot == Slot::Contacts) {
        shown.extend(compared(scene, value, constants));
    }
    (!shown.is_empty()).then(|| shown.join(", "))
}

fn hint_text(word: &NamedWord, value: &LiveValue) -> String {
    let held = value.held();
    let value = match value.output {
        OutputState::AsMemory => with_text(held_text(word, held), value.text.as_deref()),
        OutputState::Safe(_) => format!("{held}, safe value"),
        OutputState::Unknown(None) => "not known".to_owned(),
        OutputState::Unknown(Some(last)) => format!("not known, last {}", BitOrNumber::Bit(last)),
    };
    format!("{} = {value}", word.operand)
}

fn held_text(word: &NamedWord, held: BitOrNumber) -> String {
    match held {
        BitOrNumber::Word(ms) if word.is_time => {
            time_text(u64::from(ms.unsigned_abs()).saturating_mul(NS_PER_MS))
        }
        BitOrNumber::Bit(_) | BitOrNumber::Word(_) | BitOrNumber::Real(_) => held.to_string(),
    }
}
