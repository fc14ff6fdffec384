//! `input-named-twice`: two tags are the same input (X).
//!
//! Mostly one of the two has the address of a copied line. Not reported: an element of an array
//! beside a tag of its own, and a tag with `spare = true`, which says that it is meant.
//!
//! Passes:
//!
//! ```toml
//! [tags]
//! start = { at = "X0" }
//! stop  = { at = "X1" }
//! ```
//!
//! Fails:
//!
//! ```toml
//! [tags]
//! start = { at = "X0" }
//! stop  = { at = "X0" }
//! ```

use crate::resolve::program::{Tag, TagMeaning};
use crate::source::finding::{Code, Finding};
use crate::source::fix::pair;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberMap};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut first: NumberMap<Address, &Tag> = NumberMap::default();
    for tag in context.progress.during(&context.program.tags) {
        let TagMeaning::Address(address @ Address::Bit(Bit::Space(BitSpace::X, _))) = tag.meaning
        else {
            continue;
        };
        if tag.of_array.is_some() || tag.spare {
            continue;
        }
        match first.get(&address) {
            Some(other) => findings.push(finding(address, other, tag)),
            None => {
                first.insert(address, tag);
            }
        }
    }
}

fn finding(address: Address, first: &Tag, second: &Tag) -> Finding {
    let (one, two) = (&first.name, &second.name);
    let message = format!("`{one}` and `{two}` are the same input, {address}");
    Finding::new(Code::InputNamedTwice, second.span, message)
        .label("the same input again")
        .related(first.span, "first here")
        .help(format!(
            "give `{two}` the input that it is wired to; if the two are one, delete `{two}` and \
             name `{one}` in its place, or say that it is meant: `spare = true`"
        ))
        .fix(pair("spare = true").same())
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn only_two_tags_of_the_same_input_are_reported() {
        check(
            r#"
            [tags]
            start = { at = "X0" }
            stop = { at = "X0" }
            row = { at = "X0", count = 2 }
            alias = { at = "X0", spare = true }
            lamp = { at = "Y0" }
            horn = { at = "Y0" }

            [[program]]
            name = "Main"
            rung = [
              { when = ["start", "!stop", "row[1]", "alias", "horn"], do = ["OUT lamp"] },
            ]
            "#,
            expect![[r#"
                3:1 input-named-twice
                  `start` and `stop` are the same input, X0
                    give `stop` the input that it is wired to; if the two are one, delete
                    `stop` and name `start` in its place, or say that it is meant: `spare =
                    true`
            "#]],
        );
    }
}
