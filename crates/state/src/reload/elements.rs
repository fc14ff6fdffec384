//! Compares blocks, Stages, and instructions with a termination pass: finds those that are kept,
//! new or removed. Called by `ReloadPlan::new`.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::memory::KeptOwners;
use super::moves::OldAndNew;
use super::plan::{
    ElementPairs, InitialStageStart, LoweredProgram, OldState, ReloadPlan, element_of,
};
use super::report::preset;
use rungd_engine::isa::{Address, Bit, BitSpace, BlockId, ElementId, StageId};
pub use rungd_engine::{BitCell, BlockRole, Cell, ElementCode, KeptCells, PassStep, StageRestart};
use rungd_language::lower::identity::{Identity, Interval};
use rungd_language::resolve::name_book::{BlockName, StageName};
use rungd_language::resolve::program::BlockKind;
pub use rungd_language::resolve::program::Value;

/// The old program's Tasks that lose their recurrent ENTASK. The ENTASK's pass disables them.
pub(super) fn disabled(
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) -> HashSet<BlockId> {
    let there = OldInstructions::of(new);
    let gone = |(element, task): (ElementId, BlockId)| {
        let block = names.block(element.block);
        let to = block.and_then(|block| Some((block, names.block(task)?)));
        to.is_none_or(|to| !there.enabled.contains_key(&to)).then_some(task)
    };
    enabled(old).filter_map(gone).collect()
}

/// Recurrent ENTASKs: their elements and their Tasks.
fn enabled(side: LoweredProgram<'_>) -> impl Iterator<Item = (ElementId, BlockId)> {
    elements(side).flat_map(move |(element, code)| {
        code.terminations.clone().filter_map(move |at| {
            let pass = &side.program.tables.terminations[at as usize];
            let PassStep::DisableTask(task) = pass else { return None };
            Some((element, *task))
        })
    })
}

/// Pairs blocks and Stages by name, and transfers their bits.
pub(super) fn blocks(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    OldAndNew { old, new }: OldAndNew<LoweredProgram<'_>>,
    disabled: &HashSet<BlockId>,
) {
    for at in 0..names.old.names.blocks.len() as u32 {
        let id = BlockId(at);
        let running = old.symbols.layout.bit(Bit::Running(id)).0;
        let said = block_title(names.old.names.block(id));
        let Some(to) = names.block(id) else {
            plan.transfer.gone_blocks.push(id);
            if names.old.names.block(id).kind == BlockKind::Subroutine {
                let why = if names.is_in_new(id) { "is not called any more" } else { "is gone" };
                let state = OldState::Gone { cell: running, off: "not executed" };
                plan.add_line_with_state(format!("{said} {why}"), state);
                continue;
            }
            let state = OldState::Gone { cell: running, off: "not running" };
            plan.add_line_with_state(format!("{said} is gone"), state);
            continue;
        };
        plan.transfer.blocks.push((id, to));
        for bit in [Bit::Running, Bit::Done] {
            let cell = |side: LoweredProgram<'_>, id| side.symbols.layout.bit(bit(id)).0;
            let (from, to) = (cell(old, id), cell(new, to));
            plan.transfer.bits.push(KeptCells { from, to, count: 1 });
        }
        if disabled.contains(&id) {
            plan.add_line_with_state(said, OldState::Disabled { running });
        } else if names.old.names.block(id).kind != BlockKind::Subroutine
            && !names.old.names.block(id).kind.is_built_in()
            && names.old.names.block(id).name != "Main"
        {
            plan.add_line_with_state(
                format!("{said} continues to run"),
                OldState::Stays { cell: running },
            );
        }
        restart_stages(plan, names, OldAndNew { old: id, new: to }, OldAndNew { old, new });
    }
    subroutines(plan, OldAndNew { old, new });
    new_blocks(plan, names, new);
    stages(plan, names, old, new);
    kept_stages(plan, names);
    intervals(plan, names);
}

/// Pairs the subroutines by their places in the lists of subroutines.
fn subroutines(plan: &mut ReloadPlan, OldAndNew { old, new }: OldAndNew<LoweredProgram<'_>>) {
    let number = |side: LoweredProgram<'_>, id: &BlockId| {
        side.program.subroutines.iter().position(|subroutine| subroutine == id)
    };
    for (from, to) in &plan.transfer.blocks {
        if let (Some(from), Some(to)) = (number(old, from), number(new, to)) {
            plan.transfer.subroutines.push((from as u32, to as u32));
        }
    }
}

