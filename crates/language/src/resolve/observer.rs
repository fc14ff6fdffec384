//! Resolves the observer of a test file in the names of a program.
//!
//! Called by `testing`. The program is resolved already: its tags, blocks and Stages keep their
//! numbers and addresses, and the observer's tags get places behind its memory. The observer
//! becomes one more block of a program that no controller executes. Its rungs may use the
//! program's templates, and read everything; what they write is checked here.

use std::collections::HashMap;

use super::LoadOptions;
use super::Resolver;
use super::instruction::{Instruction, Mnemonic, OperandValue};
use super::name_book::NameBook;
use super::observed::ObservedProgram;
use super::placement::{self, PlacementRequest, UsedElements};
use super::places::{Places, TYPES};
use super::program::Program;
use super::scope::Scope;
use super::writes::WrittenOperand;
use crate::source::finding::{Code, Finding, Severity};
use crate::source::ladder::{self, Entry, Ladder};
use crate::source::room::LoadRoom;
use crate::source::span::{FileId, SourceFile, Span};
use rungd_engine::isa::{Address, BlockId, OperandRole, Space};
use std::sync::Arc;

/// The name of the observer's block: no author can give a block this name.
const OBSERVER: &str = "the observer";

/// An observer, with the texts of the program that it observes.
pub struct ObserverText<'a> {
    /// The files of the program, by their numbers; then the test file.
    pub files: &'a [SourceFile],
    /// The observer, with its places in the test file.
    pub ladder: Ladder<Entry>,
}

impl ObserverText<'_> {
    /// The number of the test file.
    fn file(&self) -> FileId {
        FileId(self.files.len() as u32 - 1)
    }
}

/// A program with an observer. Also returns the findings about the observer, with places in the
/// test file.
pub fn observed(program: &Program, observer: ObserverText<'_>) -> (ObservedProgram, Vec<Finding>) {
    let (files, file) = (observer.files, observer.file());
    let sizes = program.sizes.clone();
    let options = LoadOptions { sizes: sizes.clone(), ..LoadOptions::default() };
    let mut resolver = Resolver::new(files, &options);
    resolver.layers = program.layers.as_ref().clone();
    let ladders = with_templates(observer);
    resolver.read_records(&ladders);
    let mut ladders = resolver.expand(ladders);
    resolver.expand_records(&mut ladders);
    resolver.scope = Scope::of(program);
    resolver.observes = true;
    let own: Vec<_> = ladders.into_iter().filter(|(id, _)| *id == file).collect();
    let mut whole = program.clone();
    resolver.declare(&own, &mut whole);
    resolver.check_arguments();
    let block = BlockId(program.blocks.len() as u32);
    for written in own.iter().flat_map(|(_, ladder)| &ladder.blocks) {
        resolver.rungs(written, &mut whole.blocks[block.0 as usize]);
    }
    OBSERVER.clone_into(&mut whole.blocks[block.0 as usize].name);
    whole.order.push(block);
    whole.sizes = resolver.grown.take().unwrap_or(sizes.clone());
    whole.names = Arc::new(NameBook::of(&whole, resolver.scope.places().clone()));
    whole.scope = Default::default();
    let (operands, arrays) = resolver.operands();
    whole.layers = Arc::new(std::mem::take(&mut resolver.layers));
    let mut findings = std::mem::take(&mut resolver.findings);
    let mut observed = ObservedProgram::bare(whole, sizes);
    observed.observer = Some(block);
    observed.operands = operands;
    observed.arrays = arrays;
    observed.foreign_writes(&mut findings);
    let layers = &observed.program.layers;
    let mut findings = layers.placed_findings(findings);
    // The program has no error of its own: one at another place comes from a use of its templates.
    let is_of_observer =
        |finding: &Finding| finding.span.file == file || finding.severity() == Severity::Error;
    findings.retain(is_of_observer);
    findings.sort_by_key(|finding| (finding.span.start, finding.span.end, finding.code));
    (observed, findings)
}

/// The observer, behind the templates of the program.
fn with_templates(observer: ObserverText<'_>) -> Vec<(FileId, Ladder<Entry>)> {
    let file = observer.file();
    let mut room = LoadRoom::default();
    let texts = observer.files.iter().enumerate().take(file.0 as usize);
    let mut all: Vec<(FileId, Ladder<Entry>)> = Vec::new();
    for (at, source) in texts {
        let id = FileId(at as u32);
        if let (Some(ladder), _) = ladder::read(&mut room, &source.text, id) {
            let Ladder { templates, records, .. } = ladder;
            all.push((id, Ladder { templates, records, ..Ladder::default() }));
        }
    }
    all.push((file, observer.ladder));
    all
}

