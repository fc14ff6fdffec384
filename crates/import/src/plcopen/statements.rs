//! What acts in a ladder body: coils, and variables at the end of a line.

use std::collections::HashSet;

use super::body::{ElementCalls, LadderBody};
use super::elements::{BlockPin, CoilStorage, Connection, ElementBody, Modifier, SensedEdge};
use super::formula::{FormulaType, IecFormula};
use super::graph::BlockOutput;
use super::literals::{IecLiteral, literal, named_type};
use super::memory::LocatedPlace;
use super::power::{modified, weight};
use super::types::IecType;
use crate::condition::RungCondition;

/// How a bit is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BitStore {
    Follow,
    Set,
    Reset,
}

impl LadderBody<'_, '_> {
    /// Lets a coil, a variable or a block act.
    ///
    /// # Errors
    /// rungd cannot say what it does.
    pub(super) fn act(&mut self, at: usize) -> Result<(), String> {
        self.depth = 0;
        let graph = self.graph;
        match &graph.elements[at].body {
            ElementBody::Coil { variable, modifier, input } => {
                self.coil(variable, *modifier, input)
            }
            ElementBody::OutVariable { expression, is_negated, input } => {
                self.out_variable(at, expression, *is_negated, input)
            }
            ElementBody::InOutVariable { expression, input } if !input.is_empty() => {
                self.out_variable(at, expression, false, input)
            }
            ElementBody::Block(_) => self.call(at),
            ElementBody::Condition(condition) if self.is_judging => self.judge(at, condition),
            ElementBody::Condition(condition) => self.follow(condition.lines(), false),
            ElementBody::Other { name, .. } => Err(format!("the element `{name}`")),
            ElementBody::LeftRail
            | ElementBody::RightRail
            | ElementBody::Contact { .. }
            | ElementBody::InVariable { .. }
            | ElementBody::InOutVariable { .. }
            | ElementBody::Connector { .. }
            | ElementBody::Continuation { .. }
            | ElementBody::Comment(_) => Ok(()),
        }
    }

    fn coil(
        &mut self,
        variable: &str,
        modifier: Modifier,
        input: &[Connection],
    ) -> Result<(), String> {
        if input.is_empty() {
            self.differences
                .insert(format!("the coil {variable} is not connected: it does nothing"));
            return Ok(());
        }
        self.follow(input, false)?;
        self.begin(input)?;
        let power = self.power(input)?;
        let bit = self.written(variable, true)?;
        if bit.kind != IecType::Bool {
            return Err(format!("a coil of `{variable}`, which is no BOOL"));
        }
        let store = match modifier.storage {
            CoilStorage::None => BitStore::Follow,
            CoilStorage::Set => BitStore::Set,
            CoilStorage::Reset => BitStore::Reset,
        };
        let is_plain = modifier.edge == SensedEdge::None && !modifier.is_negated;
        if store != BitStore::Follow && !is_plain {
            return Err("a coil that is set or reset by an edge or a negated value".to_owned());
        }
        let power =
            if modifier.edge == SensedEdge::None { power } else { self.small(power, "edge") };
        let power = modified(power, modifier)?;
        self.store_bit(&bit, power, store)
    }

    fn out_variable(
        &mut self,
        at: usize,
        expression: &str,
        is_negated: bool,
        input: &[Connection],
    ) -> Result<(), String> {
        if input.is_empty() {
            let text = format!("the variable {expression} is not connected: nothing writes it");
            self.differences.insert(text);
            return Ok(());
        }
        let ordered = self.graph.elements[at].order > 0;
        let target = self.written(expression, false)?;
        if let Some(output) = self.direct(at, input, ordered) {
            return self.call_into(output, Some(&target));
        }
        self.follow(input, ordered)?;
        self.begin(input)?;
        let enabled = self.enabled(input)?;
        if target.kind == IecType::Bool {
            let power = self.power(input)?;
            let power = if is_negated { power.opposite() } else { power };
            return self.assign_bit(&target, power, enabled);
        }
        if is_negated {
            return Err(format!("a negated value for `{expression}`"));
        }
        let value = self.number(input)?;
        let when = enabled.unwrap_or(RungCondition::Constant(true));
        self.store_number(&target, &value, when)
    }

    /// The output of a function that nothing but a variable uses, and that was not executed yet.
    fn direct(&self, at: usize, input: &[Connection], ordered: bool) -> Option<BlockOutput> {
        let [connection] = input else { return None };
        let element = self.graph.source(connection).ok()?;
        let ElementBody::Block(block) = &self.graph.elements[element].body else { return None };
        let pin = self.graph.output(element, connection).ok()?;
        let output = BlockOutput { element, pin };
        let is_own = self.graph.consumers(output) == [at];
        let is_result =
            block.result_pin() == Ok(pin) && block.outputs[pin].modifier == Modifier::default();
        let is_free = !ordered
            && self.graph.elements[element].order == 0
            && block.instance.is_none()
            && !self.called.contains(&element);
        (is_own && is_result && is_free).then_some(output)
    }