fn new_blocks(plan: &mut ReloadPlan, names: &ElementPairs<'_>, new: LoweredProgram<'_>) {
    let known: HashSet<BlockId> = plan.transfer.blocks.iter().map(|(_, to)| *to).collect();
    for (at, block) in names.new.names.blocks.iter().enumerate() {
        let id = BlockId(at as u32);
        if known.contains(&id) {
            continue;
        }
        let starts = match new.program.blocks[at].role {
            BlockRole::Program { autostart } => autostart,
            BlockRole::TopOfScan | BlockRole::BottomOfScan => true,
            BlockRole::Task
            | BlockRole::FirstScan
            | BlockRole::LastScan
            | BlockRole::Subroutine => false,
        };
        let and = if starts { ", and starts" } else { "" };
        plan.add_line(format!("{} is new{and}", block_title(block)));
        if starts {
            plan.transfer.starting.push(id);
        }
    }
}

fn stages(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    for (at, stage) in names.old.names.stages.iter().enumerate() {
        let id = StageId(at as u32);
        let from = old.symbols.layout.bit(Bit::Stage(id)).0;
        let said = format!("Stage {}", names.old.names.stage(id));
        match names.stage(id) {
            Some(to) => {
                plan.transfer.stages.push((id, to));
                let to = new.symbols.layout.bit(Bit::Stage(to)).0;
                plan.transfer.bits.push(KeptCells { from, to, count: 1 });
                plan.add_line_with_state(
                    format!("{said} stays ON"),
                    OldState::Stays { cell: from },
                );
            }
            None if names.block(stage.block).is_some() => {
                plan.add_line_with_state(
                    format!("{said} is gone"),
                    OldState::Gone { cell: from, off: "OFF" },
                );
            }
            None => {}
        }
    }
    let known: HashSet<StageId> = plan.transfer.stages.iter().map(|(_, to)| *to).collect();
    let blocks: HashSet<BlockId> = plan.transfer.blocks.iter().map(|(_, to)| *to).collect();
    for (at, stage) in names.new.names.stages.iter().enumerate() {
        let id = StageId(at as u32);
        if !known.contains(&id) && blocks.contains(&stage.block) {
            plan.add_line(format!("Stage {} is new", names.new.names.stage(id)));
        }
    }
    for (program, (initial, start)) in plan.starts.clone() {
        let (program, stage) =
            (block_title(names.new.names.block(program)), names.new.names.stage(initial));
        plan.add_line_with_state(
            format!("{program} begins at its Stage {stage}"),
            OldState::Starts(start),
        );
    }
}

fn restart_stages(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    block: OldAndNew<BlockId>,
    OldAndNew { old, new }: OldAndNew<LoweredProgram<'_>>,
) {
    let mut stages = new.program.blocks[block.new.0 as usize].stages.clone();
    let Some(initial) = stages.next().map(StageId) else { return };
    let before = old.program.blocks[block.old.0 as usize].stages.clone();
    let had_none = before.is_empty();
    let (kept, lost): (Vec<_>, Vec<_>) =
        before.map(StageId).partition(|id| names.stage(*id).is_some());
    if had_none || !lost.is_empty() {
        let layout = &old.symbols.layout;
        let cells = |stages: &[StageId]| {
            stages.iter().map(|id| layout.bit(Bit::Stage(*id)).0).collect::<Vec<_>>()
        };
        let running = layout.bit(Bit::Running(block.old)).0;
        let start = InitialStageStart { running, kept: cells(&kept), lost: cells(&lost), had_none };
        plan.starts.insert(block.new, (initial, start));
        plan.transfer.restages.push(StageRestart { program: block.new, initial, lost, had_none });
    }
}

