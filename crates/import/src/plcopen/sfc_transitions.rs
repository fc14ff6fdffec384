//! The transitions of a chart: what each waits for, which step it leaves and which it enters.
//!
//! Called by `sfc`. All conditions are those of the begin of the scan. Of several transitions that
//! leave one step the first one whose condition is ON fires: in the order of their priorities, then
//! from left to right. Those that fire leave their steps at once, and enter others behind that.

use std::collections::{HashMap, HashSet};

use super::body::{BodyPlace, JudgedCondition};
use super::elements::{ChartCondition, ConditionSource, ElementBody, LadderElement, Modifier};
use super::networks::{join, root};
use super::passes::translated;
use super::sfc_elements::{NamedBody, SfcBody, TransitionCondition, condition_at};
use super::sfc_work::{ChartWork, ScanPart, act};
use crate::condition::RungCondition;
use crate::model::Fate;

/// Most transitions of a step whose conditions are compared with each other.
const COMPARED_MAX: usize = 64;
/// Named where MatIEC may enter several branches.
const SELECTION: &str = "a selection without priorities: the first branch from the left whose \
                         condition is ON is taken, as in the standard; MatIEC enters all of them";
/// Named where MatIEC shows a condition steps that are left already.
const PRIORITY: &str = "a condition reads which steps were active when the scan began; MatIEC \
                        shows it steps that a transition with a priority has left as inactive";

