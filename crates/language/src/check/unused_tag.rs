//! `unused-tag`: the ladder names neither this tag nor a member of it.
//!
//! Not reported: tags with `alarm`, `log` or `metric`, which are useful without being named, and
//! tags with `spare = true`. If the ladder names the tag's address instead, the finding contains
//! that.
//!
//! Passes:
//!
//! ```toml
//! [tags]
//! infeed_2 = { at = "X1", spare = true }
//! ```
//!
//! Fails:
//!
//! ```toml
//! [tags]
//! infeed_2 = { at = "X1" }
//! ```

use std::collections::HashSet;

use crate::resolve::program::{Program, Tag, TagMeaning};
use crate::resolve::record::{RecordField, RecordTag};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, pair};
use rungd_engine::isa::{Address, NumberSet};

use super::context::Context;
use super::usage::structure_of;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    // In the program, each element of an array is a tag. Only the first one is reported.
    let first = |tag: &Tag| tag.of_array.is_none_or(|place| place.at == 0);
    let idle = |tag: &Tag| first(tag) && !is_useful(tag);
    let named = named(context);
    let fields = context.program.records.iter().flat_map(|record| record.tags(None));
    let fields: NumberSet<usize> = fields.collect();
    let tags = context.program.tags.iter().enumerate();
    let idle = tags.filter(|(at, tag)| !fields.contains(at) && idle(tag));
    findings
        .extend(idle.map(|(_, tag)| typed(context, tag).unwrap_or_else(|| finding(&named, tag))));
    findings.extend(idle_records(context.program));
    findings.extend(idle_fields(context.program));
}

/// The findings for tags of records of which nothing names a field.
fn idle_records(program: &Program) -> impl Iterator<Item = Finding> {
    let idle = program.records.iter().filter(|record| useful_fields(program, record).count() == 0);
    idle.filter(|record| !record.fields.is_empty()).map(|record| {
        let message = format!("nothing names a field of `{}`", record.name);
        let finding = Finding::new(Code::UnusedTag, record.span, message).label("unused");
        finding.help(spare("spare = true"))
    })
}

/// The findings for fields that nothing names in any tag of their record, if it names others.
fn idle_fields(program: &Program) -> Vec<Finding> {
    let mut useful: HashSet<(&str, &str)> = HashSet::new();
    for record in &program.records {
        useful.extend(useful_fields(program, record).map(|field| (&*record.record, field)));
    }
    let mut found = Vec::new();
    for record in &program.records {
        if useful_fields(program, record).count() == 0 {
            continue;
        }
        for field in &record.fields {
            if !useful.insert((&record.record, &field.name)) {
                continue;
            }
            let message = format!("nothing names field `{}` of `{}`", field.name, record.record);
            let finding = Finding::new(Code::UnusedTag, record.span, message);
            let help = "delete it from `[record.fields]`, or say that the tag is meant: `{}`";
            let help = advise(help, [pair("spare = true").same()]);
            found.push(finding.label("unused in every tag").help(help));
        }
    }
    found
}

/// The names of the fields of a tag of records that need no finding.
fn useful_fields<'p>(program: &'p Program, record: &'p RecordTag) -> impl Iterator<Item = &'p str> {
    let useful = |field: &&RecordField| {
        // A field with a mistake has a finding of its own.
        field.tag.and_then(|tag| program.tags.get(tag)).is_none_or(is_useful)
    };
    record.fields.iter().filter(useful).map(|field| field.name.as_str())
}

/// Whether a tag needs no finding.
fn is_useful(tag: &Tag) -> bool {
    tag.used || tag.spare || tag.is_shown()
}

/// The finding for a tag with a `type`.
fn typed(context: &Context, tag: &Tag) -> Option<Finding> {
    let name = &tag.name;
    let kind = context.program.names.places.named(name)?.type_name();
    let message = format!("nothing names tag `{name}`");
    let finding = Finding::new(Code::UnusedTag, tag.span, message).label("unused");
    // A template declares its own tags without the name of the use.
    let name = name.rsplit('.').next().unwrap_or(name);
    Some(finding.help(spare(format!("{name} = {{ type = \"{kind}\", spare = true }}"))))
}

