//! Networks as ladder graphics: elements with positions, and the lines between them.
//!
//! Contacts and coils stand where `draw` puts them, on its grid. Calls stand right of all that
//! comes to their inputs. Networks stand below each other, and what acts in a network stands from
//! the top down in the order in which it acts: the readers of these files execute it in that order.

use std::fmt::Write as _;

use super::project::{
    BlockCall, CallResult, CallSource, CoilAction, ExportedNetwork, NetworkBody, NetworkCoil,
    NetworkPower,
};
use super::xml_text::paragraph;
use crate::draw::circuit::RungCircuit;
use crate::draw::circuit::{Circuit, ContactForm, ContactSymbol, InstructionSymbol, Outlet};
use crate::draw::grid::RungGrid;

/// The width of a column of contacts, and the height of a row.
const COLUMN: usize = 120;
const ROW: usize = 40;
/// Where lines of power begin.
const LEFT: usize = 40;
/// The size of contacts and coils.
const CONTACT: ElementSize = ElementSize { width: 21, height: 15 };
/// The width of a block, and the height of a row of its pins.
const BLOCK_WIDTH: usize = 120;
const PIN: usize = 20;
/// The space between a block and what is left or right of it.
const GAP: usize = 60;
/// The width of a letter.
const LETTER: usize = 8;

/// The size of an element.
#[derive(Clone, Copy)]
struct ElementSize {
    width: usize,
    height: usize,
}

/// A place on the sheet.
#[derive(Clone, Copy)]
struct NetworkPlace {
    x: usize,
    y: usize,
}

/// A point from which lines lead on: an element, or an output of a block.
#[derive(Clone)]
struct OutPoint {
    id: usize,
    pin: Option<&'static str>,
    at: NetworkPlace,
}

/// The ladder of some networks.
pub(super) fn ladder(networks: &[ExportedNetwork]) -> String {
    let mut sheet = Sheet { text: String::new(), last_id: 0, top: 20, rail: None };
    networks.iter().for_each(|network| sheet.network(network));
    sheet.text
}

/// The sheet on which networks are placed.
struct Sheet {
    text: String,
    last_id: usize,
    /// Where the next network begins.
    top: usize,
    /// The left rail of the network, if something begins at it.
    rail: Option<usize>,
}

/// What is left of an output: where it is, and the space that it took.
struct PlacedSource {
    points: Vec<OutPoint>,
    /// The right end.
    right: usize,
    /// The lower end.
    bottom: usize,
}

impl Sheet {
    fn next_id(&mut self) -> usize {
        self.last_id += 1;
        self.last_id
    }

    fn network(&mut self, network: &ExportedNetwork) {
        if !network.doc.is_empty() {
            let width = network.doc.len().min(100) * LETTER;
            let id = self.next_id();
            let content = paragraph(&network.doc);
            let _ = writeln!(
                self.text,
                "<comment localId=\"{id}\" height=\"{ROW}\" width=\"{width}\"><position \
                 x=\"{LEFT}\" y=\"{}\"/><content>{content}</content></comment>",
                self.top
            );
            self.top += ROW + PIN;
        }
        let top = self.top;
        let bottom = match &network.body {
            NetworkBody::Coils { power, coils } => self.coils(power, coils),
            NetworkBody::Call { call, results } => self.stored(call, results),
        };
        if let Some(id) = self.rail.take() {
            let _ = writeln!(
                self.text,
                "<leftPowerRail localId=\"{id}\" height=\"{}\" width=\"3\"><position x=\"{LEFT}\" \
                 y=\"{top}\"/><connectionPointOut formalParameter=\"\"><relPosition x=\"3\" \
                 y=\"10\"/></connectionPointOut></leftPowerRail>",
                bottom - top
            );
        }
        self.top = bottom + ROW;
    }

    /// The point at the left rail.
    fn rail(&mut self) -> OutPoint {
        let id = match self.rail {
            Some(id) => id,
            None => self.next_id(),
        };
        self.rail = Some(id);
        OutPoint { id, pin: None, at: NetworkPlace { x: LEFT + 3, y: self.top + 10 } }
    }

