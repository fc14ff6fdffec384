//! Calls of function blocks and functions of the file: uses of their templates.

use super::body::{BlockOutputName, ElementCalls, LadderBody, UnitBlock, UnitInput};
use super::elements::{BlockElement, ElementBody};
use super::graph::BlockOutput;
use super::memory::LocatedPlace;
use super::types::IecType;
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{
    Action, ActionForm, ProjectBlock, ProjectBlockKind, ProjectRung, RungBody, RungStep,
    UseArgument,
};

/// Where the values of a call lie.
pub(super) struct UnitPlaces {
    pub(super) result: LocatedPlace,
    pub(super) outputs: Vec<OutputPlace>,
}

/// Where the value of an output lies.
pub(super) struct OutputPlace {
    pub(super) pin: usize,
    pub(super) place: LocatedPlace,
}

impl LadderBody<'_, '_> {
    /// A block with a condition at EN: a subroutine that is called while it is fulfilled.
    pub(super) fn enable(
        &mut self,
        at: usize,
        block: &BlockElement,
        begin: usize,
        enabled: Option<RungCondition>,
    ) -> Result<(), String> {
        let Some(enabled) = enabled else { return Ok(()) };
        let (Some(step), true) = (self.steps.pop(), self.steps.len() >= begin) else {
            return Ok(());
        };
        let id = self.graph.elements[at].id;
        let enabled = self.steady(enabled, &format!("en_{id}"));
        if let Some(pin) = block.outputs.iter().position(|pin| pin.name == "ENO") {
            let output = BlockOutput { element: at, pin };
            self.keep_output(output, enabled.clone());
        }
        self.call_while(&block.kind, step, enabled);
        Ok(())
    }

    /// Executes a use in a subroutine, which is called under a condition.
    fn call_while(&mut self, kind: &str, step: RungStep, enabled: RungCondition) {
        let ActionForm::Use { template, name, contact, mut arguments } = step.action.form else {
            return;
        };
        // What stands in the subroutine is evaluated in it.
        if let Some(contact) = contact {
            let power = RungCondition::all(step.when.into_iter().map(|term| term.condition));
            arguments.insert(0, UseArgument { name: contact.to_owned(), value: power.text() });
        }
        let subroutine = self.own_name(&format!("{name}_call"));
        let when = self.terms(enabled);
        self.blocks.push(ProjectBlock {
            kind: ProjectBlockKind::Subroutine,
            name: subroutine.clone(),
            doc: format!("{kind} {name}, executed while its EN is ON"),
            rungs: vec![ProjectRung {
                name: Some(name),
                doc: String::new(),
                body: RungBody::Use { template, arguments },
            }],
            stages: Vec::new(),
        });
        let form = ActionForm::Do(format!("CALL {subroutine}"));
        self.steps.push(RungStep { when, action: Action { form, writes: step.action.writes } });
    }

    /// A function block of the file: its inputs are written, then its template is used.
    pub(super) fn unit_block(
        &mut self,
        block: &BlockElement,
        unit: &UnitBlock,
        own: &str,
    ) -> Result<(), String> {
        let mut arguments = Vec::new();
        for input in &unit.inputs {
            let pin = block.input(&input.name).filter(|pin| !pin.input.is_empty());
            let Some(pin) = pin else {
                match input.is_reference {
                    true => {
                        return Err(format!("the input {} of {own} is not connected", input.name));
                    }
                    false => continue,
                }
            };
            if input.is_reference {
                let [connection] = &pin.input[..] else {
                    return Err(format!("several lines into {} of {own}", input.name));
                };
                let source = self.graph.source(connection)?;
                let (ElementBody::InVariable { expression, .. }
                | ElementBody::InOutVariable { expression, .. }) =
                    &self.graph.elements[source].body
                else {
                    return Err(format!("the input {} of {own} is no variable", input.name));
                };
                let located = self.written(expression, false)?;
                if located.kind != input.kind {
                    return Err(format!("{} of {own} is of another type", input.name));
                }
                arguments.push(UseArgument { name: input.tag.clone(), value: located.text });
                continue;
            }
            let target = member_place(own, &input.tag, input.kind);
            if input.kind == IecType::Bool {
                let power = self.pin_power(Some(pin))?;
                self.assign_bit(&target, power, None)?;
            } else {
                let value = self.number(&pin.input)?;
                self.store_number(&target, &value, RungCondition::Constant(true))?;
            }
        }
        let writes = match unit.is_open {
            true => vec![TouchedPlace::everything()],
            false => {
                let given = arguments.iter().map(|argument| TouchedPlace::of(&argument.value));
                given.chain([TouchedPlace::of(own)]).collect()
            }
        };
        let form = ActionForm::Use {
            template: unit.template.clone(),
            name: own.to_owned(),
            contact: None,
            arguments,
        };
        self.steps.push(RungStep { when: Vec::new(), action: Action { form, writes } });
        Ok(())
    }

    /// A function of the file: a use of its template of its own, as each call has variables of
    /// its own.
    ///
    /// # Errors
    /// It is not translated, or something about its call is not.
    pub(super) fn unit_function(
        &mut self,
        at: usize,
        unit: &UnitBlock,
        enabled: Option<&RungCondition>,
    ) -> Result<UnitPlaces, String> {
        let graph = self.graph;
        let Some(block) = graph.elements[at].body.block() else {
            return Err("a function that is no block".to_owned());
        };
        let kind = &block.kind;
        let result = unit.result.as_ref().ok_or_else(|| format!("the function {kind}"))?;
        if enabled.is_some() && self.is_template {
            return Err(format!("{kind} with a condition at EN, in a function or function block"));
        }
        let is_given = |name: &str| block.input(name).is_some_and(|pin| !pin.input.is_empty());
        if !unit.inputs.iter().any(|input| is_given(&input.name)) {
            return Err(format!("the function {kind} without a connected input"));
        }
        let is_open = |input: &&UnitInput| input.is_written && !is_given(&input.name);
        if let Some(input) = unit.inputs.iter().find(is_open) {
            let name = &input.name;
            return Err(format!("the input {name} of {kind}, which it writes, is not connected"));
        }
        let own = self.own_name(&format!("{kind}_{}", graph.elements[at].id));
        self.unit_block(block, unit, &own)?;
        if let Some(enabled) = enabled
            && let Some(step) = self.steps.pop()
        {
            self.call_while(kind, step, enabled.clone());
        }
        let mut places = UnitPlaces {
            result: member_place(&own, &result.tag, result.kind),
            outputs: Vec::new(),
        };
        for (pin, output) in block.outputs.iter().enumerate().skip(block.result_pin()? + 1) {
            let named = |member: &&BlockOutputName| member.name.eq_ignore_ascii_case(&output.name);
            if let Some(member) = unit.outputs.iter().find(named) {
                let place = member_place(&own, &member.tag, member.kind);
                places.outputs.push(OutputPlace { pin, place });
            }
        }
        Ok(places)
    }
}

/// A member of a use.
fn member_place(own: &str, tag: &str, kind: IecType) -> LocatedPlace {
    let text = format!("{own}.{tag}");
    let place = TouchedPlace::of(&text);
    LocatedPlace { text, kind, place, variable: None, is_input: false }
}
