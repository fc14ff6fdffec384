//! The resolved program: every name is an address, and every operand has the right kind.
//!
//! Made by the resolver, checked by `check`, turned into an engine program by `lower`. It keeps the
//! author's structure (blocks, stages, rungs, branches, contacts in file order) and the place of
//! every part that a finding may point at. If a ladder has an error, parts with mistakes are left
//! out; then the program is checked, but never lowered or run.

use super::array::{Array, ArrayElement};
pub use super::block_kind::BlockKind;
use super::formula::{Formula, FormulaPart, NumberType};
pub use super::instruction::{Instruction, Value};
use super::layers::Layers;
use super::name_book::NameBook;
use super::record::RecordTag;
use super::scope::Scope;
pub use super::tag::{OfArray, Tag, TagMeaning};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::sync::{Arc, OnceLock};

pub use crate::source::atom::ConstantForm;
pub use crate::source::contact::{Comparison, Edge};
use crate::source::lost::LostTexts;
use crate::source::span::{FileId, Span};
pub use rungd_engine::isa::{
    Address, Bit, BlockId, LegName, MemorySizes, NumberSet, Real, StageId, Structure,
};

/// A whole program, of one or several ladder files.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// The name of the first ladder file's `[ladder]`, or its file name without `.toml`.
    pub name: String,
    /// `[ladder] doc` of the first file.
    pub doc: Option<String>,
    /// The memory sizes that it was resolved for.
    pub sizes: MemorySizes,
    /// All blocks: programs and tasks, in file order. `BlockId` is the index.
    pub blocks: Vec<Block>,
    /// Every stage's place: (block, index in the block's `stages`). `StageId` is the index.
    pub stages: Vec<(BlockId, usize)>,
    /// The scan order: every block except the built-in tasks, once.
    pub order: Vec<BlockId>,
    /// All tags, in file order.
    pub tags: Vec<Tag>,
    /// The tags of records, in file order; their fields are tags.
    pub records: Vec<RecordTag>,
    /// All names, for everything that shows them to people.
    pub names: Arc<NameBook>,
    /// The field devices that the ladder may name, by `DeviceId`.
    pub devices: Vec<String>,
    /// The operands that the ladder names, as written, in order of first appearance.
    pub operands: Vec<NamedOperand>,
    /// The arrays that the ladder names: whole, by a slice or range, or with a moving index.
    pub arrays: Vec<NamedArray>,
    /// `[ladder] allow`: warnings silenced in a whole file.
    pub allow: Vec<(FileId, String)>,
    /// The places of the rungs of templates.
    pub layers: Arc<Layers>,
    /// The templates that nothing uses, expanded to be checked; not part of the program.
    pub trial: Option<Box<Program>>,
    /// The missing parts of the files. A program with missing parts is never executed.
    pub lost: LostTexts,
    /// Its names for texts that people write.
    pub(super) scope: OnceLock<Arc<Scope>>,
}

/// A Program or Task.
#[derive(Clone, Debug)]
pub struct Block {
    /// Its number.
    pub id: BlockId,
    /// Its name.
    pub name: String,
    /// `doc`.
    pub doc: Option<String>,
    /// The place of its name.
    pub span: Span,
    /// Its kind.
    pub kind: BlockKind,
    /// Whether it runs from the first scan on (`Main`, or `autostart = true`).
    pub autostart: bool,
    /// Whether a restart keeps its Stages: `[retain] stages` names it.
    pub retains_stages: bool,
    /// Its own rungs.
    pub rungs: Vec<Rung>,
    /// Its stages; the first is the initial one. Empty in a Task.
    pub stages: Vec<Stage>,
}

impl Block {
    /// Whether it is the Program that always runs.
    pub fn is_main(&self) -> bool {
        self.kind == BlockKind::Program && self.name == "Main"
    }
}

/// A Stage of a Program.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Its number over the whole program.
    pub id: StageId,
    /// Its name, unique in its Program.
    pub name: String,
    /// `doc`.
    pub doc: Option<String>,
    /// The place of its name.
    pub span: Span,
    /// Its rungs.
    pub rungs: Vec<Rung>,
}

/// One rung. Either one leg `When`, or the legs of its one instruction.
#[derive(Clone, Debug)]
pub struct Rung {
    /// `name`.
    pub name: Option<String>,
    /// `doc`.
    pub doc: Option<String>,
    /// Names of the warnings silenced in this rung.
    pub allow: Vec<String>,
    /// From its header to the end of its last value; findings within belong to the rung.
    pub extent: Span,
    /// The whole name of the use of a template that it belongs to: `p1.lamp`.
    pub of_use: Option<String>,
    /// Its legs, in the order of the instruction's legs.
    pub legs: Vec<Leg>,
    /// `do`, in order.
    pub body: Vec<Instruction>,
    /// Its branches, in file order.
    pub branches: Vec<Branch>,
}