    /// Coils behind contacts; the lower end.
    fn coils(&mut self, power: &NetworkPower, coils: &[NetworkCoil]) -> usize {
        let outlets = coils.iter().map(|coil| Outlet::Branch(circuit(&coil.power), vec![symbol()]));
        let grid = RungGrid::of(&RungCircuit::Plain(circuit(power), outlets.collect()));
        let origin = NetworkPlace { x: LEFT + GAP, y: self.top };
        let mut placed = PlacedContacts { grid: &grid, origin, next: 0 };
        let rail = vec![self.rail()];
        let shared = self.power(power, rail, &mut placed);
        let x = origin.x + grid.columns * COLUMN;
        let mut ends = Vec::new();
        for (coil, place) in coils.iter().zip(&grid.instructions) {
            let lines = self.power(&coil.power, shared.clone(), &mut placed);
            let at = NetworkPlace { x, y: origin.y + place.row * ROW };
            ends.push(self.coil(&lines, coil, at));
        }
        let bottom = origin.y + grid.rows.max(1) * ROW;
        self.right_rail(&ends, NetworkPlace { x: x + COLUMN, y: self.top });
        bottom
    }

    /// Contacts between points; the points behind them.
    fn power(
        &mut self,
        power: &NetworkPower,
        from: Vec<OutPoint>,
        placed: &mut PlacedContacts<'_>,
    ) -> Vec<OutPoint> {
        match power {
            NetworkPower::Contact { variable, is_negated } => {
                let at = placed.next();
                let id = self.next_id();
                let lines = lines(&from, NetworkPlace { x: at.x, y: at.y + 7 }, at);
                let _ = writeln!(
                    self.text,
                    "<contact localId=\"{id}\" negated=\"{is_negated}\" height=\"{}\" \
                     width=\"{}\">{}{lines}<connectionPointOut><relPosition x=\"{}\" \
                     y=\"7\"/></connectionPointOut><variable>{variable}</variable></contact>",
                    CONTACT.height,
                    CONTACT.width,
                    position(at),
                    CONTACT.width
                );
                let at = NetworkPlace { x: at.x + CONTACT.width, y: at.y + 7 };
                vec![OutPoint { id, pin: None, at }]
            }
            NetworkPower::Series(parts) => {
                parts.iter().fold(from, |from, part| self.power(part, from, placed))
            }
            NetworkPower::Parallel(parts) => {
                let ends = parts.iter().map(|part| self.power(part, from.clone(), placed));
                ends.collect::<Vec<_>>().concat()
            }
            NetworkPower::Constant(_) | NetworkPower::OfRung { .. } => from,
        }
    }

    fn coil(&mut self, from: &[OutPoint], coil: &NetworkCoil, at: NetworkPlace) -> OutPoint {
        let id = self.next_id();
        let storage = match coil.action {
            CoilAction::Assign => "",
            CoilAction::Set => " storage=\"set\"",
            CoilAction::Reset => " storage=\"reset\"",
        };
        let lines = lines(from, NetworkPlace { x: at.x, y: at.y + 7 }, at);
        let _ = writeln!(
            self.text,
            "<coil localId=\"{id}\" negated=\"false\"{storage} height=\"{}\" width=\"{}\">{}\
             {lines}<connectionPointOut><relPosition x=\"{}\" y=\"7\"/></connectionPointOut>\
             <variable>{}</variable></coil>",
            CONTACT.height,
            CONTACT.width,
            position(at),
            CONTACT.width,
            coil.variable
        );
        let at = NetworkPlace { x: at.x + CONTACT.width, y: at.y + 7 };
        OutPoint { id, pin: None, at }
    }

    fn right_rail(&mut self, ends: &[OutPoint], at: NetworkPlace) {
        if ends.is_empty() {
            return;
        }
        let id = self.next_id();
        let lines = ends
            .iter()
            .map(|end| lines(std::slice::from_ref(end), NetworkPlace { x: at.x, y: end.at.y }, at));
        let lines: String = lines.collect();
        let height = ends.last().map_or(0, |end| end.at.y - at.y) + PIN;
        let _ = writeln!(
            self.text,
            "<rightPowerRail localId=\"{id}\" height=\"{height}\" width=\"3\">{}{lines}\
             </rightPowerRail>",
            position(at)
        );
    }

