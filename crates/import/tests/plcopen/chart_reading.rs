//! The interpreter's own reading of charts, and the order in which the text of Beremiz has them.

use std::collections::{HashMap, HashSet};

use roxmltree::Node;

use super::reading::{Element, Line, Part, child, element, lines};

#[derive(Clone, Debug)]
pub struct ActionUse {
    pub name: String,
    pub qualifier: String,
    /// `T#30ms`, or the name of a variable.
    pub duration: String,
}

#[derive(Clone, Debug)]
pub struct Step {
    pub name: String,
    pub is_initial: bool,
    pub actions: Vec<ActionUse>,
}

/// A condition in ST, of the few forms that the tests write.
#[derive(Clone, Debug)]
pub enum Text {
    Bit(String),
    Not(Box<Text>),
    All(Vec<Text>),
    Any(Vec<Text>),
    AtLeast(String, i64),
}

#[derive(Clone, Debug)]
pub enum Condition {
    Text(Text),
    Lines {
        elements: Vec<Element>,
        lines: Vec<Line>,
        /// What its edges belong to.
        key: u64,
    },
}

#[derive(Clone, Debug)]
pub struct Transition {
    pub x: i64,
    pub priority: i64,
    pub from: Vec<usize>,
    pub to: Vec<usize>,
    pub condition: Condition,
}

#[derive(Clone, Debug, Default)]
pub struct ChartUnit {
    pub steps: Vec<Step>,
    pub transitions: Vec<Transition>,
    /// The ladders of actions.
    pub bodies: HashMap<String, Vec<Element>>,
    /// Visits in the file's order: steps, transitions, jumps.
    visits: Vec<Visit>,
    /// The transitions into each step, by lines; and into each visit of a jump.
    into: Vec<Vec<usize>>,
}

#[derive(Clone, Debug)]
enum Visit {
    Step(usize),
    Transition(usize),
    Jump(Vec<usize>),
}

/// How elements of a chart are found.
struct Nodes<'d, 'i> {
    by_id: HashMap<u64, Node<'d, 'i>>,
    steps: HashMap<u64, usize>,
    transitions: HashMap<u64, usize>,
}

impl Nodes<'_, '_> {
    /// The steps or transitions behind all points of an element.
    fn before(&self, node: Node<'_, '_>) -> Vec<usize> {
        let points = node.children().filter(|child| child.tag_name().name() == "connectionPointIn");
        let lines = points.flat_map(|point| point.children().filter(Node::is_element));
        let ids = lines.filter_map(|line| line.attribute("refLocalId")?.parse::<u64>().ok());
        let found = ids.flat_map(|id| match (self.steps.get(&id), self.transitions.get(&id)) {
            (Some(at), _) | (_, Some(at)) => vec![*at],
            _ => self.before(self.by_id[&id]),
        });
        found.collect()
    }
}

fn number(node: Node<'_, '_>, name: &str) -> Option<i64> {
    node.attribute(name)?.parse().ok()
}

/// A ladder whose elements have numbers that no other one has.
fn ladder(node: Node<'_, '_>, base: u64) -> Vec<Element> {
    let names = [
        "leftPowerRail",
        "contact",
        "coil",
        "inVariable",
        "outVariable",
        "block",
        "rightPowerRail",
    ];
    let known = |node: &Node<'_, '_>| names.contains(&node.tag_name().name());
    let shift = |lines: &mut Vec<Line>| lines.iter_mut().for_each(|line| line.id += base);
    let moved = |node| {
        let mut one: Element = element(node);
        one.id += base;
        match &mut one.part {
            Part::Contact { lines, .. } | Part::Coil { lines, .. } | Part::Output { lines, .. } => {
                shift(lines);
            }
            Part::Block { pins, .. } => pins.iter_mut().for_each(|pin| shift(&mut pin.lines)),
            Part::Rail | Part::Input(_) | Part::Idle => {}
        }
        one
    };
    node.children().filter(known).map(moved).collect()
}

