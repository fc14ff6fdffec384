//! The program of ladders whose uses of templates are expanded.
//!
//! Called by `mod` for the whole program, and by `template::trial` for the unused templates.

use std::sync::Arc;

use super::Resolver;
use super::layers::Layers;
use super::name_book::NameBook;
use super::named_constants::NamedConstants;
use super::program::{NamedArray, NamedOperand, Program};
use crate::source::file_kind::LIBRARY;
use crate::source::ladder::Ladder;
use crate::source::span::{FileId, Span};
use rungd_engine::isa::NumberSet;

impl Resolver<'_> {
    /// The program of ladders whose uses are expanded.
    pub(super) fn plain_program(&mut self, ladders: &[(FileId, Ladder)]) -> Program {
        let mut program = Program::empty(self.options.sizes.clone());
        // The library's files usually come before the plant's own files.
        let is_own = |(id, _): &&(FileId, Ladder)| !self.file_name(*id).starts_with(LIBRARY);
        let (id, first) = ladders.iter().find(is_own).unwrap_or(&ladders[0]);
        program.name = match &first.name {
            Some(name) => name.text.clone(),
            None => file_stem(self.file_name(*id)).to_owned(),
        };
        program.doc.clone_from(&first.doc);
        for (id, ladder) in ladders {
            let names = ladder.allow.iter().map(|name| (*id, self.allowed(name)));
            program.allow.extend(names.collect::<Vec<_>>());
        }
        self.declare(ladders, &mut program);
        program.sizes.devices = program.devices.len() as u32;
        self.check_arguments();
        self.resolve_acks(&mut program);
        let written = ladders.iter().flat_map(|(_, ladder)| &ladder.blocks);
        for (at, block) in written.enumerate() {
            self.rungs(block, &mut program.blocks[at]);
        }
        program.order = self.order(ladders, &program);
        let mut names = NameBook::of(&program, self.scope.places().clone());
        names.constants = NamedConstants::of(std::mem::take(&mut self.constants), &program.tags);
        program.names = Arc::new(names);
        self.mark_own_tags(&program);
        for (tag, used) in program.tags.iter_mut().zip(&self.used) {
            tag.used = *used;
        }
        self.share_uses(&mut program.tags);
        (program.operands, program.arrays) = self.operands();
        program
    }

    /// The operands in order of place, each address once, with its first name; and the arrays.
    pub(super) fn operands(&mut self) -> (Vec<NamedOperand>, Vec<NamedArray>) {
        let (named, arrays) = (std::mem::take(&mut self.named), std::mem::take(&mut self.arrays));
        // If both have the same place, as in `recipe[step]`, the array comes before its index.
        let arrays = arrays.into_iter().map(|(span, array)| (span, Err(array)));
        let operands = named.into_iter().map(|(span, operand)| (span, Ok(operand)));
        let mut all: Vec<(Span, Result<NamedOperand, NamedArray>)> =
            arrays.chain(operands).collect();
        match self.layers.is_empty() {
            true => all.sort_by_key(|(span, _)| (span.file, span.start)),
            false => all.sort_by_cached_key(|(span, _)| self.layers.order(*span)),
        }
        let (mut operands, mut arrays) = (Vec::new(), Vec::new());
        let (mut seen, mut seen_arrays) = (NumberSet::default(), NumberSet::default());
        for (_, named) in all {
            match named {
                Ok(operand) if seen.insert(operand.address) => operands.push(operand),
                Err(of) if seen_arrays.insert((of.array.element(0), of.array.count)) => {
                    arrays.push(NamedArray { behind: operands.len(), ..of });
                }
                Ok(_) | Err(_) => {}
            }
        }
        (operands, arrays)
    }

    /// Marks an own tag of a template as used in all uses, if it is named in one of them.
    fn mark_own_tags(&mut self, program: &Program) {
        let own = || program.tags.iter().enumerate().filter(|(_, t)| Layers::is_layered(t.span));
        let places: NumberSet<Span> = own()
            .filter(|(at, _)| self.used[*at])
            .map(|(_, tag)| self.layers.in_file(tag.span))
            .collect();
        for (at, tag) in own() {
            self.used[at] |= places.contains(&self.layers.in_file(tag.span));
        }
    }
}

/// A file's name without its folder and extension.
fn file_stem(name: &str) -> &str {
    let base = name.rsplit('/').next().unwrap_or(name);
    base.strip_suffix(".toml").unwrap_or(base)
}
