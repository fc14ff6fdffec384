//! A foreign project, whatever its form was: what the writer makes files of.
//!
//! Made by the readers, completed by `rungs`. All names in it are legal names of rungd already
//! ([`crate::names`]). It has nothing of a foreign form but the originals' texts, for the report.

use crate::condition::{RungCondition, TouchedPlace};

/// A project.
#[derive(Clone, Debug, Default)]
pub struct ForeignProject {
    /// Its name, for the files.
    pub name: String,
    /// The description of the original.
    pub doc: String,
    /// What it was: `Rockwell L5X, controller Mixer, RSLogix 5000 33.00`.
    pub origin: String,
    /// The scan period, in ms.
    pub period_ms: u32,
    /// Files of the library that it uses: `lib:iec`.
    pub libraries: Vec<&'static str>,
    /// Ladder files that every project of this form has: records and templates.
    pub parts: Vec<ProjectPart>,
    /// Its ladder files, in scan order.
    pub files: Vec<LadderFile>,
    /// What becomes of each rung, and of what is no rung.
    pub outcome: Outcome,
}

/// A ladder file with records and templates of a foreign form.
#[derive(Clone, Copy, Debug)]
pub struct ProjectPart {
    /// Its name, without a folder and `.toml`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// A ladder file.
#[derive(Clone, Debug, Default)]
pub struct LadderFile {
    /// Its name, without a folder and `.toml`.
    pub name: String,
    /// `doc` of `[ladder]`.
    pub doc: String,
    /// Names of warnings that the original's own habits cause.
    pub allow: Vec<&'static str>,
    /// Records.
    pub records: Vec<Record>,
    /// Tags, in order.
    pub tags: Vec<ProjectTag>,
    /// Templates.
    pub templates: Vec<ProjectTemplate>,
    /// Programs, Tasks and subroutines.
    pub blocks: Vec<ProjectBlock>,
}

impl LadderFile {
    /// The file `main` with a Program `Main` without rungs.
    pub fn empty_main(doc: &str) -> LadderFile {
        let main = ProjectBlock {
            kind: ProjectBlockKind::Program,
            name: "Main".to_owned(),
            doc: String::new(),
            rungs: Vec::new(),
            stages: Vec::new(),
        };
        LadderFile {
            name: "main".to_owned(),
            doc: doc.to_owned(),
            blocks: vec![main],
            ..LadderFile::default()
        }
    }
}

/// A record.
#[derive(Clone, Debug)]
pub struct Record {
    /// Its name.
    pub name: String,
    /// Its description.
    pub doc: String,
    /// Its fields; each has a type of the language, and no `count`.
    pub fields: Vec<ProjectTag>,
}

/// A tag, or a field of a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectTag {
    /// Its name.
    pub name: String,
    /// `type`: a type of the language, or a record.
    pub kind: String,
    /// `at`, instead of the type.
    pub at: Option<String>,
    /// `count`.
    pub count: Option<u32>,
    /// `initial`, as TOML.
    pub initial: Option<String>,
    /// Its description.
    pub doc: String,
    /// Other keys, as TOML: `min = 0`.
    pub more: Vec<String>,
    /// Whether the import made it for itself: the original has no such tag.
    pub is_own: bool,
}

/// A template.
#[derive(Clone, Debug, Default)]
pub struct ProjectTemplate {
    /// Its name.
    pub name: String,
    /// Its description.
    pub doc: String,
    /// Its parameters: a tag's `kind` is the parameter's type, `initial` its default.
    pub parameters: Vec<ProjectTag>,
    /// The tags that each use has.
    pub tags: Vec<ProjectTag>,
    /// Its rungs.
    pub rungs: Vec<ProjectRung>,
}

/// What a block is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProjectBlockKind {
    /// A Program that runs from the first scan on.
    Program,
    /// A Program that something else starts.
    StartedProgram,
    /// A Task.
    Task,
    /// A subroutine.
    Subroutine,
}

/// A Program, Task or subroutine.
#[derive(Clone, Debug)]
pub struct ProjectBlock {
    /// What it is.
    pub kind: ProjectBlockKind,
    /// Its name.
    pub name: String,
    /// Its description.
    pub doc: String,
    /// Its rungs.
    pub rungs: Vec<ProjectRung>,
    /// The Stages of a Program.
    pub stages: Vec<ProjectStage>,
}

/// A Stage of a Program.
#[derive(Clone, Debug)]
pub struct ProjectStage {
    /// Its name.
    pub name: String,
    /// Its description.
    pub doc: String,
    /// Its rungs.
    pub rungs: Vec<ProjectRung>,
}

/// A rung of rungd, a use of a template, a comment or a stub.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectRung {
    /// Its name: kebab-case for a rung, a tag's name for a use.
    pub name: Option<String>,
    /// Why it is there.
    pub doc: String,
    /// What it is.
    pub body: RungBody,
}

