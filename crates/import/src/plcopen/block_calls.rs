//! Blocks that act: those of the standard, and what all blocks have. Those of the file are in
//! `unit_calls`, functions in `functions`.

use super::body::{BlockValue, ElementCalls, LadderBody};
use super::elements::{BlockElement, ElementBody, Modifier};
use super::formula::{FormulaType, IecFormula};
use super::graph::BlockOutput;
use super::literals::IecLiteral;
use super::memory::{BlockMember, BlockMembers, LocatedPlace};
use super::types::{INT, IecType, VariableKind};
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{Action, ActionForm, RungStep, UseArgument};

/// A function block of the standard.
struct StandardBlock {
    /// Its names in files.
    names: &'static [&'static str],
    template: &'static str,
    /// The inputs that are power: the pin and the parameter.
    contacts: &'static [[&'static str; 2]],
    /// The input that is a number.
    number: Option<&'static str>,
    outputs: &'static [StandardOutput],
}

/// An output of a block of the standard.
struct StandardOutput {
    name: &'static str,
    kind: OutputType,
}

#[derive(Clone, Copy)]
enum OutputType {
    Bool,
    Time,
    Count,
}

const fn bit(name: &'static str) -> StandardOutput {
    StandardOutput { name, kind: OutputType::Bool }
}

const ET: StandardOutput = StandardOutput { name: "ET", kind: OutputType::Time };
const CV: StandardOutput = StandardOutput { name: "CV", kind: OutputType::Count };

/// The blocks of the standard that `lib:iec` has.
const STANDARD: [StandardBlock; 10] = [
    StandardBlock {
        names: &["TON"],
        template: "Ton",
        contacts: &[["IN", "IN"]],
        number: Some("PT"),
        outputs: &[bit("Q"), ET],
    },
    StandardBlock {
        names: &["TOF"],
        template: "Tof",
        contacts: &[["IN", "IN"]],
        number: Some("PT"),
        outputs: &[bit("Q"), ET],
    },
    StandardBlock {
        names: &["TP"],
        template: "Tp",
        contacts: &[["IN", "IN"]],
        number: Some("PT"),
        outputs: &[bit("Q"), ET],
    },
    StandardBlock {
        names: &["CTU", "CTU_DINT", "CTU_UDINT", "CTU_LINT", "CTU_ULINT"],
        template: "Ctu",
        contacts: &[["CU", "CU"], ["R", "R"]],
        number: Some("PV"),
        outputs: &[bit("Q"), CV],
    },
    StandardBlock {
        names: &["CTD", "CTD_DINT", "CTD_UDINT", "CTD_LINT", "CTD_ULINT"],
        template: "Ctd",
        contacts: &[["CD", "CD"], ["LD", "LD"]],
        number: Some("PV"),
        outputs: &[bit("Q"), CV],
    },
    StandardBlock {
        names: &["CTUD", "CTUD_DINT", "CTUD_UDINT", "CTUD_LINT", "CTUD_ULINT"],
        template: "Ctud",
        contacts: &[["CU", "CU"], ["CD", "CD"], ["R", "R"], ["LD", "LD"]],
        number: Some("PV"),
        outputs: &[bit("QU"), bit("QD"), CV],
    },
    StandardBlock {
        names: &["R_TRIG"],
        template: "RTrig",
        contacts: &[["CLK", "CLK"]],
        number: None,
        outputs: &[bit("Q")],
    },
    StandardBlock {
        names: &["F_TRIG"],
        template: "FTrig",
        contacts: &[["CLK", "CLK"]],
        number: None,
        outputs: &[bit("Q")],
    },
    StandardBlock {
        names: &["SR"],
        template: "Sr",
        contacts: &[["S1", "S1"], ["R", "R"]],
        number: None,
        outputs: &[bit("Q1")],
    },
    StandardBlock {
        names: &["RS"],
        template: "Rs",
        contacts: &[["S", "S"], ["R1", "R"]],
        number: None,
        outputs: &[bit("Q1")],
    },
];

/// The members of the blocks of the standard, by their types in small letters.
pub(super) fn standard_members() -> impl Iterator<Item = (String, BlockMembers)> {
    STANDARD.iter().flat_map(|block| {
        block.names.iter().map(move |name| {
            let count = counted(name);
            let member = |output: &StandardOutput| {
                let kind = match output.kind {
                    OutputType::Bool => IecType::Bool,
                    OutputType::Time => IecType::Time,
                    OutputType::Count => count,
                };
                (output.name.to_lowercase(), BlockMember { tag: output.name.to_owned(), kind })
            };
            let members = block.outputs.iter().map(member).collect();
            (name.to_lowercase(), BlockMembers { members })
        })
    })
}

