//! The elements of a ladder body, as the file has them.

use super::xml::{XmlElement, attribute, child, is, is_true, text};
use crate::condition::RungCondition;

/// An element of a ladder body.
#[derive(Clone, Debug)]
pub(super) struct LadderElement {
    pub(super) id: u64,
    pub(super) x: i64,
    pub(super) y: i64,
    /// The order of execution that the file gives; 0: none.
    pub(super) order: u64,
    pub(super) body: ElementBody,
}

/// What an element is.
#[derive(Clone, Debug)]
pub(super) enum ElementBody {
    LeftRail,
    RightRail,
    Contact {
        variable: String,
        modifier: Modifier,
        input: Vec<Connection>,
    },
    Coil {
        variable: String,
        modifier: Modifier,
        input: Vec<Connection>,
    },
    Block(BlockElement),
    InVariable {
        expression: String,
        is_negated: bool,
    },
    OutVariable {
        expression: String,
        is_negated: bool,
        input: Vec<Connection>,
    },
    /// A variable that takes a value, and gives its own.
    InOutVariable {
        expression: String,
        input: Vec<Connection>,
    },
    Connector {
        name: String,
        input: Vec<Connection>,
    },
    Continuation {
        name: String,
    },
    Comment(String),
    /// The condition of a transition of a chart.
    Condition(ChartCondition),
    /// What rungd does not translate, by its name in the file.
    Other {
        name: String,
        input: Vec<Connection>,
    },
}

impl ElementBody {
    /// The block that it is.
    pub(super) fn block(&self) -> Option<&BlockElement> {
        if let ElementBody::Block(block) = self { Some(block) } else { None }
    }
}

/// The condition of a transition.
#[derive(Clone, Debug)]
pub(super) struct ChartCondition {
    /// What the transition is called here.
    pub(super) label: String,
    /// What the file calls the element: `transition`, or the coil of a transition's ladder.
    pub(super) part: &'static str,
    pub(super) source: ConditionSource,
    pub(super) is_negated: bool,
}

/// Where the condition of a transition comes from.
#[derive(Clone, Debug)]
pub(super) enum ConditionSource {
    Lines(Vec<Connection>),
    /// In ST.
    Text(String),
    /// From a body of its own, which is translated already.
    Known {
        condition: RungCondition,
        /// Whether it reads which steps are active.
        reads_steps: bool,
    },
    /// Nowhere, and why.
    Refused(String),
}

impl ChartCondition {
    /// The lines that it comes from.
    pub(super) fn lines(&self) -> &[Connection] {
        match &self.source {
            ConditionSource::Lines(lines) => lines,
            ConditionSource::Text(_)
            | ConditionSource::Known { .. }
            | ConditionSource::Refused(_) => &[],
        }
    }
}

/// A block.
#[derive(Clone, Debug)]
pub(super) struct BlockElement {
    /// Its type: `TON`, `ADD`, a function block of the file.
    pub(super) kind: String,
    /// The name of the instance; a function has none.
    pub(super) instance: Option<String>,
    pub(super) inputs: Vec<BlockPin>,
    pub(super) outputs: Vec<BlockPin>,
}

/// Other names of pins: those of CODESYS.
const PIN_NAMES: [[&str; 2]; 4] = [["SET1", "S1"], ["RESET", "R"], ["SET", "S"], ["RESET1", "R1"]];
/// Other names of CODESYS: the inputs of counters.
const COUNTER_NAMES: [[&str; 2]; 2] = [["RESET", "R"], ["LOAD", "LD"]];

impl BlockElement {
    /// Its input with a name.
    pub(super) fn input(&self, name: &str) -> Option<&BlockPin> {
        let named =
            |wanted: &str| self.inputs.iter().find(|pin| pin.name.eq_ignore_ascii_case(wanted));
        let is_counter = self.kind.to_uppercase().starts_with("CT");
        let others: &[[&str; 2]] = if is_counter { &COUNTER_NAMES } else { &PIN_NAMES };
        named(name).or_else(|| {
            let other = others.iter().find(|[_, own]| *own == name)?;
            named(other[0])
        })
    }

    /// The pin of a function's result.
    ///
    /// # Errors
    /// It has none.
    pub(super) fn result_pin(&self) -> Result<usize, String> {
        let found = self.outputs.iter().position(|pin| pin.name != "ENO");
        found.ok_or_else(|| format!("{} without a result", self.kind))
    }
}

/// A pin of a block.
#[derive(Clone, Debug)]
pub(super) struct BlockPin {
    pub(super) name: String,
    pub(super) modifier: Modifier,
    /// Its place relative to the block.
    pub(super) x: i64,
    pub(super) y: i64,
    /// Of an input: what it is connected to.
    pub(super) input: Vec<Connection>,
    /// Of an output: a variable or constant that CODESYS writes into the pin.
    pub(super) expression: Option<String>,
}

