//! Proposals in instructions: mnemonics that fit the legs of their rung, and names that fit each
//! operand.

use lsp_types::CompletionItemKind;

use super::contacts::{self, DottedWord};
use super::describe::{detail, doc, instruction_doc, symbol};
use super::nature::WantedName;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use crate::outline::KeyPair;
use crate::slots::DeclaredKind;
use rungd_engine::isa::instruction::TABLE;
use rungd_engine::isa::{LegName, Mnemonic, OperandKind, OperandSpec, Spec};
use rungd_language::source::instruction::{OperandWord, assignment, operand_words};
use rungd_language::source::name_reader::ExpressionUse;

/// The proposals for an incomplete instruction.
pub(super) fn offer(scene: &CompletionScene, before: &str) -> Proposals {
    let text = before.trim_start();
    let Some((name, rest)) = text.split_once([' ', '\t']) else {
        return mnemonics(scene, text);
    };
    let Some(mnemonic) = Mnemonic::from_name(name) else { return Proposals::of("") };
    if mnemonic == Mnemonic::Math {
        return match assignment(rest) {
            Some(equals) => contacts::offer_expression(scene, &rest[equals + 1..]),
            None => contacts::offer(scene, rest, WantedName::Target),
        };
    }
    operands(scene, mnemonic.spec(), rest)
}

fn mnemonics(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    let given = legs(scene);
    let specs = TABLE.iter().enumerate();
    for (number, spec) in specs.filter(|(_, spec)| !scene.is_in_observer() || !is_control(spec)) {
        let Some(rank) = rank(spec, given.as_deref()) else { continue };
        let mut proposal = CompletionProposal::new(spec.name, CompletionItemKind::KEYWORD, rank);
        if !rest_of_string(scene) {
            let needed = spec.operands.iter().any(|operand| !operand.optional);
            let space = if needed { " " } else { "" };
            proposal = proposal.writes(format!("{}{space}", spec.name), Some(snippet(spec)));
        }
        proposal.order = number;
        found.add(proposal.detail(spec.title).doc(instruction_doc(spec)));
    }
    found
}

/// Whether an instruction starts, stops, calls or leaves a block or Stage: an observer does not.
fn is_control(spec: &Spec) -> bool {
    matches!(spec.mnemonic, Mnemonic::Exit | Mnemonic::Return)
        || spec.operands.iter().any(|operand| WantedName::of(operand.kind).is_none())
}

/// Whether more text follows the word at the cursor in its string.
fn rest_of_string(scene: &CompletionScene) -> bool {
    let line = scene.file.line(scene.offset);
    let behind = scene.file.slice(scene.offset..line.end);
    let behind = behind.trim_start_matches(|c: char| c.is_ascii_alphanumeric());
    let rest = behind.split('"').next().unwrap_or_default();
    !rest.trim_matches([' ', '\t', ']', '}', ',']).is_empty()
}

/// The keys of the legs in the rung around the cursor; `None` if the rung has no legs yet.
fn legs(scene: &CompletionScene) -> Option<Vec<&'static str>> {
    let leg = |pair: &KeyPair| match pair.names().as_slice() {
        ["when"] => Some(LegName::When.key()),
        ["leg", name, ..] => LegName::KEYED.map(LegName::key).into_iter().find(|key| key == name),
        _ => None,
    };
    let pairs = scene.file.outline.pairs_in(scene.site.object);
    let mut legs: Vec<&'static str> = pairs.filter_map(leg).collect();
    legs.sort_unstable();
    legs.dedup();
    Some(legs).filter(|legs| !legs.is_empty())
}

/// The rank of an instruction by the legs of its rung; `None` if it does not fit them.
fn rank(spec: &Spec, given: Option<&[&str]>) -> Option<u8> {
    let Some(given) = given else { return Some(0) };
    let mut wanted: Vec<&str> = spec.legs.iter().map(|leg| leg.key()).collect();
    wanted.sort_unstable();
    let when = LegName::When.key();
    match (wanted == given, given.contains(&when)) {
        (true, _) => Some(0),
        (false, true) => None,
        (false, false) if given.iter().all(|leg| wanted.contains(leg)) => Some(1),
        (false, false) => Some(2),
    }
}