    /// The ENO of a block whose EN is connected, if a line comes from it alone: without it nothing
    /// is assigned.
    fn enabled(&mut self, input: &[Connection]) -> Result<Option<RungCondition>, String> {
        let [connection] = input else { return Ok(None) };
        let element = self.graph.source(connection)?;
        let ElementBody::Block(block) = &self.graph.elements[element].body else {
            return Ok(None);
        };
        let has_enable = block.inputs.iter().any(|pin| pin.name == "EN" && !pin.input.is_empty());
        if !has_enable {
            return Ok(None);
        }
        self.enable_output(element).map(Some)
    }

    /// Follows lines back to their beginnings: blocks on the way are executed, edges evaluated.
    ///
    /// # Errors
    /// A block cannot be executed.
    pub(super) fn follow(&mut self, input: &[Connection], ordered: bool) -> Result<(), String> {
        let mut seen = HashSet::new();
        self.follow_lines(input, ordered, &mut seen)
    }

    fn follow_lines(
        &mut self,
        input: &[Connection],
        ordered: bool,
        seen: &mut HashSet<usize>,
    ) -> Result<(), String> {
        let too_deep = "a loop of connections, or more than 250 elements in series";
        self.deeper(too_deep, |body| body.follow_each(input, ordered, seen))
    }

    fn follow_each(
        &mut self,
        input: &[Connection],
        ordered: bool,
        seen: &mut HashSet<usize>,
    ) -> Result<(), String> {
        let graph = self.graph;
        for connection in input {
            let at = graph.source(connection)?;
            if !seen.insert(at) {
                continue;
            }
            match &graph.elements[at].body {
                ElementBody::Contact { variable, modifier, input } => {
                    if modifier.edge != SensedEdge::None {
                        self.evaluate_edge(at, variable, *modifier)?;
                    }
                    self.follow_lines(input, ordered, seen)?;
                }
                ElementBody::Coil { input, .. } => self.follow_lines(input, ordered, seen)?,
                ElementBody::Block(_) if !ordered && !self.called.contains(&at) => {
                    self.call(at)?;
                }
                ElementBody::Continuation { name } => {
                    let lines = graph.continued(name).unwrap_or_default();
                    self.follow_lines(lines, ordered, seen)?;
                }
                ElementBody::LeftRail
                | ElementBody::RightRail
                | ElementBody::Block(_)
                | ElementBody::InVariable { .. }
                | ElementBody::OutVariable { .. }
                | ElementBody::InOutVariable { .. }
                | ElementBody::Connector { .. }
                | ElementBody::Comment(_)
                | ElementBody::Condition(_)
                | ElementBody::Other { .. } => {}
            }
        }
        Ok(())
    }

    /// Executes a block, and then goes on with what acted before.
    pub(super) fn call(&mut self, at: usize) -> Result<(), String> {
        if self.called.contains(&at) {
            return Ok(());
        }
        self.call_into(BlockOutput { element: at, pin: usize::MAX }, None)
    }

    fn call_into(
        &mut self,
        output: BlockOutput,
        target: Option<&LocatedPlace>,
    ) -> Result<(), String> {
        let before = self.statement;
        self.statement = output.element;
        self.called.insert(output.element);
        let done = self.run_block(output, target);
        self.statement = before;
        done
    }

    /// The value of a line that is no power.
    ///
    /// # Errors
    /// It is power, or a text of ST.
    pub(super) fn number(&mut self, input: &[Connection]) -> Result<IecFormula, String> {
        let [connection] = input else {
            return Err("several lines, or none, where a value is wanted".to_owned());
        };
        let graph = self.graph;
        let at = graph.source(connection)?;
        match &graph.elements[at].body {
            ElementBody::InVariable { expression, is_negated: false } => self.value_of(expression),
            ElementBody::InOutVariable { expression, .. } => self.value_of(expression),
            ElementBody::InVariable { .. } => Err("a negated value that is no BOOL".to_owned()),
            ElementBody::Block(block) => {
                let pin = graph.output(at, connection)?;
                if block.outputs[pin].modifier != Modifier::default() {
                    return Err("a negated value that is no BOOL".to_owned());
                }
                let located = self.kept_output(BlockOutput { element: at, pin })?;
                Ok(formula_of(&located))
            }
            ElementBody::Continuation { name } => {
                self.continued(name, |body, lines| body.number(lines))
            }
            ElementBody::LeftRail
            | ElementBody::RightRail
            | ElementBody::Contact { .. }
            | ElementBody::Coil { .. }
            | ElementBody::OutVariable { .. }
            | ElementBody::Connector { .. }
            | ElementBody::Comment(_)
            | ElementBody::Condition(_)
            | ElementBody::Other { .. } => Err("power where a value is wanted".to_owned()),
        }
    }

