//! Names → addresses. What it finds is unknown, duplicate, read-only or of the wrong kind.
//!
//! [`load_ladders`] takes the texts of one or several ladder files and gives the resolved
//! [`Program`], which the checks judge and `lower` turns into an engine program. It does no I/O.

mod contact;
mod declare;
pub mod instruction;
mod operand;
pub mod operands;
mod order;
pub mod program;
pub mod range;
mod rung;
pub mod scope;
mod tags;

use std::sync::LazyLock;

use crate::isa::{Address, MemorySizes};
use crate::source::finding::{Code, Finding, Severity, TABLE};
use crate::source::ladder::{self, Ladder};
use crate::source::nearest::Names;
use crate::source::reader::Text;
use crate::source::room::Room;
use crate::source::span::{FileId, Located, SourceFile, Span};
use program::{NamedOperand, Program};
use scope::{Scope, Thing};

/// What a load depends on beside the ladder files.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Sizes of the memory blocks.
    pub sizes: MemorySizes,
    /// `order` of a controller file.
    pub order: Option<Located<Vec<Text>>>,
    /// Whether the ladders are those of a controller file.
    pub has_controller: bool,
    /// The field devices of a controller file, in its order.
    pub devices: Vec<Text>,
    /// The number of the first file: spans of the ladder at index k say `first_file + k`.
    pub first_file: FileId,
}

/// Resolves the ladder files given together as one program. The program is there only if there
/// is no error among the findings, which come in order of place.
pub fn load_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let (program, findings) = resolve_ladders(files, options);
    let refused = findings.iter().any(|f| f.severity() == Severity::Error);
    (program.filter(|_| !refused), findings)
}

/// As [`load_ladders`], but gives the program with errors among the findings too, where all files
/// are TOML: what is wrong is left out of it, so that the rules can judge the rest. Such a program
/// is for nothing else.
pub fn resolve_ladders(
    files: &[SourceFile],
    options: &LoadOptions,
) -> (Option<Program>, Vec<Finding>) {
    let mut findings = Vec::new();
    let mut ladders = Vec::new();
    let mut room = Room::default();
    for (at, file) in files.iter().enumerate() {
        let id = FileId(options.first_file.0 + at as u32);
        let (ladder, found) = ladder::read_within(&mut room, &file.text, id);
        findings.extend(found);
        ladders.push((id, ladder));
    }
    let whole: Vec<(FileId, Ladder)> =
        ladders.into_iter().filter_map(|(id, ladder)| Some((id, ladder?))).collect();
    // With a file missing, half of the names would be unknown for no fault of theirs.
    if whole.len() < files.len() || whole.is_empty() {
        return (None, in_order(findings));
    }
    let mut resolver = Resolver::new(files, options);
    resolver.misread = !findings.is_empty();
    let program = resolver.program(&whole);
    findings.append(&mut resolver.findings);
    (Some(program), in_order(findings))
}

/// What a name stands for in a resolved program: a tag, an address, a member, `Prog.Stage`,
/// `Block.Running`, `Task.Done` or a `$` nickname. A structure comes as itself.
///
/// # Errors
/// A sentence for people: why it names nothing that can be watched or written.
pub fn resolve_operand(program: &Program, name: &str) -> Result<Address, String> {
    Scope::of(program).address(name)
}

/// The names that `allow` knows.
static WARNINGS: LazyLock<Names> = LazyLock::new(|| {
    let rows = TABLE.iter().filter(|row| row.severity == Severity::Warning);
    Names::new(rows.map(|row| row.name))
});

fn in_order(mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
    findings
}

