//! A ladder body, while it is translated: one pass over what acts in it.
//!
//! `statements`, `power`, `block_calls` and `functions` say what the elements do; `passes` makes
//! the passes, `finish` the rungs.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::document::VariableUse;
use super::elements::Connection;
use super::graph::{BlockOutput, LadderGraph};
use super::memory::{BlockMember, LocatedPlace, PlcopenMemory};
use super::types::{IecType, VariableKind};
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{
    Action, ActionForm, ProjectBlock, ProjectRung, ProjectTag, RungOutcome, RungStep, Term,
};

/// Most elements in series that are followed.
const DEPTH_MAX: usize = 250;

/// What the translation of bodies knows of a function block or function of the file.
#[derive(Clone, Debug)]
pub(super) struct UnitBlock {
    /// The template.
    pub(super) template: String,
    /// The inputs, and the variables that it gets by reference.
    pub(super) inputs: Vec<UnitInput>,
    /// The result of a function.
    pub(super) result: Option<BlockMember>,
    /// The other outputs.
    pub(super) outputs: Vec<BlockOutputName>,
    /// Whether it names variables that are not its own.
    pub(super) is_open: bool,
}

/// An input of a function block of the file.
#[derive(Clone, Debug)]
pub(super) struct UnitInput {
    pub(super) name: String,
    /// The tag, or the parameter, of the template.
    pub(super) tag: String,
    pub(super) kind: IecType,
    pub(super) is_reference: bool,
    /// Whether its own body writes it.
    pub(super) is_written: bool,
}

/// An output of a function of the file.
#[derive(Clone, Debug)]
pub(super) struct BlockOutputName {
    pub(super) name: String,
    pub(super) tag: String,
    pub(super) kind: IecType,
}

/// The function blocks and functions of the file by their names in small letters; or why there is
/// none.
pub(super) type UnitBlocks = HashMap<String, Result<UnitBlock, String>>;

/// What a pass has found that the next one must do.
#[derive(Clone, Debug, Default)]
pub(super) struct PassNeeds {
    /// The outputs of functions that are kept in a tag.
    pub(super) kept: HashSet<BlockOutput>,
    /// The contacts on edges that are kept in a bit, by what acts and the contact.
    pub(super) kept_edges: HashSet<EdgeUse>,
    /// The networks with a stub, and why.
    pub(super) failed: BTreeMap<usize, String>,
    /// Whether everything is kept.
    pub(super) keeps_all: bool,
}

impl PassNeeds {
    pub(super) fn size(&self) -> usize {
        self.kept.len() + self.kept_edges.len() + self.failed.len()
    }
}

/// An edge that something uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct EdgeUse {
    pub(super) statement: usize,
    pub(super) contact: usize,
}

/// An edge, and how many steps were executed when it was evaluated.
#[derive(Clone, Debug)]
pub(super) struct TimedEdge {
    pub(super) condition: RungCondition,
    pub(super) at: usize,
}

/// The condition of a transition, as a pass finds it.
#[derive(Clone, Debug)]
pub(super) struct JudgedCondition {
    pub(super) condition: RungCondition,
    /// Whether it reads which steps are active.
    pub(super) reads_steps: bool,
    /// Its network.
    pub(super) network: usize,
}

/// The value of an output of a block.
#[derive(Clone, Debug)]
pub(super) enum BlockValue {
    /// A condition, and how many steps were executed when it was evaluated.
    Power { condition: RungCondition, at: usize },
    /// A place that keeps it.
    Kept(LocatedPlace),
}

