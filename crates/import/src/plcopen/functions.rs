//! Functions: what those of the standard calculate, as conditions and expressions of rungd, and
//! what becomes of results. Calls of functions of the file are in `unit_calls`.

use super::body::{BlockValue, LATER, LadderBody, UnitBlock};
use super::calculations::{
    FunctionCalculation, FunctionResult, calculated, compared, is_compare, is_plain,
    literal_or_place,
};
use super::elements::{BlockElement, BlockPin, Connection, ElementBody};
use super::formula::{FormulaType, IecFormula, are_mixed, common};
use super::graph::BlockOutput;
use super::literals::{IecLiteral, literal};
use super::memory::LocatedPlace;
use super::types::IecType;
use crate::condition::RungCondition;

/// Named where values of different types are calculated with each other.
const MIXED: &str = "values of different types are calculated in the wider one";
/// Named where a whole number is compared with `144.3`.
const REAL_LITERAL: &str = "a whole number is compared with a REAL, which MatIEC refuses";

impl LadderBody<'_, '_> {
    /// Executes a function; a target gets its result directly.
    pub(super) fn function(
        &mut self,
        output: BlockOutput,
        target: Option<&LocatedPlace>,
    ) -> Result<(), String> {
        let graph = self.graph;
        let Some(block) = graph.elements[output.element].body.block() else { return Ok(()) };
        let enable = block.inputs.iter().find(|pin| pin.name == "EN" && !pin.input.is_empty());
        let enabled = match enable {
            Some(pin) => {
                let power = self.pin_power(Some(pin))?;
                let id = self.graph.elements[output.element].id;
                Some(match self.may_change_all(block) {
                    true => self.kept(power, &format!("en_{id}")),
                    false => self.small(power, &format!("en_{id}")),
                })
            }
            None => None,
        };
        let result = self.result(output.element, block, enabled.as_ref())?;
        let guard = match &result {
            FunctionResult::Number(calculation) => calculation.guard.clone(),
            FunctionResult::Power(_) | FunctionResult::Place(_) => None,
        };
        self.store_eno(output.element, block, enabled.clone(), guard);
        let result = match result {
            FunctionResult::Place(place) if target.is_none() && enabled.is_none() => {
                let pin = block.result_pin()?;
                self.store_place(BlockOutput { element: output.element, pin }, place);
                return Ok(());
            }
            FunctionResult::Place(place) => placed(place),
            FunctionResult::Power(_) | FunctionResult::Number(_) => result,
        };
        match (result, target) {
            (FunctionResult::Place(_), _) => Ok(()),
            (FunctionResult::Power(power), Some(target)) => match target.kind {
                IecType::Bool => self.assign_bit(target, power, enabled),
                IecType::Whole { .. } | IecType::Time | IecType::Real => {
                    Err(format!("a BOOL for `{}`", target.text))
                }
            },
            (FunctionResult::Power(power), None) => {
                let power = RungCondition::all(enabled.into_iter().chain([power]));
                self.store_power(output.element, block, power)
            }
            (FunctionResult::Number(result), Some(target)) => {
                self.assign_result(output.element, result, target, enabled)
            }
            (FunctionResult::Number(result), None) => {
                self.store_result(output.element, block, result, enabled)
            }
        }
    }

    /// Whether a function of the file writes more than its own variables.
    fn may_change_all(&self, block: &BlockElement) -> bool {
        let unit = self.units.get(&block.kind.to_lowercase()).and_then(|unit| unit.as_ref().ok());
        let has_reference = |unit: &UnitBlock| unit.inputs.iter().any(|input| input.is_reference);
        unit.is_some_and(|unit| unit.is_open || has_reference(unit))
    }

    /// Remembers the output of a function of the file, in a tag if something reads it before.
    pub(super) fn store_place(&mut self, output: BlockOutput, place: LocatedPlace) {
        self.own.kinds.insert(output, place.kind);
        let must = self.needs.keeps_all || self.needs.kept.contains(&output);
        let value = match placed(place.clone()) {
            FunctionResult::Power(power) => return self.keep_power(output, power),
            FunctionResult::Number(result) if must => self.kept_result(output, result, None),
            FunctionResult::Number(_) | FunctionResult::Place(_) => place,
        };
        self.values.insert(output, BlockValue::Kept(value));
    }

