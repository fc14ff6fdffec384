//! The interpreter's own reading of the XML.

use roxmltree::Node;

#[derive(Clone, Debug)]
pub struct Line {
    pub id: u64,
    pub pin: String,
}

#[derive(Clone, Debug)]
pub struct InputPin {
    pub name: String,
    pub is_negated: bool,
    pub lines: Vec<Line>,
}

#[derive(Clone, Debug)]
pub enum Part {
    Rail,
    Contact {
        variable: String,
        negated: bool,
        edge: String,
        lines: Vec<Line>,
    },
    Coil {
        variable: String,
        negated: bool,
        storage: String,
        edge: String,
        lines: Vec<Line>,
    },
    Input(String),
    Output {
        variable: String,
        lines: Vec<Line>,
    },
    Block {
        kind: String,
        instance: String,
        pins: Vec<InputPin>,
    },
    /// What does nothing: a comment, a right rail.
    Idle,
}

#[derive(Clone, Debug)]
pub struct Element {
    pub id: u64,
    pub x: i64,
    pub y: i64,
    pub part: Part,
}

/// A declared variable.
#[derive(Clone, Debug)]
pub struct Declared {
    pub name: String,
    pub kind: String,
    pub initial: String,
}

/// A program, a function block or a function.
#[derive(Clone, Debug)]
pub struct Unit {
    pub name: String,
    pub is_program: bool,
    /// Of a function.
    pub result: Option<String>,
    pub variables: Vec<Declared>,
    pub elements: Vec<Element>,
}

/// The unit that a node says.
pub fn unit(node: Node<'_, '_>) -> Unit {
    let interface = child(node, "interface").unwrap();
    let declared = interface.descendants().filter(|node| node.tag_name().name() == "variable");
    let variables = declared.map(|variable| {
        let kind = child(variable, "type").unwrap().first_element_child().unwrap();
        let kind = match kind.tag_name().name() {
            "derived" => kind.attribute("name").unwrap(),
            name => name,
        };
        let value = child(variable, "initialValue").and_then(|node| node.first_element_child());
        let initial = value.and_then(|node| node.attribute("value")).unwrap_or_default();
        let name = variable.attribute("name").unwrap().to_owned();
        Declared { name, kind: kind.to_owned(), initial: initial.to_owned() }
    });
    let result = child(interface, "returnType").and_then(|node| node.first_element_child());
    let body = child(child(node, "body").unwrap(), "LD");
    let elements = body.iter().flat_map(|body| body.children().filter(Node::is_element));
    Unit {
        name: node.attribute("name").unwrap().to_owned(),
        is_program: node.attribute("pouType") == Some("program"),
        result: result.map(|kind| kind.tag_name().name().to_owned()),
        variables: variables.collect(),
        elements: elements.map(element).collect(),
    }
}

/// The first child with a name.
pub fn child<'d, 'i>(node: Node<'d, 'i>, name: &str) -> Option<Node<'d, 'i>> {
    node.children().find(|child| child.tag_name().name() == name)
}

pub fn lines(node: Node<'_, '_>) -> Vec<Line> {
    let Some(point) = child(node, "connectionPointIn") else { return Vec::new() };
    let lines = point.children().filter(|line| line.tag_name().name() == "connection");
    lines
        .map(|line| Line {
            id: line.attribute("refLocalId").unwrap().parse().unwrap(),
            pin: line.attribute("formalParameter").unwrap_or_default().to_owned(),
        })
        .collect()
}

/// The element that a node says.
pub fn element(node: Node<'_, '_>) -> Element {
    let text =
        |name: &str| child(node, name).and_then(|node| node.text()).unwrap_or_default().to_owned();
    let word = |name: &str| node.attribute(name).unwrap_or_default().to_owned();
    let negated = node.attribute("negated") == Some("true");
    let position = child(node, "position").unwrap();
    let number = |name: &str| position.attribute(name).unwrap().parse::<i64>().unwrap();
    let part = match node.tag_name().name() {
        "leftPowerRail" => Part::Rail,
        "contact" => Part::Contact {
            variable: text("variable"),
            negated,
            edge: word("edge"),
            lines: lines(node),
        },
        "coil" => Part::Coil {
            variable: text("variable"),
            negated,
            storage: word("storage"),
            edge: word("edge"),
            lines: lines(node),
        },
        "inVariable" => Part::Input(text("expression")),
        "outVariable" => Part::Output { variable: text("expression"), lines: lines(node) },
        "block" => {
            let inputs = child(node, "inputVariables").unwrap();
            let pins = inputs.children().filter(Node::is_element).map(|pin| InputPin {
                name: pin.attribute("formalParameter").unwrap().to_owned(),
                is_negated: pin.attribute("negated") == Some("true"),
                lines: lines(pin),
            });
            Part::Block {
                kind: word("typeName"),
                instance: word("instanceName"),
                pins: pins.collect(),
            }
        }
        "comment" | "rightPowerRail" => Part::Idle,
        name => panic!("the interpreter has no {name}"),
    };
    let id = node.attribute("localId").unwrap().parse().unwrap();
    Element { id, x: number("x"), y: number("y"), part }
}