/// The chart of a program.
pub fn chart_unit(pou: Node<'_, '_>) -> Option<ChartUnit> {
    let content = child(child(pou, "body")?, "SFC")?;
    let named = |name: &str| {
        let all = content.children().filter(|node| node.tag_name().name() == name);
        all.collect::<Vec<Node<'_, '_>>>()
    };
    let id = |node: &Node<'_, '_>| number(*node, "localId").unwrap() as u64;
    let (steps, transitions) = (named("step"), named("transition"));
    let nodes = Nodes {
        by_id: content.children().filter(Node::is_element).map(|node| (id(&node), node)).collect(),
        steps: steps.iter().enumerate().map(|(at, node)| (id(node), at)).collect(),
        transitions: transitions.iter().enumerate().map(|(at, node)| (id(node), at)).collect(),
    };
    let mut unit = ChartUnit::default();
    for node in &steps {
        let name = node.attribute("name").unwrap().to_owned();
        let is_initial = node.attribute("initialStep") == Some("true");
        unit.steps.push(Step { name, is_initial, actions: Vec::new() });
    }
    let own = ladder(content, 0);
    for node in &transitions {
        let place = child(*node, "position").unwrap();
        unit.transitions.push(Transition {
            x: number(place, "x").unwrap(),
            priority: number(*node, "priority").unwrap_or(i64::MAX),
            from: nodes.before(*node),
            to: Vec::new(),
            condition: condition(pou, *node, &own),
        });
    }
    for (at, node) in steps.iter().enumerate() {
        let before = nodes.before(*node);
        before.iter().for_each(|one| unit.transitions[*one].to.push(at));
        unit.into.push(before);
    }
    for node in content.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "step" => unit.visits.push(Visit::Step(nodes.steps[&id(&node)])),
            "transition" => unit.visits.push(Visit::Transition(nodes.transitions[&id(&node)])),
            "actionBlock" => {
                let step = nodes.before(node)[0];
                unit.visits.push(Visit::Step(step));
                actions(pou, node, step, &mut unit);
            }
            "jumpStep" => {
                let before = nodes.before(node);
                let target = node.attribute("targetName").unwrap();
                let target = unit.steps.iter().position(|step| step.name == target).unwrap();
                before.iter().for_each(|one| unit.transitions[*one].to.push(target));
                unit.visits.push(Visit::Jump(before));
            }
            _ => {}
        }
    }
    Some(unit)
}

/// The body with a name in a list.
fn body<'d, 'i>(pou: Node<'d, 'i>, list: &str, name: &str) -> Option<(Node<'d, 'i>, u64)> {
    let mut all = child(pou, list)?.children().filter(Node::is_element).enumerate();
    let (at, found) = all.find(|(_, node)| node.attribute("name") == Some(name))?;
    let base = if list == "actions" { 1_000_000 } else { 2_000_000 };
    Some((child(found, "body")?.first_element_child()?, base + at as u64 * 10_000))
}

fn condition(pou: Node<'_, '_>, node: Node<'_, '_>, own: &[Element]) -> Condition {
    let id = number(node, "localId").unwrap() as u64;
    let said = child(node, "condition").unwrap();
    let content = said.first_element_child().unwrap();
    match content.tag_name().name() {
        "connectionPointIn" => {
            Condition::Lines { elements: own.to_vec(), lines: lines(said), key: id }
        }
        "reference" => {
            let name = content.attribute("name").unwrap();
            let (ladder_node, base) = body(pou, "transitions", name).unwrap();
            coil_of(ladder(ladder_node, base), name, base)
        }
        _ => match content.first_element_child().unwrap() {
            text if text.tag_name().name() == "ST" => {
                let words = text.descendants().filter(Node::is_text).filter_map(|node| node.text());
                let text: String = words.collect();
                Condition::Text(read(text.trim()))
            }
            ladder_node => {
                let base = 3_000_000 + id * 10_000;
                coil_of(ladder(ladder_node, base), content.attribute("name").unwrap(), base)
            }
        },
    }
}

/// The condition of a ladder: the power of the coil with its name.
fn coil_of(elements: Vec<Element>, name: &str, key: u64) -> Condition {
    let found = elements.iter().find_map(|element| match &element.part {
        Part::Coil { variable, lines, .. } if variable == name => Some(lines.clone()),
        _ => None,
    });
    Condition::Lines { lines: found.unwrap(), elements, key }
}