/// A series of contacts; all of them must be ON.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The leg.
    pub name: LegName,
    /// The elements of the array, left to right; never empty.
    pub contacts: Vec<Contact>,
}

/// Further contacts after the rung's own, and the instructions that they control.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Its contacts; ANDed with the rung's power.
    pub contacts: Vec<Contact>,
    /// `do`, in order.
    pub body: Vec<Instruction>,
}

/// A boolean over bits, edges and compares.
///
/// The place of `Not`, `All` and `Any` includes the parentheses around it, if it has any: a series
/// begins before its first contact exactly if it is in parentheses.
#[derive(Clone, Debug)]
pub enum Contact {
    /// A bit.
    Bit(Bit, Span),
    /// The bit of an array that a word selects.
    Element(ArrayElement, Span),
    /// `!`.
    Not(Box<Contact>, Span),
    /// `&`: two or more.
    All(Vec<Contact>, Span),
    /// `|`: two or more.
    Any(Vec<Contact>, Span),
    /// `rise(…)` and `fall(…)` of any contacts; each has a history of its own.
    Edge(Edge, Box<Contact>, Span),
    /// A compare of two values.
    Compare(Value, Comparison, Value, Span),
    /// A compare of expressions, or a bit whose index is an expression.
    Computed(Box<ComputedContact>, Span),
}

/// A contact that computes; it never touches a status bit. Behaviour: `docs/semantics.md`, section
/// 12.
#[derive(Clone, Debug, PartialEq)]
pub struct ComputedContact {
    /// The left side of the compare, or the bit.
    pub left: Formula,
    /// The compare; `None`: a bit, which is ON unless `left` is 0.
    pub compare: Option<ComputedCompare>,
}

/// The compare of a contact that computes.
#[derive(Clone, Debug, PartialEq)]
pub struct ComputedCompare {
    /// How it compares.
    pub comparison: Comparison,
    /// The right side.
    pub right: Formula,
    /// The type in which both sides are compared.
    pub number_type: NumberType,
}

impl ComputedContact {
    /// A compare of two values, as one that computes.
    pub fn of_values(left: Value, comparison: Comparison, right: Value) -> ComputedContact {
        let is_real = left.is_real() || right.is_real();
        let number_type = if is_real { NumberType::Real } else { NumberType::Integer };
        let compare = ComputedCompare { comparison, right: right.formula(), number_type };
        ComputedContact { left: left.formula(), compare: Some(compare) }
    }

    /// Its expressions, from left to right.
    pub fn formulas(&self) -> impl Iterator<Item = &Formula> {
        std::iter::once(&self.left).chain(self.compare.iter().map(|compare| &compare.right))
    }

    /// As [`ComputedContact::formulas`], to change them.
    pub fn formulas_mut(&mut self) -> impl Iterator<Item = &mut Formula> {
        let right = self.compare.iter_mut().map(|compare| &mut compare.right);
        std::iter::once(&mut self.left).chain(right)
    }

    /// The whole contact as one expression: not 0 while it is ON.
    pub fn condition(&self) -> Formula {
        let Some(ComputedCompare { comparison, right, number_type }) = &self.compare else {
            return self.left.clone();
        };
        let operator = FormulaPart::Binary(comparison.operator(), *number_type);
        let sides = self.left.parts.iter().chain(&right.parts).copied();
        Formula { parts: sides.chain([operator]).collect() }
    }
}

/// A bit or word, with the name that the ladder first uses for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedOperand {
    /// The name as written; of a member that an instruction names with its structure, the
    /// structure's name.
    base: Arc<str>,
    /// Such a member.
    member: Option<&'static str>,
    /// The bit or word; never a whole structure.
    pub address: Address,
}

impl NamedOperand {
    /// A bit or word with its name as written.
    pub(crate) fn new(name: &str, address: Address) -> NamedOperand {
        NamedOperand { base: name.into(), member: None, address }
    }

    /// The members of a structure with its name as written.
    pub(crate) fn members(name: &str, structure: Structure) -> impl Iterator<Item = NamedOperand> {
        let base: Arc<str> = name.into();
        let members = structure.members().iter().zip(structure.member_addresses());
        members.map(move |(member, address)| NamedOperand {
            base: Arc::clone(&base),
            member: Some(member),
            address,
        })
    }

    /// The name as written (`part_seen`, `X0`, `bottles.Done`, `Drain.Open`).
    pub fn name(&self) -> Cow<'_, str> {
        match self.member {
            Some(member) => Cow::Owned(format!("{}.{member}", self.base)),
            None => Cow::Borrowed(&self.base),
        }
    }
}

/// An array, slice or range that the ladder names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedArray {
    /// The name as written: `recipe`, `recipe[step]`, `D0..D9`.
    pub name: String,
    /// The array.
    pub array: Array,
    /// The index of the tag of its first element; `None` for a range.
    pub(crate) tag: Option<usize>,
    /// The number of the program's operands before it.
    pub(crate) behind: usize,
}

