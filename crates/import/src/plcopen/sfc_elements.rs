//! A sequential function chart, as the file has it; read by `document`.
//!
//! Steps, transitions and action blocks with what they are connected to. Who follows whom is
//! `sfc_links`' affair, what they become that of `sfc`.

use roxmltree::Node;

use super::elements::{Connection, ElementBody, LadderElement, connections, element};
use super::xml::{XmlElement, attribute, child, content, is, is_true, text};

/// A chart.
#[derive(Clone, Debug, Default)]
pub(super) struct SfcChart {
    pub(super) steps: Vec<SfcStep>,
    pub(super) transitions: Vec<SfcTransition>,
    /// Jumps, divergences and convergences.
    pub(super) links: Vec<SfcLink>,
    pub(super) blocks: Vec<ActionBlock>,
    /// The elements of all kinds in the file's order.
    pub(super) items: Vec<ChartItem>,
    /// Contacts and blocks that lead to transitions.
    pub(super) ladder: Vec<LadderElement>,
    /// The actions with names.
    pub(super) actions: Vec<NamedBody>,
    /// The transitions with names.
    pub(super) conditions: Vec<NamedBody>,
}

/// An element of a chart, by its number among those of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChartItem {
    Step(usize),
    Transition(usize),
    Link(usize),
    Block(usize),
}

/// A step.
#[derive(Clone, Debug)]
pub(super) struct SfcStep {
    pub(super) id: u64,
    pub(super) name: String,
    pub(super) is_initial: bool,
    /// Whether it contains a chart of its own.
    pub(super) is_macro: bool,
    pub(super) input: Vec<Connection>,
}

/// A transition.
#[derive(Clone, Debug)]
pub(super) struct SfcTransition {
    pub(super) id: u64,
    pub(super) x: i64,
    pub(super) y: i64,
    pub(super) priority: Option<i64>,
    pub(super) input: Vec<Connection>,
    pub(super) condition: TransitionCondition,
    pub(super) is_negated: bool,
}

/// The condition of a transition.
#[derive(Clone, Debug)]
pub(super) enum TransitionCondition {
    Lines(Vec<Connection>),
    Named(String),
    Inline(NamedBody),
}

/// What connects steps and transitions.
#[derive(Clone, Debug)]
pub(super) struct SfcLink {
    pub(super) id: u64,
    pub(super) kind: LinkKind,
    pub(super) input: Vec<Connection>,
    /// Where a jump leads to.
    pub(super) target: String,
}

/// What a link is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LinkKind {
    Jump,
    SelectionDivergence,
    SelectionConvergence,
    SimultaneousDivergence,
    SimultaneousConvergence,
}

impl LinkKind {
    /// Its name in the file.
    pub(super) fn name(self) -> &'static str {
        match self {
            LinkKind::Jump => "jumpStep",
            LinkKind::SelectionDivergence => "selectionDivergence",
            LinkKind::SelectionConvergence => "selectionConvergence",
            LinkKind::SimultaneousDivergence => "simultaneousDivergence",
            LinkKind::SimultaneousConvergence => "simultaneousConvergence",
        }
    }

    fn named(name: &str) -> Option<LinkKind> {
        let all = [
            LinkKind::Jump,
            LinkKind::SelectionDivergence,
            LinkKind::SelectionConvergence,
            LinkKind::SimultaneousDivergence,
            LinkKind::SimultaneousConvergence,
        ];
        all.into_iter().find(|kind| kind.name() == name)
    }
}

/// The actions of a step.
#[derive(Clone, Debug)]
pub(super) struct ActionBlock {
    pub(super) input: Vec<Connection>,
    pub(super) actions: Vec<SfcAction>,
}

/// An action of a step.
#[derive(Clone, Debug)]
pub(super) struct SfcAction {
    pub(super) qualifier: String,
    pub(super) duration: String,
    pub(super) indicator: String,
    pub(super) body: ActionBody,
}

