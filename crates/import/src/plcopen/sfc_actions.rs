//! The actions of a chart: which variable an active step writes, and which body it executes.
//!
//! Called by `sfc`. An action is a BOOL variable, or a body, which becomes a subroutine. The
//! qualifiers do what MatIEC's code does, in its order: the actions of a step act before those of
//! the next step in the text, S and R behind all of them, bodies last: before the first of them it
//! is known which are executed. A body is not executed once more behind its last scan.

use std::collections::{BTreeSet, HashMap};

use super::body::BodyPlace;
use super::document::VariableUse;
use super::formula::IecFormula;
use super::memory::LocatedPlace;
use super::passes::{asked, translated};
use super::rung_names::RungNames;
use super::sfc_elements::{ActionBody, SfcAction, SfcBody};
use super::sfc_qualifiers::AtStep;
use super::sfc_work::{ChartWork, ScanPart, StepBatch, act};
use super::types::IecType;
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{Fate, ProjectBlock, ProjectBlockKind, ProjectRung};

/// An action, while the steps that name it are read.
pub(super) struct ChartAction {
    /// What tags and rungs of it are called.
    name: String,
    target: ActionTarget,
    /// What its variable has other than in the original.
    differences: BTreeSet<String>,
    /// The bit by which a body is executed, without what is stored.
    active: Option<String>,
    set: Vec<RungCondition>,
    reset: Vec<RungCondition>,
    set_in: Option<ActionTime>,
    reset_in: Option<ActionTime>,
}

/// What an action acts on.
#[derive(Clone)]
enum ActionTarget {
    Variable(LocatedPlace),
    /// A subroutine.
    Body(String),
}

/// A time after which an action is set or reset.
#[derive(Clone)]
struct ActionTime {
    /// The word with the rest, in ms.
    rest: String,
    /// The bit that is ON in the scan in which it ends.
    over: RungCondition,
}

/// An action at a step.
#[derive(Clone, Copy)]
struct ActionUse<'c> {
    step: usize,
    action: &'c SfcAction,
}

/// The actions by their names, in the order in which the text has them.
#[derive(Default)]
struct ChartActions {
    all: Vec<ChartAction>,
    known: KnownActions,
}

/// The actions that steps on a way name, by their names in small letters: where each stands in the
/// list of all, or why it has a stub.
pub(super) type KnownActions = HashMap<String, Result<usize, String>>;

/// Named where an action block has no step.
pub(super) const AT_NO_STEP: &str = "an action block at no step";
/// Named where no way leads to the step of an action.
pub(super) const NEVER: &str = "no way leads to its step: it never acts";

impl<'c> ChartWork<'c> {
    /// The rungs of all actions; `needed` is what the conditions of transitions need.
    pub(super) fn actions(&mut self, needed: Vec<ProjectRung>) -> KnownActions {
        let mut actions = ChartActions::default();
        let order = self.links.order.clone();
        let mut uses = self.uses();
        for (number, step) in order.iter().enumerate() {
            for used in uses.remove(step).unwrap_or_default() {
                self.act(used, &mut actions);
            }
            self.write_batch(*step);
            if number == 0 && !needed.is_empty() {
                self.judgement(*step, &needed, &mut actions);
            }
        }
        let mut rest: Vec<usize> = uses.keys().copied().collect();
        rest.sort_unstable();
        for used in rest.iter().flat_map(|step| &uses[step]) {
            self.row(self.text(*used), "action", Fate::Different(vec![NEVER.to_owned()]));
        }
        for action in &actions.all {
            self.store(action);
        }
        actions.known
    }

