//! The points of each kind of part, and all points of a plant by name.

use std::cell::OnceCell;
use std::collections::HashMap;

use super::keys::{PlantKeys, PlantPartKind};
use rungd_io::plant::settings::PointId;
use rungd_language::resolve::names::NAME_MAX;
use rungd_language::source::atom::is_name;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, one_of, possible};
use rungd_language::source::nearest::{KnownNames, UnknownName};
use rungd_language::source::reader::Text;
use rungd_language::source::renaming;
use rungd_language::source::span::Span;

/// The name of the part to which the commands of faults belong.
pub const FAULT: &str = "fault";

/// The type of a point's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointType {
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
struct FixedPoint {
    name: &'static str,
    holds: PointType,
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
    pub holds: PointType,
    pub role: PointRole,
    /// The place of its part.
    pub span: Span,
}

/// All points of a plant.
#[derive(Default)]
pub struct PlantPoints {
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

const fn point(name: &'static str, holds: PointType, role: PointRole) -> FixedPoint {
    FixedPoint { name, holds, role }
}

/// The points of a kind, in the order of `io::plant`; named places follow.
fn fixed(kind: PlantPartKind) -> &'static [FixedPoint] {
    match kind {
        PlantPartKind::Delay => &DELAY,
        PlantPartKind::Motor => &MOTOR,
        PlantPartKind::Conveyor => &CONVEYOR,
        PlantPartKind::Tank => &TANK,
        PlantPartKind::Sensor => &SENSOR,
        PlantPartKind::Pulse => &PULSE,
        PlantPartKind::Lag => &LAG,
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
    let kind = PlantPartKind::NAMES.iter().find(|(name, _)| *name == kind);
    let all = kind.map_or(&[][..], |(_, kind)| fixed(*kind));
    let offered = |fixed: &FixedPoint| OfferedPoint {
        name: fixed.name,
        holds: fixed.holds.words(),
        is_command: fixed.role != PointRole::Told,
    };
    all.iter().map(offered).collect()
}

impl PointType {
    /// The words for this type, for editors.
    fn words(self) -> &'static str {
        match self {
            PointType::Bit => "a bit",
            PointType::Opening => "thousandths, or a bit",
            PointType::Word => "a number",
            PointType::Either => "a bit or a number",
        }
    }
}

const DELAY: [FixedPoint; 3] = [
    point("in", PointType::Bit, PointRole::Needed),
    point("enable", PointType::Bit, PointRole::Command(1)),
    point("out", PointType::Bit, PointRole::Told),
];

const MOTOR: [FixedPoint; 5] = [
    point("run", PointType::Bit, PointRole::Needed),
    point("trip", PointType::Bit, PointRole::Command(0)),
    point("reset", PointType::Bit, PointRole::Command(1)),
    point("running", PointType::Bit, PointRole::Told),
    point("tripped", PointType::Bit, PointRole::Told),
];

const CONVEYOR: [FixedPoint; 5] = [
    point("run", PointType::Opening, PointRole::Needed),
    point("feed", PointType::Bit, PointRole::Command(0)),
    point("jam", PointType::Bit, PointRole::Command(0)),
    point("parts", PointType::Word, PointRole::Told),
    point("out", PointType::Bit, PointRole::Told),
];

const TANK: [FixedPoint; 6] = [
    point("fill", PointType::Opening, PointRole::Command(0)),
    point("drain", PointType::Opening, PointRole::Command(0)),
    point("level", PointType::Word, PointRole::Told),
    point("overflow", PointType::Bit, PointRole::Told),
    point("empty", PointType::Bit, PointRole::Told),
    point("outflow", PointType::Opening, PointRole::Told),
];

const SENSOR: [FixedPoint; 3] = [
    point("of", PointType::Either, PointRole::Needed),
    point("out", PointType::Bit, PointRole::Told),
    point("value", PointType::Word, PointRole::Told),
];

const PULSE: [FixedPoint; 2] = [
    point("run", PointType::Bit, PointRole::Command(1)),
    point("out", PointType::Bit, PointRole::Told),
];

const LAG: [FixedPoint; 2] = [
    point("in", PointType::Opening, PointRole::Needed),
    point("out", PointType::Word, PointRole::Told),
];

