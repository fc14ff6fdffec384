//! Resolves names to addresses. Finds names that are unknown, duplicate, read-only or of the wrong
//! kind.
//!
//! [`load_ladders`] takes the texts of one or several ladder files and returns the resolved
//! [`Program`]. `check` applies the rules to it, and `lower` turns it into an engine program. No
//! I/O.

pub(crate) mod array;
mod array_tags;
pub(crate) mod condition;
mod contact;
pub(crate) mod declare;
pub(crate) mod formula;
mod formula_constants;
mod formula_elements;
mod formula_resolver;
mod index;
pub mod instruction;
pub mod layers;
pub(crate) mod mistake;
mod operand;
mod operand_array;
pub(crate) mod operand_list;
pub(crate) mod operands;
mod order;
mod placement;
pub(crate) mod places;
pub(crate) mod priority;
pub mod program;
pub mod range;
pub(crate) mod reads;
mod rung;
pub mod scope;
pub(crate) mod stage_move;
mod tags;
mod template;
mod typed;
mod unit;
mod uses;
mod value;
pub(crate) mod writes;

use std::sync::{Arc, LazyLock};

use crate::isa::{Address, MemorySizes, NumberSet};
use crate::progress::{Progress, Step};
use crate::source::file_kind::LIBRARY;
use crate::source::finding::{Code, Finding, Severity, TABLE};
use crate::source::ladder::{self, Entry, Ladder};
use crate::source::lost::LostTexts;
use crate::source::nearest::KnownNames;
use crate::source::reader::Text;
use crate::source::room::Room;
use crate::source::span::{FileId, Located, SourceFile, Span};
use array::{Array, Element};
use layers::Layers;
use program::{NamedArray, NamedOperand, Program};
use scope::{Scope, Thing};
use template::pending::{Argument, Trial};

/// The inputs of a load besides the ladder files.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Sizes of the memory blocks.
    pub sizes: MemorySizes,
    /// `order` of a controller file.
    pub order: Option<Located<Vec<Text>>>,
    /// Whether a controller file lists the ladders.
    pub has_controller: bool,
    /// The field devices of a controller file, in its order.
    pub devices: Vec<Text>,
    /// The texts of a controller file that may be addresses or ranges: no tag with a `type` is
    /// placed there.
    pub addresses: Vec<String>,
    /// The number of the first file: spans of the ladder at index k have the file `first_file + k`.
    pub first_file: FileId,
    /// The progress of the load.
    pub progress: Progress,
}

/// Resolves the ladder files together as one program. The program is `None` if the findings contain
/// an error. The findings are in order of place.
pub fn load_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let (program, mut findings) = resolve_ladders(files, options);
    if let Some(program) = &program {
        findings = in_order(program.layers.told(findings));
        program.lost.keep_sure(&mut findings);
    }
    let refused = findings.iter().any(|f| f.severity() == Severity::Error);
    (program.filter(|program| !refused && program.lost.is_empty()), findings)
}

/// As [`load_ladders`], but returns the program despite errors, if all files can be read. Parts
/// with mistakes are left out, so that the rules can check the rest. Such a program must not be
/// lowered. Findings may still have places in the program's layers, and may be caused by missing
/// parts of the files (`Program::lost`).
pub(crate) fn resolve_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let mut findings = Vec::new();
    let mut ladders = Vec::new();
    let mut room = Room::of(options.progress.clone());
    for (at, file) in files.iter().enumerate() {
        let id = FileId(options.first_file.0 + at as u32);
        options.progress.begin(Step::Parsing(file.name.clone()));
        let (ladder, found) = ladder::read(&mut room, &file.text, id);
        findings.extend(found);
        ladders.push((id, ladder));
    }
    let mut whole: Vec<(FileId, Ladder<Entry>)> =
        ladders.into_iter().filter_map(|(id, ladder)| Some((id, ladder?))).collect();
    let mut lost = LostTexts::default();
    whole.iter_mut().for_each(|(id, ladder)| lost.add(*id, ladder.lost.take()));
    // If a file is missing, the names that it declares would be reported as unknown.
    if whole.len() < files.len() || whole.is_empty() {
        return (None, in_order(findings));
    }
    if options.progress.is_over() {
        return (None, Vec::new());
    }
    options.progress.begin(Step::Names);
    let mut resolver = Resolver::new(files, options);
    resolver.misread = !findings.is_empty();
    let program = Program { lost, ..resolver.program(whole) };
    findings.append(&mut resolver.findings);
    (Some(program), in_order(findings))
}

