//! Operands with the writes that decided their values, as data.

use super::answer::{
    About, CallPlace, Cause, Cut, ExplainedOperand, ExplainedValue, Followed, Node, Since, Stop,
    TapeEnd, Write,
};
use super::inquiry::{ExplainedWrite, FoundStep, FoundWrite, FoundWriter, Inquiry};
use super::leaves::is_status;
use super::past::{self, TapeMoment};
use super::reasons::TOLD_MAX;
use super::replay::{Changed, SEARCHED_MAX};
use super::seen_values::{SeenValue, side};
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Address, Bit, BitSpace, BlockId, ElementId, Flag, Structure, Word};
use rungd_engine::{Cell, Element, EngineCall, ScanStep};
use rungd_language::resolve::instruction::OperandValue;
use rungd_runtime::{Origin, SectionStart, TapeEntry, TapeSection};

/// The number of operands of a long sum that are told at least.
const ZEROS_TOLD: usize = 3;

impl Inquiry<'_> {
    /// The reasons of an operand, if there is room for them.
    pub fn follow(&mut self, cell: Cell, value: i32, at: TapeMoment, depth: u32) -> Followed {
        let address = self.subject.address(cell);
        if let Some(Address::Bit(Bit::Space(BitSpace::St, st::ON | st::OFF))) = address {
            return Followed::Cut(Cut::Constant);
        }
        if depth == 0 && self.subject.is_written(cell) {
            if self.is_change_shown(cell, at) {
                return Followed::Cut(Cut::Shown);
            }
            self.cuts += 1;
            let deeper = self.limits.depth.saturating_add(1 + self.owed);
            self.deeper = Some(self.deeper.map_or(deeper, |known| known.max(deeper)));
            return Followed::Cut(Cut::Depth);
        }
        if self.nodes >= self.limits.nodes {
            self.cuts += 1;
            self.is_long = true;
            return Followed::Cut(Cut::Length);
        }
        match self.node(cell, value, at, depth.saturating_sub(1)) {
            Some(node) => Followed::Node(Box::new(node)),
            None => Followed::Cut(Cut::Shown),
        }
    }

    /// Whether the answer has explained the last change of a cell before a moment.
    fn is_change_shown(&mut self, cell: Cell, at: TapeMoment) -> bool {
        if self.shown.iter().all(|shown| shown.cell != cell) {
            return false;
        }
        let found = self.replay.last_change(cell, at, SEARCHED_MAX);
        let Changed::At(_, change) = found else { return false };
        self.shown.iter().any(|shown| (shown.cell, shown.at) == (cell, change))
    }

    /// An operand with the write that decided its value; `None` if the answer has it already.
    pub fn node(&mut self, cell: Cell, value: i32, at: TapeMoment, depth: u32) -> Option<Node> {
        let address = self.subject.address(cell);
        let (mut number, cuts) = (None, self.cuts);
        let write = if let Some(since) = self.replay.forced(cell, at) {
            self.nodes += 1;
            self.force(since, at)
        } else {
            let found = self.find(cell, at);
            let write = ExplainedWrite { cell, at: found.at, depth };
            if self.shown.iter().any(|shown| shown.covers(write)) {
                return None;
            }
            self.nodes += 1;
            self.shown.push(ExplainedWrite { depth: u32::MAX, ..write });
            number = self.shown.len().checked_sub(1);
            let is_status = is_status(address) && !matches!(found.writer, FoundWriter::Step(_));
            if is_status { self.status(at) } else { self.write(cell, value, found, depth) }
        };
        if let Some(Address::Bit(Bit::Running(block))) = address
            && value == 0
        {
            self.stopped.push(block);
        }
        let idle = match write.in_last_scan {
            true => Vec::new(),
            false => self.idle(cell, value, at, depth),
        };
        let owner = address.and_then(Address::structure);
        let about = owner.and_then(|owner| self.about(owner, at));
        let operand = self.subject.operand(cell);
        if let Some(shown) = number.and_then(|number| self.shown.get_mut(number))
            && self.cuts > cuts
        {
            shown.depth = depth;
        }
        Some(Node { operand, value, write, about, idle, earlier: None })
    }

    fn force(&mut self, since: Result<TapeMoment, TapeEnd>, at: TapeMoment) -> Write {
        let (since, who) = match since {
            Ok(moment) => {
                let section = self.replay.section(moment.section);
                let who = section.and_then(|section| past::origin(&section, moment.entry).1);
                (Since::At(self.replay.when_of(moment.section, moment.entry)), who)
            }
            Err(_) => (Since::Before(self.replay.start_of(at.section)), None),
        };
        Write { since, before: None, in_last_scan: true, cause: Cause::Force { who } }
    }

    fn status(&mut self, at: TapeMoment) -> Write {
        let since = Since::At(self.replay.when(at));
        Write { since, before: None, in_last_scan: true, cause: Cause::Status }
    }

    pub fn write(&mut self, cell: Cell, value: i32, found: FoundWrite, depth: u32) -> Write {
        let FoundWrite { at, before, in_last_scan, writer } = found;
        let mut since = Since::At(self.replay.when_of(at.section, at.entry));
        let cause = match writer {
            FoundWriter::Step(found) => self.step(&found, at, depth),
            FoundWriter::Turn(block) => self.turn(cell, block, at, depth),
            FoundWriter::Call => self.call(cell, at),
            FoundWriter::End(end, section) => {
                since = Since::Before(self.replay.start_of(section));
                let searched_section =
                    self.replay.section(section).filter(|_| end != TapeEnd::Searched);
                let is_start =
                    searched_section.is_some_and(|found_section| is_first(&found_section));
                match is_start {
                    true if self.subject.initial.value(cell) == value => Cause::Initial,
                    true => Cause::Restored,
                    false => Cause::Older(end),
                }
            }
        };
        Write { since, before, in_last_scan, cause }
    }

    /// The cause of a step: an instruction, or the termination pass over an instruction.
    fn step(&mut self, found: &FoundStep, at: TapeMoment, depth: u32) -> Cause {
        let FoundStep { deed, leaves, operands, calls } = found;
        let deed = *deed;
        let Some(site) = self.subject.site(deed) else { return Cause::Controller };
        let number = site.instruction.unwrap_or(0);
        let rung = self.subject.place_of_rung(site.part);
        let span = match self.subject.instruction(site.part, number) {
            Some(instruction) => instruction.span,
            None => self.subject.rung(site.part).extent,
        };
        let place = self.subject.place(span);
        if let ScanStep::Pass(_) = deed {
            return Cause::Pass { rung, place, stop: self.stop(site.part, at, depth) };
        }
        let legs = self.legs(site.part, leaves, at, depth);
        let (operands, zeros) = without_zeros(operands);
        let operands = operands
            .into_iter()
            .map(|read_operand| self.side(read_operand, at, depth))
            .collect::<Vec<_>>();
        let operands = operands
            .into_iter()
            .filter_map(|ExplainedValue { value, operand, followed }| {
                Some(ExplainedOperand { operand: operand?, value, followed })
            })
            .collect();
        let calls = calls.iter().filter_map(|call| self.call_place(*call)).collect();
        Cause::Instruction { rung, place, legs, operands, zeros, calls }
    }

    /// The place of a CALL.
    fn call_place(&self, call: ScanStep) -> Option<CallPlace> {
        let site = self.subject.site(call)?;
        let instruction = self.subject.instruction(site.part, site.instruction?)?;
        let rung = self.subject.place_of_rung(site.part);
        Some(CallPlace { rung, place: self.subject.place(instruction.span) })
    }

    /// Why a termination pass ran over the block or Stage of a part.
    fn stop(&mut self, part: u32, at: TapeMoment, depth: u32) -> Stop {
        let section = self.replay.section(at.section);
        let call = section.as_ref().and_then(|section| section.entries.get(at.entry));
        if call == Some(&TapeEntry::Call(EngineCall::Terminate)) {
            return Stop::Controller;
        }
        let element = self.terminating(part, at);
        let stage = element.stage.map(Bit::Stage);
        for bit in [Bit::Running(element.block)].into_iter().chain(stage) {
            let cell = Cell::Bit(self.subject.symbols.layout.bit(bit));
            if self.replay.value(cell, at) == 0
                && let Some(node) = self.node(cell, 0, at, depth.saturating_sub(1))
            {
                return Stop::Bit(Box::new(node));
            }
        }
        let restart = self.restart(element.block, at, depth);
        Stop::Again(self.subject.element(element), restart)
    }

    /// The element with whose pass a part terminates: for a subroutine, the one that executed it
    /// last.
    fn terminating(&mut self, part: u32, at: TapeMoment) -> ElementId {
        let subject = self.subject;
        let element = subject.part(part).element;
        if !subject.program.block(element.block).is_subroutine() {
            return element;
        }
        let engine = self.replay.seek(at.section, at.entry);
        match engine.and_then(|engine| engine.caller(element.block)) {
            None => element,
            Some(Element::Block(block)) => ElementId { block, stage: None },
            Some(Element::Stage(stage)) => {
                let (block, _) = subject.program.stages[stage.0 as usize];
                ElementId { block, stage: Some(stage) }
            }
        }
    }

    fn turn(&mut self, cell: Cell, block: BlockId, at: TapeMoment, depth: u32) -> Cause {
        let running = Cell::Bit(self.subject.symbols.layout.bit(Bit::Running(block)));
        let element = ElementId { block, stage: None };
        let element_place = self.subject.element(element);
        let restart = match running == cell {
            true => None,
            false => self.restart(block, at, depth),
        };
        let node = match running == cell || depth == 0 || restart.is_some() {
            true => None,
            false => {
                let value = self.replay.value(running, at);
                self.node(running, value, at, depth.saturating_sub(1)).map(Box::new)
            }
        };
        Cause::Turn { block: element_place, running: node, restart }
    }

    /// The cause of a write by the call of an entry.
    fn call(&mut self, cell: Cell, at: TapeMoment) -> Cause {
        let Some(section) = self.replay.section(at.section) else { return Cause::Controller };
        match section.entries.get(at.entry) {
            Some(TapeEntry::Call(EngineCall::Write(..))) => {
                let (origin, who) = past::origin(&section, at.entry);
                let device = match origin {
                    Origin::Device(n) => {
                        self.subject.symbols.names.devices.get(n as usize).cloned()
                    }
                    Origin::Inputs | Origin::Batch(_) | Origin::Command(_) => None,
                };
                Cause::Outside { origin, who: who.or(device) }
            }
            Some(TapeEntry::Call(EngineCall::Force(..))) => {
                Cause::Force { who: past::origin(&section, at.entry).1 }
            }
            Some(TapeEntry::Call(EngineCall::Start { .. })) if self.is_resumed(cell) => {
                Cause::Resumed
            }
            Some(
                TapeEntry::Call(
                    EngineCall::Start { .. }
                    | EngineCall::RequestStop
                    | EngineCall::Begin { .. }
                    | EngineCall::Execute
                    | EngineCall::Terminate
                    | EngineCall::Release(_),
                )
                | TapeEntry::Origin(_)
                | TapeEntry::Number(_)
                | TapeEntry::Mode(_)
                | TapeEntry::Swap { .. }
                | TapeEntry::State { .. }
                | TapeEntry::Lost { .. },
            )
            | None => Cause::Controller,
        }
    }

    /// Whether only retained Stages can turn a bit ON at the change to RUN.
    fn is_resumed(&self, cell: Cell) -> bool {
        match self.subject.address(cell) {
            Some(Address::Bit(Bit::Stage(_))) => true,
            Some(Address::Bit(Bit::Running(BlockId(at)))) => {
                let block = &self.subject.program.blocks[at as usize];
                block.retains_stages && !block.autostart
            }
            Some(Address::Bit(_) | Address::Word(_) | Address::Structure(_)) | None => false,
        }
    }

    /// The state of a timer or counter at a moment.
    fn about(&mut self, structure: Structure, at: TapeMoment) -> Option<About> {
        let layout = &self.subject.symbols.layout;
        let bit = |flag| Cell::Bit(layout.bit(Bit::Flag(structure, flag)));
        let acc_cell = Cell::Word(layout.word(Word::Acc(structure)));
        let presets = self.presets(structure, at);
        let acc = self.replay.value(acc_cell, at);
        match structure {
            Structure::Timer(_) => {
                let (timing, done) = (bit(Flag::Timing), bit(Flag::Done));
                let is_done = self.replay.value(done, at) != 0;
                Some(About::Timer {
                    acc_ms: acc,
                    preset_ms: presets.first().copied(),
                    timing: self.replay.value(timing, at) != 0,
                    since: self.replay.since(timing, at, &|_| true),
                    done: is_done.then(|| self.replay.since(done, at, &|_| true)),
                })
            }
            Structure::Counter(_) => {
                let counts = |step: i32| step == 1 || step == -1;
                let owner = self.owner(structure);
                Some(About::Counter {
                    acc,
                    presets,
                    counted: self.replay.since(acc_cell, at, &|change| {
                        let by = change.by.is_some() && change.by == owner;
                        by && counts(change.after.wrapping_sub(change.before))
                    }),
                    reset: self.replay.since(bit(Flag::Reset), at, &|change| change.after == 1),
                })
            }
            Structure::Sensaphone(_) => None,
        }
    }

    /// The operation of the instruction that owns a structure.
    fn owner(&self, structure: Structure) -> Option<ScanStep> {
        let acc = Cell::Word(self.subject.symbols.layout.word(Word::Acc(structure)));
        self.subject.writers(acc).into_iter().find(|deed| {
            let site = self.subject.site(*deed);
            let instruction =
                site.and_then(|site| self.subject.instruction(site.part, site.instruction?));
            let owned = instruction.and_then(|instruction| instruction.owned());
            matches!(deed, ScanStep::Batch(_)) && owned == Some(structure)
        })
    }

    fn presets(&mut self, structure: Structure, at: TapeMoment) -> Vec<i32> {
        let mut all = self.subject.program.instructions();
        let owner = all.find(|(_, instruction)| instruction.owned() == Some(structure));
        let Some((_, owner)) = owner else { return Vec::new() };
        let subject = self.subject;
        let Some(engine) = self.replay.seek(at.section, at.entry) else { return Vec::new() };
        let presets = owner.operands.each().filter_map(|(_, operand)| {
            let OperandValue::Value(value) = operand else { return None };
            Some(side(subject, value, engine.image()).value)
        });
        presets.collect()
    }
}

/// The operands that an instruction used; of many, without most zeros that add nothing to a sum or
/// an OR, and the number of these zeros.
fn without_zeros(operands: &[SeenValue]) -> (Vec<SeenValue>, usize) {
    let used = operands.iter().copied().filter(|side| side.cell.is_some());
    let (zeros, deciding): (Vec<SeenValue>, Vec<SeenValue>) =
        used.clone().partition(|side| side.adds_nothing);
    let told = ZEROS_TOLD.saturating_sub(deciding.len());
    if deciding.len() + zeros.len() <= TOLD_MAX || zeros.len() <= told + 1 {
        return (used.collect(), 0);
    }
    let folded = zeros.len() - told;
    (deciding.into_iter().chain(zeros.into_iter().take(told)).collect(), folded)
}

/// Whether a section begins with memory as it was at the start of the process. The first scan of
/// such a section has the number 1; in a test it may have the number 0.
fn is_first(section: &TapeSection) -> bool {
    let SectionStart { number, follows, lost, .. } = section.start;
    let is_first = number == 0 || number == 1 && !follows && lost == 0;
    is_first && section.state.scans() == 0
}