/// One load under way: the names known so far, and what was found.
struct Resolver<'a> {
    files: &'a [SourceFile],
    options: &'a LoadOptions,
    scope: Scope,
    findings: Vec<Finding>,
    /// Whether the readers found something: then a block may be missing for that reason.
    misread: bool,
    /// Per tag: whether the ladder names it.
    used: Vec<bool>,
    /// Bits and words by the names under which the ladder names them, in order of resolving.
    named: Vec<(Span, NamedOperand)>,
    /// Where a constant is named by its tag, and the tag's index.
    constants: Vec<(Span, usize)>,
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
            constants: Vec::new(),
        }
    }

    fn program(&mut self, ladders: &[(FileId, Ladder)]) -> Program {
        let mut program = Program { sizes: self.options.sizes.clone(), ..Program::default() };
        let (_, first) = &ladders[0];
        program.name = match &first.name {
            Some(name) => name.text.clone(),
            None => file_stem(&self.files[0].name).to_owned(),
        };
        program.doc.clone_from(&first.doc);
        for (id, ladder) in ladders {
            let names = ladder.allow.iter().map(|name| (*id, self.allowed(name)));
            program.allow.extend(names.collect::<Vec<_>>());
        }
        self.declare(ladders, &mut program);
        program.sizes.devices = program.devices.len() as u32;
        let written = ladders.iter().flat_map(|(_, ladder)| &ladder.blocks);
        for (at, block) in written.enumerate() {
            self.rungs(block, &mut program.blocks[at]);
        }
        program.order = self.order(ladders, &program);
        for (tag, used) in program.tags.iter_mut().zip(&self.used) {
            tag.used = *used;
        }
        program.operands = self.operands();
        program.constants = std::mem::take(&mut self.constants);
        program.constants.sort_unstable();
        program
    }

    /// The operands by place, each address once, under its first name.
    fn operands(&mut self) -> Vec<NamedOperand> {
        let mut named = std::mem::take(&mut self.named);
        named.sort_by_key(|(span, _)| (span.file, span.start));
        let mut seen = std::collections::HashSet::new();
        named.retain(|(_, operand)| seen.insert(operand.address));
        named.into_iter().map(|(_, operand)| operand).collect()
    }

    /// A name of an `allow`, which must be one of a warning.
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

    /// What a name stands for; a mistake becomes a finding.
    fn look_up(&mut self, name: &str, span: Span) -> Option<Thing> {
        match self.scope.look_up(name) {
            Ok(found) => {
                if let Some(tag) = found.tag {
                    self.used[tag] = true;
                }
                Some(found.thing)
            }
            Err(mistake) => {
                self.mark_used(name);
                self.findings.extend(mistake.finding(span));
                None
            }
        }
    }

    fn mark_used(&mut self, name: &str) {
        let base = name.split('.').next().unwrap_or(name);
        if let Some(tag) = self.scope.tag_index(base) {
            self.used[tag] = true;
        }
    }

    /// Notes that the ladder names this bit, word or structure.
    fn note(&mut self, name: &str, span: Span, address: Address) {
        match address {
            Address::Structure(structure) => {
                // `N,0` would be two columns of a list: it goes by its other name.
                let name = if name.contains(',') { structure.to_string() } else { name.to_owned() };
                for (member, address) in
                    structure.members().iter().zip(structure.member_addresses())
                {
                    let name = format!("{name}.{member}");
                    self.named.push((span, NamedOperand { name, address }));
                }
            }
            // So would `N,0,6`.
            _ if name.contains(',') => {
                let name = address.to_string();
                self.named.push((span, NamedOperand { name, address }));
            }
            _ => self.named.push((span, NamedOperand { name: name.to_owned(), address })),
        }
    }

    /// The text of a place.
    fn text(&self, span: Span) -> &'a str {
        let file = (span.file.0 - self.options.first_file.0) as usize;
        let text = self.files.get(file).map_or("", |file| file.text.as_str());
        text.get(span.start as usize..span.end as usize).unwrap_or("")
    }
}

fn file_stem(name: &str) -> &str {
    let base = name.rsplit('/').next().unwrap_or(name);
    base.strip_suffix(".toml").unwrap_or(base)
}