/// What stands in the place of a rung.
#[derive(Clone, Debug, PartialEq)]
pub enum RungBody {
    /// Contacts and instructions.
    Ladder {
        /// `when`.
        when: Vec<String>,
        /// `do`.
        body: Vec<String>,
        /// Its branches.
        branches: Vec<ProjectBranch>,
    },
    /// A rung whose instruction has several legs.
    Legs {
        /// `leg.*`: the names and their contacts.
        legs: Vec<ProjectLeg>,
        /// Its instruction.
        instruction: String,
    },
    /// A use of a template.
    Use {
        /// The template.
        template: String,
        /// `with`.
        arguments: Vec<UseArgument>,
    },
    /// A comment between rungs.
    Comment,
    /// A stub.
    Todo {
        /// The reason.
        reason: String,
        /// The original.
        was: String,
    },
}

/// A leg of an instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProjectLeg {
    /// Its name, without `leg.`.
    pub name: &'static str,
    /// Its contacts.
    pub contacts: Vec<String>,
}

/// A branch of a rung.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProjectBranch {
    /// `when`.
    pub when: Vec<String>,
    /// `do`.
    pub body: Vec<String>,
}

/// An argument of a use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UseArgument {
    /// The parameter.
    pub name: String,
    /// Its value, as a text of rungd.
    pub value: String,
}

/// A step of a foreign rung: an action, and the condition under which it acts.
///
/// A foreign rung is evaluated from left to right: a contact has the value that it had when the
/// evaluation came to it. `rungs` keeps that.
#[derive(Clone, Debug)]
pub struct RungStep {
    /// The contacts in series; none: always.
    pub when: Vec<Term>,
    /// What is done.
    pub action: Action,
}

/// A contact, or parallel branches of contacts, in the condition of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Term {
    /// What it says.
    pub condition: RungCondition,
    /// How many steps of the rung were executed when it was evaluated.
    pub at: usize,
}

/// What a step does.
#[derive(Clone, Debug)]
pub struct Action {
    /// In which form.
    pub form: ActionForm,
    /// The places that it writes.
    pub writes: Vec<TouchedPlace>,
}

/// The form of an action.
#[derive(Clone, Debug)]
pub enum ActionForm {
    /// An instruction with the leg `when`: `OUT motor`.
    Do(String),
    /// A use of a template, whose parameter `contact` gets the condition.
    Use {
        /// The template.
        template: String,
        /// The name of the use.
        name: String,
        /// The parameter of the condition; without one the use has none.
        contact: Option<&'static str>,
        /// The other arguments.
        arguments: Vec<UseArgument>,
    },
    /// An instruction with several legs; the condition belongs to one of them.
    Legs {
        /// The leg of the condition.
        leg: &'static str,
        /// The other legs.
        others: Vec<ProjectLeg>,
        /// The instruction.
        instruction: String,
    },
}

/// What became of the parts of a project.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The rungs of the original, in order.
    pub rungs: Vec<RungOutcome>,
    /// What holds for the whole project, other than in the original.
    pub differences: Vec<String>,
    /// What a person has to decide or to bring, that is no rung: each makes the import open.
    pub open: Vec<String>,
    /// Parts in other languages, and what else is not translated by design.
    pub left_out: Vec<String>,
    /// Names that changed.
    pub renamed: Vec<Renamed>,
    /// Tags that nothing in the program writes: inputs.
    pub unwritten: Vec<UnwrittenTag>,
    /// Tags of modules that the program writes: outputs.
    pub outputs: Vec<UnwrittenTag>,
}

/// A name that changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Renamed {
    /// In the original.
    pub from: String,
    /// Here.
    pub to: String,
}

/// A tag that a field device brings or takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnwrittenTag {
    /// Its name here.
    pub name: String,
    /// In the original.
    pub was: String,
    /// Which device map would bring or take it.
    pub source: String,
}

/// What became of a rung of the original.
#[derive(Clone, Debug)]
pub struct RungOutcome {
    /// Program and routine.
    pub place: String,
    /// Its number there, from 0.
    pub number: usize,
    /// Its text, or what stands for it.
    pub text: String,
    /// Its parts, for the count: `XIC`, `OTE`, `TON`, and how many of each.
    pub parts: Vec<PartCount>,
    /// What became of it.
    pub fate: Fate,
}

/// How many parts of a kind a rung has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartCount {
    /// The kind: a mnemonic, `contact`, `coil`, a block's type.
    pub kind: String,
    /// How many.
    pub count: usize,
}

/// What became of a rung.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It does the same, to the scan.
    Exact,
    /// It does the same, but for these differences.
    Different(Vec<String>),
    /// A stub stands in its place.
    Todo(String),
}
