//! The points of each kind of part, and all points of a plant by name.

use std::collections::HashMap;

use super::keys::{Keys, PartKind};
use crate::io::plant::settings::PointId;
use crate::source::atom::is_name;
use crate::source::finding::{Code, Finding};
use crate::source::nearest::nearest;
use crate::source::reader::Text;
use crate::source::span::Span;

/// The name of the part to which the commands of faults belong.
pub const FAULT: &str = "fault";

/// The type of a point's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// ON or OFF.
    Bit,
    /// 0 to 1000 thousandths; a bit that drives it is 0 or 1000.
    Opening,
    /// A number.
    Word,
    /// A bit or a number.
    Either,
}

/// A point that every part of a kind has.
struct Fixed {
    name: &'static str,
    holds: Holds,
    role: PointRole,
}

/// The role of a point: command or output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointRole {
    /// A command that must be driven.
    Needed,
    /// A command that need not be driven, with its value in that case.
    Command(i32),
    /// An output of the part.
    Told,
}

/// A point of a plant.
pub struct PlantPoint {
    /// Its name: `belt.eye`.
    pub name: String,
    pub holds: Holds,
    pub role: PointRole,
    /// The place of its part.
    pub span: Span,
}

/// All points of a plant.
pub struct Points {
    pub all: Vec<PlantPoint>,
    /// The first point of each part.
    pub firsts: Vec<PointId>,
    by_name: HashMap<String, PointId>,
}

const fn point(name: &'static str, holds: Holds, role: PointRole) -> Fixed {
    Fixed { name, holds, role }
}

/// The points of a kind, in the order of `io::plant`; named places follow.
fn fixed(kind: PartKind) -> &'static [Fixed] {
    match kind {
        PartKind::Delay => &DELAY,
        PartKind::Motor => &MOTOR,
        PartKind::Conveyor => &CONVEYOR,
        PartKind::Tank => &TANK,
        PartKind::Sensor => &SENSOR,
        PartKind::Pulse => &PULSE,
        PartKind::Lag => &LAG,
    }
}

/// The points that every part of a kind has, for editors: the name, the type of the value, and
/// whether it is a command. Empty if `kind` is not the name of a kind.
pub fn points_of(kind: &str) -> Vec<(&'static str, &'static str, bool)> {
    let kind = PartKind::NAMES.iter().find(|(name, _)| *name == kind);
    let all = kind.map_or(&[][..], |(_, kind)| fixed(*kind));
    all.iter().map(|of| (of.name, of.holds.words(), of.role != PointRole::Told)).collect()
}

impl Holds {
    /// The words for this type, for editors.
    fn words(self) -> &'static str {
        match self {
            Holds::Bit => "a bit",
            Holds::Opening => "thousandths, or a bit",
            Holds::Word => "a number",
            Holds::Either => "a bit or a number",
        }
    }
}

const DELAY: [Fixed; 2] =
    [point("in", Holds::Bit, PointRole::Needed), point("out", Holds::Bit, PointRole::Told)];

const MOTOR: [Fixed; 5] = [
    point("run", Holds::Bit, PointRole::Needed),
    point("trip", Holds::Bit, PointRole::Command(0)),
    point("reset", Holds::Bit, PointRole::Command(1)),
    point("running", Holds::Bit, PointRole::Told),
    point("tripped", Holds::Bit, PointRole::Told),
];

const CONVEYOR: [Fixed; 5] = [
    point("run", Holds::Opening, PointRole::Needed),
    point("feed", Holds::Bit, PointRole::Command(0)),
    point("jam", Holds::Bit, PointRole::Command(0)),
    point("parts", Holds::Word, PointRole::Told),
    point("out", Holds::Bit, PointRole::Told),
];

const TANK: [Fixed; 6] = [
    point("fill", Holds::Opening, PointRole::Command(0)),
    point("drain", Holds::Opening, PointRole::Command(0)),
    point("level", Holds::Word, PointRole::Told),
    point("overflow", Holds::Bit, PointRole::Told),
    point("empty", Holds::Bit, PointRole::Told),
    point("outflow", Holds::Opening, PointRole::Told),
];

const SENSOR: [Fixed; 3] = [
    point("of", Holds::Either, PointRole::Needed),
    point("out", Holds::Bit, PointRole::Told),
    point("value", Holds::Word, PointRole::Told),
];

const PULSE: [Fixed; 2] =
    [point("run", Holds::Bit, PointRole::Command(1)), point("out", Holds::Bit, PointRole::Told)];