    /// The value at a pin.
    pub(super) fn pin_number(&mut self, pin: &BlockPin) -> Result<IecFormula, String> {
        match pin.modifier == Modifier::default() {
            true => self.number(&pin.input),
            false => Err("a negated value that is no BOOL".to_owned()),
        }
    }

    /// The value of a variable or a literal.
    pub(super) fn value_of(&mut self, text: &str) -> Result<IecFormula, String> {
        if let Some(value) = literal(text) {
            if matches!(value, IecLiteral::Time { is_rounded: true, .. }) {
                self.differences.insert(format!("`{text}` is rounded to whole ms"));
            }
            let formula = IecFormula::of_literal(value);
            return match named_type(text) {
                Some(named) => formula.fitted(named),
                None => Ok(formula),
            };
        }
        let located = self.read(text, false)?;
        Ok(formula_of(&located))
    }

    /// Writes a bit.
    fn store_bit(
        &mut self,
        bit: &LocatedPlace,
        power: RungCondition,
        store: BitStore,
    ) -> Result<(), String> {
        if bit.is_input {
            return Err("a write of an input".to_owned());
        }
        let text = &bit.text;
        match store {
            BitStore::Set | BitStore::Reset => {
                let verb = if store == BitStore::Set { "SET" } else { "RST" };
                let when = self.terms(power);
                self.push(when, format!("{verb} {text}"), &bit.place);
            }
            BitStore::Follow if self.may_drive(bit) => {
                let when = self.terms(power);
                self.push(when, format!("OUT {text}"), &bit.place);
            }
            BitStore::Follow => {
                let power = if weight(&power) > 1 { self.kept(power, text) } else { power };
                let (on, off) = (self.terms(power.clone()), self.terms(power.opposite()));
                self.push(on, format!("SET {text}"), &bit.place);
                self.push(off, format!("RST {text}"), &bit.place);
            }
        }
        Ok(())
    }

    /// A bit gets the value of a condition, if another one is fulfilled.
    ///
    /// # Errors
    /// It is an input.
    pub(super) fn assign_bit(
        &mut self,
        bit: &LocatedPlace,
        power: RungCondition,
        enabled: Option<RungCondition>,
    ) -> Result<(), String> {
        let Some(enabled) = enabled else { return self.store_bit(bit, power, BitStore::Follow) };
        let power = self.steady(power, &format!("{}_value", bit.text));
        let enabled = self.steady(enabled, &format!("{}_enabled", bit.text));
        // Both conditions before both instructions: the first one may change what they read.
        let on = self.terms(RungCondition::all([enabled.clone(), power.clone()]));
        let off = self.terms(RungCondition::all([enabled, power.opposite()]));
        self.push(on, format!("SET {}", bit.text), &bit.place);
        self.push(off, format!("RST {}", bit.text), &bit.place);
        Ok(())
    }

    /// A condition that can be written twice.
    pub(super) fn steady(&mut self, power: RungCondition, wish: &str) -> RungCondition {
        let has_edge =
            matches!(&power, RungCondition::Bit { text, .. } if text.starts_with("rise("));
        match weight(&power) > 2 || has_edge {
            true => self.kept(power, &wish.replace(['.', '[', ']'], "_")),
            false => power,
        }
    }

    /// A number gets a value, if a condition is fulfilled.
    ///
    /// # Errors
    /// The value is of another type.
    pub(super) fn store_number(
        &mut self,
        target: &LocatedPlace,
        value: &IecFormula,
        when: RungCondition,
    ) -> Result<(), String> {
        let text = self.stored(target, value)?;
        let when = self.terms(when);
        self.push(when, text, &target.place);
        Ok(())
    }

    /// The instruction that stores a value.
    pub(super) fn stored(
        &self,
        target: &LocatedPlace,
        value: &IecFormula,
    ) -> Result<String, String> {
        let to = &target.text;
        let is_cut = match value.kind {
            FormulaType::Known(kind) => {
                let both_whole =
                    matches!([kind, target.kind], [IecType::Whole { .. }, IecType::Whole { .. }]);
                both_whole && !target.kind.holds(kind)
            }
            FormulaType::Literal(_) => false,
        };
        if is_cut {
            return Ok(format!("MATH {to} = {}", target.kind.cut(&value.text)));
        }
        let value = value.clone().fitted(target.kind)?;
        match value.is_atom && target.kind != IecType::Time {
            true => Ok(format!("MOVE {} to={to}", value.text)),
            false => Ok(format!("MATH {to} = {}", value.text)),
        }
    }
}

/// The value of a place.
pub(super) fn formula_of(located: &LocatedPlace) -> IecFormula {
    IecFormula {
        text: located.text.clone(),
        kind: FormulaType::Known(located.kind),
        reads: vec![located.place.clone()],
        is_atom: true,
    }
}
