//! COP of structures, and FLL that clears them: a copy of the record of the members without parts,
//! and one of every other member.
//!
//! Called by `files` for COP, CPS and FLL. A structure of Logix lies in several tags (`memory`),
//! each of which is one array over all elements on the way; so a run of structures is a run in each
//! of them.

use super::locate::{Index, LocatedOperand};
use super::memory::PartType;
use super::rll::RllInstruction;
use super::texts::LEFT_OUT;
use super::translate::{BlockNature, Terms, Translation};
use super::types::{Kind, Member, TypeOrigin};
use crate::condition::TouchedPlace;

/// Most copies of one COP, and most steps of its rung.
const COPIES_MAX: usize = 200;
const STEPS_MAX: usize = 2_000;

/// Deepest nesting of structures.
const DEPTH_MAX: usize = 16;

fn product(sizes: &[u32]) -> u32 {
    sizes.iter().fold(1, |all, size| all.saturating_mul(*size))
}

/// How many structures lie from a place on.
fn room(located: &LocatedOperand) -> u32 {
    match (&located.index, located.dimensions.is_empty()) {
        (Index::Fixed(at), true) => {
            product(&located.passed).saturating_sub(*at).min(located.within())
        }
        _ => product(&located.dimensions),
    }
}

/// Neighbours in the tag of a part of a variable.
#[derive(Clone)]
struct PartRun {
    variable: usize,
    /// The members' names with dots.
    path: String,
    /// The numbers of elements of all arrays on the way.
    sizes: Vec<u32>,
    first: u32,
    count: u32,
}

impl PartRun {
    /// The run that begins at a place; `count` is that of all elements there.
    fn of(located: &LocatedOperand) -> PartRun {
        let whole = product(&located.dimensions);
        let first = match located.index {
            Index::Fixed(at) => at.saturating_mul(whole),
            Index::None | Index::Moving(_) => 0,
        };
        PartRun {
            variable: located.variable,
            path: located.path.clone(),
            sizes: [&located.passed[..], &located.dimensions].concat(),
            first,
            count: whole,
        }
    }

    /// The run of a member.
    fn member(&self, member: &Member) -> PartRun {
        let dot = if self.path.is_empty() { "" } else { "." };
        let elements = product(&member.dimensions);
        PartRun {
            variable: self.variable,
            path: format!("{}{dot}{}", self.path, member.name),
            sizes: [&self.sizes[..], &member.dimensions].concat(),
            first: self.first.saturating_mul(elements),
            count: self.count.saturating_mul(elements),
        }
    }

    /// The elements of its tag. `is_record`: it has an index, whatever its size is.
    fn elements(&self, tag: &str, is_record: bool) -> String {
        let all = product(&self.sizes);
        match self.count {
            _ if self.sizes.is_empty() || all == 1 && !is_record => tag.to_owned(),
            1 => format!("{tag}[{}]", self.first),
            count => format!("{tag}[{}..{}]", self.first, self.first + count - 1),
        }
    }
}

/// A source and its target, of one type; without a source the target becomes 0.
#[derive(Clone, Copy)]
struct CopiedRuns<'r> {
    from: Option<&'r PartRun>,
    to: &'r PartRun,
}

/// A COP of structures.
struct StructureCopy<'c> {
    kind: &'c str,
    from: LocatedOperand,
    to: LocatedOperand,
    length: u32,
}

