//! Timers and counters: calls of the blocks of `library`, and RSTT and RSTCT.
//!
//! A structure is a group of variables, `t_Acc`, `t_Done` …: the block gets `.Acc` and gives it
//! back, so that rungs can write it. The flags that nothing reads have no variables. A RSTT or
//! RSTCT writes them at once, and leaves a bit for the block's next execution.

use super::functions::{self, number};
use super::library::LibraryBlock;
use super::project::{BlockCall, CallInput, CallResult, CallSource, CoilAction, NetworkPower, on};
use super::refusal::ExportRefusal;
use super::rung_acts::{InstructionLegs, RungExport};
use rungd_engine::isa::{Address, Bit, Flag, LegName, Mnemonic, Structure, Word};
use rungd_language::resolve::program::{Instruction, Value};

/// The flags of a timer or counter, with the outputs of its block.
const FLAGS: [(Flag, &str); 5] = [
    (Flag::Done, "Done"),
    (Flag::Reset, "Reset"),
    (Flag::Zero, "Zero"),
    (Flag::Timing, "Timing"),
    (Flag::DnDone, "DnDone"),
];

/// A structure with the block that owns it.
struct OwnedStructure {
    block: LibraryBlock,
    structure: Structure,
    /// Whether an up-down counter has an Up Preset, and a Down Preset.
    has: [bool; 2],
}

impl RungExport<'_, '_> {
    /// A timer or counter, whose block this is.
    pub(super) fn owner(
        &mut self,
        block: LibraryBlock,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let owned = instruction.first_operand::<Structure>();
        let Some(structure) = owned.map(|located| located.value) else { return Ok(()) };
        let owned = OwnedStructure { block, structure, has: [true; 2] };
        match block.has_input("Elapsed") {
            true => self.timer(&owned, instruction, legs),
            false => self.counter(owned, instruction, legs),
        }
    }

    fn timer(
        &mut self,
        owned: &OwnedStructure,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let block = owned.block;
        let preset = instruction.operands.required::<Value>("preset");
        let preset = self.number(preset, instruction.span)?.source;
        let elapsed = CallSource::Variable(self.memory.shared("Elapsed", "DINT"));
        let mut inputs = vec![
            CallInput { pin: "Preset", source: preset },
            CallInput { pin: "Elapsed", source: elapsed },
        ];
        let leg = |name| CallSource::Power(legs.leg(name));
        let has_enable = instruction.mnemonic.spec().legs.contains(&LegName::En);
        let main = if has_enable { LegName::En } else { LegName::When };
        inputs.insert(0, CallInput { pin: "Leg", source: leg(main) });
        if block.has_input("Rst") {
            inputs.insert(1, CallInput { pin: "Rst", source: leg(LegName::Rst) });
        }
        let output = instruction.operands.get::<Bit>("output");
        let output = output.map(|bit| self.memory.variable(Address::Bit(bit.value)));
        let pin = if block.has_output("Output") { "Output" } else { "Done" };
        let output = output
            .map(|variable| CallResult { pin, variable, is_coil: true })
            .into_iter()
            .collect();
        self.owned(owned, inputs, output);
        Ok(())
    }

    fn counter(
        &mut self,
        mut owned: OwnedStructure,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let block = owned.block;
        let leg = |name| CallSource::Power(legs.leg(name));
        let mut inputs = Vec::new();
        let pins = [("Up", LegName::Up), ("Dn", LegName::Dn), ("Rst", LegName::Rst)];
        for (pin, name) in pins.into_iter().filter(|(pin, _)| block.has_input(pin)) {
            inputs.push(CallInput { pin, source: leg(name) });
        }
        for (key, pin) in PRESETS {
            if block.has_input(pin) {
                let preset = self.preset(instruction, key)?;
                match key {
                    "up-preset" => owned.has[0] = preset.is_some(),
                    "dn-preset" => owned.has[1] = preset.is_some(),
                    _ => {}
                }
                inputs.push(CallInput { pin, source: preset.unwrap_or_else(|| number(0)) });
            }
        }
        self.owned(&owned, inputs, Vec::new());
        Ok(())
    }

    /// The preset of a counter with a key, if it is given.
    fn preset(
        &mut self,
        instruction: &Instruction,
        key: &str,
    ) -> Result<Option<CallSource>, ExportRefusal> {
        let preset = instruction.operands.get::<Value>(key);
        let preset = preset.map(|value| self.number(value.value, instruction.span)).transpose()?;
        Ok(preset.map(|preset| preset.source))
    }