/// Transfers what the next start restores of Programs whose Stages are retained.
fn kept_stages(plan: &mut ReloadPlan, names: &ElementPairs<'_>) {
    let first = |identity: &Identity, program| {
        let own = |stage: &&StageName| stage.block == program;
        identity.names.stages.iter().take_while(|stage| !own(stage)).count() as u32
    };
    for before in &names.old.kept {
        let to = names.block(before.program);
        let Some(now) = names.new.kept.iter().find(|now| Some(now.program) == to) else { continue };
        let mut keep = |from: BitCell, to: BitCell| {
            plan.transfer.bits.push(KeptCells { from: from.0, to: to.0, count: 1 });
        };
        keep(before.holds(), now.holds());
        keep(before.running(), now.running());
        keep(before.begins(), now.begins());
        let firsts = [first(names.old, before.program), first(names.new, now.program)];
        for n in 0..before.stages {
            if let Some(StageId(stage)) = names.stage(StageId(firsts[0] + n)) {
                keep(before.stage(n), now.stage(stage - firsts[1]));
            }
        }
    }
}

/// Reports and transfers the changed intervals of recurrent ENTASKs.
fn intervals(plan: &mut ReloadPlan, names: &ElementPairs<'_>) {
    let mut first: HashMap<BlockId, &Interval> = HashMap::new();
    for now in &names.new.intervals {
        first.entry(now.task).or_insert(now);
    }
    for before in &names.old.intervals {
        let Some(task) = names.block(before.task) else { continue };
        let Some(now) = first.get(&task) else { continue };
        if !names.same(before.every, now.every) {
            let name = &names.new.names.block(task).name;
            let was = preset(names.old, before.every, true);
            let is = preset(names.new, now.every, true);
            plan.add_line(format!("interval of {name} {was} → {is}"));
            // An element of an array is read when the Task is enabled again.
            if !matches!(now.every, Value::Element(_)) {
                plan.transfer.intervals.push((task, now.word.0));
            }
        }
    }
}

/// The elements of instructions with a pass: those that drive bits, and recurrent ENTASKs.
#[derive(Default)]
struct OldInstructions {
    outputs: HashMap<(BlockId, Cell), Vec<ElementId>>,
    enabled: HashMap<(BlockId, BlockId), ElementId>,
}

impl OldInstructions {
    fn of(side: LoweredProgram<'_>) -> OldInstructions {
        let mut there = OldInstructions::default();
        for (element, code) in elements(side) {
            for at in code.terminations.clone() {
                let termination = &side.program.tables.terminations[at as usize];
                if let Some(bit) = termination.bit_off() {
                    there.outputs.entry((element.block, bit)).or_default().push(element);
                }
                match *termination {
                    PassStep::DisableTask(task) => {
                        there.enabled.insert((element.block, task), element);
                    }
                    PassStep::BitOff(_)
                    | PassStep::WordBitOff(_)
                    | PassStep::HistoryOff(_)
                    | PassStep::Counter(..)
                    | PassStep::Timer(..)
                    | PassStep::HoldTimer(_)
                    | PassStep::CountUp(_)
                    | PassStep::CountDown(_)
                    | PassStep::Pick(_) => {}
                }
            }
        }
        there
    }

    /// The element in which a block drives a bit: the element `before` if the block still drives it
    /// there.
    fn driven(&self, block: BlockId, bit: Cell, before: Option<ElementId>) -> Option<ElementId> {
        let places = self.outputs.get(&(block, bit))?;
        before.filter(|before| places.contains(before)).or(places.first().copied())
    }
}

