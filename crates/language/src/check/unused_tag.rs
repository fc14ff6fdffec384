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

use crate::resolve::program::{Tag, TagMeaning};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, pair};
use rungd_engine::isa::{Address, NumberSet};

use super::context::Context;
use super::usage::structure_of;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    // In the program, each element of an array is a tag. Only the first one is reported.
    let first = |tag: &Tag| tag.of_array.is_none_or(|place| place.at == 0);
    let idle = |tag: &&Tag| {
        let watched = tag.is_shown();
        first(tag) && !tag.used && !tag.spare && !watched
    };
    let named = named(context);
    let idle = context.program.tags.iter().filter(idle);
    findings.extend(idle.map(|tag| typed(context, tag).unwrap_or_else(|| finding(&named, tag))));
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
}
