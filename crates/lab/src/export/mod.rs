//! A ladder as PLCopen XML, for OpenPLC, Beremiz and CODESYS: the way back from `rungd import`.
//!
//! Called by `rungd export`. Pure: a program in, a text out. Blocks that always run become one
//! program, in scan order; `contacts` and `instructions` say what a rung does, `rungs` makes
//! networks of it, `library` has rungd's timers and counters as function blocks, `xml` writes the
//! file. What has no form that does the same in every scan is refused by name; nothing is dropped.
//! What is exported, and what differs, stands in `docs/export.md`.

mod block_body;
mod contacts;
mod elements;
mod formula;
mod formula_values;
mod functions;
mod instructions;
mod ladder_xml;
mod library;
mod literals;
mod memory;
mod names;
mod owners;
mod project;
mod refusal;
mod rung_acts;
mod rungs;
mod sensaphone;
mod status_bits;
mod whole_arrays;
mod xml;
mod xml_text;

use std::collections::{HashMap, HashSet};

use memory::ExportMemory;
pub use memory::{OutsideValue, VariableOfAddress};
use project::{
    CoilAction, ExportedNetwork, ExportedProject, ExportedUnit, NetworkBody, NetworkCoil,
    NetworkPower,
};
pub use refusal::ExportRefusal;
use rung_acts::{ProgramFacts, RungExport};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, LegName, Mnemonic, OperandRole, Structure};
use rungd_language::lower::WordLimits;
use rungd_language::resolve::program::{Block, BlockKind, Contact, Program, Rung};
use rungd_language::resolve::reads::ReadOperand;

/// An exported ladder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedLadder {
    /// The file.
    pub text: String,
    /// The number of rungs.
    pub rungs: usize,
    /// What the other controller has to write.
    pub outside: Vec<OutsideValue>,
    /// The bits and words of the ladder, and their variables; in order of first use.
    pub variables: Vec<VariableOfAddress>,
}

/// Exports an error-free program, whose scans are to begin this many ms apart.
///
/// # Errors
/// All parts that have no form that does the same.
pub fn exported(
    program: &Program,
    period: ScanPeriod,
) -> Result<ExportedLadder, Vec<ExportRefusal>> {
    let mut refusals = Vec::new();
    let blocks = always_running(program, &mut refusals);
    let facts = facts(program);
    let mut memory = ExportMemory::of(program);
    let (mut networks, mut rungs) = (Vec::new(), 0);
    for block in &blocks {
        for (at, rung) in block.rungs.iter().enumerate() {
            let label = rung.name.clone().unwrap_or_else(|| format!("{}_{}", block.name, at + 1));
            rungs += 1;
            let mut export = RungExport::new(&facts, &mut memory, label);
            export.is_first_scan = block.kind == BlockKind::FirstScan;
            match export.networks(rung) {
                Ok(made) => networks.extend(with_heading(made, block, at)),
                Err(refusal) => refusals.push(refusal),
            }
        }
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    let networks = [status_bits::top(&mut memory), networks, end(&mut memory)].concat();
    let mut units: Vec<ExportedUnit> = memory.blocks.iter().map(|block| block.unit()).collect();
    units.push(ExportedUnit {
        name: memory.program_name.clone(),
        doc: program.doc.clone().unwrap_or_default(),
        is_program: true,
        variables: memory.variables.clone(),
        networks,
    });
    let project = ExportedProject { name: program.name.clone(), units };
    let text = xml::file(&project, period);
    let ExportMemory { outside, of_addresses: variables, .. } = memory;
    Ok(ExportedLadder { text, rungs, outside, variables })
}

/// The blocks that execute in every scan, in the order in which they do; others are refused.
fn always_running<'p>(program: &'p Program, refusals: &mut Vec<ExportRefusal>) -> Vec<&'p Block> {
    let of_kind = |kind| program.blocks.iter().filter(move |block| block.kind == kind);
    let order = program.order.iter().map(|id| program.block(*id));
    let all = of_kind(BlockKind::FirstScan)
        .chain(of_kind(BlockKind::TopOfScan))
        .chain(order)
        .chain(of_kind(BlockKind::BottomOfScan));
    let mut running = Vec::new();
    for block in all {
        let is_always = block.autostart
            || matches!(block.kind, BlockKind::TopOfScan | BlockKind::BottomOfScan)
            || block.kind == BlockKind::FirstScan && leaves_nothing_to_terminate(block);
        if !block.stages.is_empty() {
            let what = format!("the Stages of {}", block.name);
            refusals.push(ExportRefusal::new(block.span, what, refusal::STAGES));
        } else if is_always {
            running.push(block);
        } else if block.rungs.is_empty() && block.kind.is_built_in() {
            // It is not in the file.
        } else {
            let what = format!("{} {}, which starts and stops", block.kind.title(), block.name);
            refusals.push(ExportRefusal::new(block.span, what, refusal::BLOCKS));
        }
    }
    for kind in [BlockKind::LastScan, BlockKind::Subroutine] {
        for block in of_kind(kind).filter(|block| !block.rungs.is_empty()) {
            let what = format!("{} {}", kind.title(), block.name);
            refusals.push(ExportRefusal::new(block.span, what, refusal::BLOCKS));
        }
    }
    running
}