impl ChartWork<'_> {
    pub(super) fn transitions(&mut self) {
        let order = self.links.met.clone();
        let mut elements = self.chart.ladder.clone();
        let first = elements.len();
        for at in &order {
            let source = self.source(*at);
            let transition = &self.chart.transitions[*at];
            let label = self.label(*at);
            elements.push(LadderElement {
                id: transition.id,
                x: transition.x,
                y: transition.y,
                order: 0,
                body: ElementBody::Condition(ChartCondition {
                    label,
                    part: "transition",
                    source,
                    is_negated: transition.is_negated,
                }),
            });
        }
        let before = self.done.outcomes.len();
        let judged = self.judged(&elements, self.place);
        self.rows = self.done.outcomes.len() - before;
        let mut conditions: HashMap<usize, JudgedCondition> = HashMap::new();
        for (number, at) in order.iter().enumerate() {
            if let Some(condition) = judged.get(&(first + number)) {
                conditions.insert(*at, condition.clone());
            }
        }
        let order = self.links.transition_order.clone();
        for group in self.groups(&order) {
            self.selection(&group, &conditions);
        }
    }

    /// Translates elements with conditions; the conditions by their elements.
    fn judged(
        &mut self,
        elements: &[LadderElement],
        place: BodyPlace<'_>,
    ) -> HashMap<usize, JudgedCondition> {
        let mut done = translated(self.memory, self.units, elements, place);
        done.heads.into_iter().for_each(|rung| self.push(ScanPart::Heads, rung));
        self.needed.append(&mut done.rungs);
        self.done.blocks.append(&mut done.blocks);
        let before = self.done.outcomes.len();
        self.done.outcomes.append(&mut done.outcomes);
        for condition in done.conditions.values_mut() {
            condition.network += before;
        }
        done.conditions
    }

    /// What a transition is called: `Start to Count`.
    fn label(&self, at: usize) -> String {
        let links = &self.links.transitions[at];
        let name = |steps: &[usize]| {
            steps.first().map_or("nothing", |step| &self.chart.steps[*step].name).to_owned()
        };
        format!("{} to {}", name(&links.from), name(&links.to))
    }

    /// Where the condition of a transition comes from.
    fn source(&mut self, at: usize) -> ConditionSource {
        let chart = self.chart;
        let links = self.links.transitions[at].clone();
        let refused = || {
            links.from.iter().chain(&links.to).find_map(|step| {
                let why = self.steps[*step].as_ref().err()?;
                Some(format!("a step is not translated: {why}"))
            })
        };
        if let Some(why) = links.wrong.clone().or_else(refused) {
            if let TransitionCondition::Named(name) = &chart.transitions[at].condition {
                self.refused.insert(name.to_lowercase(), why.clone());
            }
            return ConditionSource::Refused(why);
        }
        match &chart.transitions[at].condition {
            TransitionCondition::Lines(lines) => ConditionSource::Lines(lines.clone()),
            TransitionCondition::Inline(inline) => match &inline.body {
                SfcBody::Ladder(_) => {
                    let title = format!("{}, transition {}", self.place.title, self.label(at));
                    self.body_condition(inline, &title).unwrap_or_else(ConditionSource::Refused)
                }
                SfcBody::Text(_) | SfcBody::Other(_) => text_source(&inline.body),
            },
            TransitionCondition::Named(name) => {
                self.named.insert(name.to_lowercase());
                let named = chart.conditions.iter().find(|one| one.name.eq_ignore_ascii_case(name));
                match named {
                    Some(NamedBody { body: SfcBody::Ladder(_), .. }) => {
                        let found = self.named_condition(name, named);
                        found.unwrap_or_else(ConditionSource::Refused)
                    }
                    Some(named) => text_source(&named.body),
                    None => {
                        let why = format!("no transition of the program is called `{name}`");
                        ConditionSource::Refused(why)
                    }
                }
            }
        }
    }

    fn named_condition(
        &mut self,
        name: &str,
        named: Option<&NamedBody>,
    ) -> Result<ConditionSource, String> {
        let key = name.to_lowercase();
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let found = match named {
            Some(named) => {
                let title = format!("{}, transition {name}", self.place.title);
                self.body_condition(named, &title)
            }
            None => Err(format!("no transition of the program is called `{name}`")),
        };
        self.known.insert(key, found.clone());
        found
    }

    /// The condition in a ladder of its own: the power of the coil that is called as it.
    fn body_condition(
        &mut self,
        named: &NamedBody,
        title: &str,
    ) -> Result<ConditionSource, String> {
        let SfcBody::Ladder(elements) = &named.body else {
            return Err("a transition that is no ladder".to_owned());
        };
        let (elements, at) = with_condition(elements, &named.name)?;
        let place = BodyPlace { title, ..self.place };
        let judged = self.judged(&elements, place);
        let found = judged.get(&at).ok_or_else(|| format!("{title}: it has a stub"))?;
        let JudgedCondition { condition, reads_steps, network: _ } = found.clone();
        Ok(ConditionSource::Known { condition, reads_steps })
    }

    /// A condition that is kept in a bit before any transition fires.
    fn kept_condition(&mut self, label: &str, condition: RungCondition) -> RungCondition {
        let doc = format!("The condition of {label}");
        let bit = self.own_tag(&format!("{label}_if"), "bit", doc);
        let steps = vec![act(condition, format!("OUT {bit}"))];
        self.rung(ScanPart::Heads, &format!("{label} if"), steps);
        RungCondition::bit(bit)
    }

    /// The transitions by the steps that they leave, each group in the order of its judgement.
    fn groups(&self, order: &[usize]) -> Vec<Vec<usize>> {
        let mut joined: Vec<usize> = (0..self.chart.steps.len()).collect();
        for at in order {
            let from = &self.links.transitions[*at].from;
            from.windows(2).for_each(|pair| join(&mut joined, pair[0], pair[1]));
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut known: HashMap<usize, usize> = HashMap::new();
        for at in order {
            let Some(step) = self.links.transitions[*at].from.first() else { continue };
            let root = root(&mut joined, *step);
            let group = *known.entry(root).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(*at);
        }
        let turn = |at: &usize| {
            let transition = &self.chart.transitions[*at];
            (transition.priority.unwrap_or(i64::MAX), transition.x, *at)
        };
        groups.iter_mut().for_each(|group| group.sort_by_key(turn));
        groups
    }

    /// The transitions that leave a step, or steps that one transition leaves together.
    fn selection(&mut self, group: &[usize], conditions: &HashMap<usize, JudgedCondition>) {
        let mut earlier: Vec<usize> = Vec::new();
        for at in group {
            let Some(judged) = conditions.get(at) else { continue };
            let is_certain = group.len() <= COMPARED_MAX
                && earlier.iter().all(|other| self.is_certain([*other, *at], conditions));
            if !earlier.is_empty() && !is_certain {
                self.differ(judged.network, SELECTION);
            }
            let has_priority = |one: &super::sfc_elements::SfcTransition| one.priority.is_some();
            if judged.reads_steps && self.chart.transitions.iter().any(has_priority) {
                self.differ(judged.network, PRIORITY);
            }
            let condition = match judged.reads_steps {
                true => self.kept_condition(&self.label(*at), judged.condition.clone()),
                false => judged.condition.clone(),
            };
            self.transition(*at, condition);
            earlier.push(*at);
        }
    }

    /// Whether MatIEC, too, takes one of two transitions alone.
    fn is_certain(&self, pair: [usize; 2], conditions: &HashMap<usize, JudgedCondition>) -> bool {
        let [one, other] = pair;
        let links = [&self.links.transitions[one], &self.links.transitions[other]];
        if !links[0].from.iter().any(|step| links[1].from.contains(step)) {
            return true;
        }
        let priorities =
            [self.chart.transitions[one].priority, self.chart.transitions[other].priority];
        if let [Some(first), Some(second)] = priorities
            && first != second
        {
            return true;
        }
        match (conditions.get(&one), conditions.get(&other)) {
            (Some(one), Some(other)) => is_opposite(&one.condition, &other.condition),
            _ => true,
        }
    }

    /// Adds a difference to a row.
    fn differ(&mut self, row: usize, difference: &str) {
        let fate = &mut self.done.outcomes[row].fate;
        match fate {
            Fate::Exact => *fate = Fate::Different(vec![difference.to_owned()]),
            Fate::Different(all) if !all.iter().any(|one| one == difference) => {
                all.push(difference.to_owned());
            }
            Fate::Different(_) | Fate::Todo(_) => {}
        }
    }

    /// The rungs of a transition: it fires, leaves its steps and enters others.
    fn transition(&mut self, at: usize, condition: RungCondition) {
        let label = self.label(at);
        let links = self.links.transitions[at].clone();
        let bit = self.own_tag(&label.replace(' ', "_"), "bit", format!("{label}: now"));
        let from = links.from.iter().map(|step| self.is_active(*step));
        let when = RungCondition::all(from.chain([condition]));
        let mut steps = vec![act(when.clone(), format!("OUT {bit}"))];
        for step in &links.from {
            steps.push(act(when.clone(), format!("RST {}", self.is_active(*step).text())));
        }
        self.rung(ScanPart::Judged, &label, steps);
        let (mut steps, mut seen) = (Vec::new(), HashSet::new());
        for step in links.to.iter().filter(|step| seen.insert(**step)) {
            let Ok(tag) = &self.steps[*step] else { continue };
            steps.push(act(RungCondition::bit(&bit), format!("SET {}.X", tag.name)));
            if tag.is_timed {
                steps.push(act(RungCondition::bit(&bit), format!("MOVE 0 to={}.T", tag.name)));
            }
        }
        let to = links.to.first().map_or("nothing", |step| &self.chart.steps[*step].name);
        self.rung(ScanPart::Entered, &format!("enter {to}"), steps);
    }
}