    /// A call whose results are stored; the lower end.
    fn stored(&mut self, call: &BlockCall, results: &[CallResult]) -> usize {
        let at = NetworkPlace { x: LEFT + GAP, y: self.top };
        let mut outputs: Vec<&'static str> = Vec::new();
        results.iter().for_each(|result| {
            if !outputs.contains(&result.pin) {
                outputs.push(result.pin);
            }
        });
        let placed = self.call(call, &outputs, at);
        let mut ends = Vec::new();
        let x = placed.right + GAP;
        for (row, result) in results.iter().enumerate() {
            let Some(from) = placed.points.iter().find(|point| point.pin == Some(result.pin))
            else {
                continue;
            };
            let from = std::slice::from_ref(from);
            let at = NetworkPlace { x, y: self.top + PIN + row * ROW };
            if result.is_coil {
                let coil = NetworkCoil {
                    power: NetworkPower::Constant(true),
                    variable: result.variable.clone(),
                    action: CoilAction::Assign,
                };
                ends.push(self.coil(from, &coil, at));
            } else {
                self.out_variable(from, &result.variable, at);
            }
        }
        self.right_rail(&ends, NetworkPlace { x: x + COLUMN, y: self.top });
        placed.bottom.max(self.top + PIN + results.len() * ROW)
    }

    fn out_variable(&mut self, from: &[OutPoint], variable: &str, at: NetworkPlace) {
        let id = self.next_id();
        let width = (variable.len() * LETTER).max(GAP);
        let lines = lines(from, NetworkPlace { x: at.x, y: at.y + 10 }, at);
        let _ = writeln!(
            self.text,
            "<outVariable localId=\"{id}\" negated=\"false\" height=\"20\" width=\"{width}\">{}\
             {lines}<expression>{variable}</expression></outVariable>",
            position(at)
        );
    }

    fn in_variable(&mut self, text: &str, at: NetworkPlace) -> PlacedSource {
        let id = self.next_id();
        let width = (text.len() * LETTER).max(GAP);
        let _ = writeln!(
            self.text,
            "<inVariable localId=\"{id}\" negated=\"false\" height=\"20\" width=\"{width}\">{}\
             <connectionPointOut><relPosition x=\"{width}\" y=\"10\"/></connectionPointOut>\
             <expression>{text}</expression></inVariable>",
            position(at)
        );
        let end = NetworkPlace { x: at.x + width, y: at.y + 10 };
        let points = vec![OutPoint { id, pin: None, at: end }];
        PlacedSource { points, right: end.x, bottom: at.y + ROW }
    }

    /// What comes to an input.
    fn source(&mut self, source: &CallSource, at: NetworkPlace) -> PlacedSource {
        match source {
            CallSource::Variable(name) => self.in_variable(name, at),
            CallSource::Literal(literal) => self.in_variable(&literal.text(), at),
            CallSource::Call(call) => self.call(call, &["OUT"], at),
            CallSource::Power(NetworkPower::Constant(false)) => self.in_variable("FALSE", at),
            CallSource::Power(power) => {
                let grid = RungGrid::of(&RungCircuit::Plain(circuit(power), Vec::new()));
                let mut placed = PlacedContacts { grid: &grid, origin: at, next: 0 };
                let rail = vec![self.rail()];
                let points = self.power(power, rail, &mut placed);
                let right = at.x + grid.columns * COLUMN;
                PlacedSource { points, right, bottom: at.y + grid.rows.max(1) * ROW }
            }
        }
    }