    /// The call of a block that owns a structure.
    fn owned(
        &mut self,
        owned: &OwnedStructure,
        mut inputs: Vec<CallInput>,
        outputs: Vec<CallResult>,
    ) {
        let OwnedStructure { block, structure, has: [has_up, has_dn] } = *owned;
        let acc = self.memory.variable(Address::Word(Word::Acc(structure)));
        let is_reset = self.facts.reset.contains(&structure);
        let pending = is_reset.then(|| self.memory.pending(structure));
        let pending_power = pending.as_ref().map(|bit| CallSource::Power(on(bit)));
        let never = || CallSource::Power(NetworkPower::Constant(false));
        inputs.push(CallInput { pin: "Pending", source: pending_power.unwrap_or_else(never) });
        inputs.push(CallInput { pin: "Acc", source: CallSource::Variable(acc.clone()) });
        let mut results = vec![CallResult { pin: "NewAcc", variable: acc, is_coil: false }];
        for (flag, pin) in FLAGS {
            let bit = Bit::Flag(structure, flag);
            let is_given = (flag != Flag::Done || has_up) && (flag != Flag::DnDone || has_dn);
            if is_given && block.has_output(pin) && self.facts.read_flags.contains(&bit) {
                let variable = self.memory.variable(Address::Bit(bit));
                results.push(CallResult { pin, variable, is_coil: true });
            }
        }
        results.extend(outputs);
        let name = self.facts.program.names.name(Address::Structure(structure));
        let instance = self.memory.instance(&name, block);
        let call =
            BlockCall { type_name: block.name().to_owned(), instance: Some(instance), inputs };
        self.call(call, results);
        if let Some(pending) = pending {
            self.coil(CoilAction::Reset, NetworkPower::Constant(true), &pending);
        }
    }

    /// RSTT and RSTCT.
    pub(super) fn reset(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let structure = instruction.first_operand::<Structure>();
        let Some(structure) = structure.map(|located| located.value) else { return Ok(()) };
        let owner = self.facts.owners.get(&structure).copied();
        let Some(owner) = owner else { return Ok(()) };
        let power = legs.leg(LegName::When);
        let value = self.reset_value(owner)?;
        for (flag, _) in FLAGS {
            let bit = Bit::Flag(structure, flag);
            if !self.facts.read_flags.contains(&bit) {
                continue;
            }
            let state = self.reset_state(owner, flag, value.clone())?;
            let variable = self.memory.variable(Address::Bit(bit));
            self.store_bit(&variable, state, power.clone());
        }
        self.store(Word::Acc(structure), value, power.clone());
        let pending = self.memory.pending(structure);
        self.coil(CoilAction::Set, power, &pending);
        Ok(())
    }

    /// `.Acc` after a reset.
    fn reset_value(&mut self, owner: &Instruction) -> Result<CallSource, ExportRefusal> {
        if ![Mnemonic::Cntdn, Mnemonic::Tmrdown, Mnemonic::Tmradown].contains(&owner.mnemonic) {
            return Ok(number(0));
        }
        let preset = self.preset(owner, "preset")?.unwrap_or_else(|| number(0));
        match owner.mnemonic == Mnemonic::Cntdn {
            true => Ok(preset),
            false => Ok(functions::at_least_zero(preset)),
        }
    }

    /// A flag after a reset, with this value in `.Acc`.
    fn reset_state(
        &mut self,
        owner: &Instruction,
        flag: Flag,
        value: CallSource,
    ) -> Result<NetworkPower, ExportRefusal> {
        if flag == Flag::Reset {
            return Ok(NetworkPower::Constant(true));
        }
        let is_counter =
            LibraryBlock::of(owner.mnemonic).is_some_and(|block| !block.has_input("Elapsed"));
        let compared = if flag == Flag::Zero {
            Some(("EQ", number(0)))
        } else if !is_counter {
            None
        } else if flag == Flag::DnDone {
            self.preset(owner, "dn-preset")?.map(|to| ("LE", to))
        } else if owner.mnemonic == Mnemonic::Cntdn {
            Some(("LE", number(0)))
        } else {
            let key = if owner.mnemonic == Mnemonic::Cnt { "preset" } else { "up-preset" };
            self.preset(owner, key)?.map(|to| ("GE", to))
        };
        let Some((name, to)) = compared else { return Ok(NetworkPower::Constant(false)) };
        Ok(self.compared(name, value, to))
    }
}

/// The keys of the presets of counters, with the inputs of their blocks.
const PRESETS: [(&str, &str); 3] =
    [("preset", "Preset"), ("up-preset", "UpPreset"), ("dn-preset", "DnPreset")];