    /// ENO: the function was executed, and it has a result.
    fn store_eno(
        &mut self,
        at: usize,
        block: &BlockElement,
        enabled: Option<RungCondition>,
        guard: Option<RungCondition>,
    ) {
        let Some(pin) = block.outputs.iter().position(|pin| pin.name == "ENO") else { return };
        let output = BlockOutput { element: at, pin };
        let power = RungCondition::all(enabled.into_iter().chain(guard));
        self.keep_power(output, power);
    }

    /// The ENO of a block, whether it has such a pin or not.
    pub(super) fn eno(&mut self, at: usize) -> Result<RungCondition, String> {
        let ElementBody::Block(block) = &self.graph.elements[at].body else {
            return Ok(RungCondition::Constant(true));
        };
        let Some(pin) = block.outputs.iter().position(|pin| pin.name == "ENO") else {
            return Err(format!("{} with EN and without ENO, whose result is used", block.kind));
        };
        let output = BlockOutput { element: at, pin };
        match self.value(output)? {
            BlockValue::Power { condition, at } => {
                if self.is_changed(&condition, at) {
                    self.found.kept.insert(output);
                }
                Ok(condition)
            }
            BlockValue::Kept(located) => Ok(RungCondition::bit(located.text)),
        }
    }

    /// Remembers the power of an output, in a bit if it has to.
    pub(super) fn keep_power(&mut self, output: BlockOutput, power: RungCondition) {
        self.own.kinds.insert(output, IecType::Bool);
        let must = self.needs.keeps_all || self.needs.kept.contains(&output);
        let is_shared = self.graph.consumers(output).len() > 1 && super::power::weight(&power) > 3;
        let value = match must || is_shared {
            true => {
                let bit = self.result_tag(output, IecType::Bool);
                let when = self.terms(power);
                self.push(when, format!("OUT {}", bit.text), &bit.place);
                BlockValue::Kept(bit)
            }
            false => BlockValue::Power { condition: power, at: self.steps.len() },
        };
        self.values.insert(output, value);
    }

    fn store_power(
        &mut self,
        at: usize,
        block: &BlockElement,
        power: RungCondition,
    ) -> Result<(), String> {
        self.keep_power(BlockOutput { element: at, pin: block.result_pin()? }, power);
        Ok(())
    }

    /// The tag of a result.
    fn result_tag(&mut self, output: BlockOutput, kind: IecType) -> LocatedPlace {
        let element = &self.graph.elements[output.element];
        let kind_name = element.body.block().map(|block| block.kind.to_lowercase());
        let name = kind_name.unwrap_or_else(|| "value".to_owned());
        let is_eno = matches!(&element.body, ElementBody::Block(block)
            if block.outputs[output.pin].name == "ENO");
        let other = element
            .body
            .block()
            .filter(|block| !is_eno && block.result_pin().is_ok_and(|pin| pin != output.pin));
        let end = match other {
            Some(block) => format!("_{}", block.outputs[output.pin].name.to_lowercase()),
            None if is_eno => "_eno".to_owned(),
            None => String::new(),
        };
        self.own_tag(&format!("{name}{}{end}", element.id), kind)
    }

    /// The value of an output whose function is executed later.
    pub(super) fn early(&mut self, output: BlockOutput) -> Result<BlockValue, String> {
        let is_kept = self.needs.keeps_all || self.needs.kept.contains(&output);
        match self.own.kinds.get(&output).copied() {
            Some(kind) if is_kept => Ok(BlockValue::Kept(self.result_tag(output, kind))),
            None if is_kept && self.is_bit_output(output) => {
                Ok(BlockValue::Kept(self.result_tag(output, IecType::Bool)))
            }
            None if is_kept => Err("a value of a function that is not translated".to_owned()),
            Some(_) | None => Err(LATER.to_owned()),
        }
    }

