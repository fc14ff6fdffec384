//! The power at a point of a ladder body, as a condition.
//!
//! Several lines into one point are parallel. What several lines share is written once: as common
//! contacts before parallel branches, or, where that is not possible, in a bit of its own; so the
//! size of the rungs grows with the size of the graph only.

use super::body::{BlockValue, EdgeUse, ElementCalls, LadderBody, TimedEdge};
use super::elements::{BlockPin, Connection, ElementBody, Modifier, SensedEdge};
use super::graph::BlockOutput;
use super::literals::{IecLiteral, literal};
use super::memory::LocatedPlace;
use super::types::IecType;
use crate::condition::{RungCondition, TouchedPlace};

/// Most contacts that are written several times.
const SHARED_MAX: usize = 2;
/// Most contacts of a condition within `rise(…)`, or as an argument.
pub(super) const INNER_MAX: usize = 6;

impl LadderBody<'_, '_> {
    /// Begins with what acts next: nothing is known about the power of its contacts.
    pub(super) fn begin(&mut self, input: &[Connection]) -> Result<(), String> {
        self.powers.clear();
        self.uses.clear();
        let mut seen = std::collections::HashSet::new();
        let mut waiting: Vec<&Connection> = input.iter().collect();
        let graph = self.graph;
        while let Some(connection) = waiting.pop() {
            let at = graph.source(connection)?;
            *self.uses.entry(at).or_default() += 1;
            if !seen.insert(at) {
                continue;
            }
            match &graph.elements[at].body {
                ElementBody::Continuation { name } => {
                    waiting.extend(graph.continued(name).unwrap_or_default());
                }
                ElementBody::Contact { input, .. } | ElementBody::Coil { input, .. } => {
                    waiting.extend(input);
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

    /// The power of all lines into a point.
    ///
    /// # Errors
    /// A line comes from something that rungd cannot say; the lines make a loop.
    pub(super) fn power(&mut self, input: &[Connection]) -> Result<RungCondition, String> {
        let too_deep = "a loop of connections, or more contacts in series than 250";
        self.deeper(too_deep, |body| {
            let mut lines = Vec::new();
            for connection in input {
                let line = body.line(connection)?;
                if !lines.contains(&line) {
                    lines.push(line);
                }
            }
            Ok(parallel(lines))
        })
    }

    /// The power at a pin; nothing connected is OFF.
    pub(super) fn pin_power(&mut self, pin: Option<&BlockPin>) -> Result<RungCondition, String> {
        let Some(pin) = pin.filter(|pin| !pin.input.is_empty()) else {
            return Ok(RungCondition::Constant(false));
        };
        let power = self.power(&pin.input)?;
        let id = self.graph.elements[self.statement].id;
        let power = match pin.modifier == Modifier::default() {
            true => power,
            false => self.small(power, &format!("{}_{id}", pin.name)),
        };
        modified(power, pin.modifier)
    }

    /// The power of one line.
    fn line(&mut self, connection: &Connection) -> Result<RungCondition, String> {
        let graph = self.graph;
        let at = graph.source(connection)?;
        match &graph.elements[at].body {
            ElementBody::LeftRail => Ok(RungCondition::Constant(true)),
            ElementBody::Contact { variable, modifier, input } => {
                if let Some(power) = self.powers.get(&at) {
                    return Ok(power.clone());
                }
                if input.is_empty() {
                    return Err(format!("the contact {variable} is not connected"));
                }
                let before = self.power(input)?;
                let own = self.contact(at, variable, *modifier)?;
                let power = self.shared(at, RungCondition::all([before, own]));
                self.powers.insert(at, power.clone());
                Ok(power)
            }
            ElementBody::Coil { input, .. } => {
                if let Some(power) = self.powers.get(&at) {
                    return Ok(power.clone());
                }
                let before = self.power(input)?;
                let power = self.shared(at, before);
                self.powers.insert(at, power.clone());
                Ok(power)
            }
            ElementBody::InVariable { expression, is_negated } => {
                let value = self.bit_of(expression)?;
                Ok(if *is_negated { value.opposite() } else { value })
            }
            ElementBody::InOutVariable { expression, .. } => self.bit_of(expression),
            ElementBody::Block(_) => self.output_power(at, connection),
            ElementBody::Continuation { name } => {
                self.continued(name, |body, lines| body.power(lines))
            }
            ElementBody::Other { name, .. } => Err(format!("the element `{name}`")),
            ElementBody::RightRail
            | ElementBody::OutVariable { .. }
            | ElementBody::Connector { .. }
            | ElementBody::Condition(_)
            | ElementBody::Comment(_) => Err("a line from an element without an output".to_owned()),
        }
    }

    /// A condition that is used several times and is not small gets a bit.
    fn shared(&mut self, at: usize, power: RungCondition) -> RungCondition {
        let uses = self.uses.get(&at).copied().unwrap_or(1);
        let is_small = weight(&power) <= SHARED_MAX;
        if uses < 2 || is_small {
            return power;
        }
        let id = self.graph.elements[at].id;
        self.kept(power, &format!("{id}_at_{}", self.graph.elements[self.statement].id))
    }

    /// Keeps the value that a condition has now in a bit.
    pub(super) fn kept(&mut self, power: RungCondition, wish: &str) -> RungCondition {
        self.lines += 1;
        let bit = self.own_tag(&format!("line_{wish}_{}", self.lines), IecType::Bool);
        let when = self.terms(power);
        self.push(when, format!("OUT {}", bit.text), &bit.place);
        RungCondition::bit(bit.text)
    }

    /// A condition that can stand within another text.
    pub(super) fn small(&mut self, power: RungCondition, wish: &str) -> RungCondition {
        match weight(&power) <= INNER_MAX {
            true => power,
            false => self.kept(power, wish),
        }
    }

    /// What a contact says.
    fn contact(
        &mut self,
        at: usize,
        variable: &str,
        modifier: Modifier,
    ) -> Result<RungCondition, String> {
        let contact = EdgeUse { statement: self.statement, contact: at };
        if let Some(edge) = self.edges.get(&contact).cloned() {
            // It was evaluated when the line was followed.
            if self.is_changed(&edge.condition, edge.at) {
                self.found.kept_edges.insert(contact);
            }
            return Ok(edge.condition);
        }
        let bit = self.bit_of(variable)?;
        match self.is_judging && modifier.edge != SensedEdge::None {
            true => Ok(RungCondition::bit(self.chart_edge(at).text)),
            false => modified(bit, modifier),
        }
    }

    /// Evaluates the edge of a contact, when a line is followed to it.
    pub(super) fn evaluate_edge(
        &mut self,
        at: usize,
        variable: &str,
        modifier: Modifier,
    ) -> Result<(), String> {
        let contact = EdgeUse { statement: self.statement, contact: at };
        if self.edges.contains_key(&contact) {
            return Ok(());
        }
        let bit = self.bit_of(variable)?;
        let edge = modified(bit, modifier)?;
        if matches!(self.graph.elements[self.statement].body, ElementBody::Condition(_)) {
            self.sense_edge(at, edge);
            return Ok(());
        }
        let condition = match self.needs.keeps_all || self.needs.kept_edges.contains(&contact) {
            true => {
                let id = self.graph.elements[at].id;
                let statement = self.graph.elements[self.statement].id;
                self.kept(edge, &format!("edge_{id}_at_{statement}"))
            }
            false => edge,
        };
        self.edges.insert(contact, TimedEdge { condition, at: self.steps.len() });
        Ok(())
    }

    /// The bit that a text names, or the constant that it is.
    pub(super) fn bit_of(&mut self, text: &str) -> Result<RungCondition, String> {
        match literal(text) {
            Some(IecLiteral::Bool(is_on)) => return Ok(RungCondition::Constant(is_on)),
            Some(IecLiteral::Whole(value @ 0..=1)) => {
                return Ok(RungCondition::Constant(value == 1));
            }
            Some(_) => return Err(format!("the number `{text}` where power is wanted")),
            None => {}
        }
        let located = self.read(text, true)?;
        power_of(&located, text)
    }

    /// The power of an output of a block.
    fn output_power(
        &mut self,
        at: usize,
        connection: &Connection,
    ) -> Result<RungCondition, String> {
        let pin = self.graph.output(at, connection)?;
        let output = BlockOutput { element: at, pin };
        let ElementBody::Block(block) = &self.graph.elements[at].body else {
            return Err("a line from an element without an output".to_owned());
        };
        let modifier = block.outputs[pin].modifier;
        let power = match self.output_value(output)? {
            BlockValue::Power { condition, at } => {
                if self.is_changed(&condition, at) {
                    self.found.kept.insert(output);
                }
                condition
            }
            BlockValue::Kept(located) => power_of(&located, &block.kind)?,
        };
        modified(power, modifier)
    }
}

/// The number of contacts of a condition, with those within `rise(…)`.
pub(super) fn weight(condition: &RungCondition) -> usize {
    match condition {
        RungCondition::Bit { text, .. } if text.starts_with("rise(") => {
            1 + text.matches(['&', '|']).count()
        }
        RungCondition::Constant(_) | RungCondition::Bit { .. } | RungCondition::Compare { .. } => 1,
        RungCondition::Not(inner) => weight(inner),
        RungCondition::All(parts) | RungCondition::Any(parts) => parts.iter().map(weight).sum(),
    }
}

fn power_of(located: &LocatedPlace, text: &str) -> Result<RungCondition, String> {
    match located.kind {
        IecType::Bool => Ok(RungCondition::Bit {
            text: located.text.clone(),
            reads: vec![located.place.clone()],
        }),
        IecType::Whole { .. } | IecType::Time | IecType::Real => {
            Err(format!("`{text}`, which is no BOOL, where power is wanted"))
        }
    }
}

/// A condition as a pin or contact changes it. Of an edge the first execution is one: R_TRIG of a
/// bit that is ON, F_TRIG of a bit that is OFF.
pub(super) fn modified(power: RungCondition, modifier: Modifier) -> Result<RungCondition, String> {
    let edge = |power: RungCondition| {
        let mut reads = Vec::new();
        places(&power, &mut reads);
        RungCondition::Bit { text: format!("rise({})", power.text()), reads }
    };
    match (modifier.edge, modifier.is_negated) {
        (SensedEdge::None, false) => Ok(power),
        (SensedEdge::None, true) => Ok(power.opposite()),
        (SensedEdge::Rising, false) => Ok(edge(power)),
        (SensedEdge::Falling, false) => Ok(edge(power.opposite())),
        (SensedEdge::Rising | SensedEdge::Falling, true) => {
            Err("an edge of a negated value".to_owned())
        }
    }
}

/// The places that a condition reads.
pub(super) fn places(condition: &RungCondition, found: &mut Vec<TouchedPlace>) {
    match condition {
        RungCondition::Constant(_) => {}
        RungCondition::Bit { reads, .. } | RungCondition::Compare { reads, .. } => {
            found.extend(reads.iter().cloned());
        }
        RungCondition::Not(inner) => places(inner, found),
        RungCondition::All(parts) | RungCondition::Any(parts) => {
            parts.iter().for_each(|part| places(part, found));
        }
    }
}

/// Parallel lines; what all begin with stands before them.
fn parallel(lines: Vec<RungCondition>) -> RungCondition {
    if lines.contains(&RungCondition::Constant(true)) {
        return RungCondition::Constant(true);
    }
    let series = |line: &RungCondition| match line {
        RungCondition::All(parts) => parts.clone(),
        RungCondition::Constant(_)
        | RungCondition::Bit { .. }
        | RungCondition::Compare { .. }
        | RungCondition::Not(_)
        | RungCondition::Any(_) => vec![line.clone()],
    };
    let lines: Vec<RungCondition> =
        lines.into_iter().filter(|line| *line != RungCondition::Constant(false)).collect();
    let all: Vec<Vec<RungCondition>> = lines.iter().map(series).collect();
    let Some(first) = all.first() else { return RungCondition::Constant(false) };
    let common = (0..first.len())
        .take_while(|at| all.iter().all(|line| line.get(*at) == first.get(*at)))
        .count();
    let before = first[..common].to_vec();
    let rests = all.iter().map(|line| RungCondition::all(line[common..].to_vec()));
    let rest = RungCondition::any(rests);
    RungCondition::all(before.into_iter().chain([rest]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_parallel_lines_begin_with_stands_before_them() {
        let bit = RungCondition::bit;
        let one = RungCondition::all([bit("a"), bit("b"), bit("c")]);
        let other = RungCondition::all([bit("a"), bit("d")]);
        assert_eq!(parallel(vec![one.clone(), other]).text(), "a & ((b & c) | d)");
        assert_eq!(parallel(vec![one, bit("a")]).text(), "a");
        assert_eq!(parallel(vec![]).text(), "$Off");
        assert_eq!(parallel(vec![bit("a"), RungCondition::Constant(false)]).text(), "a");
    }

    #[test]
    fn an_edge_of_a_contact_begins_with_the_first_execution() {
        let falling = Modifier { edge: SensedEdge::Falling, ..Modifier::default() };
        let bit = RungCondition::bit("a");
        assert_eq!(modified(bit, falling).unwrap().text(), "rise(!a)");
    }
}
