//! The units of tags: a unit is a short text, and each location has at most one.
//!
//! Called by `tags` for each tag, and by `declare` once all tags are known. `misfits` checks
//! whether a tag may have a unit, as it does for the other keys. Nothing here depends on the
//! meaning of a unit.

use std::collections::HashSet;

use super::Resolver;
use super::names::kept;
use super::program::{Program, TagMeaning};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, possible};
use crate::source::ladder;
use crate::source::reader::Text;
use crate::source::wording::is_obeyed;
use rungd_engine::isa::{Address, NumberMap};

/// Maximum number of characters of a unit: tables show it behind the value.
const UNIT_CHARS_MAX: usize = 16;

impl Resolver<'_> {
    /// Reports a unit that cannot be shown behind a value.
    pub(super) fn unit_misfits(&mut self, tag: &ladder::WrittenTag) {
        let Some(unit) = &tag.unit else { return };
        let count = unit.text.chars().count();
        let name = kept(&tag.name.text);
        let (message, help) = if unit.text.trim().is_empty() {
            (format!("the `unit` of `{name}` is empty"), "leave `unit` out if the tag has no unit")
        } else if count > UNIT_CHARS_MAX {
            let help = "a unit has at most 16, as `bar` or `m³/h`; `doc` has room for more";
            (format!("the `unit` of `{name}` has {count} characters"), help)
        } else if unit.text.contains(is_obeyed) {
            let help = "a unit is printed as it stands, in one line: leave the character out";
            (format!("the `unit` of `{name}` has a control character"), help)
        } else {
            return;
        };
        let finding = Finding::new(Code::TagKey, unit.span, message).help(help);
        self.find(match unit.text.trim().is_empty() {
            true => finding.fix(FixEdit::Delete),
            false => finding.or_omit(),
        });
    }

    /// Reports two tags of one location with different units.
    pub(super) fn check_units(&mut self, program: &Program) {
        let mut first: NumberMap<Address, (&Text, usize)> = NumberMap::default();
        // Two arrays may share many elements: one finding for each pair of tags is enough.
        let mut found = HashSet::new();
        for (at, tag) in program.tags.iter().enumerate() {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            let Some(unit) = &tag.unit else { continue };
            let (other, element) = *first.entry(address).or_insert((unit, at));
            let pair = (tag.span, program.tags[element].span);
            if other.text != unit.text && found.insert(pair) {
                let message = format!("`unit` of `{address}` is given twice, differently");
                let finding = Finding::new(Code::TagKey, unit.span, message);
                let finding = finding.related(other.span, "another tag of this address gives this");
                let help = "leave `unit` to one of the two tags";
                self.find(finding.help(help).fix(possible(FixEdit::Delete)));
            }
        }
    }
}