fn finding(named: &NumberSet<Address>, tag: &Tag) -> Finding {
    let name = tag.array_name();
    let finding = |message| Finding::new(Code::UnusedTag, tag.span, message).label("unused");
    match tag.meaning {
        TagMeaning::Address(_) | TagMeaning::Array(_) if tag.of_array.is_some() => {
            let at = tag.of_array.map_or(String::new(), |place| place.array.to_string());
            finding(format!("nothing names the array `{name}` ({at})")).help(spare("spare = true"))
        }
        TagMeaning::Address(address) if named.contains(&address) => finding(format!(
            "nothing names tag `{name}`, though the ladder uses {address} by its address"
        ))
        .help(format!("write `{name}` where the ladder says `{address}`")),
        TagMeaning::Address(address) => finding(format!("nothing names tag `{name}` ({address})"))
            .help(spare(format!("{name} = {{ at = \"{address}\", spare = true }}"))),
        TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => {
            finding(format!("nothing names the constant `{name}`")).help(spare("spare = true"))
        }
    }
}

/// The help to delete a tag, or to keep it by a pair.
fn spare(kept: impl Into<String>) -> Help {
    advise("delete it, or say that it is meant: `{}`", [pair(kept).same()]).with(FixEdit::Delete)
}

/// The addresses that the ladder names. If it names a structure or one of its members, all
/// addresses of the structure.
fn named(context: &Context) -> NumberSet<Address> {
    let mut named: NumberSet<Address> = context
        .instructions()
        .filter_map(|p| p.instruction.structure().map(Address::Structure))
        .collect();
    for operand in &context.program.operands {
        named.insert(operand.address);
        named.extend(structure_of(operand.address).map(Address::Structure));
    }
    named
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn tags_without_any_use_are_reported() {
        check(
            r#"
            [tags]
            never = { at = "X1" }
            spare = { at = "X2", spare = true }
            bare = { at = "X3" }
            alarmed = { at = "C1", alarm = "Look" }
            logged = { at = "C2", log = "change" }
            counter = { at = "CT0" }
            by_address = { at = "T0" }
            limit = { value = 5 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X3", "counter.Done"], do = ["OUT Y0"] },
              { when = ["X4"], do = ["TMR T0 preset=1s"] },
            ]
            "#,
            expect![[r#"
                2:1 unused-tag
                  nothing names tag `never` (X1)
                    delete it, or say that it is meant: `never = { at = "X1", spare = true
                    }`
                4:1 unused-tag
                  nothing names tag `bare`, though the ladder uses X3 by its address
                    write `bare` where the ladder says `X3`
                8:1 unused-tag
                  nothing names tag `by_address`, though the ladder uses T0 by its address
                    write `by_address` where the ladder says `T0`
                9:1 unused-tag
                  nothing names the constant `limit`
                    delete it, or say that it is meant: `spare = true`
            "#]],
        );
    }

    #[test]
    fn records_and_fields_without_any_use_are_reported() {
        check(
            r#"
            [[record]]
            name = "Step"
            fields = { kind = { type = "int" }, on = { type = "bit" }, idle = { type = "real" } }
            [[record]]
            name = "Other"
            fields = { meant = { type = "bit" } }
            [tags]
            one = { type = "Step" }
            two = { type = "Step" }
            list = { type = "Step", count = 3 }
            other = { type = "Other", spare = true }
            [[program]]
            name = "Main"
            rung = [ { when = ["one.on", "two.kind == 1"], do = ["OUT Y0"] } ]
            "#,
            expect![[r#"
                8:1 unused-tag
                  nothing names field `idle` of `Step`
                    delete it from `[record.fields]`, or say that the tag is meant: `spare =
                    true`
                10:1 unused-tag
                  nothing names a field of `list`
                    delete it, or say that it is meant: `spare = true`
            "#]],
        );
    }
}
