//! The program that is observed: resolved, lowered for observation, with the origin of every step.
//!
//! Made once for a program and its files, and used for every question. It finds the rung of a part,
//! the text and place of an instruction, and the steps that may write a cell.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use super::answer::{BlockPlace, Place, RungName};
use super::cell_index::CellIndex;
use rungd_config::controller::OutputRules;
use rungd_engine::isa::{BlockId, ElementId};
use rungd_engine::{self as engine, Cell, Engine, EngineState, ScanStep, Stretches};
use rungd_language::lower::sites::{LoweredRungPart, OperationSite, Sites};
use rungd_language::lower::{Symbols, lower_seen};
use rungd_language::resolve::program::{self, Instruction, Program};
use rungd_language::source::span::{SourceFile, Span};

/// A program that can be observed.
#[derive(Debug)]
pub struct Subject {
    pub(super) program: Arc<Program>,
    /// The lowered program: one operation in each batch, in file order.
    pub(super) seen: engine::EngineProgram,
    pub(super) symbols: Symbols,
    /// The part and the instruction of each batch.
    pub sites: Sites,
    /// Memory after a cold start.
    pub(super) initial: EngineState,
    files: Vec<SourceFile>,
    /// By file: the ends of its lines.
    line_ends: Vec<Vec<u32>>,
    /// By batch: the cells that it may write.
    pub batches: Vec<Stretches>,
    /// By step of the passes: the cells that it may write.
    pub(super) passes: Vec<Stretches>,
    /// By block: the cells that its turn may write.
    pub(super) turns: Vec<Stretches>,
    /// The parts, in order of the batch before which their contacts are evaluated.
    ready: Vec<(u32, u32)>,
    /// By batch: the index in `ready` of its first part.
    ready_from: Vec<u32>,
    writers: CellIndex<ScanStep>,
    /// What its outputs are driven to, if its controller file is known.
    pub(super) outputs: OutputRules,
}

impl Subject {
    /// Lowers a program for observation. `files`: the loaded files; places refer to them by index.
    pub fn new(program: Arc<Program>, files: Vec<SourceFile>) -> Subject {
        let (seen, symbols, sites) = lower_seen(&program);
        let initial = EngineState::of(&Engine::new(seen.clone()));
        let element = |site: &OperationSite| sites.parts[site.part as usize].element;
        let batches = sites.batches.iter().enumerate();
        let batches =
            batches.map(|(at, site)| seen.written_by_batch(at as u32, element(site))).collect();
        let batches: Vec<Stretches> = batches;
        let passes = (0..sites.passes.len()).map(|at| seen.written_by_pass(at as u32)).collect();
        let turns =
            (0..program.blocks.len()).map(|at| seen.written_by_turn(BlockId(at as u32))).collect();
        let parts = (0..).zip(&sites.parts).filter(|(_, part)| has_steps(part));
        let mut ready: Vec<(u32, u32)> = parts.map(|(at, part)| (part.ready, at)).collect();
        ready.sort_unstable();
        let from = |batch: u32| ready.partition_point(|(at, _)| *at < batch) as u32;
        let ready_from = (0..=sites.batches.len() as u32 + 1).map(from).collect();
        let line_ends = files.iter().map(|file| {
            let ends = file.text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            ends.map(|(at, _)| at as u32).collect()
        });
        let line_ends = line_ends.collect();
        let mut subject = Subject {
            program,
            seen,
            symbols,
            sites,
            initial,
            files,
            line_ends,
            batches,
            passes,
            turns,
            ready,
            ready_from,
            writers: CellIndex::new(std::iter::empty()),
            outputs: OutputRules::default(),
        };
        subject.writers = CellIndex::new(subject.steps());
        subject
    }

    /// The program with the outputs of its controller file, so that `why` tells what they are
    /// driven to.
    #[must_use]
    pub fn with_outputs(self, outputs: OutputRules) -> Subject {
        Subject { outputs, ..self }
    }

    /// The program of which each scan executes this block alone: the observer of a test.
    #[must_use]
    pub fn of_block(self, block: BlockId) -> Subject {
        let mut seen = self.seen;
        seen.order = vec![block];
        seen.kept.clear();
        let initial = EngineState::of(&Engine::new(seen.clone()));
        Subject { seen, initial, ..self }
    }