/// The type in which a counter counts: `CTU` in INT, `CTU_DINT` in DINT.
fn counted(kind: &str) -> IecType {
    match kind.contains('_') {
        true => IecType::Whole { bits: 32, is_signed: true },
        false => INT,
    }
}

fn standard(kind: &str) -> Option<&'static StandardBlock> {
    let is_it =
        |block: &&StandardBlock| block.names.iter().any(|name| name.eq_ignore_ascii_case(kind));
    STANDARD.iter().find(is_it)
}

impl LadderBody<'_, '_> {
    /// Executes a block; a target gets the value of the output directly.
    pub(super) fn execute(
        &mut self,
        output: BlockOutput,
        target: Option<&LocatedPlace>,
    ) -> Result<(), String> {
        let graph = self.graph;
        let ElementBody::Block(block) = &graph.elements[output.element].body else {
            return Ok(());
        };
        let ordered = graph.elements[output.element].order > 0;
        for pin in &block.inputs {
            self.follow(&pin.input, ordered)?;
        }
        let lines: Vec<_> = block.inputs.iter().flat_map(|pin| pin.input.clone()).collect();
        self.begin(&lines)?;
        match &block.instance {
            None => self.run_function(output, target)?,
            Some(name) => self.instance(output.element, block, name)?,
        }
        for (at, pin) in block.outputs.iter().enumerate() {
            if let Some(text) = &pin.expression {
                let output = BlockOutput { element: output.element, pin: at };
                self.assign_output(output, text)?;
            }
        }
        Ok(())
    }

    /// A variable that stands in an output of a block.
    fn assign_output(&mut self, output: BlockOutput, text: &str) -> Result<(), String> {
        let target = self.written(text, false)?;
        let located = self.kept_value(output)?;
        match target.kind {
            IecType::Bool => self.assign_bit(&target, RungCondition::bit(located.text), None),
            IecType::Whole { .. } | IecType::Time | IecType::Real => {
                let value = super::statements::formula_of(&located);
                self.store_number(&target, &value, RungCondition::Constant(true))
            }
        }
    }

    fn instance(&mut self, at: usize, block: &BlockElement, name: &str) -> Result<(), String> {
        let kind = &block.kind;
        let id = self.memory.variable(self.scope, name);
        let id =
            id.ok_or_else(|| format!("the block `{name}`, which the file does not declare"))?;
        let variable = &self.memory.variables[id];
        let is_kind =
            matches!(&variable.kind, VariableKind::Instance(own) if own.eq_ignore_ascii_case(kind));
        if !is_kind {
            return Err(format!("`{name}` is no {kind}"));
        }
        if self.memory.calls.get(&id).copied().unwrap_or(0) > 1 {
            return Err(format!("the block `{name}` is called in several places"));
        }
        let enable = block.inputs.iter().find(|pin| pin.name == "EN");
        let enable = enable.filter(|pin| !pin.input.is_empty());
        let enabled = match enable {
            Some(pin) => Some(self.pin_power(Some(pin))?),
            None => None,
        };
        if enabled.is_some() && self.is_template {
            return Err(format!("{kind} with a condition at EN, in a function block"));
        }
        let begin = self.steps.len();
        let own = self.memory.variables[id].name.clone();
        if let Some(standard) = standard(kind) {
            self.standard_block(block, standard, &own)?;
            return self.enable(at, block, begin, enabled);
        }
        let units = self.units;
        let unit = units.get(&kind.to_lowercase());
        let unit = unit.ok_or_else(|| format!("the block {kind}"))?;
        let unit = unit.as_ref().map_err(|why| format!("the block {kind}: {why}"))?;
        self.unit_block(block, unit, &own)?;
        self.enable(at, block, begin, enabled)
    }