/// What an action does.
#[derive(Clone, Debug)]
pub(super) enum ActionBody {
    /// A variable, or an action with a name.
    Named(String),
    Inline(SfcBody),
}

/// A body of a chart with a name.
#[derive(Clone, Debug)]
pub(super) struct NamedBody {
    pub(super) name: String,
    pub(super) body: SfcBody,
}

/// A body within a chart.
#[derive(Clone, Debug)]
pub(super) enum SfcBody {
    Ladder(Vec<LadderElement>),
    /// In ST.
    Text(String),
    /// In another language.
    Other(String),
}

impl SfcBody {
    /// What it says, for the report.
    pub(super) fn language(&self) -> &str {
        match self {
            SfcBody::Ladder(_) => "LD",
            SfcBody::Text(_) => "ST",
            SfcBody::Other(language) => language,
        }
    }
}

impl SfcChart {
    /// The bodies of its transitions, with names or within them.
    pub(super) fn bodies_of_conditions(&self) -> impl Iterator<Item = &NamedBody> {
        let inline = self.transitions.iter().filter_map(|transition| match &transition.condition {
            TransitionCondition::Inline(named) => Some(named),
            TransitionCondition::Lines(_) | TransitionCondition::Named(_) => None,
        });
        self.conditions.iter().chain(inline)
    }

    /// The ladders in it: that of its transitions, and those of actions and transitions.
    pub(super) fn ladders(&self) -> impl Iterator<Item = &[LadderElement]> {
        let named = self.actions.iter().map(|named| &named.body);
        let inline = self.blocks.iter().flat_map(|block| &block.actions).filter_map(|action| {
            if let ActionBody::Inline(body) = &action.body { Some(body) } else { None }
        });
        let conditions = self.bodies_of_conditions().map(|named| &named.body);
        let bodies = named.chain(inline).chain(conditions);
        let ladders = bodies.filter_map(|body| {
            if let SfcBody::Ladder(elements) = body { Some(elements.as_slice()) } else { None }
        });
        std::iter::once(self.ladder.as_slice()).chain(ladders)
    }

    /// The texts of its conditions in ST.
    pub(super) fn texts(&self) -> impl Iterator<Item = &str> {
        self.bodies_of_conditions().filter_map(|named| {
            if let SfcBody::Text(text) = &named.body { Some(text.as_str()) } else { None }
        })
    }
}

/// The coil or variable of a transition's ladder that gives its condition: the one that is called
/// as it, or, of a transition without a name, the only one.
///
/// # Errors
/// There is none.
pub(super) fn condition_at(elements: &[LadderElement], name: &str) -> Result<usize, String> {
    let written = |element: &LadderElement| match &element.body {
        ElementBody::Coil { variable: name, .. }
        | ElementBody::OutVariable { expression: name, .. } => Some(name.trim().to_owned()),
        ElementBody::LeftRail
        | ElementBody::RightRail
        | ElementBody::Contact { .. }
        | ElementBody::Block(_)
        | ElementBody::InVariable { .. }
        | ElementBody::InOutVariable { .. }
        | ElementBody::Connector { .. }
        | ElementBody::Continuation { .. }
        | ElementBody::Comment(_)
        | ElementBody::Condition(_)
        | ElementBody::Other { .. } => None,
    };
    let names = elements.iter().map(written).enumerate();
    let all: Vec<(usize, String)> = names.filter_map(|(at, name)| Some((at, name?))).collect();
    let named = all.iter().find(|(_, text)| text.eq_ignore_ascii_case(name));
    let only = all.first().filter(|_| name.is_empty() && all.len() == 1);
    let found = named.or(only).map(|(at, _)| *at);
    found.ok_or_else(|| "a transition without a coil or variable that is called as it".to_owned())
}

/// The chart of a body; `unit` has its actions and transitions with names.
pub(super) fn chart(content: XmlElement<'_, '_>, unit: XmlElement<'_, '_>) -> SfcChart {
    let mut chart = SfcChart {
        actions: named_bodies(unit, "actions", "action"),
        conditions: named_bodies(unit, "transitions", "transition"),
        ..SfcChart::default()
    };
    content.children().filter(Node::is_element).for_each(|node| item(&mut chart, node));
    chart
}