/// A body, while it is translated.
pub(super) struct LadderBody<'m, 'g> {
    pub(super) memory: &'m mut PlcopenMemory,
    pub(super) scope: usize,
    pub(super) graph: &'g LadderGraph<'g>,
    pub(super) units: &'m UnitBlocks,
    pub(super) needs: &'g PassNeeds,
    pub(super) found: PassNeeds,
    pub(super) steps: Vec<RungStep>,
    /// Where the steps of the current network begin.
    pub(super) turn: usize,
    /// What acts now.
    pub(super) statement: usize,
    pub(super) values: HashMap<BlockOutput, BlockValue>,
    pub(super) called: HashSet<usize>,
    /// The power behind contacts, for what acts now.
    pub(super) powers: HashMap<usize, RungCondition>,
    /// How often the power behind a contact is used by what acts now.
    pub(super) uses: HashMap<usize, usize>,
    /// The edges that were evaluated.
    pub(super) edges: HashMap<EdgeUse, TimedEdge>,
    pub(super) driven: HashSet<String>,
    /// The instances whose calls have a stub.
    pub(super) dead: HashSet<usize>,
    pub(super) differences: BTreeSet<String>,
    pub(super) tags: Vec<ProjectTag>,
    /// How many conditions are kept in a bit.
    pub(super) lines: usize,
    /// Subroutines that calls under a condition need.
    pub(super) blocks: Vec<ProjectBlock>,
    /// Whether it is the body of a function block.
    pub(super) is_template: bool,
    pub(super) own: &'g mut BodyMemo,
    pub(super) prefix: &'g str,
    pub(super) depth: usize,
    /// Whether the conditions of transitions are found; what leads to them acts behind that.
    pub(super) is_judging: bool,
    pub(super) reads_steps: bool,
    /// The conditions of transitions, by their elements.
    pub(super) conditions: HashMap<usize, RungCondition>,
}

/// Whether an element could act; or why not.
pub(super) type Acted = Result<(), String>;

/// What elements call of each other. The files of the elements define it (`dispatch`): each
/// element can stand behind each other one.
pub(super) trait ElementCalls {
    /// Lets a coil, a variable or a block act.
    fn run_element(&mut self, at: usize) -> Result<(), String>;
    /// Executes a block; a target gets the value of the output directly.
    fn run_block(&mut self, output: BlockOutput, target: Option<&LocatedPlace>) -> Acted;
    /// Executes a function.
    fn run_function(&mut self, output: BlockOutput, target: Option<&LocatedPlace>) -> Acted;
    /// The value of an output.
    fn output_value(&mut self, output: BlockOutput) -> Result<BlockValue, String>;
    /// The value of an output that is kept in a place.
    fn kept_output(&mut self, output: BlockOutput) -> Result<LocatedPlace, String>;
    /// The value of an output whose function is executed later.
    fn early_output(&mut self, output: BlockOutput) -> Result<BlockValue, String>;
    /// The ENO of a block.
    fn enable_output(&mut self, at: usize) -> Result<RungCondition, String>;
    /// Remembers the power of an output.
    fn keep_output(&mut self, output: BlockOutput, power: RungCondition);
}

/// What a body keeps over all passes.
#[derive(Debug, Default)]
pub(super) struct BodyMemo {
    /// The names of tags that it made.
    names: HashMap<String, String>,
    /// The types of the outputs of functions.
    pub(super) kinds: HashMap<BlockOutput, IecType>,
}

/// The reason for which a pass leaves something out that the next one does.
pub(super) const LATER: &str = "in the next pass";

/// A translated body.
#[derive(Debug, Default)]
pub(super) struct TranslatedBody {
    pub(super) rungs: Vec<ProjectRung>,
    pub(super) outcomes: Vec<RungOutcome>,
    /// Subroutines that it calls.
    pub(super) blocks: Vec<ProjectBlock>,
    /// Of a chart: the rungs that its conditions need, and the stubs.
    pub(super) heads: Vec<ProjectRung>,
    /// Of a chart: the conditions of its transitions, by their elements.
    pub(super) conditions: HashMap<usize, JudgedCondition>,
}

/// Where a body stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyPlace<'p> {
    pub(super) scope: usize,
    /// The beginning of the names of tags that it makes.
    pub(super) prefix: &'p str,
    /// The program or block, for the report.
    pub(super) title: &'p str,
    /// Whether it is the body of a function block.
    pub(super) is_template: bool,
}

/// What one pass gives.
pub(super) struct Pass {
    pub(super) found: PassNeeds,
    pub(super) turns: Vec<NetworkTurn>,
    pub(super) tags: Vec<ProjectTag>,
    pub(super) blocks: Vec<ProjectBlock>,
    pub(super) driven: HashSet<String>,
    pub(super) differences: Vec<BTreeSet<String>>,
    pub(super) conditions: HashMap<usize, JudgedCondition>,
}

/// What a network does in one go.
pub(super) struct NetworkTurn {
    pub(super) network: usize,
    /// Whether it is a part of the judgement of transitions.
    pub(super) is_head: bool,
    pub(super) steps: Vec<RungStep>,
}

