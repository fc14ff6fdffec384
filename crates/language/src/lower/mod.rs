//! Turns a resolved program into an engine program and symbols. Cannot fail: the resolver and the
//! checks have found every mistake before. Only a load whose time is over ends it early
//! (`lower_within`).
//!
//! `contacts` and `instructions` turn rungs into operations in file order; `schedule` puts
//! operations of one kind together. `symbols` keeps the names, limits and texts that the engine
//! does not need. `identity` and `rungs` name states and rungs, so that a reload finds them in a
//! new version of the program.

mod alarm_order;
mod alike;
mod arrays;
mod assembler;
mod contacts;
mod elements;
mod formula;
mod formula_calls;
mod formula_marks;
pub mod formula_value;
pub mod identity;
mod instructions;
pub mod judged;
mod last_uses;
mod legs;
mod loaded_bits;
mod math;
mod packing;
mod private_cells;
mod record_copy;
mod regions;
mod rungs;
pub mod schedule;
pub mod sites;
mod stores;
mod symbols;
mod values;
mod word_limits;

pub use symbols::Alarm;
pub use symbols::Symbols;
pub use word_limits::WordLimits;

use std::sync::Arc;

use crate::resolve::program::{Block, BlockKind, Contact, Program, Rung};
use assembler::Assembler;
use legs::Legs;
use rungd_base::progress::{Progress, UNASKED};
use rungd_engine::isa::ElementId;
use rungd_engine::ops::LegPowers;
use rungd_engine::{self as engine, BlockRole, ElementCode};
use sites::Sites;

/// Lowers a program, with operations of one kind put together.
pub fn lower(program: &Program) -> (engine::EngineProgram, Symbols) {
    lower_with(program, schedule::WINDOW)
}

/// As [`lower`], for a load that its caller may end; `None` if the load must end.
pub fn lower_within(
    program: &Program,
    progress: &Progress,
) -> Option<(engine::EngineProgram, Symbols)> {
    let (code, symbols, _) = lower_noting(program, schedule::WINDOW, None, progress)?;
    Some((code, symbols))
}

/// Does the same as [`lower`], with a window: the number of operations among which operations may
/// change places. 1 keeps them in file order. The memory after a scan is the same with every
/// window; a test compares it.
pub fn lower_with(program: &Program, window: usize) -> (engine::EngineProgram, Symbols) {
    let lowered = lower_noting(program, window, None, &UNASKED);
    let (code, symbols, _) = lowered.expect(NOT_ENDED);
    (code, symbols)
}

/// Lowers a program for observation: each operation has a batch of its own, in file order, and a
/// site. The memory after a scan is the same as with [`lower`], cell by cell, including the
/// program's own cells.
pub fn lower_seen(program: &Program) -> (engine::EngineProgram, Symbols, Sites) {
    let lowered = lower_noting(program, 1, Some(Sites::default()), &UNASKED);
    let (code, symbols, sites) = lowered.expect(NOT_ENDED);
    (code, symbols, sites.unwrap_or_default())
}

/// The message of a broken invariant.
const NOT_ENDED: &str = "nothing ends a lowering without a time limit";

fn lower_noting(
    program: &Program,
    window: usize,
    sites: Option<Sites>,
    progress: &Progress,
) -> Option<(engine::EngineProgram, Symbols, Option<Sites>)> {
    let mut assembler = Assembler::new(program, window, progress);
    assembler.sites = sites;
    let (blocks, stages) = lower_blocks(&mut assembler, &program.blocks)?;
    let order = turns(program);
    let identity = std::mem::take(&mut assembler.identity);
    let kept = identity.kept.clone();
    let places = alarm_order::places(program, &order);
    let mut symbols = Symbols::new(program, assembler.layout.clone(), identity, &places);
    symbols.maths = std::mem::take(&mut assembler.maths);
    let sites = assembler.sites.take();
    let subroutines = program.subroutines().map(|block| block.id).collect();
    let code = assembler.finish(blocks, stages, order, subroutines);
    Some((engine::EngineProgram { kept, ..code }, symbols, sites))
}

