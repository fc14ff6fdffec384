//! `never-written`: the ladder reads a bit or word that nothing writes.
//!
//! Writers are instructions, devices, Modbus clients, and an operator if `writers` counts the
//! address as a setting. A member of a structure needs an instruction that owns the structure, or a
//! write to that member. X bits have their own rule (`input_unmapped`).
//!
//! Passes:
//!
//! ```toml
//! [tags]
//! speed = { at = "D0", initial = 40 }
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["speed > 20"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails: the same without `initial`.

use crate::resolve::program::TagMeaning;
use crate::resolve::record::NamedField;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Fix, FixEdit, Help};
use crate::source::span::Span;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberSet, Structure, Word, WordSpace};

use super::context::Context;
use super::names::owner_of;
use super::usage::{reads, structure_of, writes};
use super::writers::is_writable;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let (read, writes) = (reads(context), writes(context));
    let mut structures = NumberSet::default();
    let logged = logged(context, read);
    let all = read.iter().copied().chain(logged);
    for (address, span) in context.progress.during(all) {
        let is_written = is_always_written(address) || writes.contains_key(&address);
        if is_written || is_writable(context, address) {
            continue;
        }
        let Some(structure) = structure_of(address) else {
            findings.push(finding(context, address, span));
            continue;
        };
        if !context.is_owned(structure) && structures.insert(structure) {
            findings.push(without_owner(context, address, structure, span));
        }
    }
}

/// The addresses that the log reads but no rung reads: tags with `alarm`, and tags whose changes
/// are logged.
fn logged(context: &Context, read: &[(Address, Span)]) -> Vec<(Address, Span)> {
    let read: NumberSet<Address> = read.iter().map(|(address, _)| *address).collect();
    let tags = context.program.tags.iter().filter(|tag| tag.alarm.is_some() || tag.log_changes);
    let bits = tags.filter_map(|tag| match tag.meaning {
        TagMeaning::Address(address) => Some((address, tag.span)),
        TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
    });
    bits.filter(|(address, _)| !read.contains(address)).collect()
}

/// Whether the controller itself writes the address, or a different rule covers it.
pub(super) fn is_always_written(address: Address) -> bool {
    match address {
        Address::Bit(Bit::Space(space, _)) => matches!(space, BitSpace::St | BitSpace::X),
        Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..)) => true,
        Address::Word(Word::Space(space, _)) => space == WordSpace::Dst,
        Address::Bit(Bit::InWord(bit)) => is_always_written(Address::Word(bit.word)),
        Address::Bit(Bit::Flag(..))
        | Address::Word(Word::Acc(_) | Word::Pre(_))
        | Address::Structure(_) => false,
    }
}

fn finding(context: &Context, address: Address, span: Span) -> Finding {
    let said = context.say(address);
    let message = match context.outside {
        Some(_) => format!("nothing writes {said}"),
        None => format!("nothing in the ladder writes {said}"),
    };
    let name = context.name(address);
    let label = format!("`{name}` is always {}", always(address).0);
    let finding = Finding::new(Code::NeverWritten, span, message).label(label);
    if let Address::Bit(Bit::Space(BitSpace::Y, _)) = address {
        return finding.help(format!("`OUT {name}` in a rung with its condition"));
    }
    let elsewhere = match context.outside {
        Some(_) => "a device writes it by a row of its `map`, a Modbus client if it is `writable`",
        None => "check the controller file to know what devices and Modbus clients write",
    };
    finding.help(setting(context, address).and(&format!("\n{elsewhere}")))
}

/// The value of an address that nothing writes: as shown in a finding, and as written in `initial`.
pub(super) fn always(address: Address) -> (&'static str, &'static str) {
    match address {
        Address::Word(word) if word.is_real() => ("0.0", "0.0"),
        Address::Word(_) => ("0", "0"),
        Address::Bit(_) | Address::Structure(_) => ("OFF", "false"),
    }
}

