//! The conditions of transitions, as a ladder body finds them.
//!
//! A transition is judged before its chart does anything else in a scan. Contacts are read then.
//! The blocks and edges that lead to it are executed later in the scan, as an action of the first
//! initial step: so is the text that Beremiz and OpenPLC generate. Their values are therefore
//! those of the last scan.

use super::body::LadderBody;
use super::calculations::compared;
use super::elements::{BlockElement, ChartCondition, ConditionSource};
use super::formula::FormulaType;
use super::literals::{IecLiteral, literal};
use super::memory::LocatedPlace;
use super::sfc_text::{TextCondition, TextOperator, read};
use super::types::IecType;
use crate::condition::RungCondition;

impl LadderBody<'_, '_> {
    /// Finds the condition of a transition.
    ///
    /// # Errors
    /// rungd cannot say it.
    pub(super) fn judge(&mut self, at: usize, condition: &ChartCondition) -> Result<(), String> {
        let power = match &condition.source {
            ConditionSource::Lines(lines) if lines.is_empty() => {
                return Err("a transition without a condition".to_owned());
            }
            ConditionSource::Lines(lines) => {
                self.begin(lines)?;
                self.power(lines)?
            }
            ConditionSource::Text(text) => {
                let said = read(text).ok_or_else(|| format!("a transition in ST: `{text}`"))?;
                self.said(&said)?
            }
            ConditionSource::Known { condition, reads_steps } => {
                self.reads_steps |= reads_steps;
                condition.clone()
            }
            ConditionSource::Refused(why) => return Err(why.clone()),
        };
        let power = if condition.is_negated { power.opposite() } else { power };
        self.conditions.insert(at, power);
        Ok(())
    }

    /// What a text says.
    fn said(&mut self, text: &TextCondition) -> Result<RungCondition, String> {
        let (operator, [left, right]) = match text {
            TextCondition::Value(text) => return self.bit_of(text),
            TextCondition::Not(inner) => return Ok(self.said(inner)?.opposite()),
            TextCondition::Both { operator, sides } => (*operator, &**sides),
        };
        let name = match operator {
            TextOperator::Compare(name) if !self.is_bit(left)? && !self.is_bit(right)? => {
                return self.compare(name, [left, right]);
            }
            TextOperator::And => {
                return Ok(RungCondition::all([self.said(left)?, self.said(right)?]));
            }
            TextOperator::Or => {
                return Ok(RungCondition::any([self.said(left)?, self.said(right)?]));
            }
            TextOperator::Xor => "NE",
            TextOperator::Compare(name) => name,
        };
        let (one, other) = (self.said(left)?, self.said(right)?);
        match (name, one, other) {
            ("EQ", one, RungCondition::Constant(is_on)) if is_on => Ok(one),
            ("EQ", one, RungCondition::Constant(_)) => Ok(one.opposite()),
            ("EQ", one, other) => Ok(self.differ(one, other).opposite()),
            ("NE", one, other) => Ok(self.differ(one, other)),
            (name, _, _) => Err(format!("the function {name} of BOOLs")),
        }
    }

    /// Whether a text says a BOOL.
    fn is_bit(&mut self, text: &TextCondition) -> Result<bool, String> {
        let TextCondition::Value(text) = text else { return Ok(true) };
        match literal(text) {
            Some(literal) => Ok(matches!(literal, IecLiteral::Bool(_))),
            None if self.is_undeclared(text) => Ok(true),
            None => Ok(self.read(text, false)?.kind == IecType::Bool),
        }
    }

    fn compare(&mut self, name: &str, sides: [&TextCondition; 2]) -> Result<RungCondition, String> {
        let mut values = Vec::new();
        for side in sides {
            let TextCondition::Value(text) = side else {
                return Err("a compare of BOOLs".to_owned());
            };
            values.push(self.value_of(text)?);
        }
        let is_literal =
            |value: &super::formula::IecFormula| matches!(value.kind, FormulaType::Literal(_));
        if values.iter().all(is_literal) {
            return Err("a compare of two constants".to_owned());
        }
        let (_, values) = self.alike(name, values)?;
        compared(name, &values).ok_or_else(|| format!("the function {name}"))
    }

    /// The bit that keeps the edge of a contact for a transition.
    pub(super) fn chart_edge(&mut self, contact: usize) -> LocatedPlace {
        let graph = self.graph;
        let (id, at) = (graph.elements[contact].id, graph.elements[self.statement].id);
        self.own_tag(&format!("edge_{id}_at_{at}"), IecType::Bool)
    }

    /// Keeps the edge of a contact for the next judgement.
    pub(super) fn sense_edge(&mut self, contact: usize, edge: RungCondition) {
        let bit = self.chart_edge(contact);
        let when = self.terms(edge);
        self.push(when, format!("OUT {}", bit.text), &bit.place);
    }

    /// Whether the ENO of a block is known before it is executed.
    ///
    /// # Errors
    /// It has an EN, and a transition asks for it.
    pub(super) fn certain_enable(&self, block: &BlockElement) -> Result<(), String> {
        let has_enable = block.inputs.iter().any(|pin| pin.name == "EN" && !pin.input.is_empty());
        match self.is_judging && has_enable {
            true => Err(format!("a transition that the ENO of a {} leads to", block.kind)),
            false => Ok(()),
        }
    }
}