/// What changes a value at a pin, a contact or a coil.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Modifier {
    pub(super) is_negated: bool,
    pub(super) storage: CoilStorage,
    pub(super) edge: SensedEdge,
}

/// Whether a coil keeps its variable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum CoilStorage {
    #[default]
    None,
    Set,
    Reset,
}

/// Which edge counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum SensedEdge {
    #[default]
    None,
    Rising,
    Falling,
}

/// A connection: the element from which power or a value comes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Connection {
    pub(super) id: u64,
    /// The output of a block.
    pub(super) pin: Option<String>,
    /// Where the line ends at that element.
    pub(super) end: Option<[i64; 2]>,
}

/// The element that a node says.
pub(super) fn element(node: XmlElement<'_, '_>) -> LadderElement {
    let [x, y] = position(node, "position");
    let number = |name: &str| attribute(node, name).parse::<u64>();
    LadderElement {
        id: number("localId").unwrap_or(u64::MAX),
        x,
        y,
        order: number("executionOrderId").unwrap_or(0),
        body: body(node),
    }
}

fn body(node: XmlElement<'_, '_>) -> ElementBody {
    let part = |name: &str| child(node, name).map_or_else(String::new, text);
    let input = connections(node);
    let is_negated = is_true(node, "negated");
    match node.tag_name().name() {
        "leftPowerRail" => ElementBody::LeftRail,
        "rightPowerRail" => ElementBody::RightRail,
        "contact" => {
            ElementBody::Contact { variable: part("variable"), modifier: modifier(node), input }
        }
        "coil" => ElementBody::Coil { variable: part("variable"), modifier: modifier(node), input },
        "inVariable" => ElementBody::InVariable { expression: part("expression"), is_negated },
        "outVariable" => {
            ElementBody::OutVariable { expression: part("expression"), is_negated, input }
        }
        "inOutVariable" => ElementBody::InOutVariable { expression: part("expression"), input },
        "block" => ElementBody::Block(BlockElement {
            kind: attribute(node, "typeName"),
            instance: node.attribute("instanceName").map(|name| name.trim().to_owned()),
            inputs: [pins(node, "inputVariables"), pins(node, "inOutVariables")].concat(),
            outputs: pins(node, "outputVariables"),
        }),
        "connector" => ElementBody::Connector { name: attribute(node, "name"), input },
        "continuation" => ElementBody::Continuation { name: attribute(node, "name") },
        "comment" => ElementBody::Comment(text(node)),
        name => ElementBody::Other { name: name.to_owned(), input },
    }
}

fn pins(node: XmlElement<'_, '_>, list: &str) -> Vec<BlockPin> {
    let lists = node.children().filter(|child| is(*child, list));
    let variables = lists.flat_map(|list| list.children().filter(|child| is(*child, "variable")));
    let pin = |node: XmlElement<'_, '_>| {
        let outwards = child(node, "connectionPointOut");
        let [x, y] = outwards.map_or([0, 0], |point| position(point, "relPosition"));
        let expression = outwards.and_then(|point| child(point, "expression")).map(text);
        BlockPin {
            name: attribute(node, "formalParameter"),
            modifier: modifier(node),
            x,
            y,
            input: connections(node),
            expression: expression.filter(|text| !text.is_empty()),
        }
    };
    variables.map(pin).collect()
}

/// The connections of all points of an element where something comes in.
pub(super) fn connections(node: XmlElement<'_, '_>) -> Vec<Connection> {
    let points = node.children().filter(|child| is(*child, "connectionPointIn"));
    let lines = points.flat_map(|point| point.children().filter(|child| is(*child, "connection")));
    let connection = |node: XmlElement<'_, '_>| Connection {
        id: attribute(node, "refLocalId").parse().unwrap_or(u64::MAX),
        pin: node
            .attribute("formalParameter")
            .map(str::trim)
            .filter(|name| !name.is_empty())
            .map(str::to_owned),
        end: node.children().rfind(|child| is(*child, "position")).map(place),
    };
    lines.map(connection).collect()
}

fn modifier(node: XmlElement<'_, '_>) -> Modifier {
    Modifier {
        is_negated: is_true(node, "negated"),
        storage: match attribute(node, "storage").as_str() {
            "set" => CoilStorage::Set,
            "reset" => CoilStorage::Reset,
            _ => CoilStorage::None,
        },
        edge: match attribute(node, "edge").as_str() {
            "rising" => SensedEdge::Rising,
            "falling" => SensedEdge::Falling,
            _ => SensedEdge::None,
        },
    }
}

fn position(node: XmlElement<'_, '_>, name: &str) -> [i64; 2] {
    child(node, name).map_or([0, 0], place)
}

/// The place that an element says; at most a million wide, so that sums stay small.
fn place(node: XmlElement<'_, '_>) -> [i64; 2] {
    let number = |name: &str| {
        let value = attribute(node, name).parse::<f64>().unwrap_or(0.0);
        value.clamp(-1e6, 1e6) as i64
    };
    [number("x"), number("y")]
}
