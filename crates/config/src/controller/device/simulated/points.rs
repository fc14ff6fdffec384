//! The points of each kind of part, and all points of a plant by name.

use std::cell::OnceCell;
use std::collections::HashMap;

use super::keys::{Keys, PartKind};
use rungd_io::plant::settings::PointId;
use rungd_language::resolve::names::NAME_MAX;
use rungd_language::source::atom::is_name;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, one_of};
use rungd_language::source::nearest::{KnownNames, Near};
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;

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
#[derive(Default)]
pub struct Points {
    pub all: Vec<PlantPoint>,
    /// The first point of each part.
    pub firsts: Vec<PointId>,
    by_name: HashMap<String, PointId>,
    by_part: HashMap<String, PointsOfPart>,
    /// The names of all parts, for the help about an unknown part.
    known_parts: OnceCell<KnownNames>,
}

/// The points of one part.
#[derive(Default)]
struct PointsOfPart {
    points: Vec<PointId>,
    /// Their names without that of the part, for the help about an unknown point.
    known: OnceCell<KnownNames>,
}

/// Maximum number of points in a help.
const LISTED_MAX: usize = 12;

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

/// A point that every part of a kind has, for editors.
pub struct OfferedPoint {
    /// Its name behind the part's.
    pub name: &'static str,
    /// The words for the type of its value.
    pub holds: &'static str,
    /// Whether it is a command to the part; otherwise the part reports it.
    pub is_command: bool,
}

/// The points that every part of a kind has, for editors. Empty if `kind` is not the name of a
/// kind.
pub fn points_of(kind: &str) -> Vec<OfferedPoint> {
    let kind = PartKind::NAMES.iter().find(|(name, _)| *name == kind);
    let all = kind.map_or(&[][..], |(_, kind)| fixed(*kind));
    let offered = |of: &Fixed| OfferedPoint {
        name: of.name,
        holds: of.holds.words(),
        is_command: of.role != PointRole::Told,
    };
    all.iter().map(offered).collect()
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

const DELAY: [Fixed; 3] = [
    point("in", Holds::Bit, PointRole::Needed),
    point("enable", Holds::Bit, PointRole::Command(1)),
    point("out", Holds::Bit, PointRole::Told),
];

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
        let mut points = Points::default();
        let mut names = HashMap::new();
        for part in &keys.parts {
            points.firsts.push(points.next());
            let Some(name) = &part.name else { continue };
            check_name(name, "a part", &mut names, findings);
            if name.text.len() > NAME_MAX {
                // Each of its points would contain it.
                continue;
            }
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
        let mut names = HashMap::new();
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
        let base = name.split_once('.').map_or("", |(base, _)| base);
        match self.by_part.get_mut(base) {
            Some(of) => of.points.push(id),
            None => {
                let of = PointsOfPart { points: vec![id], ..PointsOfPart::default() };
                self.by_part.insert(base.to_owned(), of);
            }
        }
        if self.by_name.insert(name.clone(), id).is_some() && part != FAULT {
            let message = format!("`{name}` is there already");
            // The second of two parts with the same name already has a finding, which is the last.
            if findings.last().is_none_or(|finding| finding.span != span) {
                findings.push(Finding::new(Code::DuplicateName, span, message));
            }
        }
        self.all.push(PlantPoint { name, holds, role, span });
    }

    /// As [`Points::find`], for a point that drives a command: the help names outputs alone.
    pub fn find_source(&self, text: &Text) -> Result<(PointId, &PlantPoint), Finding> {
        self.find(text).map_err(|finding| {
            let part = text.text.split_once('.').map_or("", |(part, _)| part);
            let Some(of) = self.by_part.get(part) else { return finding };
            let is_told = |id: &&PointId| self.all[id.0 as usize].role == PointRole::Told;
            let points = of.points.iter().filter(is_told).copied().collect();
            let told = PointsOfPart { points, ..PointsOfPart::default() };
            finding.near_any(None).help(self.listed(&told))
        })
    }

    /// The point that a text names, or the finding.
    pub fn find(&self, text: &Text) -> Result<(PointId, &PlantPoint), Finding> {
        if let Some(id) = self.by_name.get(&text.text) {
            return Ok((*id, &self.all[id.0 as usize]));
        }
        let message = format!("the plant has no point `{}`", text.text);
        let (part, name) = text.text.split_once('.').unwrap_or_default();
        let (help, near) = match self.by_part.get(part) {
            Some(of) => {
                let known = of.known.get_or_init(|| self.known_points(of));
                let near = Near::new(name, known).behind(&format!("{part}."));
                (self.listed(of), near)
            }
            None => {
                let parts = || KnownNames::new(self.by_part.keys().map(String::as_str));
                let near = Near::new(part, self.known_parts.get_or_init(parts));
                (format!("there is no part `{part}`").into(), near.followed_by(&format!(".{name}")))
            }
        };
        let finding = Finding::new(Code::UnknownName, text.span, message);
        Err(finding.help(help).near_any(Some(Box::new(near))))
    }

    fn known_points(&self, of: &PointsOfPart) -> KnownNames {
        let names = of.points.iter().map(|id| self.all[id.0 as usize].name.split_once('.'));
        KnownNames::new(names.flatten().map(|(_, name)| name))
    }

    /// A help: the points of a part.
    fn listed(&self, of: &PointsOfPart) -> Help {
        let first = of.points.iter().take(LISTED_MAX);
        let names = first.map(|id| &*self.all[id.0 as usize].name);
        let help = one_of("there are", names).possible();
        match of.points.len().saturating_sub(LISTED_MAX) {
            0 => help,
            more => help.and(&format!(", and {more} more")),
        }
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

fn check_name<'k>(
    name: &'k Text,
    what: &str,
    names: &mut HashMap<&'k str, Span>,
    findings: &mut Vec<Finding>,
) {
    if !is_name(&name.text) {
        findings.push(no_name(name, what));
    }
    if name.text.len() > NAME_MAX {
        let message = format!("this name of {what} has {} characters", name.text.len());
        let finding = Finding::new(Code::ForbiddenName, name.span, message);
        findings.push(finding.help(format!("a name has at most {NAME_MAX}")));
    }
    if what == "a part" && name.text == FAULT {
        let message = "`fault` is where the faults are: `fault.NAME`";
        let finding = Finding::new(Code::ForbiddenName, name.span, message);
        findings.push(finding.help("choose a different name for the part"));
    }
    if let Some(first) = names.get(name.text.as_str()) {
        let message = format!("{what} is called `{}` already", name.text);
        let finding = Finding::new(Code::DuplicateName, name.span, message);
        findings.push(finding.label("again here").related(*first, "first here"));
    } else {
        names.insert(&name.text, name.span);
    }
}