impl PlantPoints {
    /// The points of all parts, followed by those of all faults.
    pub fn new(keys: &PlantKeys, findings: &mut Vec<Finding>) -> PlantPoints {
        let mut points = PlantPoints::default();
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
            let part_name = &name.text;
            for FixedPoint { name: point, holds, role } in kind {
                let (point, span) = (format!("{part_name}.{point}"), name.span);
                let point = PlantPoint { name: point, holds: *holds, role: *role, span };
                points.add(part_name, point, findings);
            }
            for (place, _) in &part.places {
                if !is_name(&place.text) || !place.text.starts_with(char::is_lowercase) {
                    findings.push(no_name(place, "a place"));
                }
                let (point, span) = (format!("{part_name}.{}", place.text), place.span);
                let (holds, role) = (PointType::Bit, PointRole::Told);
                points.add(part_name, PlantPoint { name: point, holds, role, span }, findings);
            }
        }
        let mut names = HashMap::new();
        for name in keys.faults.iter().filter_map(|fault| fault.name.as_ref()) {
            check_name(name, "a fault", &mut names, findings);
            if !name.text.starts_with(char::is_lowercase) {
                findings.push(no_name(name, "a fault"));
            }
            let (point, span) = (format!("{FAULT}.{}", name.text), name.span);
            let (holds, role) = (PointType::Bit, PointRole::Needed);
            points.add(FAULT, PlantPoint { name: point, holds, role, span }, findings);
        }
        points
    }

    fn next(&self) -> PointId {
        PointId(self.all.len() as u32)
    }

    /// Adds a point of a part, or the command of a fault.
    fn add(&mut self, part: &str, point: PlantPoint, findings: &mut Vec<Finding>) {
        let (name, span, id) = (&point.name, point.span, self.next());
        let base = name.split_once('.').map_or("", |(base, _)| base);
        match self.by_part.get_mut(base) {
            Some(part_points) => part_points.points.push(id),
            None => {
                let part_points = PointsOfPart { points: vec![id], ..PointsOfPart::default() };
                self.by_part.insert(base.to_owned(), part_points);
            }
        }
        if self.by_name.insert(name.clone(), id).is_some() && part != FAULT {
            let message = format!("`{name}` is there already");
            // The second of two parts with the same name already has a finding, which is the last.
            if findings.last().is_none_or(|finding| finding.span != span) {
                let own = &name[part.len() + 1..];
                let fix = renaming::another(own, '_', |name| {
                    self.by_name.contains_key(&format!("{part}.{name}"))
                });
                findings.push(Finding::new(Code::DuplicateName, span, message).fix(fix));
            }
        }
        self.all.push(point);
    }

    /// As [`PlantPoints::find`], for a point that drives a command: the help names outputs alone.
    pub fn find_source(&self, text: &Text) -> Result<(PointId, &PlantPoint), Finding> {
        self.find(text).map_err(|finding| {
            let part = text.text.split_once('.').map_or("", |(part, _)| part);
            let Some(part_points) = self.by_part.get(part) else { return finding };
            let is_told = |id: &&PointId| self.all[id.0 as usize].role == PointRole::Told;
            let points = part_points.points.iter().filter(is_told).copied().collect();
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
            Some(part_points) => {
                let known = part_points.known.get_or_init(|| self.known_points(part_points));
                let near = UnknownName::new(name, known).behind(&format!("{part}."));
                (self.listed(part_points), near)
            }
            None => {
                let parts = || KnownNames::new(self.by_part.keys().map(String::as_str));
                let near = UnknownName::new(part, self.known_parts.get_or_init(parts));
                (format!("there is no part `{part}`").into(), near.followed_by(&format!(".{name}")))
            }
        };
        let finding = Finding::new(Code::UnknownName, text.span, message);
        Err(finding.help(help).near_any(Some(Box::new(near))))
    }

    fn known_points(&self, part_points: &PointsOfPart) -> KnownNames {
        let names =
            part_points.points.iter().map(|id| self.all[id.0 as usize].name.split_once('.'));
        KnownNames::new(names.flatten().map(|(_, name)| name))
    }

    /// A help: the points of a part.
    fn listed(&self, points_of_part: &PointsOfPart) -> Help {
        let first = points_of_part.points.iter().take(LISTED_MAX);
        let names = first.map(|id| &*self.all[id.0 as usize].name);
        let help = one_of("there are", names).possible();
        match points_of_part.points.len().saturating_sub(LISTED_MAX) {
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
    let right = match what {
        "a part" => renaming::plain(&name.text, "part"),
        _ => renaming::plain(&name.text.to_lowercase(), "at"),
    };
    Finding::new(Code::ForbiddenName, name.span, message).help(help).fix(possible(right))
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
        let finding = finding.help("choose a different name for the part");
        findings.push(finding.fix(possible("fault_1")));
    }
    if let Some(first) = names.get(name.text.as_str()) {
        let message = format!("{what} is called `{}` already", name.text);
        let finding = Finding::new(Code::DuplicateName, name.span, message);
        let fix = renaming::another(&name.text, '_', |name| names.contains_key(name));
        findings.push(finding.label("again here").related(*first, "first here").fix(fix));
    } else {
        names.insert(&name.text, name.span);
    }
}
