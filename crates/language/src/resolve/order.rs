//! Determines the scan order: the order given by `order`, or, without it, programs in file order,
//! then tasks in file order. Called by `plain`. Built-in tasks have fixed turns and are not part of
//! the scan order.

use super::Resolver;
use super::program::{Block, BlockKind, Program};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, pair};
use crate::source::ladder::Ladder;
use crate::source::reader::Text;
use crate::source::span::{FileId, Located};
use rungd_engine::isa::BlockId;

impl Resolver<'_> {
    /// The scan order of all blocks except the built-in tasks.
    pub(super) fn order(
        &mut self,
        ladders: &[(FileId, Ladder)],
        program: &Program,
    ) -> Vec<BlockId> {
        match self.written_order(ladders) {
            Some(order) => self.explicit_order(&order, program),
            None => default_order(program),
        }
    }

    fn written_order(&mut self, ladders: &[(FileId, Ladder)]) -> Option<Located<Vec<Text>>> {
        let controller = self.options.order.clone();
        for (_, ladder) in ladders {
            let Some(order) = &ladder.order else { continue };
            let finding = if ladders.len() > 1 {
                Finding::new(Code::Order, order.span, "`order` in one of several ladder files")
                    .help("put it into the controller file, which sees all of them")
            } else if let Some(other) = &controller {
                Finding::new(Code::Order, order.span, "`order` is given twice")
                    .related(other.span, "the controller file gives it here")
                    .help("remove one of the two")
            } else {
                return Some(order.clone());
            };
            self.find(finding);
        }
        controller
    }

    fn explicit_order(&mut self, order: &Located<Vec<Text>>, program: &Program) -> Vec<BlockId> {
        let mut ids: Vec<BlockId> = Vec::new();
        let mut places = vec![None; program.blocks.len()];
        for name in &order.value {
            let Some(block) = self.scope.block(&name.text) else {
                let message = format!("no program or task is called `{}`", name.text);
                let finding = Finding::new(Code::UnknownBlock, name.span, message);
                self.find(finding.near(&name.text, self.scope.known_blocks()));
                continue;
            };
            let (id, kind) = (block.id, block.kind);
            if kind == BlockKind::Subroutine {
                let message = format!("`{}` is a subroutine, which has no turn", name.text);
                let finding = Finding::new(Code::Order, name.span, message);
                self.find(finding.help("take it out of `order`").fix(FixEdit::Delete));
                continue;
            }
            if !has_turn(kind) {
                let message = format!("`{}` is a built-in task: its turn is fixed", name.text);
                let finding = Finding::new(Code::BuiltInTask, name.span, message);
                self.find(finding.help("take it out of `order`").fix(FixEdit::Delete));
                continue;
            }
            if let Some(first) = places[id.0 as usize] {
                let message = format!("`order` names `{}` twice", name.text);
                let finding = Finding::new(Code::Order, name.span, message);
                self.find(finding.related(first, "first here").or_omit());
                continue;
            }
            places[id.0 as usize] = Some(name.span);
            ids.push(id);
        }
        let missing: Vec<&Block> =
            with_turns(program).filter(|block| places[block.id.0 as usize].is_none()).collect();
        if !missing.is_empty() {
            let names = missing.iter().map(|block| format!("`{}`", block.name));
            let names = names.collect::<Vec<_>>().join(", ");
            let mut finding =
                Finding::new(Code::Order, order.span, format!("`order` leaves out {names}"));
            let missing_names: Vec<&str> = missing.iter().map(|block| &*block.name).collect();
            for block in missing {
                finding = finding.related(block.span, "this one");
            }
            let all = order.value.iter().map(|name| &*name.text).chain(missing_names);
            let all: Vec<_> = all.map(|name| format!("\"{name}\"")).collect();
            let whole = pair(format!("order = [{}]", all.join(", ")));
            self.find(finding.help("`order` names every program and task once").fix(whole));
        }
        ids
    }
}

fn has_turn(kind: BlockKind) -> bool {
    matches!(kind, BlockKind::Program | BlockKind::Task)
}

fn with_turns(program: &Program) -> impl Iterator<Item = &Block> {
    program.blocks.iter().filter(|block| has_turn(block.kind))
}

fn default_order(program: &Program) -> Vec<BlockId> {
    let blocks = |kind| program.blocks.iter().filter(move |b| b.kind == kind).map(|b| b.id);
    blocks(BlockKind::Program).chain(blocks(BlockKind::Task)).collect()
}