/// A part of a program that executes and terminates as a whole: a block's own rungs, or a Stage.
#[derive(Clone, Copy, Debug)]
pub struct ProgramPart<'p> {
    /// The block.
    pub block: &'p Block,
    /// The Stage; `None`: the block's own rungs.
    pub stage: Option<&'p Stage>,
    /// Its rungs.
    pub rungs: &'p [Rung],
}

impl Program {
    /// All parts in file order: for each block its own rungs, then its Stages.
    pub fn parts(&self) -> impl Iterator<Item = ProgramPart<'_>> {
        self.blocks.iter().flat_map(|block| {
            let own = ProgramPart { block, stage: None, rungs: &block.rungs };
            let stages = block.stages.iter();
            std::iter::once(own).chain(stages.map(move |stage| ProgramPart {
                block,
                stage: Some(stage),
                rungs: &stage.rungs,
            }))
        })
    }

    /// All instructions in file order, each with its block.
    pub fn instructions(&self) -> impl Iterator<Item = (&Block, &Instruction)> {
        self.parts().flat_map(|part| {
            let instructions = part.rungs.iter().flat_map(Rung::instructions);
            instructions.map(move |(_, instruction)| (part.block, instruction))
        })
    }

    /// All bits and words that the ladder names, in order of first appearance, each address once.
    /// For an array, its first elements, at most `most`.
    pub fn named(&self, most: usize) -> Vec<NamedOperand> {
        let mut all = Vec::new();
        let mut operands = self.operands.iter().cloned();
        let mut taken = 0;
        for named_array in &self.arrays {
            all.extend(operands.by_ref().take(named_array.behind - taken));
            taken = named_array.behind;
            all.extend(named_array.array.addresses().take(most).enumerate().map(
                |(at, address)| {
                    let tag = named_array.tag.and_then(|first| self.tags.get(first + at));
                    let name = tag.map_or_else(|| address.to_string(), |tag| tag.name.clone());
                    NamedOperand::new(&name, address)
                },
            ));
        }
        all.extend(operands);
        let mut seen = NumberSet::default();
        all.retain(|operand| seen.insert(operand.address));
        all
    }

    /// A program without anything, with memory of these sizes.
    pub fn empty(sizes: MemorySizes) -> Program {
        Program { sizes, ..Program::default() }
    }

    /// The block with this number.
    pub fn block(&self, id: BlockId) -> &Block {
        &self.blocks[id.0 as usize]
    }

    /// The stage with this number.
    pub fn stage(&self, id: StageId) -> &Stage {
        let (block, at) = self.stages[id.0 as usize];
        &self.block(block).stages[at]
    }
}

impl Rung {
    /// The rung for people, in a block or Stage: `rung count-bottles`, `rung 3`, and of a use among
    /// the rungs of a ladder `rung 3 (p1)`. `at`: its index in the block or Stage.
    pub fn label(&self, element: &str, at: usize) -> String {
        let mut text = String::new();
        self.write_label(element, at, &mut text);
        text
    }

    /// Adds the rung's label to a text.
    pub(crate) fn write_label(&self, element: &str, at: usize, text: &mut String) {
        let number = at + 1;
        let _ = match (&self.name, &self.of_use) {
            (Some(name), _) => write!(text, "rung {name}"),
            (None, Some(of_use)) if !is_in(element, of_use) => {
                write!(text, "rung {number} ({of_use})")
            }
            (None, _) => write!(text, "rung {number}"),
        };
    }

    /// Its instructions in file order, each with its branch.
    pub fn instructions(&self) -> impl Iterator<Item = (Option<&Branch>, &Instruction)> {
        let branches = self.branches.iter();
        let behind = branches.flat_map(|branch| branch.body.iter().map(move |i| (Some(branch), i)));
        self.body.iter().map(|instruction| (None, instruction)).chain(behind)
    }
}

/// Whether a name of a block or Stage shows that it belongs to this use.
fn is_in(element: &str, of_use: &str) -> bool {
    element.strip_prefix(of_use).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

impl Contact {
    /// The contacts that must all be ON.
    pub(crate) fn in_series(&self) -> &[Contact] {
        match self {
            Contact::All(parts, _) => parts,
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::Any(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => std::slice::from_ref(self),
        }
    }

    /// The contacts of which any one is enough.
    pub(crate) fn in_parallel(&self) -> &[Contact] {
        match self {
            Contact::Any(parts, _) => parts,
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::All(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => std::slice::from_ref(self),
        }
    }

    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            Contact::Bit(_, span)
            | Contact::Element(_, span)
            | Contact::Not(_, span)
            | Contact::All(_, span)
            | Contact::Any(_, span)
            | Contact::Edge(_, _, span)
            | Contact::Compare(_, _, _, span)
            | Contact::Computed(_, span) => *span,
        }
    }
}