impl Resolver<'_> {
    /// The names of a program that is resolved already, each with its place.
    pub(super) fn taken_names(program: &Program) -> HashMap<String, Span> {
        let mut names = HashMap::new();
        for tag in &program.tags {
            let name = tag.array_name();
            // The use that a tag belongs to has its name too.
            let used = name.split('.').next().unwrap_or_default().to_owned();
            names.entry(used).or_insert(tag.span);
            names.entry(name.into_owned()).or_insert(tag.span);
        }
        let blocks = program.blocks.iter().map(|block| (block.name.clone(), block.span));
        names.extend(blocks.filter(|(name, _)| !name.is_empty()));
        names
    }

    /// Places the tags of an observer behind the memory of the program that it observes.
    pub(super) fn place_behind(
        &mut self,
        wishes: Vec<PlacementRequest>,
        ladders: &[(FileId, Ladder)],
    ) {
        let mut sizes = self.options.sizes.clone();
        let mut used = UsedElements::default();
        for (_, space) in TYPES {
            let count = space.count(&sizes);
            let more: u32 =
                wishes.iter().filter(|wish| wish.space == space).map(|wish| wish.count).sum();
            used.add(space, space.first(), count);
            sizes = space.sized(&sizes, count.saturating_add(more));
        }
        let (fit, short): (Vec<_>, Vec<_>) =
            wishes.into_iter().partition(|wish| wish.space != Space::Sensaphone);
        for wish in short {
            let mut tags = ladders.iter().flat_map(|(_, ladder)| &ladder.tags);
            let tag = tags.find(|tag| tag.name.text == wish.name);
            let kind = tag.and_then(|tag| tag.kind.as_ref()).map_or(Span::default(), |k| k.span);
            let message = "an observer has no Sensaphone counters".to_owned();
            let help = "`counter` counts too: CNT, UDC";
            self.find(Finding::new(Code::TagKey, kind, message).help(help));
        }
        let placed = placement::place(fit, &used, &sizes).places;
        let all = self.scope.places().by_name().cloned().chain(placed).collect();
        self.scope.set_places(Places::new(all));
        self.grown = Some(sizes);
    }
}

impl ObservedProgram {
    fn instructions(&self) -> impl Iterator<Item = &Instruction> {
        let observer = self.observer;
        let all = self.program.instructions();
        all.filter(move |(block, _)| Some(block.id) == observer).map(|(_, instruction)| instruction)
    }

    /// The findings about what the observer writes, starts or stops beyond its own tags.
    fn foreign_writes(&self, findings: &mut Vec<Finding>) {
        for instruction in self.instructions() {
            for written in instruction.writes() {
                let address = match written.value {
                    WrittenOperand::Bit(bit) => Address::Bit(bit),
                    WrittenOperand::Word(word) => Address::Word(word),
                    WrittenOperand::Array(array) => array.element(0),
                };
                if self.is_of_program(address) {
                    findings.push(self.foreign(address, written.span));
                }
            }
            for operand in &instruction.operands.0 {
                match (operand.value, operand.row.role) {
                    (
                        OperandValue::Structure(structure),
                        OperandRole::Owns | OperandRole::Resets,
                    ) if self.is_of_program(Address::Structure(structure)) => {
                        findings.push(self.foreign(Address::Structure(structure), operand.span));
                    }
                    (OperandValue::Block(_) | OperandValue::Stage(_), _) => {
                        findings.push(no_control(operand.span));
                    }
                    _ => {}
                }
            }
            if instruction.mnemonic == Mnemonic::Exit {
                findings.push(no_control(instruction.span));
            }
        }
    }

    fn foreign(&self, address: Address, span: Span) -> Finding {
        let name = self.program.names.name(address);
        let message = format!("`{name}` belongs to the ladder: an observer only reads it");
        let finding = Finding::new(Code::ReadOnly, span, message);
        finding.help("write a tag of the observer: declare it in `[observer.tags]`")
    }
}

/// The finding for an instruction that starts, stops or calls a block.
fn no_control(span: Span) -> Finding {
    let finding = Finding::new(Code::ReadOnly, span, "an observer starts, stops and calls nothing");
    finding.help("take it away: an observer only reads the bits of blocks and Stages")
}