    /// A call with all that comes to its inputs.
    fn call(
        &mut self,
        call: &BlockCall,
        outputs: &[&'static str],
        at: NetworkPlace,
    ) -> PlacedSource {
        let (mut y, mut right, mut sources) = (at.y, at.x, Vec::new());
        for input in &call.inputs {
            let placed = self.source(&input.source, NetworkPlace { x: at.x, y });
            (y, right) = (placed.bottom, right.max(placed.right));
            sources.push(placed.points);
        }
        let block = NetworkPlace { x: right + GAP, y: at.y };
        let has_enable = call.inputs.iter().any(|input| input.pin == "EN");
        let all = has_enable.then_some("ENO").into_iter().chain(outputs.iter().copied());
        let all: Vec<&'static str> = all.collect();
        let pin_place = |row: usize, x: usize| NetworkPlace { x, y: block.y + PIN * (row + 1) };
        let inputs = call.inputs.iter().zip(&sources).enumerate().map(|(row, (input, from))| {
            let lines = lines(from, pin_place(row, block.x), block);
            format!("<variable formalParameter=\"{}\">{lines}</variable>", input.pin)
        });
        let outs = all.iter().enumerate().map(|(row, pin)| {
            format!(
                "<variable formalParameter=\"{pin}\"><connectionPointOut><relPosition \
                 x=\"{BLOCK_WIDTH}\" y=\"{}\"/></connectionPointOut></variable>",
                PIN * (row + 1)
            )
        });
        let (inputs, outs) = (inputs.collect::<String>(), outs.collect::<String>());
        let height = PIN * (call.inputs.len().max(all.len()) + 1);
        let id = self.next_id();
        let instance = call.instance.iter().map(|name| format!(" instanceName=\"{name}\""));
        let _ = writeln!(
            self.text,
            "<block localId=\"{id}\" typeName=\"{}\"{} height=\"{height}\" width=\"{BLOCK_WIDTH}\">\
             {}<inputVariables>{inputs}</inputVariables><inOutVariables/><outputVariables>{outs}\
             </outputVariables></block>",
            call.type_name,
            instance.collect::<String>(),
            position(block)
        );
        let right = block.x + BLOCK_WIDTH;
        let points = all.iter().enumerate();
        let points = points
            .map(|(row, pin)| OutPoint { id, pin: Some(pin), at: pin_place(row, right) })
            .filter(|point| point.pin != Some("ENO"));
        let points = points.collect();
        PlacedSource { points, right, bottom: y.max(block.y + height + PIN) }
    }
}

/// The contacts of a grid, in the order in which they are placed.
struct PlacedContacts<'g> {
    grid: &'g RungGrid,
    origin: NetworkPlace,
    next: usize,
}

impl PlacedContacts<'_> {
    /// The place of the next contact.
    fn next(&mut self) -> NetworkPlace {
        let place = self.grid.contacts.get(self.next);
        let (column, row) = place.map_or((0, 0), |contact| (contact.column, contact.row));
        self.next += 1;
        NetworkPlace { x: self.origin.x + column * COLUMN, y: self.origin.y + row * ROW }
    }
}

fn position(at: NetworkPlace) -> String {
    format!("<position x=\"{}\" y=\"{}\"/>", at.x, at.y)
}

/// The lines from points to a point of an element that stands at a place.
fn lines(from: &[OutPoint], to: NetworkPlace, element: NetworkPlace) -> String {
    let mut text = format!(
        "<connectionPointIn><relPosition x=\"{}\" y=\"{}\"/>",
        to.x - element.x,
        to.y.saturating_sub(element.y)
    );
    for point in from {
        let pin = point.pin.map(|pin| format!(" formalParameter=\"{pin}\"")).unwrap_or_default();
        let _ = write!(text, "<connection refLocalId=\"{}\"{pin}>{}", point.id, position(to));
        if point.at.y != to.y {
            let x = to.x.saturating_sub(10);
            text += &position(NetworkPlace { x, y: to.y });
            text += &position(NetworkPlace { x, y: point.at.y });
        }
        text += &position(point.at);
        text += "</connection>";
    }
    text + "</connectionPointIn>"
}

/// A power as a circuit of `draw`, for its places.
fn circuit(power: &NetworkPower) -> Circuit {
    let all = |parts: &[NetworkPower]| parts.iter().map(circuit).collect();
    match power {
        NetworkPower::Contact { is_negated, .. } => {
            let form = if *is_negated { ContactForm::Closed } else { ContactForm::Open };
            let label = Default::default();
            Circuit::Contact(ContactSymbol { form, label, branch: None, leaf: 0 })
        }
        NetworkPower::Series(parts) => Circuit::Series(all(parts)),
        NetworkPower::Parallel(parts) => Circuit::Parallel(all(parts)),
        NetworkPower::Constant(_) | NetworkPower::OfRung { .. } => Circuit::Series(Vec::new()),
    }
}

/// A coil of `draw`, for its place.
fn symbol() -> InstructionSymbol {
    let label = Default::default();
    InstructionSymbol { mnemonic: "OUT", coil: Some(""), label, operands: Vec::new() }
}
