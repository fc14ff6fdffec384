//! The wires of a plant: the driver of each command, the points that are inputs, and the points
//! that faults falsify.

use std::collections::HashMap;

use super::super::driver::{ResolvedRow, ResolvedRows, RowDirection};
use super::keys::{self as written, FaultKind, PlantKeys};
use super::points::{FAULT, PlantPoint, PlantPoints, PointRole, PointType};
use rungd_io::plant::settings::{
    CommandShare, FaultEffect, FaultSettings, Feed, PlantCommand, PointId, opening,
};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Fix, FixEdit, give_one, pair, propose, text};
use rungd_language::source::reader::Text;
use rungd_language::source::span::{Located, Span};

/// The longest delay that a fault causes, ms.
const LATE_MS_MAX: i32 = 60_000;
/// The time between changes of noise if `every` is not given, ms.
const NOISE_MS: u32 = 20;

/// The drivers of commands that were found so far.
struct Wires<'a> {
    points: &'a PlantPoints,
    feeds: HashMap<u32, (PlantCommand, Span)>,
    findings: &'a mut Vec<Finding>,
}

/// The rows of inputs.
pub fn incoming(rows: ResolvedRows<'_>) -> impl Iterator<Item = &ResolvedRow<'_>> {
    rows.each().filter(|row| row.direction == RowDirection::In)
}

/// The rows of outputs.
pub fn outgoing(rows: ResolvedRows<'_>) -> impl Iterator<Item = &ResolvedRow<'_>> {
    rows.each().filter(|row| row.direction == RowDirection::Out)
}

/// The driver of each command, in the order of the points, and the findings for commands without a
/// driver. These findings are valid only if no row of the map was left out.
pub fn commands(
    keys: &PlantKeys,
    rows: ResolvedRows<'_>,
    points: &PlantPoints,
    findings: &mut Vec<Finding>,
) -> (Vec<PlantCommand>, Vec<Finding>) {
    let mut wires = Wires { points, feeds: HashMap::new(), findings };
    for (at, row) in outgoing(rows).enumerate() {
        wires.by_row(at, row);
    }
    for part in rows.progress.during(&keys.parts) {
        let Some(name) = &part.name else { continue };
        for (command, from) in &part.driven {
            wires.by_points(&format!("{}.{command}", name.text), from);
        }
    }
    for fault in rows.progress.during(&keys.faults) {
        if let (Some(name), Some(from)) = (&fault.name, &fault.when) {
            wires.by_points(&format!("{FAULT}.{}", name.text), std::slice::from_ref(from));
        }
    }
    wires.finish()
}

impl Wires<'_> {
    fn by_row(&mut self, at: usize, row: &ResolvedRow<'_>) {
        let (id, point) = match one_point(row, self.points) {
            Ok(found) => found,
            Err(finding) => return self.findings.push(finding),
        };
        if point.role == PointRole::Told {
            let message = format!("`{}` is an output of the plant", point.name);
            let help = "a row that goes out drives a command, as `run`, `fill` or `in`";
            let swapped = text(&*row.points.text).at(row.text.span);
            let input = row.placed_in("X").at(row.points.span);
            let swapped = input.edits.into_iter().fold(swapped, Fix::and).possible();
            return self.findings.push(row.find(message).help(help).fix(swapped));
        }
        if point.holds == PointType::Bit && row.is_words() {
            let finding = row.find(format!("`{}` is a bit", point.name));
            return self.findings.push(finding.fixes(["C", "Y"].map(|block| row.placed_in(block))));
        }
        let drive = CommandShare { feed: Feed::Output(at), gain: gain(point, !row.is_words()) };
        self.enter(PlantCommand { point: id, drives: vec![drive] }, row.points.span);
    }

    fn by_points(&mut self, command: &str, from: &[Text]) {
        let Some(first) = from.first() else { return };
        // The command is missing if its part already has a finding.
        let text = Text { text: command.to_owned(), span: first.span, exact: false };
        let Ok((id, point)) = self.points.find(&text) else { return };
        let drives: Vec<CommandShare> =
            from.iter().filter_map(|from| self.drive(command, point, from)).collect();
        if drives.len() == from.len() {
            self.enter(PlantCommand { point: id, drives }, first.span);
        }
    }

    /// The share of a point of the plant in a command's value; `None` after a finding.
    fn drive(&mut self, command: &str, point: &PlantPoint, from: &Text) -> Option<CommandShare> {
        let (source, told) = match self.points.find_source(from) {
            Ok(found) => found,
            Err(finding) => {
                self.findings.push(finding);
                return None;
            }
        };
        if point.holds == PointType::Bit && told.holds != PointType::Bit {
            let message = format!("`{}` is a number, and `{command}` is a bit", told.name);
            let help = "a part of kind `sensor` turns a number into a bit";
            let finding = Finding::new(Code::Controller, from.span, message);
            self.findings.push(finding.help(help));
            return None;
        }
        let gain = gain(point, told.holds == PointType::Bit);
        Some(CommandShare { feed: Feed::Point(source), gain })
    }

    fn enter(&mut self, command: PlantCommand, span: Span) {
        let name = &self.points.all[command.point.0 as usize].name;
        if let Some((_, first)) = self.feeds.get(&command.point.0) {
            let finding = Finding::new(Code::Controller, span, format!("`{name}` is driven twice"));
            self.findings.push(finding.related(*first, "first here"));
            return;
        }
        self.feeds.insert(command.point.0, (command, span));
    }

    fn finish(self) -> (Vec<PlantCommand>, Vec<Finding>) {
        let (mut commands, mut found) = (Vec::new(), Vec::new());
        for (at, point) in self.points.all.iter().enumerate() {
            let id = PointId(at as u32);
            let fixed = match (self.feeds.get(&id.0), point.role) {
                (_, PointRole::Told) => continue,
                (Some((command, _)), _) => {
                    commands.push(command.clone());
                    continue;
                }
                (None, PointRole::Command(fixed)) => fixed,
                (None, PointRole::Needed) => {
                    found.push(undriven(point));
                    0
                }
            };
            let drive = CommandShare { feed: Feed::Fixed(fixed), gain: 1 };
            commands.push(PlantCommand { point: id, drives: vec![drive] });
        }
        (commands, found)
    }
}

fn undriven(point: &PlantPoint) -> Finding {
    let (part, command) = point.name.split_once('.').unwrap_or_default();
    let key = if part == FAULT { "when" } else { command };
    let row = format!("{{ from = \"Y0\", to = \"{}\" }}", point.name);
    let help = format!(
        "add a row to the map: `{row}`; or name what drives it within the plant: `{key} = \
         \"pump.running\"`"
    );
    let message = format!("nothing drives `{}`", point.name);
    Finding::new(Code::Controller, point.span, message).help(help).fix(FixEdit::Row(row))
}

/// The factor from a driver's value to the point's value: a bit opens an opening fully.
fn gain(point: &PlantPoint, from_bit: bool) -> i32 {
    if point.holds == PointType::Opening && from_bit { opening::FULL } else { 1 }
}

fn one_point<'a>(
    row: &ResolvedRow<'_>,
    points: &'a PlantPoints,
) -> Result<(PointId, &'a PlantPoint), Finding> {
    if row.addresses.len() != 1 {
        let message =
            format!("`{}` is one point, and `{}` is more than one", row.points.text, row.text.text);
        return Err(row.find(message).help("write a row each").fixes(row.of_count(1)));
    }
    points.find(row.points)
}