/// Whether two conditions are never ON together, by their contacts.
fn is_opposite(one: &RungCondition, other: &RungCondition) -> bool {
    let parts = |condition: &RungCondition| match condition {
        RungCondition::All(parts) => parts.clone(),
        RungCondition::Constant(_)
        | RungCondition::Bit { .. }
        | RungCondition::Compare { .. }
        | RungCondition::Not(_)
        | RungCondition::Any(_) => vec![condition.clone()],
    };
    let others = parts(other);
    parts(one).into_iter().any(|part| others.contains(&part.opposite()))
}

/// The condition of a body that is no ladder.
fn text_source(body: &SfcBody) -> ConditionSource {
    match body {
        SfcBody::Text(text) => ConditionSource::Text(text.clone()),
        SfcBody::Ladder(_) | SfcBody::Other(_) => {
            ConditionSource::Refused(format!("a transition in {}", body.language()))
        }
    }
}

/// The elements of a transition's ladder with a condition in place of the coil that is called as
/// it, or of the only one; and where.
fn with_condition(
    elements: &[LadderElement],
    name: &str,
) -> Result<(Vec<LadderElement>, usize), String> {
    let at = condition_at(elements, name)?;
    let (part, lines) = if let ElementBody::Coil { input, modifier, .. } = &elements[at].body
        && *modifier == Modifier::default()
    {
        ("coil", input.clone())
    } else if let ElementBody::OutVariable { input, is_negated: false, .. } = &elements[at].body {
        ("outVariable", input.clone())
    } else {
        return Err("a transition whose coil is negated, set or on an edge".to_owned());
    };
    let mut elements = elements.to_vec();
    elements[at].body = ElementBody::Condition(ChartCondition {
        label: if name.is_empty() { "condition".to_owned() } else { name.to_owned() },
        part,
        source: ConditionSource::Lines(lines),
        is_negated: false,
    });
    Ok((elements, at))
}