/// Lowers blocks and their Stages; `None` if the load must end.
fn lower_blocks(
    assembler: &mut Assembler,
    all: &[Block],
) -> Option<(Vec<engine::BlockCode>, Vec<ElementCode>)> {
    let (mut blocks, mut stages) = (Vec::new(), Vec::new());
    for block in all {
        let own =
            lower_element(assembler, &block.rungs, ElementId { block: block.id, stage: None });
        let first = stages.len() as u32;
        for stage in &block.stages {
            let element = ElementId { block: block.id, stage: Some(stage.id) };
            stages.push(lower_element(assembler, &stage.rungs, element));
        }
        let range = first..stages.len() as u32;
        blocks.push(engine::BlockCode { role: role(block), own, stages: range });
        if assembler.progress.is_over() {
            return None;
        }
    }
    Some((blocks, stages))
}

fn role(block: &Block) -> BlockRole {
    match block.kind {
        BlockKind::Program => BlockRole::Program { autostart: block.autostart },
        BlockKind::Task => BlockRole::Task,
        BlockKind::FirstScan => BlockRole::FirstScan,
        BlockKind::TopOfScan => BlockRole::TopOfScan,
        BlockKind::BottomOfScan => BlockRole::BottomOfScan,
        BlockKind::LastScan => BlockRole::LastScan,
        BlockKind::Subroutine => BlockRole::Subroutine,
    }
}

/// The scan order with the built-in Tasks at their places.
fn turns(program: &Program) -> Vec<rungd_engine::isa::BlockId> {
    let built_in = |kind| program.blocks.iter().filter(move |b| b.kind == kind).map(|b| b.id);
    built_in(BlockKind::FirstScan)
        .chain(built_in(BlockKind::TopOfScan))
        .chain(program.order.iter().copied())
        .chain(built_in(BlockKind::BottomOfScan))
        .chain(built_in(BlockKind::LastScan))
        .collect()
}

fn lower_element(assembler: &mut Assembler, rungs: &[Rung], element: ElementId) -> ElementCode {
    for (at, rung) in assembler.progress.during(rungs).enumerate() {
        let whole: Arc<str> = rungs::text(&assembler.identity, rung).into();
        let place = place(assembler, element, at, rung);
        assembler.site = identity::LoweringSite { element, rung: rung.name.clone(), whole, place };
        let acts = rungs::acts(&assembler.identity, rung);
        let parts = rungs::parts(assembler.layers, rung);
        assembler.identity.rung(&assembler.site, acts, parts);
        lower_rung(assembler, rung, element, at as u32);
    }
    assembler.close_element(!rungs.is_empty())
}

/// A rung for people: `Main, rung count-bottles`, `Drain.Open, rung 3`.
fn place(assembler: &Assembler, element: ElementId, at: usize, rung: &Rung) -> Arc<str> {
    let element = assembler.identity.names.element(element);
    let mut text = String::with_capacity(element.len() + RUNG_LABEL_MANY);
    [element, ", "].into_iter().for_each(|part| text.push_str(part));
    rung.write_label(element, at, &mut text);
    text.into()
}

/// The usual length of a rung's label.
const RUNG_LABEL_MANY: usize = 32;

/// Lowers a rung: its contacts give the power, `do` executes with it, then each branch adds its own
/// contacts.
fn lower_rung(assembler: &mut Assembler, rung: &Rung, element: ElementId, at: u32) {
    assembler.note(|sites| sites.begin(element, at, None));
    let legs: Vec<_> = rung
        .legs
        .iter()
        .map(|leg| {
            let whole = series(assembler, &leg.contacts, None);
            let whole = if rung.instructions().count() > 1 { assembler.keep(whole) } else { whole };
            (leg.name, whole)
        })
        .collect();
    assembler.note(Sites::ready);
    for instruction in &rung.body {
        assembler.instruction(instruction, Legs(&legs));
    }
    let Some((when, rung_leg)) = legs.first().copied() else { return };
    for (number, branch) in (0..).zip(&rung.branches) {
        assembler.note(|sites| sites.begin(element, at, Some(number)));
        let leg = series(assembler, &branch.contacts, Some(rung_leg));
        let leg = if branch.body.len() > 1 { assembler.keep(leg) } else { leg };
        assembler.note(Sites::ready);
        for instruction in &branch.body {
            assembler.instruction(instruction, Legs(&[(when, leg)]));
        }
    }
}

fn series(assembler: &mut Assembler, contacts: &[Contact], before: Option<LegPowers>) -> LegPowers {
    let mut powers = Vec::new();
    if let Some(before) = before {
        powers.push(assembler.one_power(before));
    }
    for contact in contacts {
        assembler.all_of(contact, &mut powers);
    }
    assembler.leg_of(&powers)
}