/// The points that are inputs, in the order of the rows.
pub fn inputs(
    rows: ResolvedRows<'_>,
    points: &PlantPoints,
    findings: &mut Vec<Finding>,
) -> Option<Vec<PointId>> {
    let mut input = |row: &ResolvedRow<'_>| match one_point(row, points) {
        Ok((id, point)) => {
            let is_word = point.holds != PointType::Bit;
            if is_word != row.is_words() {
                let what = if is_word { "a number: it goes to a word" } else { "a bit" };
                let blocks = if is_word { ["D", "V"] } else { ["X", "C"] };
                let finding = row.find(format!("`{}` is {what}", point.name));
                findings.push(finding.fixes(blocks.map(|block| row.placed_in(block))));
            }
            Some(id)
        }
        Err(finding) => {
            findings.push(finding);
            None
        }
    };
    incoming(rows).map(&mut input).collect()
}

/// A fault's settings, if its keys are valid.
pub fn fault(
    fault: &written::WrittenFault,
    points: &PlantPoints,
    findings: &mut Vec<Finding>,
) -> Option<FaultSettings> {
    let (name, kind) = (fault.name.as_ref()?, fault.kind?);
    let when = Text { text: format!("{FAULT}.{}", name.text), span: name.span, exact: false };
    let (when, _) = points.find(&when).ok()?;
    let effect = match kind {
        FaultKind::Lost => Ok(FaultEffect::Lost),
        FaultKind::StuckOn
        | FaultKind::StuckOff
        | FaultKind::Stuck
        | FaultKind::Noisy
        | FaultKind::Late => effect(fault, kind, points),
    };
    match effect {
        Ok(effect) => Some(FaultSettings { when, effect }),
        Err(finding) => {
            findings.push(finding);
            None
        }
    }
}