    fn assign_result(
        &mut self,
        at: usize,
        result: FunctionCalculation,
        target: &LocatedPlace,
        enabled: Option<RungCondition>,
    ) -> Result<(), String> {
        let enabled = match (enabled, &result.guard) {
            (Some(enabled), Some(guard)) => Some(RungCondition::all([enabled, guard.clone()])),
            (enabled, _) => enabled,
        };
        let when = enabled.unwrap_or(RungCondition::Constant(true));
        let [text] = &result.texts[..] else {
            let block = self.graph.elements[at].body.block();
            let pin = block.map_or(Ok(0), BlockElement::result_pin)?;
            let value = self.kept_result(BlockOutput { element: at, pin }, result, None);
            let value = super::statements::formula_of(&value);
            return self.store_number(target, &value, when);
        };
        let is_move = literal_or_place(text) && !result.is_bit;
        let value = IecFormula {
            text: text.clone(),
            kind: FormulaType::Known(result.kind),
            reads: result.reads,
            is_atom: is_move,
        };
        self.store_number(target, &value, when)
    }

    fn store_result(
        &mut self,
        at: usize,
        block: &BlockElement,
        result: FunctionCalculation,
        enabled: Option<RungCondition>,
    ) -> Result<(), String> {
        let output = BlockOutput { element: at, pin: block.result_pin()? };
        self.own.kinds.insert(output, result.kind);
        let located = self.kept_result(output, result, enabled);
        self.values.insert(output, BlockValue::Kept(located));
        Ok(())
    }

    /// Calculates a result into a tag; 0, if the function is not executed.
    fn kept_result(
        &mut self,
        output: BlockOutput,
        result: FunctionCalculation,
        enabled: Option<RungCondition>,
    ) -> LocatedPlace {
        let tag = self.result_tag(output, result.kind);
        let off = enabled.clone().map(|enabled| self.terms(enabled.opposite()));
        let on = self.terms(enabled.unwrap_or(RungCondition::Constant(true)));
        for text in &result.texts {
            let text = text.replace('@', &tag.text);
            self.push(on.clone(), format!("MATH {} = {text}", tag.text), &tag.place);
        }
        if let Some(off) = off {
            self.push(off, format!("MOVE 0 to={}", tag.text), &tag.place);
        }
        tag
    }

    /// Whether power comes to a pin, and no number.
    fn is_power(&mut self, input: &[Connection]) -> Result<bool, String> {
        let [connection] = input else { return Ok(true) };
        let graph = self.graph;
        let at = graph.source(connection)?;
        match &graph.elements[at].body {
            ElementBody::InVariable { expression, .. }
            | ElementBody::InOutVariable { expression, .. } => match literal(expression) {
                Some(IecLiteral::Bool(_)) => Ok(true),
                Some(_) => Ok(false),
                None => Ok(self.read(expression, false)?.kind == IecType::Bool),
            },
            ElementBody::Block(_) => {
                let pin = graph.output(at, connection)?;
                match self.value(BlockOutput { element: at, pin })? {
                    BlockValue::Power { .. } => Ok(true),
                    BlockValue::Kept(located) => Ok(located.kind == IecType::Bool),
                }
            }
            ElementBody::Continuation { name } => {
                self.continued(name, |body, lines| body.is_power(lines))
            }
            ElementBody::LeftRail
            | ElementBody::RightRail
            | ElementBody::Contact { .. }
            | ElementBody::Coil { .. }
            | ElementBody::OutVariable { .. }
            | ElementBody::Connector { .. }
            | ElementBody::Comment(_)
            | ElementBody::Condition(_)
            | ElementBody::Other { .. } => Ok(true),
        }
    }