    /// The parts of rungs whose contacts have been evaluated right before one of these batches.
    pub(super) fn ready_at(&self, batches: Range<u32>) -> impl Iterator<Item = u32> + use<'_> {
        let from = |at: u32| self.ready_from.get(at as usize).map_or(0, |from| *from as usize);
        let ready = self.ready.get(from(batches.start)..from(batches.end)).unwrap_or_default();
        ready.iter().map(|(_, part)| *part)
    }

    /// The part of the rung's own legs, for a part that is a branch.
    pub(super) fn outer(&self, part: u32) -> Option<u32> {
        let at = part as usize;
        self.sites.parts[at].branch?;
        let outer = self.sites.parts[..at].iter().rposition(|part| part.branch.is_none())?;
        Some(outer as u32)
    }

    /// A part of a rung.
    pub(super) fn part(&self, part: u32) -> &LoweredRungPart {
        &self.sites.parts[part as usize]
    }

    /// The rung of a part.
    pub(super) fn rung(&self, part: u32) -> &program::Rung {
        let LoweredRungPart { element, rung, .. } = self.part(part);
        let rungs = match element.stage {
            Some(stage) => &self.program.stage(stage).rungs,
            None => &self.program.block(element.block).rungs,
        };
        &rungs[*rung as usize]
    }

    /// The branch of a part.
    pub(super) fn branch(&self, part: u32) -> Option<&program::Branch> {
        let branch = self.part(part).branch?;
        self.rung(part).branches.get(branch as usize)
    }

    /// An instruction, by its part and its number.
    pub fn instruction(&self, part: u32, number: u32) -> Option<&Instruction> {
        let at = number.checked_sub(self.part(part).instructions.start)?;
        self.body(part).get(at as usize)
    }

    /// The instructions of a part.
    pub(super) fn body(&self, part: u32) -> &[Instruction] {
        match self.branch(part) {
            Some(branch) => &branch.body,
            None => &self.rung(part).body,
        }
    }

    /// The CALLs of a subroutine, in file order: the step, its part of a rung, the instruction.
    pub(super) fn calls_of(&self, subroutine: BlockId) -> Vec<(ScanStep, u32, &Instruction)> {
        let sites = (0..).zip(&self.sites.batches);
        let calls = sites.filter_map(|(at, site)| {
            let call = self.instruction(site.part, site.instruction?)?;
            let is_call = call.called() == Some(subroutine);
            is_call.then_some((ScanStep::Batch(at), site.part, call))
        });
        calls.collect()
    }

    /// The CALLs that lead to the subroutines among these blocks, through others too.
    pub(super) fn calls_to(&self, mut open: Vec<BlockId>) -> Vec<(ScanStep, u32, &Instruction)> {
        let (mut calls, mut known) = (Vec::new(), HashSet::new());
        while let Some(id) = open.pop() {
            if self.program.block(id).is_subroutine() && known.insert(id) {
                let found = self.calls_of(id);
                open.extend(found.iter().map(|(_, part, _)| self.part(*part).element.block));
                calls.extend(found);
            }
        }
        calls
    }

    /// The origin of a step in the program; a turn has none.
    pub(super) fn site(&self, deed: ScanStep) -> Option<OperationSite> {
        match deed {
            ScanStep::Batch(at) => self.sites.batches.get(at as usize).copied(),
            ScanStep::Pass(at) => self.sites.passes.get(at as usize).copied(),
            ScanStep::Turn(_) | ScanStep::Element(_) => None,
        }
    }

    /// All steps, with the cells that each may write.
    fn steps(&self) -> impl Iterator<Item = (ScanStep, &Stretches)> {
        let batches = (0..).zip(&self.batches).map(|(at, batch)| (ScanStep::Batch(at), batch));
        let passes = (0..).zip(&self.passes).map(|(at, pass)| (ScanStep::Pass(at), pass));
        let turns = (0..).zip(&self.turns).map(|(at, turn)| (ScanStep::Turn(BlockId(at)), turn));
        batches.chain(passes).chain(turns)
    }

    /// The steps that may write a cell: operations, then passes, then turns.
    pub(super) fn writers(&self, cell: Cell) -> Vec<ScanStep> {
        self.writers.entries(cell)
    }

    /// Whether a step of the program may write a cell.
    pub(super) fn is_written(&self, cell: Cell) -> bool {
        !self.writers(cell).is_empty()
    }

    /// A place with its file, line and text; for a part of a template, the place in the template.
    pub fn place(&self, span: Span) -> Place {
        let span = self.program.layers.in_file(span);
        let file = self.files.get(span.file.0 as usize);
        let text = file.map_or("", |file| file.text.as_str());
        let (start, end) = (span.start as usize, span.end as usize);
        let ends = self.line_ends.get(span.file.0 as usize).map_or(&[][..], Vec::as_slice);
        Place {
            file: file.map_or_else(String::new, |file| file.name.clone()),
            line: ends.partition_point(|end| *end < span.start) as u32 + 1,
            start: span.start,
            end: span.end,
            text: text.get(start..end).unwrap_or_default().to_owned(),
        }
    }

    /// The rung of a part, for people.
    pub(super) fn place_of_rung(&self, part: u32) -> RungName {
        let (part_place, rung) = (self.part(part), self.rung(part));
        let element = self.element(part_place.element);
        RungName {
            label: rung.label(&element.name, part_place.rung as usize),
            element,
            name: rung.name.clone(),
            number: part_place.rung + 1,
            branch: part_place.branch.map(|branch| branch + 1),
        }
    }

    /// A block or Stage, for people.
    pub(super) fn element(&self, element: ElementId) -> BlockPlace {
        let name = self.symbols.names.element(element).to_owned();
        let span = match element.stage {
            Some(stage) => self.program.stage(stage).span,
            None => self.program.block(element.block).span,
        };
        BlockPlace { name, place: self.place(span) }
    }

    /// The cell of an operand, by its name.
    ///
    /// # Errors
    /// The name is unknown, or is that of a whole structure.
    pub fn cell(&self, name: &str) -> Result<Cell, String> {
        self.symbols.cell(self.program.scope().address(name)?, name)
    }

    /// What its outputs are driven to, if its controller file is known.
    pub fn output_rules(&self) -> &OutputRules {
        &self.outputs
    }

    /// The names and cells of the program.
    pub fn symbols(&self) -> &Symbols {
        &self.symbols
    }
}

fn has_steps(part: &LoweredRungPart) -> bool {
    // A rung without its own `do` counts too: its branches execute after its contacts.
    !part.instructions.is_empty() || part.branch.is_none()
}
