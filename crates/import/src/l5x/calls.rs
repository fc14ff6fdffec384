//! Calls: JSR with its values, RET, jumps, and Add-On Instructions.

use super::call_book::{OwnInstruction, RoutineKey, prescan_rung};
use super::formula::LogixFormula;
use super::locate::Index;
use super::memory::LogixMemory;
use super::path::whole;
use super::rll::RllInstruction;
use super::translate::{BlockNature, Terms, Translation, operand};
use super::types::Kind;
use crate::condition::TouchedPlace;
use crate::model::{
    Action, ActionForm, ProjectBlock, ProjectBlockKind, ProjectRung, RungBody, RungStep,
    UseArgument,
};

impl Translation<'_> {
    /// JSR, SBR, RET, TND, JMP, LBL.
    pub(super) fn call(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        match instruction.name.as_str() {
            "JSR" => self.jump_to_subroutine(instruction, when),
            "SBR" | "LBL" => Ok(()),
            "JMP" => {
                let label = operand(instruction, 0)?.to_lowercase();
                let bit = self.labels.get(&label).cloned();
                let bit =
                    bit.ok_or("a jump that is not forward, not last, or without its label")?;
                self.push(when.clone(), format!("SET {bit}"), vec![TouchedPlace::of(&bit)]);
                Ok(())
            }
            name => match self.block {
                BlockNature::Routine => {
                    let all = vec![TouchedPlace::everything()];
                    self.push(when.clone(), "RETURN".to_owned(), all);
                    Ok(())
                }
                BlockNature::Main | BlockNature::JumpedSegment | BlockNature::ProjectTemplate => {
                    Err(format!("{name} outside of a subroutine, or within a jump"))
                }
            },
        }
    }

    fn jump_to_subroutine(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        if self.block == BlockNature::ProjectTemplate {
            return Err("JSR in an Add-On Instruction".to_owned());
        }
        let name = operand(instruction, 0)?.to_owned();
        let key = RoutineKey { scope: self.scope, name: name.to_lowercase() };
        let callee = self.calls.routines.get(&key);
        let callee =
            callee.cloned().ok_or_else(|| format!("no routine `{name}` in the program"))?;
        let target = callee.name.map_err(|why| format!("the routine `{name}` {why}"))?;
        let count = instruction.operands.get(1).and_then(|text| whole(text)).unwrap_or(0);
        let count = usize::try_from(count).unwrap_or(0);
        let given: Vec<String> = instruction.operands.iter().skip(2).cloned().collect();
        let (inputs, outputs) = given.split_at(count.min(given.len()));
        for (from, to) in inputs.iter().zip(&callee.inputs) {
            let value = LogixFormula::of(&self.value(from)?)?;
            self.store(to, value, when)?;
        }
        self.push(when.clone(), format!("CALL {target}"), vec![TouchedPlace::everything()]);
        if !outputs.is_empty() {
            let sources = callee.outputs.ok_or("RETs with different values")?;
            let when = vec![{
                let power = self.whole(when.clone());
                self.term(power)
            }];
            for (to, from) in outputs.iter().zip(&sources) {
                let value = LogixFormula::of(&self.value(from)?)?;
                self.store(to, value, &when)?;
            }
        }
        Ok(())
    }

    /// A call of an Add-On Instruction.
    pub(super) fn own_instruction(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        let calls = self.calls;
        let found = calls.instructions.get(&instruction.name.to_lowercase());
        let own = found.ok_or_else(|| format!("the instruction {}", instruction.name))?;
        let own = own.as_ref().map_err(|why| format!("{}: {why}", instruction.name))?;
        let text = operand(instruction, 0)?.to_owned();
        let kind = Kind::Struct(instruction.name.to_lowercase());
        let instance = self.written(&text, &kind)?;
        self.memory.variables[instance.variable].is_read = true;
        if instance.kind != kind || !instance.dimensions.is_empty() {
            return Err(format!("`{text}` is no {}", instruction.name));
        }
        if matches!(instance.index, Index::Moving(_)) {
            return Err("an Add-On Instruction of an element with a moving index".to_owned());
        }
        let mut arguments = self.parts(own, &text)?;
        let required = own.parameters.iter().filter(|parameter| parameter.is_required);
        let mut results = Vec::new();
        for (at, parameter) in required.enumerate() {
            let given = operand(instruction, at + 1)?.to_owned();
            let member = format!("{text}.{}", parameter.name);
            match parameter.usage.as_str() {
                "InOut" => arguments.extend(self.reference(own, &parameter.name, &given)?),
                "Output" => results.push((member, given)),
                _ => {
                    let value = LogixFormula::of(&self.value(&given)?)?;
                    self.store(&member, value, when)?;
                }
            }
        }
        self.use_own(own, &instance.text, arguments, when)?;
        if !results.is_empty() {
            let power = self.whole(when.clone());
            let when = vec![self.term(power)];
            for (from, to) in results {
                let value = LogixFormula::of(&self.value(&from)?)?;
                self.store(&to, value, &when)?;
            }
        }
        Ok(())
    }

    /// The use of an Add-On Instruction's template: in its place, if it has no condition, else in a
    /// subroutine of its own, because without power its logic is not executed at all.
    fn use_own(
        &mut self,
        own: &OwnInstruction,
        instance: &str,
        arguments: Vec<UseArgument>,
        when: &Terms,
    ) -> Result<(), String> {
        let wish = instance.replace(['[', ']', '.'], "_");
        let name = self.memory.names.fresh(&format!("{wish}_logic"));
        if let Some(template) = &own.prescan {
            let name = self.memory.names.fresh(&format!("{wish}_prescan"));
            self.prescan.instance(self.scope, prescan_rung(template, &name, &arguments));
        }
        let everything = vec![TouchedPlace::everything()];
        if when.is_empty() {
            let form =
                ActionForm::Use { template: own.template.clone(), name, contact: None, arguments };
            self.steps
                .push(RungStep { when: Vec::new(), action: Action { form, writes: everything } });
            return Ok(());
        }
        if self.block == BlockNature::ProjectTemplate {
            return Err("an Add-On Instruction within another, under a condition".to_owned());
        }
        let subroutine = self.memory.names.fresh(&format!("{wish}_call"));
        self.own_blocks.push(ProjectBlock {
            kind: ProjectBlockKind::Subroutine,
            name: subroutine.clone(),
            doc: format!("{} of {instance}, executed while its rung has power", own.template),
            rungs: vec![ProjectRung {
                name: Some(name),
                doc: String::new(),
                body: RungBody::Use { template: own.template.clone(), arguments },
            }],
            stages: Vec::new(),
        });
        self.push(when.clone(), format!("CALL {subroutine}"), everything);
        Ok(())
    }

    /// The arguments for the parts of an instance.
    fn parts(&mut self, own: &OwnInstruction, text: &str) -> Result<Vec<UseArgument>, String> {
        let mut arguments = Vec::new();
        for part in &own.parts {
            arguments.push(self.argument(&part.parameter, text, &part.path)?);
        }
        Ok(arguments)
    }

    /// The arguments for an operand that the instruction uses by reference.
    fn reference(
        &mut self,
        own: &OwnInstruction,
        parameter: &str,
        given: &str,
    ) -> Result<Vec<UseArgument>, String> {
        let mut arguments = Vec::new();
        for reference in own.references.iter().filter(|one| one.name == parameter) {
            let located = self.written(given, &reference.kind)?;
            self.memory.variables[located.variable].is_read = true;
            if located.kind != reference.kind {
                return Err(format!("`{given}` is of another type than `{parameter}`"));
            }
            arguments.push(self.argument(
                &reference.part.parameter,
                given,
                &reference.part.path,
            )?);
        }
        Ok(arguments)
    }

    /// An argument for a part of a structure.
    pub(super) fn argument(
        &mut self,
        parameter: &str,
        text: &str,
        path: &str,
    ) -> Result<UseArgument, String> {
        let whole = if path.is_empty() { text.to_owned() } else { format!("{text}.{path}") };
        let part = self.written(&whole, &Kind::Dint)?;
        if matches!(part.index, Index::Moving(_))
            || !part.dimensions.is_empty() && part.index != Index::None
        {
            return Err("an instruction of an element with arrays in it".to_owned());
        }
        Ok(UseArgument { name: parameter.to_owned(), value: part.text })
    }
}

impl LogixMemory {
    /// The parts of a variable that have a tag, in the order of their paths.
    pub(crate) fn parts_of(&self, id: usize) -> Vec<(String, String)> {
        let parts = self.variables[id].parts.iter();
        let mut parts: Vec<(String, String)> =
            parts.map(|(path, tag)| (path.clone(), tag.clone())).collect();
        parts.sort();
        parts
    }
}
