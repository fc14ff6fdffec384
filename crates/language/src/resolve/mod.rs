//! Resolves names to addresses. Finds names that are unknown, duplicate, read-only or of the wrong
//! kind.
//!
//! [`load_ladders`] takes the texts of one or several ladder files and returns the resolved
//! [`Program`]. `check` applies the rules to it, and `lower` turns it into an engine program. No
//! I/O.

pub mod alarm_keys;
pub mod alarm_terms;
pub mod array;
mod array_tags;
pub mod beside;
mod block_kind;
pub mod calls;
mod computed;
pub mod condition;
mod contact;
mod declare;
pub mod formula;
mod formula_constants;
mod formula_elements;
mod formula_operands;
mod formula_resolver;
#[cfg(test)]
mod formula_tests;
mod iec_counter;
mod index;
pub mod instruction;
pub mod layers;
mod math;
pub mod mistake;
pub mod name_book;
mod name_texts;
pub mod named_constants;
pub mod names;
pub mod observed;
pub mod observer;
mod operand;
mod operand_array;
pub mod operand_list;
pub mod operands;
mod order;
mod packing;
mod placement;
pub mod places;
mod plain;

pub mod priority;
pub mod program;
mod program_names;
pub mod range;
pub mod reads;
pub mod record;
mod record_copy;
mod record_names;
mod record_tags;
mod resolver;
mod rung;
pub mod scope;
mod tag;
mod tag_texts;
mod tag_words;
mod tags;
mod template;
mod typed;
mod unit;
mod uses;
mod value;
pub mod value_texts;
mod word_bits;
mod writable;
pub mod writes;

use std::sync::Arc;

use crate::source::finding::{Finding, Severity};
use crate::source::ladder::{self, Entry, Ladder};
use crate::source::lost::LostTexts;
use crate::source::room::LoadRoom;
use crate::source::span::{FileId, SourceFile};
use program::Program;
use resolver::Resolver;
use rungd_base::progress::LoadStep;

pub use resolver::LoadOptions;
pub use template::{ParameterKind, is_type_name, placeholders};

/// Resolves the ladder files together as one program. The program is `None` if the findings contain
/// an error. The findings are in order of place.
pub fn load_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let (program, mut findings) = resolve_ladders(files, options);
    if let Some(program) = &program {
        findings = in_order(program.layers.placed_findings(findings));
        program.lost.keep_sure(&mut findings);
    }
    let refused = findings.iter().any(|f| f.severity() == Severity::Error);
    (program.filter(|program| !refused && program.lost.is_empty()), findings)
}

/// As [`load_ladders`], but returns the program despite errors, if all files can be read. Parts
/// with mistakes are left out, so that the rules can check the rest. Such a program must not be
/// lowered. Findings may still have places in the program's layers, and may be caused by missing
/// parts of the files (`Program::lost`).
pub fn resolve_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let mut findings = Vec::new();
    let mut ladders = Vec::new();
    let bytes = files.iter().map(|file| file.text.len()).sum();
    let mut room = LoadRoom::of(options.progress.clone()).for_bytes(bytes);
    for (at, file) in files.iter().enumerate() {
        let id = FileId(options.first_file.0 + at as u32);
        options.progress.begin(LoadStep::Parsing(file.name.clone()));
        let (ladder, found) = ladder::read(&mut room, &file.text, id);
        findings.extend(found);
        ladders.push((id, ladder));
    }
    let mut whole: Vec<(FileId, Ladder<Entry>)> =
        ladders.into_iter().filter_map(|(id, ladder)| Some((id, ladder?))).collect();
    let mut lost = LostTexts::default();
    whole.iter_mut().for_each(|(id, ladder)| lost.add(*id, ladder.lost.take()));
    // If a file is missing, the names that it declares would be reported as unknown.
    if whole.len() < files.len() || whole.is_empty() {
        return (None, in_order(findings));
    }
    if options.progress.is_over() {
        return (None, Vec::new());
    }
    options.progress.begin(LoadStep::Names);
    let mut resolver = Resolver::new(files, options);
    resolver.misread = !findings.is_empty();
    let program = Program { lost, ..resolver.program(whole) };
    findings.append(&mut resolver.findings);
    (Some(program), in_order(findings))
}

fn in_order(mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
    findings
}

impl Resolver<'_> {
    fn program(&mut self, ladders: Vec<(FileId, Ladder<Entry>)>) -> Program {
        self.read_records(&ladders);
        let mut ladders = self.expand(ladders);
        self.expand_records(&mut ladders);
        let mut program = self.plain_program(&ladders);
        program.trial = self.trial_program(&ladders).map(Box::new);
        program.layers = Arc::new(std::mem::take(&mut self.layers));
        program
    }
}