    /// What a function gives.
    fn result(
        &mut self,
        at: usize,
        block: &BlockElement,
        enabled: Option<&RungCondition>,
    ) -> Result<FunctionResult, String> {
        let units = self.units;
        if let Some(unit) = units.get(&block.kind.to_lowercase()) {
            let unit =
                unit.as_ref().map_err(|why| format!("the function {}: {why}", block.kind))?;
            return self.unit_result(at, unit, enabled);
        }
        let pins: Vec<&BlockPin> = block.inputs.iter().filter(|pin| pin.name != "EN").collect();
        if let Some(pin) = pins.iter().find(|pin| pin.input.is_empty()) {
            return Err(format!("the input {} of {} is not connected", pin.name, block.kind));
        }
        self.standard_function(block, &pins)
    }

    /// What a function of the file gives; its other outputs are remembered.
    fn unit_result(
        &mut self,
        at: usize,
        unit: &UnitBlock,
        enabled: Option<&RungCondition>,
    ) -> Result<FunctionResult, String> {
        let places = self.unit_function(at, unit, enabled)?;
        for output in places.outputs {
            self.store_place(BlockOutput { element: at, pin: output.pin }, output.place);
        }
        Ok(FunctionResult::Place(places.result))
    }

    /// What a function of the standard gives.
    fn standard_function(
        &mut self,
        block: &BlockElement,
        pins: &[&BlockPin],
    ) -> Result<FunctionResult, String> {
        let kind = block.kind.to_uppercase();
        let name = match kind.as_str() {
            "ADD_TIME" => "ADD",
            "SUB_TIME" => "SUB",
            name => name,
        };
        if let Some((from, to)) = name.split_once("_TO_") {
            return self.conversion([from, to], pins);
        }
        if name == "SEL" {
            return self.selection(block);
        }
        if let ("TRUNC", [pin]) = (name, pins) {
            return self.truncated(pin);
        }
        let are_powers: Result<Vec<bool>, String> =
            pins.iter().map(|pin| self.is_power(&pin.input)).collect();
        let are_powers = are_powers?;
        let is_power = !are_powers.is_empty() && are_powers.iter().all(|is_power| *is_power);
        if are_powers.contains(&true) && !is_power {
            return Err(format!("{name} of a BOOL and a number"));
        }
        match is_power {
            true => self.logic(name, pins),
            false => self.arithmetic(name, block, pins),
        }
    }

    /// A function of powers.
    fn logic(&mut self, name: &str, pins: &[&BlockPin]) -> Result<FunctionResult, String> {
        let powers: Result<Vec<RungCondition>, String> =
            pins.iter().map(|pin| self.pin_power(Some(pin))).collect();
        let powers = powers?;
        let power = match (name, &powers[..]) {
            ("AND", [_, ..]) => RungCondition::all(powers),
            ("OR", [_, ..]) => RungCondition::any(powers),
            ("NOT", [one]) => one.clone().opposite(),
            ("MOVE", [one]) => one.clone(),
            ("XOR" | "NE", [one, other]) => self.differ(one.clone(), other.clone()),
            ("EQ", [one, other]) => self.differ(one.clone(), other.clone()).opposite(),
            ("XOR", [one, other, rest @ ..]) => {
                let mut power = self.differ(one.clone(), other.clone());
                for next in rest {
                    power = self.differ(power, next.clone());
                }
                power
            }
            _ => return Err(format!("the function {name} of BOOLs")),
        };
        Ok(FunctionResult::Power(power))
    }

    /// Two powers that are not equal.
    pub(super) fn differ(&mut self, one: RungCondition, other: RungCondition) -> RungCondition {
        let id = self.graph.elements[self.statement].id;
        let count = self.tags.len();
        let one = self.steady(one, &format!("xor{id}_{count}"));
        let other = self.steady(other, &format!("xor{id}_{count}_other"));
        RungCondition::any([
            RungCondition::all([one.clone(), other.clone().opposite()]),
            RungCondition::all([one.opposite(), other]),
        ])
    }

