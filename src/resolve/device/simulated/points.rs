//! The points of each kind of part, and all points of a plant by name.

use std::collections::HashMap;

use crate::source::device::simulated::{Keys, PartKind};
use crate::source::finding::{Code, Finding};
use crate::source::nearest::did_you_mean;
use crate::source::reader::Text;
use crate::source::span::Span;

/// A point of a plant, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointId(pub u32);

/// A valve or drive that is fully open: 1000 thousandths.
pub mod opening {
    /// Fully open.
    pub const FULL: i32 = 1000;
}

/// The part to which the commands of faults belong.
pub const FAULT: &str = "fault";

/// What a point holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// ON or OFF.
    Bit,
    /// 0 to 1000 thousandths; a bit is nothing or all.
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
    role: Role,
}

/// Which way a point goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// To the part, which makes no sense without.
    Needed,
    /// To the part; where nothing drives it, it is this.
    Command(i32),
    /// From the part.
    Told,
}

/// A point of a plant.
pub struct Point {
    /// `belt.eye`.
    pub name: String,
    pub holds: Holds,
    pub role: Role,
    /// The place of its part.
    pub span: Span,
}

/// All points of a plant.
pub struct Points {
    pub all: Vec<Point>,
    /// The first point of each part.
    pub firsts: Vec<PointId>,
    by_name: HashMap<String, PointId>,
}

const fn point(name: &'static str, holds: Holds, role: Role) -> Fixed {
    Fixed { name, holds, role }
}

/// The points of a kind, as `io::plant` counts them; named places follow.
fn fixed(kind: PartKind) -> &'static [Fixed] {
    use Holds::{Bit, Either, Opening, Word};
    use Role::{Command, Needed, Told};
    match kind {
        PartKind::Delay => const { &[point("in", Bit, Needed), point("out", Bit, Told)] },
        PartKind::Motor => const {
            &[
                point("run", Bit, Needed),
                point("trip", Bit, Command(0)),
                point("reset", Bit, Command(1)),
                point("running", Bit, Told),
                point("tripped", Bit, Told),
            ]
        },
        PartKind::Conveyor => const {
            &[
                point("run", Opening, Needed),
                point("feed", Bit, Command(0)),
                point("jam", Bit, Command(0)),
                point("parts", Word, Told),
                point("out", Bit, Told),
            ]
        },
        PartKind::Tank => const {
            &[
                point("fill", Opening, Command(0)),
                point("drain", Opening, Command(0)),
                point("level", Word, Told),
                point("overflow", Bit, Told),
                point("empty", Bit, Told),
                point("outflow", Opening, Told),
            ]
        },
        PartKind::Sensor => const {
            &[point("of", Either, Needed), point("out", Bit, Told), point("value", Word, Told)]
        },
        PartKind::Pulse => const { &[point("run", Bit, Command(1)), point("out", Bit, Told)] },
    }
}

/// Whether a text can be the name of a part or a point.
pub fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

impl Points {
    /// The points of all parts, and of all faults behind them.
    pub fn new(keys: &Keys, findings: &mut Vec<Finding>) -> Points {
        let mut points =
            Points { all: Vec::new(), firsts: Vec::new(), by_name: HashMap::new() };
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
                let told = (Holds::Bit, Role::Told);
                points.add((&name.text, &place.text), told, place.span, findings);
            }
        }
        let mut names = Vec::new();
        for name in keys.faults.iter().filter_map(|fault| fault.name.as_ref()) {
            check_name(name, "a fault", &mut names, findings);
            if !name.text.starts_with(char::is_lowercase) {
                findings.push(no_name(name, "a fault"));
            }
            let needed = (Holds::Bit, Role::Needed);
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
        (holds, role): (Holds, Role),
        span: Span,
        findings: &mut Vec<Finding>,
    ) {
        let (name, id) = (format!("{part}.{point}"), self.next());
        if self.by_name.insert(name.clone(), id).is_some() && part != FAULT {
            // Of two parts of one name, the second has had its finding.
            let message = format!("`{name}` is there already");
            if !findings.iter().any(|finding| finding.span == span) {
                findings.push(Finding::new(Code::DuplicateName, span, message));
            }
        }
        self.all.push(Point { name, holds, role, span });
    }

    /// A point that a text names, or the finding.
    pub fn find(&self, text: &Text) -> Result<(PointId, &Point), Finding> {
        if let Some(id) = self.by_name.get(&text.text) {
            return Ok((*id, &self.all[id.0 as usize]));
        }
        let message = format!("the plant has no point `{}`", text.text);
        let part = text.text.split('.').next().unwrap_or_default();
        let of_part = || {
            let points = self.all.iter().map(|point| point.name.as_str());
            points.filter(move |name| name.split('.').next() == Some(part))
        };
        let near = did_you_mean(&text.text, self.all.iter().map(|point| point.name.as_str()));
        let list = of_part().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let help = match near {
            Some(near) => near,
            None if list.is_empty() => format!("there is no part `{part}`"),
            None => format!("there are {list}"),
        };
        Err(Finding::new(Code::UnknownName, text.span, message).help(help))
    }
}

fn no_name(name: &Text, what: &str) -> Finding {
    let message = format!("`{}` cannot be the name of {what}", name.text);
    let help = "write a small letter first, then letters, digits and `_`";
    Finding::new(Code::ForbiddenName, name.span, message).help(help)
}

fn check_name(
    name: &Text,
    what: &str,
    names: &mut Vec<Text>,
    findings: &mut Vec<Finding>,
) {
    if !is_name(&name.text) || (what == "a part" && name.text == FAULT) {
        findings.push(no_name(name, what));
    }
    if let Some(first) = names.iter().find(|known| known.text == name.text) {
        let message = format!("{what} is called `{}` already", name.text);
        let finding = Finding::new(Code::DuplicateName, name.span, message);
        findings.push(finding.label("again here").related(first.span, "first here"));
    }
    names.push(name.clone());
}
