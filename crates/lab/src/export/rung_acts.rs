//! A rung that is being exported: its acts, and what all parts of the export add to them.
//!
//! `contacts`, `formula` and `elements` add what computes a value, `instructions` and the files
//! below it what an instruction does; `rungs` makes networks of the acts.

use std::collections::{HashMap, HashSet};

use super::functions::{self, limited, number};
use super::literals::CallLiteral;
use super::memory::ExportMemory;
use super::project::{
    BlockCall, CallResult, CallSource, CoilAction, NetworkCoil, NetworkPower, off, on,
};
use super::refusal::{self, ExportRefusal};
use super::status_bits;
use rungd_engine::isa::{
    Address, Bit, BitSpace, LegName, Real, Structure, Word, WordSpace, status,
};
use rungd_language::lower::WordLimits;
use rungd_language::resolve::program::{Edge, Instruction, Program};
use rungd_language::source::span::Span;

/// What a rung does, in its order.
#[derive(Clone, Debug)]
pub(super) enum RungAct {
    Coil(NetworkCoil),
    Call { call: BlockCall, results: Vec<CallResult> },
}

/// A number of a ladder.
#[derive(Clone, Debug)]
pub(super) struct ExportedNumber {
    pub(super) source: CallSource,
    pub(super) is_real: bool,
    /// The constant, if it is one.
    pub(super) constant: Option<i32>,
}

impl ExportedNumber {
    /// The number as a REAL, if its value is one exactly.
    pub(super) fn real_source(self) -> Option<CallSource> {
        match self.constant {
            _ if self.is_real => Some(self.source),
            Some(constant) if f64::from(constant as f32) == f64::from(constant) => {
                Some(CallSource::Literal(CallLiteral::Real(Real::nearest(constant))))
            }
            Some(_) | None => None,
        }
    }
}

/// What the rungs of a program share.
pub(super) struct ProgramFacts<'p> {
    pub(super) program: &'p Program,
    pub(super) limits: WordLimits,
    /// The timers and counters that a RSTT or RSTCT resets.
    pub(super) reset: HashSet<Structure>,
    /// The instructions that own timers and counters.
    pub(super) owners: HashMap<Structure, &'p Instruction>,
    /// The flags of timers and counters that the ladder reads.
    pub(super) read_flags: HashSet<Bit>,
}

/// A rung that is being exported.
pub(super) struct RungExport<'e, 'p> {
    pub(super) facts: &'e ProgramFacts<'p>,
    pub(super) memory: &'e mut ExportMemory<'p>,
    /// The beginning of the names of its variables.
    pub(super) label: String,
    pub(super) acts: Vec<RungAct>,
    /// Whether its instructions act in the first scan only.
    pub(super) is_first_scan: bool,
}

/// The power of an instruction's legs.
pub(super) struct InstructionLegs(pub(super) Vec<LegPower>);

/// The power of a leg.
pub(super) struct LegPower {
    pub(super) name: LegName,
    pub(super) power: NetworkPower,
}

impl InstructionLegs {
    /// The power of a leg; an open end, if the instruction has no such leg.
    pub(super) fn leg(&self, name: LegName) -> NetworkPower {
        let found = self.0.iter().find(|leg| leg.name == name);
        found.map_or(NetworkPower::Constant(false), |leg| leg.power.clone())
    }

    /// The power of a rung with one leg.
    pub(super) fn of_rung() -> InstructionLegs {
        let power = NetworkPower::OfRung { is_negated: false };
        InstructionLegs(vec![LegPower { name: LegName::When, power }])
    }
}

impl<'e, 'p> RungExport<'e, 'p> {
    /// A rung that is named so among the variables.
    pub(super) fn new(
        facts: &'e ProgramFacts<'p>,
        memory: &'e mut ExportMemory<'p>,
        label: String,
    ) -> RungExport<'e, 'p> {
        RungExport { facts, memory, label, acts: Vec::new(), is_first_scan: false }
    }

    /// The acts that turn a bit ON at an edge of a power, for one execution.
    pub(super) fn edge(&mut self, edge: Edge, power: &NetworkPower, bit: &str) {
        let was = self.fresh("was", "BOOL");
        let now = match edge {
            Edge::Rise => NetworkPower::all([power.clone(), off(&was)]),
            Edge::Fall => NetworkPower::all([power.clone().opposite(), on(&was)]),
        };
        self.coil(CoilAction::Assign, now, bit);
        self.coil(CoilAction::Assign, power.clone(), &was);
    }

    /// A bit of the export with a power.
    pub(super) fn kept_bit(&mut self, power: NetworkPower) -> NetworkPower {
        if matches!(power, NetworkPower::Constant(_)) {
            return power;
        }
        let bit = self.fresh("result", "BOOL");
        self.coil(CoilAction::Assign, power, &bit);
        on(&bit)
    }

