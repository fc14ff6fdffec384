//! `never-written`, for the controller file: a row of a map sends an operand that nothing writes,
//! or a simulated input follows such an operand.
//!
//! If the ladder reads the operand too, only the ladder's finding is reported (`never_written`). A
//! row of several operands may contain spare operands: it is reported only if nothing writes any of
//! them.
//!
//! Passes, and fails without the rung:
//!
//! ```toml
//! # of the controller file: map = [{ from = "Y0", to = "coil 0" }]
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["OUT Y0"] } ]
//! ```

use crate::resolve::operands::{numbered, numbers};
use crate::source::finding::{Code, Finding};
use crate::source::fix::FixEdit;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRange, NumberRanges, NumberSet};

use super::context::Context;
use super::names::owner_of;
use super::never_written::{always, is_always_written, setting};
use super::outside_operands::OutsideRead;
use super::usage::{reads, structure_of, writes};
use super::writers::is_writable;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let Some(outside) = context.outside.filter(|outside| !outside.reads.is_empty()) else { return };
    let writes = writes(context);
    let told: NumberSet<Address> = reads(context).iter().map(|(address, _)| *address).collect();
    let is_owned =
        |address| structure_of(address).is_some_and(|structure| context.is_owned(structure));
    let is_written = |address: &Address| {
        let operand = *address;
        let is_ladders =
            is_always_written(operand) || writes.contains_key(address) || is_owned(operand);
        is_ladders || is_writable(context, operand)
    };
    // A file may have thousands of rows, each with the same thousands of operands: an operand that
    // nothing writes is looked up only once.
    let mut unwritten = NumberRanges::default();
    for read in context.progress.during(&outside.reads) {
        let NumberRange { kind, first, last } = numbers(read.first, read.count);
        let mut at = unwritten.next_new(kind, first);
        while at <= last {
            let address = numbered(kind, at);
            if is_written(&address) || told.contains(&address) {
                break;
            }
            unwritten.add(NumberRange::one(kind, at), 0);
            at = unwritten.next_new(kind, at);
        }
        if at > last {
            findings.push(finding(context, read));
        }
    }
}

fn finding(context: &Context, read: &OutsideRead) -> Finding {
    let NumberRange { kind, last, .. } = numbers(read.first, read.count);
    let (first, last) = (read.first, numbered(kind, last));
    let said = match first == last {
        true => context.say(first),
        false => format!("any of `{}` to `{}`", context.name(first), context.name(last)),
    };
    let message = format!("nothing writes {said}: {}", read.reader);
    let finding = Finding::new(Code::NeverWritten, read.span, message);
    let name = context.name(first);
    let finding = finding.label(format!("always {}", always(first).0));
    if let Some(structure) = structure_of(first) {
        let owner = owner_of(context, structure);
        return finding.help(format!("add the instruction, such as {owner}"));
    }
    match first {
        Address::Bit(Bit::Space(BitSpace::Y, _)) => {
            let help = format!("`OUT {name}` in a rung with its condition; or take this away");
            finding.help(help).fix(FixEdit::Delete)
        }
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => {
            finding.help(setting(context, first))
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_read_outside;

    #[test]
    fn unwritten_cells_that_device_rows_or_inputs_read_are_reported() {
        let rungs = r#"
            { when = ["X0"], do = ["OUT Y0", "SET C2", "TMR T0 preset=1s"] },
            { when = ["C2"], do = ["RST C2", "MOVE D9 to=V0"], allow = ["never-written"] },
            "#;
        let reads = [
            ("Y0", "device `rio` receives it"),
            ("Y1", "device `rio` receives it"),
            ("Y2..Y3", "device `rio` takes them"),
            ("Y0..Y4", "device `rio` takes them"),
            ("C0..C2", "device `rio` takes them, and the ladder writes the last"),
            ("Y1..Y3", "device `rio` takes them, and each has a finding already"),
            ("C2", "X5 follows it"),
            ("C3", "X6 follows it"),
            ("X7 $On D1 R1 MC1", "nothing to say of inputs, status bits and what others write"),
            ("T0.Done", "X7 follows it"),
            ("T1.Done", "X8 follows it"),
            ("D9", "the ladder reads it too"),
            ("V1", "device `rio` receives it"),
            ("R2", "Modbus clients read it"),
        ];
        check_read_outside(
            rungs,
            &reads,
            expect![[r#"
                1:1 never-written
                  nothing writes `Y1`: device `rio` receives it
                    `OUT Y1` in a rung with its condition; or take this away
                1:1 never-written
                  nothing writes any of `Y2` to `Y3`: device `rio` takes them
                    `OUT Y2` in a rung with its condition; or take this away
                1:1 never-written
                  nothing writes any of `Y1` to `Y3`: device `rio` takes them, and each
                  has a finding already
                    `OUT Y1` in a rung with its condition; or take this away
                1:1 never-written
                  nothing writes `C3`: X6 follows it
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C3", initial = false }`, with its name `setting` here
                1:1 never-written
                  nothing writes `T1.Done`: X8 follows it
                    add the instruction, such as `TMR T1 preset=1s`
                1:1 never-written
                  nothing writes `V1`: device `rio` receives it
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "V1", initial = 0 }`, with its name `setting` here
                1:1 never-written
                  nothing writes `R2`: Modbus clients read it
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "R2", initial = 0.0 }`, with its name `setting` here
            "#]],
        );
    }
}