/// The help to write an address, or to declare that an operator sets it.
pub(super) fn setting(context: &Context, address: Address) -> Help {
    let initial = always(address).1;
    let words = "write it in the ladder; or if an operator sets it, say so by";
    match context.tag_at(address) {
        Some(_) => {
            let (tag, pair) = (context.name(address), format!("initial = {initial}"));
            let words = format!("{words} `{pair}` in {}", context.say_declaration(&tag));
            let edit = match context.field_named(&tag) {
                Some(NamedField { record, field }) => {
                    let (record, field) = (record.to_owned(), field.to_owned());
                    FixEdit::InField { record, field, pair }
                }
                None => FixEdit::InTag { tag, pair },
            };
            Help::from(words).with(Fix::from(edit).same())
        }
        None => {
            let tag = format!("setting = {{ at = \"{address}\", initial = {initial} }}");
            let words = format!("{words} a tag: `{tag}`, with its name `setting` here");
            let name = FixEdit::Word { old: address.to_string(), new: "setting".to_owned() };
            Help::from(words).with(Fix::from(name).after(FixEdit::Declare(tag)).same())
        }
    }
}

fn without_owner(context: &Context, member: Address, structure: Structure, span: Span) -> Finding {
    let (said, name) = (context.say_structure(structure), context.name(member));
    let message = format!("`{name}` never changes: no instruction owns {said}");
    let help = format!("add the instruction, such as {}", owner_of(context, structure));
    Finding::new(Code::NeverWritten, span, message).label("never changes").help(help)
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use crate::check::testing::{check_only, check_outside, main};
    use crate::source::finding::Code;

    fn check(ladder: &str, expected: Expect) {
        check_only(Code::NeverWritten, ladder, expected);
    }

    #[test]
    fn alarms_that_nothing_sets_are_reported() {
        check(
            r#"
            [tags]
            jam = { at = "C0", alarm = "Jammed" }
            late = { at = "T0.Done", alarm = "Late" }
            hot = { at = "C1", alarm = "Hot" }
            eye = { at = "X0", alarm = "Eye" }
            count = { at = "D0", log = "change" }
            total = { at = "D1", log = "change" }
            [[program]]
            name = "Main"
            rung = [ { when = ["eye"], do = ["OUT hot", "MOVE 1 to=total"] } ]
            "#,
            expect![[r#"
                2:1 never-written
                  nothing in the ladder writes `jam` (C0)
                    write it in the ladder; or if an operator sets it, say so by `initial =
                    false` in tag `jam`
                    check the controller file to know what devices and Modbus clients write
                3:1 never-written
                  `late` never changes: no instruction owns `T0`
                    add the instruction, such as `TMR T0 preset=1s`
                6:1 never-written
                  nothing in the ladder writes `count` (D0)
                    write it in the ladder; or if an operator sets it, say so by `initial =
                    0` in tag `count`
                    check the controller file to know what devices and Modbus clients write
            "#]],
        );
    }

    #[test]
    fn contacts_and_compares_of_unwritten_cells_are_reported() {
        let rungs = r#"
            { when = ["C0", "!C1", "rise(C2)", "C0", "X0", "$On"], do = ["OUT Y0"] },
            { when = ["V0 == V1", "R0 < 1.5"], do = ["OUT Y1"] },
            { when = ["Y0", "Y2", "MC1", "MI1", "MHR1 > 2"], do = ["OUT Y3"] },
            "#;
        check(
            &main(rungs),
            expect![[r#"
                4:12 never-written
                  nothing in the ladder writes `C0`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C0", initial = false }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                4:19 never-written
                  nothing in the ladder writes `C1`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C1", initial = false }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                4:30 never-written
                  nothing in the ladder writes `C2`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C2", initial = false }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                5:12 never-written
                  nothing in the ladder writes `V0`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "V0", initial = 0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                5:12 never-written
                  nothing in the ladder writes `V1`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "V1", initial = 0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                5:24 never-written
                  nothing in the ladder writes `R0`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "R0", initial = 0.0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                6:18 never-written
                  nothing in the ladder writes `Y2`
                    `OUT Y2` in a rung with its condition
                6:31 never-written
                  nothing in the ladder writes `MI1`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "MI1", initial = false }`, with its name `setting`
                    here
                    check the controller file to know what devices and Modbus clients write
            "#]],
        );
    }

    #[test]
    fn operands_that_no_instruction_writes_are_reported() {
        let rungs = r#"
            { when = ["X0"], do = ["MOVE D1 to=D2", "ADD D2 1 to=D3", "MATH D4 = D5 + C3 + D3"] },
            { when = ["X1"], do = ["TMR T0 preset=D6"] },
            { when = ["X2"], do = ["OUT C4", "SET C5", "RST C5"] },
            { when = ["C4", "C5", "D4 > 1"], do = ["OUT Y4"] },
            "#;
        check(
            &main(rungs),
            expect![[r#"
                4:30 never-written
                  nothing in the ladder writes `D1`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "D1", initial = 0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                4:60 never-written
                  nothing in the ladder writes `D5`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "D5", initial = 0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                4:60 never-written
                  nothing in the ladder writes `C3`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C3", initial = false }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
                5:39 never-written
                  nothing in the ladder writes `D6`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "D6", initial = 0 }`, with its name `setting` here
                    check the controller file to know what devices and Modbus clients write
            "#]],
        );
    }

    #[test]
    fn members_of_unused_structures_are_reported() {
        let rungs = r#"
            { when = ["T0.Done", "T1.Done", "T1.Acc > 1s"], do = ["TMR T0 preset=3s"] },
            { when = ["CT0.Acc > 3", "CT0.Done"], do = ["MOVE 5 to=CT0.Acc"] },
            { when = ["N0.DN", "N1.PRE > 1"], do = ["CTU N0 preset=1"] },
            "#;
        check(
            &main(rungs),
            expect![[r#"
                4:23 never-written
                  `T1.Done` never changes: no instruction owns `T1`
                    add the instruction, such as `TMR T1 preset=1s`
                5:27 never-written
                  `CT0.Done` never changes: no instruction owns `CT0`
                    add the instruction, such as `UDCG CT0`
                6:21 never-written
                  `N1.PRE` never changes: no instruction owns `N1`
                    add the instruction, such as `CTU N1 preset=1`
            "#]],
        );
    }

    #[test]
    fn tags_that_an_operator_or_a_device_may_write_are_not_reported() {
        let tags = r#"
            a = { at = "C0", initial = false }
            b = { at = "D0", min = 0 }
            c = { at = "D1", max = 9 }
            d = { at = "D2", doc = "The level" }
            "#;
        let rest = r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["a", "b == c" , "d > 1"], do = ["OUT Y0"] } ]
            "#;
        check(
            &format!("[tags]{tags}{rest}"),
            expect![[r#"
                9:37 never-written
                  nothing in the ladder writes `d` (D2)
                    write it in the ladder; or if an operator sets it, say so by `initial =
                    0` in tag `d`
                    check the controller file to know what devices and Modbus clients write
            "#]],
        );
        let ladder = "[ladder]\ndevices = [\"line1\"]\n";
        check(&format!("{ladder}[tags]{tags}{rest}"), expect![[""]]);
    }

    #[test]
    fn cells_that_the_controller_file_writes_are_not_reported() {
        check_outside(
            r#"
            { when = ["X0", "C0", "C1", "D0 > 1", "D1 > 1"], do = ["OUT Y0"] },
            { when = ["R1 > 1.0", "MC1", "MC2", "MC5"], do = ["OUT Y2"] },
            { when = ["MHR1 > 1", "MHR2 > 1", "CT0.Acc > 1", "CT1.Acc > 1"], do = ["OUT Y1"] },
            "#,
            expect![[r#"
                4:18 never-written
                  nothing writes `C0`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "C0", initial = false }`, with its name `setting` here
                    a device writes it by a row of its `map`, a Modbus client if it is
                    `writable`
                4:30 never-written
                  nothing writes `D0`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "D0", initial = 0 }`, with its name `setting` here
                    a device writes it by a row of its `map`, a Modbus client if it is
                    `writable`
                5:31 never-written
                  nothing writes `MC2`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "MC2", initial = false }`, with its name `setting`
                    here
                    a device writes it by a row of its `map`, a Modbus client if it is
                    `writable`
                6:24 never-written
                  nothing writes `MHR2`
                    write it in the ladder; or if an operator sets it, say so by a tag:
                    `setting = { at = "MHR2", initial = 0 }`, with its name `setting` here
                    a device writes it by a row of its `map`, a Modbus client if it is
                    `writable`
                6:36 never-written
                  `CT0.Acc` never changes: no instruction owns `CT0`
                    add the instruction, such as `UDCG CT0`
            "#]],
        );
    }
}
