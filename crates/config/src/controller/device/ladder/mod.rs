//! A plant that is a ladder, resolved: the bits and words of its memory that the map connects with
//! those of the controller.
//!
//! Called by [`super`] with the rows of the map; `load` has loaded the plant's ladder before, and
//! `io::ladder` executes it. A point is the device's name and an operand of the plant's ladder.
//!
//! ```toml
//! # passes: the plant has an input `run` and a word `level`
//! [[device]]
//! name = "tank"
//! driver = "ladder"
//! ladder = ["tank.toml"]
//! map = [{ from = "Y0", to = "tank.run" }, { from = "tank.level", to = "D0" }]
//! # fails with { from = "tank.level", to = "X0" }: a word goes to a word
//! ```

pub mod keys;

use std::collections::HashMap;

use keys::LadderKeys;

use super::driver::{DriverKeys, ResolvedRow, ResolvedRows, RowDirection, WrittenDevice};
use super::is_movable;
use super::scaling::ScalingKeys;
use super::settings::DriverSettings;
use crate::controller::side_ladder::{WrittenSideLadder, operand_of};
use rungd_engine::isa::Address;
use rungd_io::ladder::settings::{LadderPoint, LadderSettings};
use rungd_io::scaling::Scaling;
use rungd_language::resolve::operands::{Operands, resolve_operands};
use rungd_language::resolve::scope::Scope;
use rungd_language::source::finding::Finding;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::Span;

impl DriverKeys for LadderKeys {
    fn read_row(&mut self, row: &mut Table<'_>) {
        self.rows.push(ScalingKeys::read(row));
    }

    fn read(&mut self, table: &mut Table<'_>) {
        self.read_device(table);
    }

    fn is_point(&self, text: &str, device: &str) -> bool {
        operand_of(text, device).is_some()
    }

    fn example(&self, device: &str) -> String {
        format!("{device}.C0")
    }

    fn resolve(
        &self,
        device: &WrittenDevice,
        rows: ResolvedRows<'_>,
        findings: &mut Vec<Finding>,
    ) -> Option<DriverSettings> {
        plant(self, device, rows, findings).map(DriverSettings::Ladder)
    }

    fn side_ladder(&self) -> Option<&WrittenSideLadder> {
        Some(&self.side)
    }
}

/// The places of the plant's memory that rows write, each with its row.
type Written = HashMap<Address, Span>;

fn plant(
    keys: &LadderKeys,
    device: &WrittenDevice,
    rows: ResolvedRows<'_>,
    findings: &mut Vec<Finding>,
) -> Option<LadderSettings> {
    let program = rows.ladder?;
    let name = device.name.as_ref().map_or("", |name| name.text.as_str());
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    let mut written = Written::new();
    for row in rows.each() {
        let operands = match operands(row, name, program.scope()) {
            Ok(operands) => operands,
            Err(finding) => {
                findings.push(finding);
                continue;
            }
        };
        let scaling = scaling(row, &keys.rows[row.at], findings);
        let points = operands.addresses().map(|address| LadderPoint { address, scaling });
        match row.direction {
            RowDirection::In => inputs.extend(points),
            RowDirection::Out => {
                findings.extend(written_twice(row, &operands, &mut written));
                outputs.extend(points);
            }
        }
    }
    let period = keys.side.period.unwrap_or(rows.period);
    Some(LadderSettings { program: program.clone(), period, inputs, outputs })
}

/// The bits or words of the plant that a row names.
fn operands(row: &ResolvedRow<'_>, device: &str, scope: &Scope) -> Result<Operands, Finding> {
    let operands = resolve_operands(scope, &in_plant(row.points, device)).map_err(|finding| {
        let help = || format!("declare it in the ladder of `{device}`, under [tags]").into();
        finding.declared_as(help)
    })?;
    let is_words = matches!(operands.first, Address::Word(_));
    if is_words != row.is_words() {
        let (point, what) = (&row.points.text, &row.text.text);
        let (one, other) = if is_words { ("a word", "a bit") } else { ("a bit", "a word") };
        let finding = row.find(format!("`{point}` is {one}, and `{what}` is {other}"));
        return Err(finding.help("a row connects bits with bits, or words with words"));
    }
    let (count, wanted) = (operands.count as usize, row.addresses.len());
    if count != wanted {
        let (point, what) = (&row.points.text, &row.text.text);
        let message = format!("`{point}` has {count} elements, and `{what}` {wanted}");
        return Err(row
            .find(message)
            .help("a row connects one by one: name as many on both sides"));
    }
    if row.direction == RowDirection::Out && !operands.addresses().all(|at| is_movable(&at)) {
        let message = format!("`{}` cannot be written by the map", row.points.text);
        let help = "the controller writes only X, C, MC, MI, V, D, R, MHR and MIR of the plant";
        return Err(row.find(message).help(help));
    }
    Ok(operands)
}

/// The text of a point without the name of the device.
fn in_plant(points: &Text, device: &str) -> Text {
    let prefix = format!("{device}.");
    let (before, exact) = (prefix.len() as u32, points.exact);
    let text = points.text.strip_prefix(&prefix).unwrap_or(&points.text);
    let start = points.span.start + if exact { before } else { 0 };
    // `tank.X0..tank.X3` is `tank.X0..X3`.
    let text = text.replace(&format!("..{prefix}"), "..");
    Text { text, span: Span { start, ..points.span }, exact }
}

fn scaling(row: &ResolvedRow<'_>, keys: &ScalingKeys, findings: &mut Vec<Finding>) -> Scaling {
    if row.is_words() {
        return keys.resolve(row.is_real(), findings);
    }
    keys.refuse(findings);
    Scaling::none(false)
}

/// The finding for a row that writes what an earlier row writes.
fn written_twice(
    row: &ResolvedRow<'_>,
    operands: &Operands,
    written: &mut Written,
) -> Option<Finding> {
    let again = operands.addresses().find_map(|at| written.get(&at).copied());
    written.extend(operands.addresses().map(|at| (at, row.points.span)));
    let finding = row.find(format!("`{}` is written twice", row.points.text));
    Some(finding.related(again?, "first here").help("take one row out").or_delete_row())
}