    /// A bit that a contact reads.
    pub(super) fn bit(&mut self, bit: Bit, span: Span) -> Result<NetworkPower, ExportRefusal> {
        use status::st;
        let refused = |remedy| {
            let what = format!("`{}`", self.facts.program.names.name(Address::Bit(bit)));
            Err(ExportRefusal::new(span, what, remedy))
        };
        match bit {
            Bit::Space(BitSpace::St, number) => match number {
                st::ON => Ok(NetworkPower::Constant(true)),
                st::OFF => Ok(NetworkPower::Constant(false)),
                number => match status_bits::variable(self.memory, number) {
                    Some(variable) => Ok(on(&variable)),
                    None => refused(refusal::STATUS),
                },
            },
            Bit::Space(..) | Bit::Flag(..) | Bit::Device(..) => {
                Ok(on(&self.memory.variable(Address::Bit(bit))))
            }
            Bit::Stage(_) => refused(refusal::STAGES),
            Bit::Running(_) | Bit::Done(_) => refused(refusal::BLOCKS),
            Bit::InWord(_) => refused(refusal::NOT_YET),
        }
    }

    /// The variable of a word that is read.
    pub(super) fn word(&mut self, word: Word, span: Span) -> Result<ExportedNumber, ExportRefusal> {
        if let Word::Space(WordSpace::Dst, number) = word
            && !status::dst::is_of_clock(number)
        {
            let what = format!("`{}`", self.facts.program.names.name(Address::Word(word)));
            return Err(ExportRefusal::new(span, what, refusal::STATUS));
        }
        let source = CallSource::Variable(self.memory.variable(Address::Word(word)));
        Ok(ExportedNumber { source, is_real: word.is_real(), constant: None })
    }

    /// Adds a compare of two values; the bit with its result. Two constants need none.
    pub(super) fn compared(
        &mut self,
        name: &'static str,
        left: CallSource,
        right: CallSource,
    ) -> NetworkPower {
        if let Some(is_on) = functions::compared(name, &left, &right) {
            return NetworkPower::Constant(is_on);
        }
        let bit = self.fresh(&name.to_lowercase(), "BOOL");
        let call = functions::call_of_two(name, left, right);
        self.call(call, vec![CallResult { pin: "OUT", variable: bit.clone(), is_coil: true }]);
        on(&bit)
    }

    /// Adds a coil.
    pub(super) fn coil(&mut self, action: CoilAction, power: NetworkPower, variable: &str) {
        let variable = variable.to_owned();
        self.acts.push(RungAct::Coil(NetworkCoil { power, variable, action }));
    }

    /// Adds a call.
    pub(super) fn call(&mut self, call: BlockCall, results: Vec<CallResult>) {
        self.acts.push(RungAct::Call { call, results });
    }

    /// A variable of the export, named after the rung.
    pub(super) fn fresh(&mut self, purpose: &str, type_name: &str) -> String {
        self.memory.fresh(&format!("{}_{purpose}", self.label), type_name)
    }

    /// Gives a bit a state while a power is ON.
    pub(super) fn store_bit(&mut self, bit: &str, state: NetworkPower, power: NetworkPower) {
        let on = NetworkPower::all([power.clone(), state.clone()]);
        let off = NetworkPower::all([power, state.opposite()]);
        for (action, power) in [(CoilAction::Set, on), (CoilAction::Reset, off)] {
            if power != NetworkPower::Constant(false) {
                self.coil(action, power, bit);
            }
        }
    }

    /// The value within the limits of a word and its tags.
    pub(super) fn within_limits(&self, word: Word, source: CallSource) -> CallSource {
        let (low, high) = self.facts.limits.get(word);
        if (low, high) == (Word::range(word)) && (word.is_real() || word.bit_count() == 32) {
            return source;
        }
        if let Some(constant) = functions::literal(&source)
            && !word.is_real()
        {
            return number(constant.clamp(low.into(), high.into()));
        }
        let limit = |cell: i32| match word.is_real() {
            true => CallSource::Literal(CallLiteral::Real(Real::of_cell(cell))),
            false => number(cell.into()),
        };
        limited(limit(low), source, limit(high))
    }

    /// Writes a value to a word while a power is ON.
    pub(super) fn store(&mut self, word: Word, source: CallSource, power: NetworkPower) {
        let variable = self.memory.variable(Address::Word(word));
        self.assign(&variable, source, power);
    }

    /// Writes a value to a variable while a power is ON.
    pub(super) fn assign(&mut self, variable: &str, source: CallSource, power: NetworkPower) {
        let result = CallResult { pin: "OUT", variable: variable.to_owned(), is_coil: false };
        self.call(functions::stored(source, power), vec![result]);
    }
}

impl RungAct {
    pub(super) fn has_rung(&self) -> bool {
        match self {
            RungAct::Coil(coil) => coil.power.has_rung(),
            RungAct::Call { call, .. } => call.has_rung(),
        }
    }

    /// The variables that it writes.
    pub(super) fn writes(&self) -> impl Iterator<Item = &str> {
        let (coil, results) = match self {
            RungAct::Coil(coil) => (Some(coil.variable.as_str()), &[][..]),
            RungAct::Call { results, .. } => (None, results.as_slice()),
        };
        coil.into_iter().chain(results.iter().map(|result| result.variable.as_str()))
    }

    pub(super) fn with_rung(self, rung: &NetworkPower) -> RungAct {
        match self {
            RungAct::Coil(coil) => {
                RungAct::Coil(NetworkCoil { power: coil.power.with_rung(rung), ..coil })
            }
            RungAct::Call { call, results } => {
                RungAct::Call { call: call.mapped(&|power| power.with_rung(rung)), results }
            }
        }
    }
}