/// Finds the instructions of the old program that have a step in a termination pass and are not in
/// the new program. The swap executes these steps.
pub(super) fn terminations(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    OldAndNew { old, new }: OldAndNew<LoweredProgram<'_>>,
    kept: &KeptOwners,
) {
    let there = OldInstructions::of(new);
    let mut undriven: BTreeMap<(BlockId, Cell), Vec<u32>> = BTreeMap::new();
    for (element, code) in elements(old) {
        let Some(block) = names.block(element.block) else { continue };
        for at in code.terminations.clone() {
            let termination = &old.program.tables.terminations[at as usize];
            let driven = termination.bit_off();
            let stays = match termination {
                PassStep::HistoryOff(_) | PassStep::Pick(_) => true,
                PassStep::BitOff(_) | PassStep::WordBitOff(_) => {
                    let to = driven.and_then(|bit| plan.transfer.cell(bit));
                    let before = names.element(element);
                    to.and_then(|to| there.driven(block, to, before))
                        .map(|now| plan.record_move(names, element, now))
                        .is_some()
                }
                PassStep::DisableTask(task) => names
                    .block(*task)
                    .and_then(|task| there.enabled.get(&(block, task)))
                    .map(|now| plan.record_move(names, element, *now))
                    .is_some(),
                PassStep::Counter(..)
                | PassStep::Timer(..)
                | PassStep::HoldTimer(_)
                | PassStep::CountUp(_)
                | PassStep::CountDown(_) => kept.is_kept(termination, element),
            };
            if stays {
                continue;
            }
            plan.transfer.gone.push((element_of(element), at));
            if let Some(bit) = driven {
                undriven.entry((element.block, bit)).or_default().push(active(old, element));
            }
        }
    }
    for ((block, bit), active) in undriven {
        let block = &names.old.names.block(block).name;
        let text = |said: String| format!("{said} is not driven in {block} any more");
        match bit {
            Cell::Bit(BitCell(bit)) => {
                let state = OldState::Undriven { bit, active };
                plan.add_line_with_state(text(bit_name(old, bit)), state);
            }
            Cell::Word(_) | Cell::WordBit(_) => {
                let address = old.symbols.layout.address(bit);
                let said = address.map(|address| old.symbols.identity.names.say(address));
                plan.add_line(text(said.unwrap_or_default()));
            }
        }
    }
}

/// Reports bits that no instruction of the new program writes. Only bits that the old program SET,
/// RST or toggled are reported, because a pass may turn the others OFF.
pub(super) fn unwritten(plan: &mut ReloadPlan, names: &ElementPairs<'_>, old: LoweredProgram<'_>) {
    let tables = &old.program.tables;
    let driven: HashSet<u32> = tables
        .terminations
        .iter()
        .filter_map(|termination| {
            let PassStep::BitOff(bit) = termination else { return None };
            Some(*bit)
        })
        .collect();
    for bit in names.old.written_in_order() {
        // A bit outside memory is removed with its block or Stage, and a bit of a `type` tag with
        // its tag.
        let (Bit::Space(..), Some(Address::Bit(now))) = (bit, names.moves.after(Address::Bit(bit)))
        else {
            continue;
        };
        if names.new.written.contains(&now) {
            continue;
        }
        let cell = old.symbols.layout.bit(bit).0;
        if driven.contains(&cell) {
            continue;
        }
        let (was, now) = (Address::Bit(bit), Address::Bit(now));
        let is_tagged = names.new.names.tag(now).is_some();
        let said = if is_tagged { names.new.names.say(now) } else { names.old.names.say(was) };
        plan.add_line_with_state(said, OldState::Unwritten { bit: cell });
    }
}

/// The bit that is ON while an element executes: the bit of its Stage, or the `.Running` of its
/// block.
fn active(side: LoweredProgram<'_>, element: ElementId) -> u32 {
    let bit = element.stage.map_or(Bit::Running(element.block), Bit::Stage);
    side.symbols.layout.bit(bit).0
}

fn block_title(block: &BlockName) -> String {
    format!("{} {}", block.kind.title(), block.name)
}

fn bit_name(side: LoweredProgram<'_>, cell: u32) -> String {
    let layout = &side.symbols.layout;
    let spaces = [BitSpace::Y, BitSpace::C, BitSpace::Mc, BitSpace::Mi];
    for space in spaces {
        let first = layout.bit(Bit::Space(space, space.first())).0;
        if (first..first + space.count(layout.sizes())).contains(&cell) {
            let bit = Bit::Space(space, space.first() + (cell - first));
            return side.symbols.identity.names.say(Address::Bit(bit));
        }
    }
    "a bit".to_owned()
}

/// Every element of a program.
fn elements<'a>(side: LoweredProgram<'a>) -> impl Iterator<Item = (ElementId, &'a ElementCode)> {
    side.program.blocks.iter().enumerate().flat_map(move |(at, code)| {
        let block = BlockId(at as u32);
        let own = (ElementId { block, stage: None }, &code.own);
        let stages = code.stages.clone().map(move |id| {
            let element = ElementId { block, stage: Some(StageId(id)) };
            (element, &side.program.stages[id as usize])
        });
        std::iter::once(own).chain(stages)
    })
}