/// The address of a name in a resolved program. The name is a tag, an address, a member,
/// `Prog.Stage`, `Block.Running`, `Task.Done` or a `$` nickname. For the name of a structure, the
/// result is the structure.
///
/// # Errors
/// A sentence for people: the reason why the name has no address.
pub fn resolve_operand(program: &Program, name: &str) -> Result<Address, String> {
    Scope::of(program).address(name)
}

/// The names of all warnings, valid in `allow`.
static WARNINGS: LazyLock<KnownNames> = LazyLock::new(|| {
    let rows = TABLE.iter().filter(|row| row.severity == Severity::Warning);
    KnownNames::new(rows.map(|row| row.name))
});

fn in_order(mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
    findings
}

/// The state of one load: the names declared so far, and the findings.
struct Resolver<'a> {
    files: &'a [SourceFile],
    options: &'a LoadOptions,
    scope: Scope,
    findings: Vec<Finding>,
    /// Whether the readers made findings. If so, a block may be missing because it was not
    /// readable.
    misread: bool,
    /// Per tag: whether the ladder names it.
    used: Vec<bool>,
    /// Bits and words with their names as written in the ladder, in order of resolving.
    named: Vec<(Span, NamedOperand)>,
    /// The arrays that the ladder names.
    arrays: Vec<(Span, NamedArray)>,
    /// The places where the ladder names a constant by its tag, and the tag's index.
    constants: Vec<(Span, usize)>,
    /// The places of the rungs of templates.
    layers: Layers,
    /// The names of the uses in rungs.
    use_names: Vec<Text>,
    /// The whole names of all uses in rungs, including uses within uses.
    uses: Vec<String>,
    /// The whole names of the uses whose template is unknown.
    unknown_uses: Vec<String>,
    /// The arguments of the uses.
    arguments: Vec<Argument>,
    /// Templates that nothing uses.
    trials: Vec<Trial>,
    /// The number of elements of whole arrays in formulas, so far.
    elements: usize,
    /// The number of elements of the arrays of all tags, so far.
    tag_elements: usize,
}

impl<'a> Resolver<'a> {
    fn new(files: &'a [SourceFile], options: &'a LoadOptions) -> Self {
        let scope = Scope::new(options.sizes.clone());
        Resolver {
            files,
            options,
            scope,
            findings: Vec::new(),
            misread: false,
            used: Vec::new(),
            named: Vec::new(),
            arrays: Vec::new(),
            constants: Vec::new(),
            layers: Layers::default(),
            use_names: Vec::new(),
            uses: Vec::new(),
            unknown_uses: Vec::new(),
            arguments: Vec::new(),
            trials: Vec::new(),
            elements: 0,
            tag_elements: 0,
        }
    }

    fn program(&mut self, ladders: Vec<(FileId, Ladder<Entry>)>) -> Program {
        let ladders = self.expand(ladders);
        let mut program = self.plain_program(&ladders);
        program.trial = self.trial_program(&ladders).map(Box::new);
        program.layers = Arc::new(std::mem::take(&mut self.layers));
        program
    }

