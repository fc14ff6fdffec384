//! CTU, CTD and RES: calls of the blocks of `library`. A counter is a group of variables, which its
//! CTU and its CTD share.

use super::functions::{limited, number};
use super::library::LibraryBlock;
use super::project::{BlockCall, CallInput, CallResult, CallSource, CoilAction, NetworkPower, on};
use super::refusal::ExportRefusal;
use super::rung_acts::{InstructionLegs, RungExport};
use rungd_engine::isa::{Address, Bit, Flag, LegName, Mnemonic, Structure, Word};
use rungd_language::resolve::program::{Instruction, Value};

/// The limits of a preset.
const LIMITS: [i64; 2] = [i16::MIN as i64, i16::MAX as i64];
/// All flags.
const FLAGS: [Flag; 5] = [Flag::Cu, Flag::Cd, Flag::Dn, Flag::Ov, Flag::Un];

impl RungExport<'_, '_> {
    /// CTU and CTD.
    pub(super) fn sensaphone(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let counter: Structure = instruction.operands.required("n");
        let is_up = instruction.mnemonic == Mnemonic::Ctu;
        let block = if is_up { LibraryBlock::Ctu } else { LibraryBlock::Ctd };
        let acc = self.memory.variable(Address::Word(Word::Acc(counter)));
        let preset = self.memory.variable(Address::Word(Word::Pre(counter.number())));
        if let Some(given) = instruction.operands.get::<Value>("preset") {
            match given.value {
                Value::Const(constant, _) => {
                    self.memory.begin_with(&preset, &constant.to_string());
                }
                value @ (Value::Word(_) | Value::Element(_) | Value::Real(_)) => {
                    let source = self.number(value, instruction.span)?.source;
                    let [low, high] = LIMITS.map(number);
                    let source = limited(low, source, high);
                    self.store(Word::Pre(counter.number()), source, NetworkPower::Constant(true));
                }
            }
        }
        let mut flag = |flag| self.memory.variable(Address::Bit(Bit::Flag(counter, flag)));
        let (over, under, done) = (flag(Flag::Ov), flag(Flag::Un), flag(Flag::Dn));
        let enabled = flag(if is_up { Flag::Cu } else { Flag::Cd });
        let power = |bit: &str| CallSource::Power(on(bit));
        let inputs = vec![
            CallInput { pin: "Leg", source: CallSource::Power(legs.leg(LegName::When)) },
            CallInput { pin: "Ov", source: power(&over) },
            CallInput { pin: "Un", source: power(&under) },
            CallInput { pin: "Pre", source: CallSource::Variable(preset) },
            CallInput { pin: "Acc", source: CallSource::Variable(acc.clone()) },
        ];
        let coil = |pin, variable| CallResult { pin, variable, is_coil: true };
        let results = vec![
            CallResult { pin: "NewAcc", variable: acc, is_coil: false },
            coil("Enabled", enabled),
            coil("Dn", done),
            coil("NewOv", over),
            coil("NewUn", under),
        ];
        let name = self.facts.program.names.name(Address::Structure(counter));
        let instance =
            self.memory.instance(&format!("{name}_{}", if is_up { "up" } else { "down" }), block);
        let type_name = block.name().to_owned();
        self.call(BlockCall { type_name, instance: Some(instance), inputs }, results);
        Ok(())
    }

    /// RES.
    pub(super) fn sensaphone_reset(&mut self, instruction: &Instruction, legs: &InstructionLegs) {
        let counter: Structure = instruction.operands.required("n");
        let power = legs.leg(LegName::When);
        self.store(Word::Acc(counter), number(0), power.clone());
        for flag in FLAGS {
            let bit = self.memory.variable(Address::Bit(Bit::Flag(counter, flag)));
            self.coil(CoilAction::Reset, power.clone(), &bit);
        }
    }
}