    /// The actions of each step, in the file's order.
    fn uses(&mut self) -> HashMap<usize, Vec<ActionUse<'c>>> {
        let mut uses: HashMap<usize, Vec<ActionUse<'c>>> = HashMap::new();
        let chart = self.chart;
        for (at, block) in chart.blocks.iter().enumerate() {
            let steps = match self.links.blocks[at].clone() {
                Ok(steps) if steps.is_empty() => Err(AT_NO_STEP.to_owned()),
                found => found,
            };
            for action in &block.actions {
                match &steps {
                    Ok(steps) => {
                        for step in steps {
                            uses.entry(*step).or_default().push(ActionUse { step: *step, action });
                        }
                    }
                    Err(why) => {
                        let text = format!("action {}", action_name(action));
                        self.refuse(text, why.clone());
                    }
                }
            }
        }
        uses
    }

    /// What stands for an action in the report.
    fn text(&self, used: ActionUse<'_>) -> String {
        let ActionUse { step, action } = used;
        let name = action_name(action);
        format!("action {} {name} of {}", action.qualifier, self.chart.steps[step].name)
    }

    fn refuse(&mut self, text: String, why: String) {
        self.stub(ScanPart::Acting, &text, &why);
        self.row(text, "action", Fate::Todo(why));
    }

    /// What conditions of transitions need is an action of the first initial step.
    fn judgement(&mut self, step: usize, needed: &[ProjectRung], actions: &mut ChartActions) {
        let name = "judgement".to_owned();
        let doc = format!("What the transitions of {} need of the next scan", self.place.title);
        // Each condition gave its rungs names of its own.
        let mut names = RungNames::default();
        let mut rungs = needed.to_vec();
        rungs.iter_mut().for_each(|rung| names.keep_apart(rung));
        let call = self.subroutine(&name, doc, rungs);
        let mut action = ChartAction::of(name, ActionTarget::Body(call));
        action.set.push(self.is_active(step));
        actions.all.push(action);
    }

    fn subroutine(&mut self, name: &str, doc: String, rungs: Vec<ProjectRung>) -> String {
        let call = self.memory.names.fresh(&format!("{}_{name}", self.place.title));
        self.done.blocks.push(ProjectBlock {
            kind: ProjectBlockKind::Subroutine,
            name: call.clone(),
            doc,
            rungs,
            stages: Vec::new(),
        });
        call
    }

    /// An action of a step acts.
    fn act(&mut self, used: ActionUse<'c>, actions: &mut ChartActions) {
        let text = self.text(used);
        let found = self.found(used, actions);
        let done = found.and_then(|at| {
            let differences = self.qualified(used, &mut actions.all[at])?;
            Ok([&actions.all[at].differences, &differences]
                .into_iter()
                .flatten()
                .cloned()
                .collect())
        });
        let done: Result<BTreeSet<String>, String> = done;
        match done {
            Ok(differences) if differences.is_empty() => self.row(text, "action", Fate::Exact),
            Ok(differences) => {
                let all = differences.into_iter().collect();
                self.row(text, "action", Fate::Different(all));
            }
            Err(why) => {
                if let ActionBody::Inline(SfcBody::Text(original)) = &used.action.body {
                    self.stub(ScanPart::Acting, &format!("{text}: {original}"), &why);
                    self.row(text, "action", Fate::Todo(why));
                } else {
                    self.refuse(text, why);
                }
            }
        }
    }

    /// The action that a step names.
    fn found(&mut self, used: ActionUse<'c>, actions: &mut ChartActions) -> Result<usize, String> {
        let name = match &used.action.body {
            ActionBody::Named(name) => name,
            ActionBody::Inline(body) => {
                let step = &self.chart.steps[used.step].name;
                let action = self.body_action(&format!("{step}_inline"), body)?;
                actions.all.push(action);
                return Ok(actions.all.len() - 1);
            }
        };
        let key = name.to_lowercase();
        if let Some(known) = actions.known.get(&key) {
            return known.clone();
        }
        let made = self.named(name);
        let found = made.map(|action| {
            actions.all.push(action);
            actions.all.len() - 1
        });
        actions.known.insert(key, found.clone());
        found
    }

    fn named(&mut self, name: &str) -> Result<ChartAction, String> {
        let body = self.chart.actions.iter().find(|one| one.name.eq_ignore_ascii_case(name));
        let variable = self.memory.variable(self.place.scope, name);
        let is_variable =
            variable.is_some_and(|id| self.memory.variables[id].usage != VariableUse::Step);
        match body {
            _ if name.is_empty() => Err("an action without a name".to_owned()),
            Some(_) if is_variable => Err(format!("`{name}` is an action and a variable")),
            Some(named) => self.body_action(name, &named.body),
            None => {
                let (found, differences) =
                    asked(self.memory, self.units, self.place, |body| body.written(name, true));
                let bit = found?;
                if bit.kind != IecType::Bool {
                    return Err(format!("an action `{name}`, which is no BOOL"));
                }
                let target = ActionTarget::Variable(bit);
                Ok(ChartAction { differences, ..ChartAction::of(name.to_owned(), target) })
            }
        }
    }

    /// An action with a body, as a subroutine.
    fn body_action(&mut self, name: &str, body: &SfcBody) -> Result<ChartAction, String> {
        let SfcBody::Ladder(elements) = body else {
            return Err(format!("an action in {}", body.language()));
        };
        let title = format!("{}, action {name}", self.place.title);
        let place = BodyPlace { title: &title, ..self.place };
        let mut done = translated(self.memory, self.units, elements, place);
        self.done.blocks.append(&mut done.blocks);
        self.done.outcomes.append(&mut done.outcomes);
        let doc = format!("The action {name} of {}", self.place.title);
        let call = self.subroutine(name, doc, done.rungs);
        Ok(ChartAction::of(name.to_owned(), ActionTarget::Body(call)))
    }

    /// The bit that keeps whether a step was active before the transitions of a scan.
    fn was(&mut self, step: usize) -> RungCondition {
        if let Some(name) = self.was.get(&step) {
            return RungCondition::bit(name);
        }
        let name = &self.chart.steps[step].name;
        let doc = format!("{name} was active when the scan began");
        let label = format!("{name}_was");
        let bit = self.own_tag(&label, "bit", doc);
        let steps = vec![act(self.is_active(step), format!("OUT {bit}"))];
        self.rung(ScanPart::Times, &label, steps);
        self.was.insert(step, bit.clone());
        RungCondition::bit(bit)
    }

    /// The duration of an action.
    fn duration(&mut self, action: &SfcAction) -> Result<(IecFormula, BTreeSet<String>), String> {
        let text = &action.duration;
        if text.is_empty() {
            return Err(format!("the qualifier {} without a duration", action.qualifier));
        }
        let (value, differences) =
            asked(self.memory, self.units, self.place, |body| body.value_of(text));
        let value = value?.fitted(IecType::Time);
        value.map(|value| (value, differences)).map_err(|_| format!("the duration `{text}`"))
    }

    /// What an action does at a step; with the differences.
    fn qualified(
        &mut self,
        used: ActionUse<'_>,
        action: &mut ChartAction,
    ) -> Result<BTreeSet<String>, String> {
        let qualifier = used.action.qualifier.as_str();
        let active = self.is_active(used.step);
        let tag = self.steps[used.step].clone()?;
        let mut differences = BTreeSet::new();
        if !used.action.indicator.is_empty() {
            differences.insert("its indicator does nothing, as in MatIEC's code".to_owned());
        }
        match qualifier {
            "S" => action.set.push(active),
            "R" => action.reset.push(active),
            "N" | "P" | "P1" | "P0" => {
                let was = self.was(used.step);
                self.write(action, used.step, &AtStep { active, was, qualifier, in_time: None });
            }
            "L" | "D" => {
                let (duration, more) = self.duration(used.action)?;
                differences.extend(more);
                let reads = [duration.reads, vec![TouchedPlace::of(&tag.name)]].concat();
                let operator = if qualifier == "L" { "<" } else { ">=" };
                let time = format!("{}.T", tag.name);
                let in_time = RungCondition::compare(&time, operator, &duration.text, reads);
                let was = self.was(used.step);
                let in_time = Some(in_time);
                self.write(action, used.step, &AtStep { active, was, qualifier, in_time });
            }
            "SD" | "DS" | "SL" => {
                let (duration, more) = self.duration(used.action)?;
                differences.extend(more);
                let was = self.was(used.step);
                let at = AtStep { active, was, qualifier, in_time: None };
                self.timed(action, used.step, &at, &duration);
            }
            _ => return Err(format!("the qualifier `{qualifier}`")),
        }
        Ok(differences)
    }

    /// What the steps of an action write: its variable, or the bit by which its body is executed.
    /// That begins each scan OFF, as MatIEC's state of an action.
    fn written_bit(&mut self, action: &mut ChartAction) -> String {
        if let ActionTarget::Variable(bit) = &action.target {
            return bit.text.clone();
        }
        if let Some(bit) = &action.active {
            return bit.clone();
        }
        let name = &action.name;
        let doc = format!("{name} is executed in this scan");
        let bit = self.own_tag(&format!("{name}_active"), "bit", doc);
        let steps = vec![act(RungCondition::Constant(true), format!("RST {bit}"))];
        self.rung(ScanPart::Times, &format!("{name} begins"), steps);
        action.active = Some(bit.clone());
        bit
    }

    /// N, P, P0, L and D write a variable, or the bit of a body.
    fn write(&mut self, action: &mut ChartAction, step: usize, at: &AtStep<'_>) {
        let turns = at.turns();
        let text = self.written_bit(action);
        if self.batch.bits.contains(&text) {
            self.write_batch(step);
        }
        self.batch.on.push(act(turns.on, format!("SET {text}")));
        self.batch.off.push(act(turns.off, format!("RST {text}")));
        self.batch.bits.insert(text);
    }

    /// Writes the bits of a step together.
    fn write_batch(&mut self, step: usize) {
        let StepBatch { on, off, bits: _ } = std::mem::take(&mut self.batch);
        let name = &self.chart.steps[step].name;
        self.rung(ScanPart::Acting, &format!("in {name}"), on);
        self.rung(ScanPart::Acting, &format!("after {name}"), off);
    }

    /// SD, DS and SL begin a time.
    fn timed(
        &mut self,
        action: &mut ChartAction,
        step: usize,
        at: &AtStep<'_>,
        duration: &IecFormula,
    ) {
        let begins = at.begins();
        let is_limit = at.qualifier == "SL";
        let time = self.time(action, is_limit);
        let mut steps =
            vec![act(begins.clone(), format!("MATH {} = {}", time.rest, duration.text))];
        if at.qualifier == "DS" {
            steps.push(act(at.ends(), format!("MOVE 0 to={}", time.rest)));
        }
        if is_limit {
            action.set.push(begins);
        }
        let name = format!("{} in {}", action.name, self.chart.steps[step].name);
        self.rung(ScanPart::Acting, &name, steps);
    }

    /// The time after which an action is set, or reset.
    fn time(&mut self, action: &mut ChartAction, is_reset: bool) -> ActionTime {
        let place = if is_reset { &mut action.reset_in } else { &mut action.set_in };
        if let Some(time) = place {
            return time.clone();
        }
        let verb = if is_reset { "reset" } else { "set" };
        let elapsed = self.elapsed();
        let name = &action.name;
        let rest = self.own_tag(
            &format!("{name}_{verb}_in"),
            "int",
            format!("{name}: ms until it is {verb}"),
        );
        let over =
            self.own_tag(&format!("{name}_{verb}"), "bit", format!("{name}: it is {verb} now"));
        let runs = RungCondition::compare(&rest, ">", "0", Vec::new());
        let ends = RungCondition::compare(&rest, "<=", &elapsed, Vec::new());
        let label = format!("{name} {verb}");
        self.rung(
            ScanPart::Times,
            &label,
            vec![act(RungCondition::all([runs.clone(), ends]), format!("OUT {over}"))],
        );
        let text = format!("MATH {rest} = max({rest} - {elapsed}, 0)");
        self.rung(ScanPart::Times, &format!("{label} in"), vec![act(runs, text)]);
        let time = ActionTime { rest, over: RungCondition::bit(over) };
        *place = Some(time.clone());
        let list = if is_reset { &mut action.reset } else { &mut action.set };
        list.push(time.over.clone());
        time
    }

    /// S and R of an action, and its call.
    fn store(&mut self, action: &ChartAction) {
        let name = &action.name;
        let is_stored = !action.set.is_empty();
        let stored = match &action.target {
            ActionTarget::Variable(bit) => bit.text.clone(),
            ActionTarget::Body(_) if is_stored => {
                self.own_tag(&format!("{name}_stored"), "bit", format!("{name} is stored"))
            }
            ActionTarget::Body(_) => String::new(),
        };
        let parts = [
            StorePart { when: &action.set, verb: "SET", time: &action.set_in },
            StorePart { when: &action.reset, verb: "RST", time: &action.reset_in },
        ];
        for StorePart { when, verb, time } in parts {
            if when.is_empty() || stored.is_empty() {
                continue;
            }
            let when = RungCondition::any(when.iter().cloned());
            let mut steps = vec![act(when.clone(), format!("{verb} {stored}"))];
            if let Some(time) = time {
                steps.push(act(when, format!("MOVE 0 to={}", time.rest)));
            }
            let label = if verb == "SET" { "set" } else { "reset" };
            self.rung(ScanPart::Acting, &format!("{name} {label}"), steps);
        }
        if let ActionTarget::Body(call) = &action.target {
            let stored = is_stored.then_some(&stored);
            let bits = action.active.iter().chain(stored);
            let when = RungCondition::any(bits.map(RungCondition::bit));
            self.rung(ScanPart::Called, name, vec![act(when, format!("CALL {call}"))]);
        }
    }
}

/// What sets or resets an action.
struct StorePart<'a> {
    when: &'a [RungCondition],
    verb: &'static str,
    time: &'a Option<ActionTime>,
}

impl ChartAction {
    fn of(name: String, target: ActionTarget) -> ChartAction {
        ChartAction {
            name,
            target,
            differences: BTreeSet::new(),
            active: None,
            set: Vec::new(),
            reset: Vec::new(),
            set_in: None,
            reset_in: None,
        }
    }
}

/// What an action is called in the report.
fn action_name(action: &SfcAction) -> String {
    match &action.body {
        ActionBody::Named(name) => name.clone(),
        ActionBody::Inline(body) => format!("in {}", body.language()),
    }
}