/// `a`, `NOT a`, `a AND NOT b`, `a OR b`, `n >= 3`, `S1.T >= T#30ms`.
fn read(text: &str) -> Text {
    if text.contains(" AND ") {
        return Text::All(text.split(" AND ").map(read).collect());
    }
    if text.contains(" OR ") {
        return Text::Any(text.split(" OR ").map(read).collect());
    }
    if let Some(rest) = text.strip_prefix("NOT ") {
        return Text::Not(Box::new(read(rest)));
    }
    match text.split_once(" >= ") {
        Some((name, least)) => {
            let least = least.trim_start_matches("T#").trim_end_matches("ms");
            Text::AtLeast(name.to_owned(), least.parse().unwrap())
        }
        None => Text::Bit(text.to_owned()),
    }
}

fn actions(pou: Node<'_, '_>, block: Node<'_, '_>, step: usize, unit: &mut ChartUnit) {
    let all = block.children().filter(|node| node.tag_name().name() == "action");
    for (number, action) in all.enumerate() {
        let duration = action.attribute("duration").unwrap_or("T#0ms").to_owned();
        let name = match child(action, "reference") {
            Some(named) => {
                let name = named.attribute("name").unwrap().to_owned();
                if let Some((node, base)) = body(pou, "actions", &name) {
                    unit.bodies.insert(name.clone(), ladder(node, base));
                }
                name
            }
            None => {
                let id = block.attribute("localId").unwrap().parse::<u64>().unwrap();
                let name = format!("inline {id} {number}");
                let inline = child(action, "inline").unwrap().first_element_child().unwrap();
                let base = 5_000_000 + (id * 10 + number as u64) * 10_000;
                unit.bodies.insert(name.clone(), ladder(inline, base));
                name
            }
        };
        let qualifier = action.attribute("qualifier").unwrap_or("N").to_owned();
        unit.steps[step].actions.push(ActionUse { name, qualifier, duration });
    }
}

/// What the generator of the text has met.
#[derive(Default)]
struct Met {
    steps: HashSet<usize>,
    transitions: Vec<usize>,
    leaving: HashMap<usize, Vec<usize>>,
    /// The steps and the transitions that are in the text.
    order: Vec<usize>,
    written: HashSet<usize>,
}

impl ChartUnit {
    fn meet(&self) -> Met {
        let mut met = Met::default();
        for visit in &self.visits {
            match visit {
                Visit::Step(at) => self.meet_step(*at, &mut met),
                Visit::Transition(at) => self.meet_transition(*at, &mut met),
                Visit::Jump(before) => {
                    before.iter().for_each(|at| self.meet_transition(*at, &mut met));
                }
            }
        }
        met
    }

    fn meet_step(&self, at: usize, met: &mut Met) {
        if met.steps.insert(at) {
            self.into[at].iter().for_each(|one| self.meet_transition(*one, met));
        }
    }

    fn meet_transition(&self, at: usize, met: &mut Met) {
        if met.transitions.contains(&at) {
            return;
        }
        met.transitions.push(at);
        for step in &self.transitions[at].from {
            self.meet_step(*step, met);
            met.leaving.entry(*step).or_default().push(at);
        }
    }

    /// The transitions as their conditions are computed.
    pub fn compute_order(&self) -> Vec<usize> {
        self.meet().transitions
    }

    /// The steps as the text has them.
    pub fn text_order(&self) -> Vec<usize> {
        let mut met = self.meet();
        for at in (0..self.steps.len()).filter(|at| self.steps[*at].is_initial) {
            self.write(at, &mut met);
        }
        met.order
    }

    fn write(&self, at: usize, met: &mut Met) {
        if met.order.contains(&at) {
            return;
        }
        met.order.push(at);
        for one in met.leaving.get(&at).cloned().unwrap_or_default() {
            if met.written.insert(one) {
                self.transitions[one].to.iter().for_each(|step| self.write(*step, met));
            }
        }
    }

    /// The bodies as the text has them; those of conditions belong to the first step.
    pub fn body_order(&self, compute: &str) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (number, at) in self.text_order().into_iter().enumerate() {
            let own = self.steps[at].actions.iter().map(|used| used.name.clone());
            let more = (number == 0).then(|| compute.to_owned());
            for name in own.chain(more) {
                let is_body = self.bodies.contains_key(&name) || name == compute;
                if is_body && !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        names
    }
}