fn effect(
    fault: &written::WrittenFault,
    kind: FaultKind,
    points: &PlantPoints,
) -> Result<FaultEffect, Finding> {
    let missing = |key: &str, example: &str| {
        let message = format!("a fault `{}` has no `{key}`", kind.name());
        Finding::new(Code::MissingKey, fault.span, message).help(give_one(key, example))
    };
    let text = fault.point.as_ref().ok_or_else(|| missing("point", "\"belt.eye\""))?;
    let (id, point) = points.find(text)?;
    let wrong = |message: String| Finding::new(Code::Controller, text.span, message);
    if point.name.starts_with("fault.") {
        return Err(wrong(format!("`{}` is a fault itself", point.name)));
    }
    let is_bit = point.holds == PointType::Bit;
    let is_number = matches!(point.holds, PointType::Word | PointType::Either);
    let every_ms = || at_least_1ms("every", fault.every_ms.as_ref());
    Ok(match kind {
        FaultKind::StuckOn | FaultKind::StuckOff if is_number => {
            let help = propose(pair("kind = \"stuck\"")).and(" with a `value`");
            return Err(wrong(format!("`{}` is a number", point.name)).help(help));
        }
        FaultKind::StuckOn => FaultEffect::Fixed { point: id, value: gain(point, true) },
        FaultKind::StuckOff => FaultEffect::Fixed { point: id, value: 0 },
        FaultKind::Stuck => match &fault.value {
            Some(value) if is_bit && !(0..=1).contains(&value.value) => {
                let bits = ["value = 1", "value = 0"].map(|bit| pair(bit).possible());
                return Err(wrong(format!("`{}` is a bit: 0 or 1", point.name)).fixes(bits));
            }
            Some(value) => FaultEffect::Fixed { point: id, value: value.value as i32 },
            None => FaultEffect::Stuck { point: id },
        },
        FaultKind::Noisy if is_bit => {
            FaultEffect::Bouncing { point: id, every_ms: every_ms()?.unwrap_or(NOISE_MS) }
        }
        FaultKind::Noisy => {
            let amplitude = fault.amplitude.as_ref().ok_or_else(|| missing("amplitude", "20"))?;
            let every_ms = every_ms()?.unwrap_or(NOISE_MS);
            FaultEffect::Noisy { point: id, every_ms, amplitude: amplitude.value as u32 }
        }
        FaultKind::Late => {
            let by = fault.by_ms.as_ref().ok_or_else(|| missing("by", "\"200ms\""))?;
            let by_ms = at_least_1ms("by", Some(by))?.unwrap_or(1);
            if by.value > LATE_MS_MAX {
                let message = "a fault delays a value by 60s at most";
                return Err(
                    Finding::new(Code::OutOfRange, by.span, message).fix(pair("by = \"60s\""))
                );
            }
            FaultEffect::Late { point: id, by_ms }
        }
        FaultKind::Lost => FaultEffect::Lost,
    })
}

fn at_least_1ms(key: &str, ms: Option<&Located<i32>>) -> Result<Option<u32>, Finding> {
    match ms {
        Some(ms) if ms.value < 1 => {
            Err(Finding::new(Code::OutOfRange, ms.span, format!("`{key}` is at least 1ms")))
        }
        Some(ms) => Ok(Some(ms.value.unsigned_abs())),
        None => Ok(None),
    }
}