impl Translation<'_> {
    /// COP of structures; `None` if the target is none.
    pub(super) fn copy_structure(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
        length: u32,
    ) -> Option<Result<(), String>> {
        let target = instruction.operands.get(1)?;
        let to = self.written(target, &Kind::Dint).ok()?;
        let Kind::Struct(kind) = to.kind.clone() else { return None };
        let from = self.read(instruction.operands.first()?, &to.kind).ok()?;
        if from.kind != to.kind {
            return Some(Err("COP of structures of different types".to_owned()));
        }
        if self.memory.types.structure(&kind)?.origin == TypeOrigin::Use {
            self.differences.insert(format!(
                "`{target}` is of a type that the file does not declare: its members without \
                 parts, as far as rungs name them, are copied"
            ));
        }
        let copy = StructureCopy { kind: &kind, from, to, length };
        let is_moving = |one: &LocatedOperand| matches!(one.index, Index::Moving(_));
        Some(match is_moving(&copy.from) || is_moving(&copy.to) {
            true => self.copy_record(&copy, when),
            false => self.copy_runs(&copy, when),
        })
    }

    /// FLL of 0 into structures; `None` if the target is none.
    pub(super) fn clear_structure(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
        length: u32,
    ) -> Option<Result<(), String>> {
        if instruction.operands.first()? != "0" {
            return None;
        }
        let to = self.written(instruction.operands.get(1)?, &Kind::Dint).ok()?;
        let Kind::Struct(kind) = to.kind.clone() else { return None };
        if matches!(to.index, Index::Moving(_)) {
            return Some(Err("FLL of structures with a moving index".to_owned()));
        }
        let mut run = PartRun::of(&to);
        run.count = length.min(room(&to));
        if run.count < length && !to.path.is_empty() {
            return Some(Err("a copy beyond the end of a member, into the next ones".to_owned()));
        }
        let runs = CopiedRuns { from: None, to: &run };
        Some(if run.count == 0 { Ok(()) } else { self.bounded_copies(&kind, runs, when) })
    }

    /// One structure with a moving index: its record, if there is nothing beside it.
    fn copy_record(&mut self, copy: &StructureCopy<'_>, when: &Terms) -> Result<(), String> {
        let structure = self.memory.types.structure(copy.kind);
        let is_flat = structure.is_some_and(|one| one.members.iter().all(Member::is_field));
        if !is_flat {
            return Err("COP of a structure with parts, with a moving index".to_owned());
        }
        let (from, to) = (&copy.from, &copy.to);
        if copy.length != 1 || !from.dimensions.is_empty() || !to.dimensions.is_empty() {
            return Err("COP of several structures with a moving index".to_owned());
        }
        let is_computed =
            |one: &LocatedOperand| matches!(&one.index, Index::Moving(text) if text.contains(' '));
        if is_computed(from) || is_computed(to) {
            return Err("COP of a structure with a computed index".to_owned());
        }
        self.prescan.other(&to.place());
        let text = format!("COPY {} to={}", from.text, to.text);
        self.push(when.clone(), text, vec![TouchedPlace::of(&to.text)]);
        Ok(())
    }

    /// Structures at constant places.
    fn copy_runs(&mut self, copy: &StructureCopy<'_>, when: &Terms) -> Result<(), String> {
        let (mut from, mut to) = (PartRun::of(&copy.from), PartRun::of(&copy.to));
        let length = copy.length.min(room(&copy.to));
        if length > room(&copy.from) {
            return Err("COP beyond the end of its source".to_owned());
        }
        if length < copy.length && !copy.to.path.is_empty() {
            return Err("a copy beyond the end of a member, into the next ones".to_owned());
        }
        if length == 0 {
            return Ok(());
        }
        (from.count, to.count) = (length, length);
        self.bounded_copies(copy.kind, CopiedRuns { from: Some(&from), to: &to }, when)
    }

    /// The copies, as far as they are not too many.
    fn bounded_copies(
        &mut self,
        kind: &str,
        runs: CopiedRuns<'_>,
        when: &Terms,
    ) -> Result<(), String> {
        let begun = self.steps.len();
        self.copy_parts(kind, runs, when)?;
        match self.steps.len() - begun {
            0..=COPIES_MAX => Ok(()),
            count => Err(format!("COP of structures that would be {count} copies")),
        }
    }

    /// Copies the record of structures, then their other members.
    fn copy_parts(&mut self, kind: &str, runs: CopiedRuns<'_>, when: &Terms) -> Result<(), String> {
        let structure = self.memory.types.structure(kind).cloned();
        let structure = structure.ok_or_else(|| format!("no type {kind}"))?;
        let depth = runs.to.path.matches('.').count();
        if depth > DEPTH_MAX || self.steps.len() > STEPS_MAX {
            return Err("COP of a structure that is too large".to_owned());
        }
        let fields: Vec<&str> = structure
            .members
            .iter()
            .filter(|member| member.is_field())
            .map(|member| member.field.as_str())
            .collect();
        if !fields.is_empty() {
            self.copy_fields(&Kind::Struct(kind.to_owned()), &fields, runs, when)?;
        }
        for member in structure.members.iter().filter(|member| !member.is_field()) {
            if self.memory.types.is_text(&member.kind) {
                self.differences.insert(LEFT_OUT.to_owned());
                continue;
            }
            let from = runs.from.map(|from| from.member(member));
            let to = runs.to.member(member);
            let runs = CopiedRuns { from: from.as_ref(), to: &to };
            match &member.kind {
                Kind::Struct(inner) => self.copy_parts(inner, runs, when)?,
                Kind::Bool
                | Kind::Sint
                | Kind::Int
                | Kind::Dint
                | Kind::Usint
                | Kind::Uint
                | Kind::Real
                | Kind::Foreign(_) => self.copy_fields(&member.kind, &[], runs, when)?,
            }
        }
        Ok(())
    }

    /// Copies or clears a record or an array: several records column by column.
    fn copy_fields(
        &mut self,
        kind: &Kind,
        fields: &[&str],
        runs: CopiedRuns<'_>,
        when: &Terms,
    ) -> Result<(), String> {
        let is_record = !fields.is_empty();
        if is_record && !runs.to.sizes.is_empty() && self.block == BlockNature::ProjectTemplate {
            return Err("COP of an array of structures in an Add-On Instruction".to_owned());
        }
        let to = self.elements(kind, runs.to, is_record)?;
        let from = runs.from.map(|from| self.elements(kind, from, is_record)).transpose()?;
        let place = TouchedPlace::of(&to);
        self.prescan.other(&place);
        let is_several = runs.to.count > 1;
        let columns: Vec<String> = match is_record && (is_several || from.is_none()) {
            true => fields.iter().map(|field| format!(".{field}")).collect(),
            false => vec![String::new()],
        };
        for column in columns {
            let to = format!("{to}{column}");
            let text = match (from.as_ref().map(|from| format!("{from}{column}")), is_several) {
                (None, true) => format!("FILL 0 to={to}"),
                (None, false) => format!("MATH {to} = 0"),
                (Some(from), false) if *kind == Kind::Bool => format!("MATH {to} = {from}"),
                (Some(from), false) if !is_record => format!("MOVE {from} to={to}"),
                (Some(from), _) => format!("COPY {from} to={to}"),
            };
            self.push(when.clone(), text, vec![place.clone()]);
        }
        Ok(())
    }

    /// The elements of a part here.
    fn elements(&mut self, kind: &Kind, run: &PartRun, is_record: bool) -> Result<String, String> {
        let part = PartType { kind, dimensions: &run.sizes };
        let tag = self.memory.part(run.variable, &run.path, part)?;
        Ok(run.elements(&tag, is_record))
    }
}