/// Whether the pass behind the first scan changes nothing of the Task of the first scan: it has
/// only what acts while its rung is ON and stays.
fn leaves_nothing_to_terminate(block: &Block) -> bool {
    let is_kept = |rung: &Rung| {
        let is_plain = rung.legs.iter().all(|leg| leg.name == LegName::When);
        let body = rung.instructions();
        is_plain
            && body.into_iter().all(|(_, instruction)| KEPT.contains(&instruction.mnemonic))
            && contacts(rung).all(|contact| !has_edge(contact))
    };
    block.rungs.iter().all(is_kept)
}

/// Whether a contact has an edge in it.
fn has_edge(contact: &Contact) -> bool {
    match contact {
        Contact::Edge(..) => true,
        Contact::Not(inner, _) => has_edge(inner),
        Contact::All(parts, _) | Contact::Any(parts, _) => parts.iter().any(has_edge),
        Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) | Contact::Computed(..) => {
            false
        }
    }
}

/// The contacts of a rung and its branches.
fn contacts(rung: &Rung) -> impl Iterator<Item = &Contact> {
    let legs = rung.legs.iter().flat_map(|leg| &leg.contacts);
    legs.chain(rung.branches.iter().flat_map(|branch| &branch.contacts))
}

/// Instructions that do nothing while their rung is OFF, and whose results a pass keeps. Not all of
/// them: a first scan with another one, as RSTT, is refused.
const KEPT: [Mnemonic; 8] = [
    Mnemonic::Set,
    Mnemonic::Rst,
    Mnemonic::Move,
    Mnemonic::Add,
    Mnemonic::Sub,
    Mnemonic::Math,
    Mnemonic::Copy,
    Mnemonic::Fill,
];

/// What the rungs need to know of the whole program.
fn facts(program: &Program) -> ProgramFacts<'_> {
    let mut reset = HashSet::new();
    let mut owners = HashMap::new();
    for (_, instruction) in program.instructions() {
        for located in instruction.operands_with::<Structure>(OperandRole::Resets) {
            reset.insert(located.value);
        }
        for located in instruction.operands_with::<Structure>(OperandRole::Owns) {
            owners.insert(located.value, instruction);
        }
    }
    let rungs = program.parts().flat_map(|part| part.rungs);
    let by_contacts = rungs.flat_map(contacts).flat_map(|contact| contact.reads_of_all());
    let by_instructions = program.instructions().flat_map(|(_, instruction)| instruction.reads());
    let flags = by_contacts.chain(by_instructions).filter_map(|operand| match operand {
        ReadOperand::Address(Address::Bit(bit @ Bit::Flag(..))) => Some(bit),
        ReadOperand::Address(_) | ReadOperand::Array(_) => None,
    });
    let read_flags = flags.collect();
    ProgramFacts { program, limits: WordLimits::of(program), reset, owners, read_flags }
}

/// The networks of a rung; those of a block's first one begin with the block's name.
fn with_heading(
    mut networks: Vec<ExportedNetwork>,
    block: &Block,
    at: usize,
) -> Vec<ExportedNetwork> {
    if let (0, Some(first)) = (at, networks.first_mut()) {
        let heading = format!("{} {}", block.kind.title(), block.name);
        let parts = [Some(heading), block.doc.clone(), Some(first.doc.clone())];
        let parts = parts.into_iter().flatten().filter(|part| !part.is_empty());
        first.doc = parts.collect::<Vec<_>>().join(". ");
    }
    networks
}

/// The networks behind all others: the end of the first scan.
fn end(memory: &mut ExportMemory<'_>) -> Vec<ExportedNetwork> {
    if !memory.has_shared("FirstScan") {
        return Vec::new();
    }
    let variable = memory.shared("FirstScan", "BOOL");
    memory.begin_with(&variable, "TRUE");
    let power = NetworkPower::Constant(true);
    let coil = NetworkCoil { power: power.clone(), variable, action: CoilAction::Reset };
    let body = NetworkBody::Coils { power, coils: vec![coil] };
    vec![ExportedNetwork { doc: "The end of the first scan".to_owned(), body }]
}