    /// The program of ladders whose uses are expanded.
    fn plain_program(&mut self, ladders: &[(FileId, Ladder)]) -> Program {
        let mut program = Program { sizes: self.options.sizes.clone(), ..Program::default() };
        // The library's files usually come before the plant's own files.
        let is_own = |(id, _): &&(FileId, Ladder)| !self.file_name(*id).starts_with(LIBRARY);
        let (id, first) = ladders.iter().find(is_own).unwrap_or(&ladders[0]);
        program.name = match &first.name {
            Some(name) => name.text.clone(),
            None => file_stem(self.file_name(*id)).to_owned(),
        };
        program.doc.clone_from(&first.doc);
        for (id, ladder) in ladders {
            let names = ladder.allow.iter().map(|name| (*id, self.allowed(name)));
            program.allow.extend(names.collect::<Vec<_>>());
        }
        self.declare(ladders, &mut program);
        program.sizes.devices = program.devices.len() as u32;
        self.check_arguments();
        let written = ladders.iter().flat_map(|(_, ladder)| &ladder.blocks);
        for (at, block) in written.enumerate() {
            self.rungs(block, &mut program.blocks[at]);
        }
        program.order = self.order(ladders, &program);
        program.places = self.scope.places().clone();
        self.mark_own_tags(&program);
        for (tag, used) in program.tags.iter_mut().zip(&self.used) {
            tag.used = *used;
        }
        self.share_uses(&mut program.tags);
        (program.operands, program.arrays) = self.operands();
        program.constants = std::mem::take(&mut self.constants);
        program.constants.sort_unstable();
        program
    }

    /// The operands in order of place, each address once, with its first name; and the arrays.
    fn operands(&mut self) -> (Vec<NamedOperand>, Vec<NamedArray>) {
        let (named, arrays) = (std::mem::take(&mut self.named), std::mem::take(&mut self.arrays));
        // If both have the same place, as in `recipe[step]`, the array comes before its index.
        let arrays = arrays.into_iter().map(|(span, array)| (span, Err(array)));
        let operands = named.into_iter().map(|(span, operand)| (span, Ok(operand)));
        let mut all: Vec<(Span, Result<NamedOperand, NamedArray>)> =
            arrays.chain(operands).collect();
        match self.layers.is_empty() {
            true => all.sort_by_key(|(span, _)| (span.file, span.start)),
            false => all.sort_by_cached_key(|(span, _)| self.layers.order(*span)),
        }
        let (mut operands, mut arrays) = (Vec::new(), Vec::new());
        let (mut seen, mut seen_arrays) = (NumberSet::default(), NumberSet::default());
        for (_, named) in all {
            match named {
                Ok(operand) if seen.insert(operand.address) => operands.push(operand),
                Err(of) if seen_arrays.insert((of.array.element(0), of.array.count)) => {
                    arrays.push(NamedArray { behind: operands.len(), ..of });
                }
                Ok(_) | Err(_) => {}
            }
        }
        (operands, arrays)
    }

    /// Checks a name of an `allow`: it must be the name of a warning.
    fn allowed(&mut self, name: &Text) -> String {
        let message = match Code::from_name(&name.text).map(Code::severity) {
            Some(Severity::Warning) => return name.text.clone(),
            Some(Severity::Error) => format!("`{}` is an error: it cannot be silenced", name.text),
            None => format!("no warning is called `{}`", name.text),
        };
        let finding = Finding::new(Code::UnknownAllow, name.span, message);
        self.findings.push(finding.near(&name.text, &WARNINGS));
        name.text.clone()
    }

    fn find(&mut self, finding: Finding) {
        self.findings.push(finding);
    }

    /// Looks up a name; a mistake becomes a finding.
    fn look_up(&mut self, name: &str, span: Span) -> Option<Thing> {
        match self.scope.look_up(name) {
            Ok(found) => {
                if let Some(tag) = found.tag {
                    self.used[tag] = true;
                }
                if let Thing::Array(array) | Thing::Element(Element { array, .. }) = found.thing {
                    self.note_array(name, span, (array, found.tag));
                }
                if let Some(index) = &found.index {
                    self.note_index(index, span);
                }
                Some(found.thing)
            }
            Err(mistake) => {
                self.mark_used(name);
                let finding = mistake.finding(span);
                self.findings.extend(finding.map(|finding| self.layers.near(finding, name)));
                None
            }
        }
    }

