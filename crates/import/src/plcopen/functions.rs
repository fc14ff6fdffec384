//! Functions of the standard: what they calculate, as conditions and expressions of rungd.

use super::block_calls::find;
use super::body::{BlockValue, LATER, LadderBody};
use super::calculations::{calculated, compared, literal_or_place};
use super::elements::{BlockElement, BlockPin, Connection, ElementBody, Modifier};
use super::formula::{FormulaType, IecFormula, are_mixed, common};
use super::graph::BlockOutput;
use super::literals::{IecLiteral, literal};
use super::memory::LocatedPlace;
use super::types::IecType;
use crate::condition::RungCondition;

/// What a function gives.
enum FunctionResult {
    Power(RungCondition),
    Number(FunctionCalculation),
}

/// A calculation.
struct FunctionCalculation {
    kind: IecType,
    /// The expressions, each with `@` for the result of the one before it.
    texts: Vec<String>,
    reads: Vec<crate::condition::TouchedPlace>,
    /// Whether the expression is a bit, which only MATH makes a number of.
    is_bit: bool,
    /// Without it nothing is assigned: a divisor that is not 0.
    guard: Option<RungCondition>,
}

/// Named where values of different types are calculated with each other.
const MIXED: &str = "values of different types are calculated in the wider one";

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
                Some(self.small(power, &format!("en_{id}")))
            }
            None => None,
        };
        let pins: Vec<&BlockPin> = block.inputs.iter().filter(|pin| pin.name != "EN").collect();
        if let Some(pin) = pins.iter().find(|pin| pin.input.is_empty()) {
            return Err(format!("the input {} of {} is not connected", pin.name, block.kind));
        }
        let result = self.result(block, &pins)?;
        let guard = match &result {
            FunctionResult::Number(calculation) => calculation.guard.clone(),
            FunctionResult::Power(_) => None,
        };
        self.store_eno(output.element, block, enabled.clone(), guard);
        match (result, target) {
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
        self.keep_power(BlockOutput { element: at, pin: result_pin(block)? }, power);
        Ok(())
    }

    /// The tag of a result.
    fn result_tag(&mut self, output: BlockOutput, kind: IecType) -> LocatedPlace {
        let element = &self.graph.elements[output.element];
        let kind_name = element.body.block().map(|block| block.kind.to_lowercase());
        let name = kind_name.unwrap_or_else(|| "value".to_owned());
        let is_eno = matches!(&element.body, ElementBody::Block(block)
            if block.outputs[output.pin].name == "ENO");
        let end = if is_eno { "_eno" } else { "" };
        self.own_tag(&format!("{name}{}{end}", element.id), kind)
    }

    /// The value of an output whose function is executed later.
    pub(super) fn early(&mut self, output: BlockOutput) -> Result<BlockValue, String> {
        let is_kept = self.needs.keeps_all || self.needs.kept.contains(&output);
        match self.own.kinds.get(&output).copied() {
            Some(kind) if is_kept => Ok(BlockValue::Kept(self.result_tag(output, kind))),
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
            let pin = block.map_or(Ok(0), result_pin)?;
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
        let output = BlockOutput { element: at, pin: result_pin(block)? };
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
            | ElementBody::Other { .. } => Ok(true),
        }
    }

    /// What a function gives.
    fn result(
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
    fn differ(&mut self, one: RungCondition, other: RungCondition) -> RungCondition {
        let id = self.graph.elements[self.statement].id;
        let count = self.tags.len();
        let one = self.steady(one, &format!("xor{id}_{count}"));
        let other = self.steady(other, &format!("xor{id}_{count}_other"));
        RungCondition::any([
            RungCondition::all([one.clone(), other.clone().opposite()]),
            RungCondition::all([one.opposite(), other]),
        ])
    }

    /// The value at a pin.
    fn pin_number(&mut self, pin: &BlockPin) -> Result<IecFormula, String> {
        match pin.modifier == Modifier::default() {
            true => self.number(&pin.input),
            false => Err("a negated value that is no BOOL".to_owned()),
        }
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
                .map(|pin| match find(block, pin) {
                    Some(pin) => self.pin_number(pin),
                    None => Err(format!("LIMIT without {pin}")),
                })
                .collect(),
            _ => pins.iter().map(|pin| self.pin_number(pin)).collect(),
        };
        let values = values?;
        let kind = common(&values)?;
        if are_mixed(&values) && name != "MOVE" {
            self.differences.insert(MIXED.to_owned());
        }
        let mixed_whole =
            |value: &IecFormula| matches!(value.kind, FormulaType::Known(IecType::Whole { .. }));
        let values: Result<Vec<IecFormula>, String> = values
            .into_iter()
            .map(|value| match matches!(kind, IecType::Whole { .. }) && mixed_whole(&value) {
                true => Ok(value),
                false => value.fitted(kind),
            })
            .collect();
        let values = values?;
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

    /// SEL: the second value while G is ON, else the first.
    fn selection(&mut self, block: &BlockElement) -> Result<FunctionResult, String> {
        let pin =
            |name: &str| find(block, name).ok_or_else(|| format!("SEL without its input {name}"));
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

    /// A conversion of types.
    fn conversion(
        &mut self,
        types: [&str; 2],
        pins: &[&BlockPin],
    ) -> Result<FunctionResult, String> {
        let [pin] = pins else { return Err("a conversion of several values".to_owned()) };
        let (from, to) = (IecType::named(types[0])?, IecType::named(types[1])?);
        let refused = || Err(format!("the conversion {}_TO_{}", types[0], types[1]));
        if from == IecType::Bool {
            if !matches!(to, IecType::Whole { .. }) {
                return refused();
            }
            let power = self.pin_power(Some(pin))?;
            let id = self.graph.elements[self.statement].id;
            let power = if is_plain(&power) { power } else { self.kept(power, &format!("in{id}")) };
            let mut reads = Vec::new();
            super::power::places(&power, &mut reads);
            let texts = vec![power.text()];
            let calculation =
                FunctionCalculation { kind: to, texts, reads, is_bit: true, guard: None };
            return Ok(FunctionResult::Number(calculation));
        }
        let value = self.pin_number(pin)?.fitted(from)?;
        let text = match (from, to) {
            (IecType::Whole { .. }, IecType::Bool) => {
                let power = RungCondition::compare(&value.text, "!=", "0", value.reads);
                return Ok(FunctionResult::Power(power));
            }
            (IecType::Whole { .. }, IecType::Whole { .. }) if to.holds(from) => value.text,
            (IecType::Whole { .. }, IecType::Whole { .. }) => to.cut(&value.text),
            (IecType::Whole { .. }, IecType::Real) => value.text,
            _ => return refused(),
        };
        let (texts, reads) = (vec![text], value.reads);
        let calculation =
            FunctionCalculation { kind: to, texts, reads, is_bit: false, guard: None };
        Ok(FunctionResult::Number(calculation))
    }
}

/// Whether a condition is one bit.
fn is_plain(power: &RungCondition) -> bool {
    matches!(power, RungCondition::Bit { text, .. } if !text.contains('('))
}

/// The pin of a function's result.
fn result_pin(block: &BlockElement) -> Result<usize, String> {
    let found = block.outputs.iter().position(|pin| pin.name != "ENO");
    found.ok_or_else(|| format!("{} without a result", block.kind))
}