    fn standard_block(
        &mut self,
        block: &BlockElement,
        standard: &StandardBlock,
        own: &str,
    ) -> Result<(), String> {
        let mut when = Vec::new();
        let mut arguments = Vec::new();
        for (at, [pin, parameter]) in standard.contacts.iter().enumerate() {
            let mut power = self.pin_power(block.input(pin))?;
            // Under a condition the block's text is not always executed; edges are.
            let is_conditional = block.input("EN").is_some_and(|pin| !pin.input.is_empty());
            if is_conditional && power.text().contains("rise(") {
                power = self.kept(power, &format!("{own}_{pin}"));
            }
            if at == 0 {
                when = vec![power];
                continue;
            }
            let value = self.small(power, &format!("{own}_{pin}")).text();
            arguments.push(UseArgument { name: (*parameter).to_owned(), value });
        }
        if let Some(name) = standard.number {
            let wanted = if name == "PT" { IecType::Time } else { counted(&block.kind) };
            if let Some(loss) = block.kind.split_once('_').and_then(|(_, kind)| IecType::loss(kind))
            {
                self.differences.insert(format!("{} counts {loss}", block.kind));
            }
            let value = self.preset(block, name, own, wanted)?;
            arguments.push(UseArgument { name: name.to_owned(), value });
        }
        let power = when.pop().unwrap_or(RungCondition::Constant(false));
        let when = self.terms(power);
        let form = ActionForm::Use {
            template: standard.template.to_owned(),
            name: own.to_owned(),
            contact: standard.contacts.first().map(|[_, parameter]| *parameter),
            arguments,
        };
        let writes = vec![TouchedPlace::of(own)];
        self.steps.push(RungStep { when, action: Action { form, writes } });
        Ok(())
    }

    /// The number of a timer or counter, as an argument.
    fn preset(
        &mut self,
        block: &BlockElement,
        name: &str,
        own: &str,
        wanted: IecType,
    ) -> Result<String, String> {
        let pin = block.input(name).filter(|pin| !pin.input.is_empty());
        let value = match pin {
            None => IecFormula::of_literal(match wanted {
                IecType::Time => IecLiteral::Time { ms: 0, is_rounded: false },
                IecType::Bool | IecType::Whole { .. } | IecType::Real => IecLiteral::Whole(0),
            }),
            Some(pin) if pin.modifier != Modifier::default() => {
                return Err(format!("{name} with a negation or an edge"));
            }
            Some(pin) => self.number(&pin.input)?,
        };
        let is_wider = matches!(value.kind, FormulaType::Known(IecType::Whole { bits: 32, .. }))
            && wanted == INT;
        if is_wider {
            return Err(format!("{name} of {own} is of a wider type"));
        }
        let value = match value.kind {
            // CODESYS' counters have WORDs.
            FormulaType::Known(IecType::Whole { .. }) if wanted == INT => value,
            FormulaType::Known(_) | FormulaType::Literal(_) => value.fitted(wanted)?,
        };
        let own_place = TouchedPlace::of(own);
        if value.reads.iter().any(|read| read.overlaps(&own_place)) {
            let kept = self.own_tag(&format!("{own}_{name}"), wanted);
            self.store_number(&kept, &value, RungCondition::Constant(true))?;
            return Ok(kept.text);
        }
        Ok(value.text)
    }

    /// The value of an output.
    ///
    /// # Errors
    /// Its block is not translated.
    pub(super) fn value(&mut self, output: BlockOutput) -> Result<BlockValue, String> {
        if let Some(value) = self.values.get(&output) {
            return Ok(value.clone());
        }
        let graph = self.graph;
        let ElementBody::Block(block) = &graph.elements[output.element].body else {
            return Err("a line from an element without an output".to_owned());
        };
        let pin = &block.outputs[output.pin];
        if let Some(name) = &block.instance {
            if pin.name == "ENO" {
                self.certain_enable(block)?;
                let condition = RungCondition::Constant(true);
                return Ok(BlockValue::Power { condition, at: self.steps.len() });
            }
            let located = self.read(&format!("{name}.{}", pin.name), false)?;
            return Ok(BlockValue::Kept(located));
        }
        // The function is executed later: the value of the last scan.
        self.found.kept.insert(output);
        self.early_output(output)
    }

    /// The value of an output that is kept in a place.
    pub(super) fn kept_value(&mut self, output: BlockOutput) -> Result<LocatedPlace, String> {
        match self.value(output)? {
            BlockValue::Kept(located) => Ok(located),
            BlockValue::Power { condition, at } => {
                if self.is_changed(&condition, at) {
                    self.found.kept.insert(output);
                }
                let id = self.graph.elements[output.element].id;
                let bit = self.own_tag(&format!("value_{id}_{}", output.pin), IecType::Bool);
                let when = self.terms(condition);
                self.push(when, format!("OUT {}", bit.text), &bit.place);
                let value = BlockValue::Kept(bit.clone());
                self.values.insert(output, value);
                Ok(bit)
            }
        }
    }
}