const LAG: [Fixed; 2] =
    [point("in", Holds::Opening, PointRole::Needed), point("out", Holds::Word, PointRole::Told)];

impl Points {
    /// The points of all parts, followed by those of all faults.
    pub fn new(keys: &Keys, findings: &mut Vec<Finding>) -> Points {
        let mut points = Points { all: Vec::new(), firsts: Vec::new(), by_name: HashMap::new() };
        let mut names = Vec::new();
        for part in &keys.parts {
            points.firsts.push(points.next());
            let Some(name) = &part.name else { continue };
            check_name(name, "a part", &mut names, findings);
            let kind = part.kind.map_or(&[][..], fixed);
            for Fixed { name: point, holds, role } in kind {
                points.add((&name.text, point), (*holds, *role), name.span, findings);
            }
            for (place, _) in &part.places {
                if !is_name(&place.text) || !place.text.starts_with(char::is_lowercase) {
                    findings.push(no_name(place, "a place"));
                }
                let told = (Holds::Bit, PointRole::Told);
                points.add((&name.text, &place.text), told, place.span, findings);
            }
        }
        let mut names = Vec::new();
        for name in keys.faults.iter().filter_map(|fault| fault.name.as_ref()) {
            check_name(name, "a fault", &mut names, findings);
            if !name.text.starts_with(char::is_lowercase) {
                findings.push(no_name(name, "a fault"));
            }
            let needed = (Holds::Bit, PointRole::Needed);
            points.add((FAULT, &name.text), needed, name.span, findings);
        }
        points
    }

    fn next(&self) -> PointId {
        PointId(self.all.len() as u32)
    }

    fn add(
        &mut self,
        (part, point): (&str, &str),
        (holds, role): (Holds, PointRole),
        span: Span,
        findings: &mut Vec<Finding>,
    ) {
        let (name, id) = (format!("{part}.{point}"), self.next());
        if self.by_name.insert(name.clone(), id).is_some() && part != FAULT {
            // The second of two parts with the same name already has a finding.
            let message = format!("`{name}` is there already");
            if !findings.iter().any(|finding| finding.span == span) {
                findings.push(Finding::new(Code::DuplicateName, span, message));
            }
        }
        self.all.push(PlantPoint { name, holds, role, span });
    }

    /// The point that a text names, or the finding.
    pub fn find(&self, text: &Text) -> Result<(PointId, &PlantPoint), Finding> {
        if let Some(id) = self.by_name.get(&text.text) {
            return Ok((*id, &self.all[id.0 as usize]));
        }
        let message = format!("the plant has no point `{}`", text.text);
        let (part, name) = text.text.split_once('.').unwrap_or_default();
        let known = || self.all.iter().filter_map(|point| point.name.split_once('.'));
        let of_part = || known().filter(|(of, _)| *of == part).map(|(_, name)| name);
        let list = of_part().map(|name| format!("`{part}.{name}`")).collect::<Vec<_>>().join(", ");
        let help = match nearest(name, of_part()) {
            Some(near) => format!("did you mean `{part}.{near}`?"),
            None if !list.is_empty() => format!("there are {list}"),
            None => match nearest(part, known().map(|(part, _)| part)) {
                Some(near) => format!("did you mean `{near}.{name}`?"),
                None => format!("there is no part `{part}`"),
            },
        };
        Err(Finding::new(Code::UnknownName, text.span, message).help(help))
    }
}

fn no_name(name: &Text, what: &str) -> Finding {
    let message = format!("`{}` cannot be the name of {what}", name.text);
    let help = match what {
        "a part" => "write a letter first, then letters, digits and `_`",
        _ => "write a small letter first, then letters, digits and `_`",
    };
    Finding::new(Code::ForbiddenName, name.span, message).help(help)
}

fn check_name(name: &Text, what: &str, names: &mut Vec<Text>, findings: &mut Vec<Finding>) {
    if !is_name(&name.text) {
        findings.push(no_name(name, what));
    }
    if what == "a part" && name.text == FAULT {
        let message = "`fault` is where the faults are: `fault.NAME`";
        let finding = Finding::new(Code::ForbiddenName, name.span, message);
        findings.push(finding.help("take another name for the part"));
    }
    if let Some(first) = names.iter().find(|known| known.text == name.text) {
        let message = format!("{what} is called `{}` already", name.text);
        let finding = Finding::new(Code::DuplicateName, name.span, message);
        findings.push(finding.label("again here").related(first.span, "first here"));
    }
    names.push(name.clone());
}