    /// A function of numbers.
    fn arithmetic(
        &mut self,
        name: &str,
        block: &BlockElement,
        pins: &[&BlockPin],
    ) -> Result<FunctionResult, String> {
        let values: Result<Vec<IecFormula>, String> = match name {
            "LIMIT" => ["MN", "IN", "MX"]
                .iter()
                .map(|pin| match block.input(pin) {
                    Some(pin) => self.pin_number(pin),
                    None => Err(format!("LIMIT without {pin}")),
                })
                .collect(),
            _ => pins.iter().map(|pin| self.pin_number(pin)).collect(),
        };
        let (kind, values) = self.alike(name, values?)?;
        if let Some(power) = compared(name, &values) {
            return Ok(FunctionResult::Power(power));
        }
        let reads = values.iter().flat_map(|value| value.reads.clone()).collect();
        let texts = calculated(name, kind, &values)?;
        let guard = match (name, values.last()) {
            ("DIV", Some(divisor)) if !divisor.reads.is_empty() => {
                Some(RungCondition::compare(&divisor.text, "!=", "0", divisor.reads.clone()))
            }
            _ => None,
        };
        Ok(FunctionResult::Number(FunctionCalculation { kind, texts, reads, is_bit: false, guard }))
    }

    /// The values of a function in the type in which it calculates.
    pub(super) fn alike(
        &mut self,
        name: &str,
        values: Vec<IecFormula>,
    ) -> Result<(IecType, Vec<IecFormula>), String> {
        let kind = common(&values)?;
        let is_real =
            |value: &IecFormula| matches!(value.kind, FormulaType::Literal(IecLiteral::Real(_)));
        if matches!(kind, IecType::Whole { .. }) && is_compare(name) && values.iter().any(is_real) {
            self.differences.insert(REAL_LITERAL.to_owned());
            return Ok((kind, values));
        }
        if are_mixed(&values) && name != "MOVE" {
            self.differences.insert(MIXED.to_owned());
        }
        let mixed_whole =
            |value: &IecFormula| matches!(value.kind, FormulaType::Known(IecType::Whole { .. }));
        let values = values.into_iter().map(|value| {
            match matches!(kind, IecType::Whole { .. }) && mixed_whole(&value) {
                true => Ok(value),
                false => value.fitted(kind),
            }
        });
        let values: Result<Vec<IecFormula>, String> = values.collect();
        Ok((kind, values?))
    }

    /// SEL: the second value while G is ON, else the first.
    fn selection(&mut self, block: &BlockElement) -> Result<FunctionResult, String> {
        let pin =
            |name: &str| block.input(name).ok_or_else(|| format!("SEL without its input {name}"));
        let (chooser, off, on) = (pin("G")?, pin("IN0")?, pin("IN1")?);
        let power = self.pin_power(Some(chooser))?;
        let id = self.graph.elements[self.statement].id;
        let power = self.steady(power, &format!("g{id}"));
        if self.is_power(&off.input)? && self.is_power(&on.input)? {
            let (off, on) = (self.pin_power(Some(off))?, self.pin_power(Some(on))?);
            return Ok(FunctionResult::Power(RungCondition::any([
                RungCondition::all([power.clone(), on]),
                RungCondition::all([power.opposite(), off]),
            ])));
        }
        let values = [self.pin_number(off)?, self.pin_number(on)?];
        let kind = common(&values)?;
        let [off, on] = values;
        let (off, on) = (off.fitted(kind)?, on.fitted(kind)?);
        let power = if is_plain(&power) { power } else { self.kept(power, &format!("g{id}")) };
        let mut reads = [off.reads.clone(), on.reads.clone()].concat();
        super::power::places(&power, &mut reads);
        let text = format!("if({}, {}, {})", power.text(), on.text, off.text);
        let texts = vec![text];
        Ok(FunctionResult::Number(FunctionCalculation {
            kind,
            texts,
            reads,
            is_bit: false,
            guard: None,
        }))
    }
}

/// A place as a result.
fn placed(place: LocatedPlace) -> FunctionResult {
    match place.kind {
        IecType::Bool => FunctionResult::Power(RungCondition::bit(place.text)),
        kind @ (IecType::Whole { .. } | IecType::Time | IecType::Real) => {
            FunctionResult::Number(FunctionCalculation {
                kind,
                texts: vec![place.text],
                reads: vec![place.place],
                is_bit: false,
                guard: None,
            })
        }
    }
}