/// What a pass makes.
struct Made<'n> {
    differences: Vec<BTreeSet<String>>,
    turns: Vec<NetworkTurn>,
    /// The network of each element.
    network_of: &'n [Option<usize>],
}

impl<'g> LadderBody<'_, 'g> {
    /// What the lines into the connector of a continuation give.
    ///
    /// # Errors
    /// There is no such connector, or the connectors make a loop.
    pub(super) fn continued<T>(
        &mut self,
        name: &str,
        follow: impl FnOnce(&mut Self, &'g [Connection]) -> Result<T, String>,
    ) -> Result<T, String> {
        let lines = self.graph.continued(name);
        let lines = lines.ok_or_else(|| format!("no connector `{name}`"))?;
        self.deeper("a loop of connectors", |body| follow(body, lines))
    }

    /// Follows the lines of one element more.
    ///
    /// # Errors
    /// More than [`DEPTH_MAX`] are in series, or they make a loop: `too_deep` says it.
    pub(super) fn deeper<T>(
        &mut self,
        too_deep: &str,
        follow: impl FnOnce(&mut Self) -> Result<T, String>,
    ) -> Result<T, String> {
        if self.depth == DEPTH_MAX {
            return Err(too_deep.to_owned());
        }
        self.depth += 1;
        let found = follow(self);
        self.depth -= 1;
        found
    }

    /// One pass over what acts. In a chart the conditions come first, and then what they need of
    /// the next scan.
    pub(super) fn pass(
        mut self,
        order: &[usize],
        network_of: &[Option<usize>],
        networks: usize,
    ) -> Pass {
        let mut made =
            Made { differences: vec![BTreeSet::new(); networks], turns: Vec::new(), network_of };
        let mut judged = HashMap::new();
        self.is_judging = !super::networks::conditions(self.graph).is_empty();
        if self.is_judging {
            self.run(order, &mut made, &mut judged);
            self.is_judging = false;
        }
        self.run(order, &mut made, &mut judged);
        Pass {
            found: self.found,
            turns: made.turns,
            tags: self.tags,
            blocks: self.blocks,
            driven: self.driven,
            differences: made.differences,
            conditions: judged,
        }
    }

    fn run(
        &mut self,
        order: &[usize],
        made: &mut Made<'_>,
        judged: &mut HashMap<usize, JudgedCondition>,
    ) {
        let mut current = None;
        for at in order {
            let Some(network) = made.network_of[*at] else { continue };
            if current != Some(network) {
                self.end_turn(current, &mut made.turns);
                current = Some(network);
            }
            if self.needs.failed.contains_key(&network) {
                continue;
            }
            self.statement = *at;
            self.reads_steps = false;
            if let Err(why) = self.run_element(*at)
                && why != LATER
            {
                self.found.failed.entry(network).or_insert(why);
            }
            if let Some(condition) = self.conditions.remove(at) {
                let reads_steps = self.reads_steps;
                judged.insert(*at, JudgedCondition { condition, reads_steps, network });
            }
            made.differences[network].append(&mut self.differences);
        }
        self.end_turn(current, &mut made.turns);
    }

    fn end_turn(&mut self, network: Option<usize>, turns: &mut Vec<NetworkTurn>) {
        let Some(network) = network else { return };
        let begin = self.turn;
        let mut steps = self.steps[begin..].to_vec();
        for term in steps.iter_mut().flat_map(|step| &mut step.when) {
            term.at -= begin.min(term.at);
        }
        turns.push(NetworkTurn { network, is_head: self.is_judging, steps });
        self.turn = self.steps.len();
    }

    /// A term for the value that a condition has now: of as early a time as gives the same value.
    fn term(&self, condition: RungCondition) -> Term {
        let mut at = self.steps.len();
        while at > self.turn && !condition.is_changed_by(&self.steps[at - 1].action.writes) {
            at -= 1;
        }
        Term { condition, at }
    }

    /// The terms of a condition that is evaluated now.
    pub(super) fn terms(&self, condition: RungCondition) -> Vec<Term> {
        match condition {
            RungCondition::Constant(true) => Vec::new(),
            RungCondition::All(parts) => parts.into_iter().map(|part| self.term(part)).collect(),
            RungCondition::Constant(false)
            | RungCondition::Bit { .. }
            | RungCondition::Compare { .. }
            | RungCondition::Not(_)
            | RungCondition::Any(_) => vec![self.term(condition)],
        }
    }

    /// Adds a step with an instruction.
    pub(super) fn push(&mut self, when: Vec<Term>, text: String, place: &TouchedPlace) {
        let writes = vec![place.clone()];
        self.steps.push(RungStep { when, action: Action { form: ActionForm::Do(text), writes } });
    }

    /// Whether something has changed a condition since a step.
    pub(super) fn is_changed(&self, condition: &RungCondition, since: usize) -> bool {
        let steps = self.steps.get(since..).unwrap_or_default();
        steps.iter().any(|step| condition.is_changed_by(&step.action.writes))
    }

    /// A name of the body's own; the same wish has the same name.
    pub(super) fn own_name(&mut self, wish: &str) -> String {
        let wish = format!("{}_{wish}", self.prefix);
        match self.own.names.get(&wish) {
            Some(name) => name.clone(),
            None => {
                let name = self.memory.names.fresh(&wish);
                self.own.names.insert(wish, name.clone());
                name
            }
        }
    }

    /// A tag of the body's own; the same wish has the same tag.
    pub(super) fn own_tag(&mut self, wish: &str, kind: IecType) -> LocatedPlace {
        let name = self.own_name(wish);
        if self.tags.iter().all(|tag| tag.name != name) {
            self.tags.push(ProjectTag {
                name: name.clone(),
                kind: kind.plain().to_owned(),
                doc: "A value between blocks, made by the import".to_owned(),
                ..ProjectTag::default()
            });
        }
        let place = TouchedPlace::of(&name);
        LocatedPlace { text: name, kind, place, variable: None, is_input: false }
    }

    /// Whether a text is the name of a variable that the file does not declare.
    pub(super) fn is_undeclared(&self, name: &str) -> bool {
        name.chars().all(|c| c.is_alphanumeric() || c == '_')
            && name.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && self.memory.variable(self.scope, name).is_none()
    }

    /// The place that a text names; a bit that the file does not declare gets one.
    pub(super) fn locate(&mut self, text: &str, is_bit: bool) -> Result<LocatedPlace, String> {
        let name = text.trim();
        if is_bit && self.is_undeclared(name) {
            self.memory.guess(self.scope, name);
        }
        let located = self.memory.locate(self.scope, name)?;
        let Some(id) = located.variable else { return Ok(located) };
        let variable = &self.memory.variables[id];
        if matches!(variable.kind, VariableKind::Instance(_)) && self.dead.contains(&id) {
            return Err(format!("`{text}`, whose block is not translated"));
        }
        if let Some(difference) = &variable.difference {
            self.differences.insert(difference.clone());
        }
        if variable.is_guessed {
            let name = &variable.original;
            self.differences.insert(format!("`{name}` is not declared: taken as a BOOL"));
        }
        Ok(located)
    }

    /// Whether an OUT may drive a bit: nothing else does, and in the template of a function block
    /// it is the block's own.
    pub(super) fn may_drive(&mut self, bit: &LocatedPlace) -> bool {
        let id = bit.variable.filter(|_| self.is_template);
        let is_own = id.is_none_or(|id| {
            let own = self.memory.scopes[self.scope].tags.iter();
            let usage = self.memory.variables[id].usage;
            matches!(usage, VariableUse::Local | VariableUse::Output)
                && own.into_iter().any(|tag| tag.name == self.memory.variables[id].name)
        });
        is_own && self.driven.insert(bit.text.clone())
    }

    /// A place whose value is read.
    pub(super) fn read(&mut self, text: &str, is_bit: bool) -> Result<LocatedPlace, String> {
        let located = self.locate(text, is_bit)?;
        if let Some(id) = located.variable {
            let variable = &mut self.memory.variables[id];
            variable.is_read = true;
            self.reads_steps |=
                variable.usage == VariableUse::Step && located.kind == IecType::Bool;
        }
        Ok(located)
    }

    /// A place that is written.
    pub(super) fn written(&mut self, text: &str, is_bit: bool) -> Result<LocatedPlace, String> {
        let located = self.locate(text, is_bit)?;
        if located.is_input {
            return Err(format!("a write of the input `{text}`"));
        }
        if let Some(id) = located.variable {
            if self.memory.variables[id].usage == VariableUse::Step {
                return Err(format!("a write of the step `{text}`"));
            }
            self.memory.variables[id].is_written = true;
        }
        Ok(located)
    }
}