    /// Records that the ladder names this array; with the index of the tag of its element 0.
    fn note_array(&mut self, name: &str, span: Span, (array, tag): (Array, Option<usize>)) {
        let name = name.to_owned();
        self.arrays.push((span, NamedArray { name, array, tag, behind: 0 }));
    }

    /// As [`Resolver::look_up`], for a place that accepts only tags of some types: the help for an
    /// unknown name proposes these types.
    fn look_up_as(&mut self, name: &str, span: Span, types: &[&str]) -> Option<Thing> {
        let before = self.findings.len();
        let thing = self.look_up(name, span);
        if let (None, [first, others @ ..]) = (thing, types)
            && !name.contains(['.', '['])
        {
            let mut found = self.findings.split_off(before);
            let others = others.iter().map(|other| format!(", or \"{other}\"")).collect::<String>();
            let declared =
                || format!("declare it under [tags]: `{name} = {{ type = \"{first}\" }}`{others}");
            self.findings.extend(found.drain(..).map(|finding| finding.declared_as(declared)));
        }
        thing
    }

    /// Records the word or constant that is an index.
    fn note_index(&mut self, name: &str, span: Span) {
        if let Some(thing) = self.look_up(name, span) {
            match thing {
                Thing::Constant(..) => self.note_constant(name, span),
                Thing::Address(address) => self.note(name, span, address),
                Thing::Real(_)
                | Thing::Block(_)
                | Thing::Device(_)
                | Thing::Array(_)
                | Thing::Element(_) => {}
            }
        }
    }

    /// Marks an own tag of a template as used in all uses, if it is named in one of them.
    fn mark_own_tags(&mut self, program: &Program) {
        let own = || program.tags.iter().enumerate().filter(|(_, t)| Layers::is_layered(t.span));
        let places: NumberSet<Span> = own()
            .filter(|(at, _)| self.used[*at])
            .map(|(_, tag)| self.layers.in_file(tag.span))
            .collect();
        for (at, tag) in own() {
            self.used[at] |= places.contains(&self.layers.in_file(tag.span));
        }
    }

    fn mark_used(&mut self, name: &str) {
        let name = name.split('[').next().unwrap_or(name);
        if let Some(tag) = self.scope.tag_index(name) {
            self.used[tag] = true;
        }
    }

    /// Records that the ladder names this bit, word or structure.
    fn note(&mut self, name: &str, span: Span, address: Address) {
        match address {
            Address::Structure(structure) => {
                // `N,0` would be two columns of a list, so it is recorded as `N0`.
                let name = if name.contains(',') { structure.to_string() } else { name.to_owned() };
                for (member, address) in
                    structure.members().iter().zip(structure.member_addresses())
                {
                    let name = format!("{name}.{member}");
                    self.named.push((span, NamedOperand { name, address }));
                }
            }
            Address::Bit(_) | Address::Word(_) => {
                // `N,0,6` would be three columns.
                let name = if name.contains(',') { address.to_string() } else { name.to_owned() };
                let name = self.scope.element_name(&name, address).unwrap_or(name);
                self.named.push((span, NamedOperand { name, address }));
            }
        }
    }

    /// The name of a file.
    fn file_name(&self, id: FileId) -> &'a str {
        let file = (id.0 - self.options.first_file.0) as usize;
        self.files.get(file).map_or("", |file| file.name.as_str())
    }

    /// The text of a place.
    fn text(&self, span: Span) -> &'a str {
        let span = self.layers.in_file(span);
        let file = (span.file.0 - self.options.first_file.0) as usize;
        let text = self.files.get(file).map_or("", |file| file.text.as_str());
        text.get(span.start as usize..span.end as usize).unwrap_or("")
    }
}

fn file_stem(name: &str) -> &str {
    let base = name.rsplit('/').next().unwrap_or(name);
    base.strip_suffix(".toml").unwrap_or(base)
}