fn item(chart: &mut SfcChart, node: XmlElement<'_, '_>) {
    let id = id(node);
    let input = connections(node);
    match node.tag_name().name() {
        name @ ("step" | "macroStep") => {
            chart.items.push(ChartItem::Step(chart.steps.len()));
            chart.steps.push(SfcStep {
                id,
                name: attribute(node, "name"),
                is_initial: is_true(node, "initialStep"),
                is_macro: name == "macroStep",
                input,
            });
        }
        "transition" => {
            chart.items.push(ChartItem::Transition(chart.transitions.len()));
            chart.transitions.push(transition(node));
        }
        "actionBlock" => {
            chart.items.push(ChartItem::Block(chart.blocks.len()));
            let actions = node.children().filter(|child| is(*child, "action"));
            chart.blocks.push(ActionBlock { input, actions: actions.map(action).collect() });
        }
        name => match LinkKind::named(name) {
            Some(kind) => {
                chart.items.push(ChartItem::Link(chart.links.len()));
                let target = attribute(node, "targetName");
                chart.links.push(SfcLink { id, kind, input, target });
            }
            None => chart.ladder.push(element(node)),
        },
    }
}

fn transition(node: XmlElement<'_, '_>) -> SfcTransition {
    let place = element(node);
    let condition = child(node, "condition");
    let named = condition.and_then(|one| child(one, "reference"));
    let inline = condition.and_then(|one| child(one, "inline"));
    SfcTransition {
        id: place.id,
        x: place.x,
        y: place.y,
        priority: attribute(node, "priority").parse().ok(),
        input: connections(node),
        condition: match (named, inline) {
            (Some(node), _) => TransitionCondition::Named(attribute(node, "name")),
            (None, Some(node)) => TransitionCondition::Inline(NamedBody {
                name: attribute(node, "name"),
                body: body(node),
            }),
            (None, None) => {
                TransitionCondition::Lines(condition.map_or_else(Vec::new, connections))
            }
        },
        is_negated: condition.is_some_and(|one| is_true(one, "negated")),
    }
}

fn action(node: XmlElement<'_, '_>) -> SfcAction {
    let qualifier = attribute(node, "qualifier").to_uppercase();
    SfcAction {
        qualifier: if qualifier.is_empty() { "N".to_owned() } else { qualifier },
        duration: attribute(node, "duration"),
        indicator: attribute(node, "indicator"),
        body: match child(node, "inline") {
            Some(inline) => ActionBody::Inline(body(inline)),
            None => {
                let named = child(node, "reference");
                ActionBody::Named(named.map_or_else(String::new, |node| attribute(node, "name")))
            }
        },
    }
}

fn named_bodies(unit: XmlElement<'_, '_>, list: &str, name: &str) -> Vec<NamedBody> {
    let lists = unit.children().filter(|child| is(*child, list));
    let all = lists.flat_map(|list| list.children().filter(|child| is(*child, name)));
    let named = |node: XmlElement<'_, '_>| NamedBody {
        name: attribute(node, "name"),
        body: child(node, "body").map_or_else(|| SfcBody::Other("no language".to_owned()), body),
    };
    all.map(named).collect()
}

/// The body that an element contains.
fn body(node: XmlElement<'_, '_>) -> SfcBody {
    let Some(content) = content(node) else {
        return SfcBody::Other("no language".to_owned());
    };
    match content.tag_name().name() {
        "LD" => SfcBody::Ladder(content.children().filter(Node::is_element).map(element).collect()),
        "ST" => SfcBody::Text(text(content)),
        name => SfcBody::Other(name.to_owned()),
    }
}

fn id(node: XmlElement<'_, '_>) -> u64 {
    attribute(node, "localId").parse().unwrap_or(u64::MAX)
}
