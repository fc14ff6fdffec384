//! Instructions of a ladder as acts: coils, MOVE and sums. Timers and counters: `owners`.

use super::contacts::ExportedNumber;
use super::functions::{difference, limited, number, sum};
use super::library::LibraryBlock;
use super::memory::real;
use super::project::{
    BlockCall, CallInput, CallResult, CallSource, CoilAction, NetworkPower, off, on,
};
use super::refusal::{self, ExportRefusal};
use super::rungs::{InstructionLegs, RungExport};
use rungd_engine::isa::{Address, Bit, LegName, Mnemonic, Real, Word};
use rungd_language::resolve::operand_list::WordPlace;
use rungd_language::resolve::program::{Edge, Instruction, Value};

/// The instructions that write a bit.
const BITS: [Mnemonic; 6] =
    [Mnemonic::Out, Mnemonic::Set, Mnemonic::Rst, Mnemonic::Pd, Mnemonic::Nd, Mnemonic::Ponoff];
/// Those of them that are coils.
const COILS: [(Mnemonic, CoilAction); 3] = [
    (Mnemonic::Out, CoilAction::Assign),
    (Mnemonic::Set, CoilAction::Set),
    (Mnemonic::Rst, CoilAction::Reset),
];
/// The instructions that write a word.
const STORES: [Mnemonic; 3] = [Mnemonic::Move, Mnemonic::Add, Mnemonic::Sub];
/// The instructions that reset a timer or counter.
const RESETS: [Mnemonic; 2] = [Mnemonic::Rstt, Mnemonic::Rstct];
/// The instructions of Stages.
const STAGES: &[Mnemonic] =
    &[Mnemonic::Jmp, Mnemonic::Sgset, Mnemonic::Sgrst, Mnemonic::Sgdivrg, Mnemonic::Sgconvrg];
/// The instructions that could be exported.
const NOT_YET: &[Mnemonic] = &[
    Mnemonic::Ctu,
    Mnemonic::Ctd,
    Mnemonic::Res,
    Mnemonic::Math,
    Mnemonic::Copy,
    Mnemonic::Fill,
    Mnemonic::Pack,
    Mnemonic::Unpack,
    Mnemonic::Sr,
];

impl RungExport<'_, '_> {
    /// Adds the acts of an instruction.
    pub(super) fn instruction(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let mnemonic = instruction.mnemonic;
        if BITS.contains(&mnemonic) {
            self.bit_instruction(instruction, legs)
        } else if STORES.contains(&mnemonic) {
            self.stored(instruction, legs)
        } else if RESETS.contains(&mnemonic) {
            self.reset(instruction, legs)
        } else if let Some(block) = LibraryBlock::of(mnemonic) {
            self.owner(block, instruction, legs)
        } else {
            let remedies = [(STAGES, refusal::STAGES), (NOT_YET, refusal::NOT_YET)];
            let found = remedies.iter().find(|(mnemonics, _)| mnemonics.contains(&mnemonic));
            let other = if mnemonic == Mnemonic::Stop { refusal::STOP } else { refusal::BLOCKS };
            let remedy = found.map_or(other, |(_, remedy)| *remedy);
            Err(ExportRefusal::new(instruction.span, mnemonic.spec().name, remedy))
        }
    }

    fn bit_instruction(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let bit: Bit = instruction.operands.required("bit");
        if bit.of_word().is_some() {
            let what = format!("{} of a bit of a word", instruction.mnemonic.spec().name);
            return Err(ExportRefusal::new(instruction.span, what, refusal::NOT_YET));
        }
        let bit = self.memory.variable(Address::Bit(bit));
        let power = legs.of(LegName::When);
        let mnemonic = instruction.mnemonic;
        if let Some((_, action)) = COILS.into_iter().find(|(coil, _)| *coil == mnemonic) {
            self.coil(action, power, &bit);
        } else if mnemonic == Mnemonic::Ponoff {
            let edge = self.fresh("press", "BOOL");
            self.edge(Edge::Rise, &power, &edge);
            let turned = NetworkPower::any([
                NetworkPower::all([on(&edge), off(&bit)]),
                NetworkPower::all([off(&edge), on(&bit)]),
            ]);
            self.coil(CoilAction::Assign, turned, &bit);
        } else {
            let edge = if mnemonic == Mnemonic::Pd { Edge::Rise } else { Edge::Fall };
            self.edge(edge, &power, &bit);
        }
        Ok(())
    }

    /// MOVE, ADD and SUB.
    fn stored(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let span = instruction.span;
        let word = match instruction.operands.required("to") {
            WordPlace::Word(word) => word,
            WordPlace::Element(_) => {
                return Err(ExportRefusal::new(span, "a moving index", refusal::NOT_YET));
            }
        };
        let a = self.number(instruction.operands.required::<Value>("a"), span)?;
        let b = instruction.operands.get::<Value>("b");
        let b = b.map(|b| self.number(b.value, span)).transpose()?;
        let is_sum = instruction.mnemonic == Mnemonic::Add;
        let source = match word.is_real() {
            true => real_result(a, b, is_sum),
            false => whole_result(a, b, is_sum),
        };
        let Some(source) = source else {
            let name = instruction.mnemonic.spec().name;
            let what = format!("{name} of whole numbers and reals together");
            return Err(ExportRefusal::new(span, what, refusal::TYPES));
        };
        let source = self.within_limits(word, source);
        self.store(word, source, legs.of(LegName::When));
        Ok(())
    }

    /// The value within the limits of a word and its tags.
    fn within_limits(&self, word: Word, source: CallSource) -> CallSource {
        let (low, high) = self.facts.limits.get(word);
        if (low, high) == (Word::range(word)) && (word.is_real() || word.bit_count() == 32) {
            return source;
        }
        if let CallSource::Text(text) = &source
            && let Ok(constant) = text.parse::<i32>()
            && !word.is_real()
        {
            return number(constant.clamp(low, high).into());
        }
        let limit = |cell: i32| match word.is_real() {
            true => CallSource::Text(real(Real::of_cell(cell))),
            false => number(cell.into()),
        };
        limited(limit(low), source, limit(high))
    }

    /// Writes a value to a word while a power is ON.
    pub(super) fn store(&mut self, word: Word, source: CallSource, power: NetworkPower) {
        let variable = self.memory.variable(Address::Word(word));
        let mut inputs = vec![CallInput { pin: "IN", source }];
        if power != NetworkPower::Constant(true) {
            inputs.insert(0, CallInput { pin: "EN", source: CallSource::Power(power) });
        }
        let results = vec![CallResult { pin: "OUT", variable, is_coil: false }];
        self.call(BlockCall::function("MOVE", inputs), results);
    }
}

/// The sum, difference or copy of whole numbers.
fn whole_result(a: ExportedNumber, b: Option<ExportedNumber>, is_sum: bool) -> Option<CallSource> {
    if a.is_real || b.as_ref().is_some_and(|b| b.is_real) {
        return None;
    }
    Some(match b {
        Some(b) if is_sum => sum(a.source, b.source),
        Some(b) => difference(a.source, b.source),
        None => a.source,
    })
}

/// The sum, difference or copy of reals.
fn real_result(a: ExportedNumber, b: Option<ExportedNumber>, is_sum: bool) -> Option<CallSource> {
    let a = a.real_source()?;
    let name = if is_sum { "ADD" } else { "SUB" };
    match b {
        Some(b) => Some(super::functions::of_two(name, a, b.real_source()?)),
        None => Some(a),
    }
}