/// `TMR ${1:t} preset=${2:preset}`.
fn snippet(spec: &Spec) -> String {
    if spec.mnemonic == Mnemonic::Math {
        return format!("{} ${{1:target}} = ${{2:expression}}", spec.name);
    }
    let needed = spec.operands.iter().filter(|operand| !operand.optional);
    let words = needed.enumerate().map(|(at, operand)| match operand.key {
        Some(key) => format!(" {key}=${{{}:{}}}", at + 1, operand.name),
        None => format!(" ${{{}:{}}}", at + 1, operand.name),
    });
    format!("{}{}", spec.name, words.collect::<String>())
}

/// The proposals for the operand at the end of `rest`.
fn operands(scene: &CompletionScene, spec: &'static Spec, rest: &str) -> Proposals {
    // With one more letter, the text ends with an operand for certain.
    let text = format!("{rest}x");
    let mut done = operand_words(&text, spec);
    let Some(OperandWord { key, value, row }) = done.pop() else { return Proposals::of("") };
    let word = &rest[value.start..];
    if key.is_some() {
        return row.map_or(Proposals::of(""), |operand| of_kind(scene, operand, word));
    }
    let number = done.iter().filter(|operand| operand.key.is_none()).count();
    let mut found = match row {
        Some(operand) => of_kind(scene, operand, word),
        None => Proposals::of(DottedWord::of(word, ExpressionUse::Contact).typed),
    };
    // Operands with a key come after the operands without a key.
    let is_whole = number >= spec.operands.iter().filter(|operand| operand.key.is_none()).count();
    let keyed = spec.operands.iter().filter_map(|operand| Some((operand, operand.key?)));
    for (operand, key) in keyed {
        let is_given = done.iter().any(|given| given.key == Some(key));
        if !is_given && is_whole && !word.contains(['.', '[']) {
            let needed = if operand.optional { "optional" } else { "" };
            let rank = u8::from(operand.optional);
            let proposal =
                CompletionProposal::new(format!("{key}="), CompletionItemKind::PROPERTY, rank);
            found.add(proposal.detail(needed));
        }
    }
    found
}

/// The names that fit an operand.
fn of_kind(scene: &CompletionScene, operand: &OperandSpec, word: &str) -> Proposals {
    if let Some(wish) = WantedName::of(operand.kind) {
        return contacts::offer(scene, word, wish);
    }
    let mut found = Proposals::of(word);
    if operand.kind.is_stage() {
        stages(scene, &mut found);
        return found;
    }
    let kinds = [
        (DeclaredKind::Program, [OperandKind::Program, OperandKind::Block]),
        (DeclaredKind::Task, [OperandKind::Task, OperandKind::Block]),
        (DeclaredKind::Subroutine, [OperandKind::Subroutine; 2]),
    ];
    let named = kinds.into_iter().filter(|(_, fitting)| fitting.contains(&operand.kind));
    let named: Vec<DeclaredKind> = named.map(|(kind, _)| kind).collect();
    blocks(scene, &named, &mut found);
    found
}

/// The Stages of the Program or template around the cursor.
fn stages(scene: &CompletionScene, into: &mut Proposals) {
    let stages = scene.names().all.iter().filter(|declared| declared.kind == DeclaredKind::Stage);
    for stage in stages.filter(|stage| stage.parent.is_some() && stage.parent == scene.block) {
        let proposal = CompletionProposal::new(&stage.name, symbol(stage.kind), 0);
        into.add(proposal.detail("stage").doc(doc(stage, scene.project)));
    }
}

/// The Programs and Tasks that an instruction may name; it cannot name `Main`.
fn blocks(scene: &CompletionScene, kinds: &[DeclaredKind], into: &mut Proposals) {
    for block in scene.names().all.iter().filter(|declared| kinds.contains(&declared.kind)) {
        if block.name != "Main" {
            let proposal = CompletionProposal::new(&block.name, symbol(block.kind), 0);
            let proposal = proposal.detail(detail(block, scene.project));
            into.add(proposal.doc(doc(block, scene.project)));
        }
    }
}
