//! The cross-reference of an operand: its writers, its readers, its uses in the controller file,
//! and the tests that touch it.
//!
//! `cli::xref` and `cli::explain` look it up by name. [`text`] prints it; its JSON is made from the
//! types of [`answer`].

pub mod answer;
mod controller_uses;
#[cfg(test)]
mod tests;
pub mod text;
mod wanted;

use std::borrow::Cow;
use std::collections::HashSet;

use super::xref::answer::{CrossReference, FileLine, ReadPlace, TestPlace, WritePlace};
use super::xref::wanted::AskedOperand;
use crate::testing::TestTouch;
use rungd_config::controller::Controller;
use rungd_engine::Cell;
use rungd_engine::isa::Address;
use rungd_history::observe::{self, ProgramUses, Subject};
use rungd_language::resolve::program::{Program, TagMeaning};

/// A program whose operands can be looked up.
#[derive(Debug)]
pub struct CrossReferenceIndex<'a> {
    subject: &'a Subject,
    uses: ProgramUses<'a>,
    controller: Option<&'a Controller>,
    /// The uses of operands in tests, each with its cells.
    tests: Vec<(&'a TestTouch, Vec<Cell>)>,
}

impl<'a> CrossReferenceIndex<'a> {
    /// Walks a program. `tests`: the uses of operands in test files, in the order of the files.
    pub fn new(
        subject: &'a Subject,
        controller: Option<&'a Controller>,
        tests: &'a [TestTouch],
    ) -> CrossReferenceIndex<'a> {
        let cells = |touch: &TestTouch| {
            let names = touch.names.iter().filter_map(|name| {
                let wanted = AskedOperand::named(subject.program(), name).ok()?;
                Some(cells_of(subject, &wanted))
            });
            names.flatten().collect()
        };
        let tests = tests.iter().map(|touch| (touch, cells(touch))).collect();
        CrossReferenceIndex { subject, uses: subject.uses(), controller, tests }
    }

    /// The cross-reference of an operand: a tag, an address, a member, a structure, an array, a
    /// block or a device. It covers all bits and words of the operand.
    ///
    /// # Errors
    /// A sentence for people: the name is unknown.
    pub fn reference(&self, name: &str) -> Result<CrossReference, String> {
        Ok(self.of_wanted(&AskedOperand::named(self.program(), name)?))
    }

    /// The cross-references of all tags, of all other operands that the ladder names, and of all
    /// blocks, in this order.
    pub fn all(&self) -> Vec<CrossReference> {
        let program = self.program();
        let tags = program.tags.iter().filter(|tag| tag.of_array.is_none_or(|array| array.at == 0));
        let names = tags.map(|tag| tag.array_name());
        let meant = program.tags.iter().filter_map(|tag| match tag.meaning {
            TagMeaning::Address(address) => Some(address),
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
        });
        let tagged: HashSet<Address> = meant.collect();
        let known: HashSet<&str> = program.tags.iter().map(|tag| tag.name.as_str()).collect();
        // A member is in the reference of its structure.
        let is_member =
            |name: &str| name.rsplit_once('.').is_some_and(|(base, _)| known.contains(base));
        let operands = program.operands.iter();
        let untagged =
            operands.filter(|named| !tagged.contains(&named.address) && !is_member(&named.name()));
        let names = names.chain(untagged.map(|named| named.name()));
        let blocks = program.blocks.iter().map(|block| Cow::Borrowed(block.name.as_str()));
        let mut seen = HashSet::new();
        let names = names.chain(blocks).filter(|name| seen.insert(name.clone()));
        names.filter_map(|name| self.reference(&name).ok()).collect()
    }

    fn program(&self) -> &Program {
        self.subject.program()
    }

    fn of_wanted(&self, wanted: &AskedOperand) -> CrossReference {
        let cells = cells_of(self.subject, wanted);
        let uses = self.uses.of_cells(&cells);
        let touches = |touched: &[Cell]| touched.iter().any(|cell| cells.contains(cell));
        let tests =
            self.tests.iter().filter(|(_, touched)| touches(touched)).map(|(touch, _)| *touch);
        let calls = wanted.subroutine.map_or_else(Vec::new, |id| self.uses.calls(id));
        let (mut outside, mut kept) = (Vec::new(), false);
        if let Some(controller) = self.controller {
            outside = controller_uses::of(controller, &wanted.addresses, self.subject);
            kept = controller_uses::is_retained(controller, &wanted.addresses, self.program());
        }
        CrossReference {
            name: wanted.name.clone(),
            address: wanted.address.clone(),
            doc: wanted.doc.clone(),
            declared: wanted.span.map(|span| FileLine::of(&self.subject.place(span))),
            constants: self.constants(wanted),
            written: uses.writes.iter().map(|write_use| self.write(write_use)).collect(),
            turned: uses.turns.iter().map(|turn| turn.name.clone()).collect(),
            read: uses.reads.iter().map(|read_use| self.read(read_use)).collect(),
            called: calls.iter().map(|call| self.read(call)).collect(),
            outside,
            retained: kept,
            tests: tests.map(test).collect(),
        }
    }

    /// The places where the ladder names a constant.
    fn constants(&self, wanted: &AskedOperand) -> Vec<FileLine> {
        let Some(constant) = wanted.constant else { return Vec::new() };
        let named = self.program().names.constants.iter().filter(|named| named.tag == constant);
        named.map(|named| FileLine::of(&self.subject.place(named.span))).collect()
    }

    fn write(&self, write_use: &observe::WriteUse) -> WritePlace {
        WritePlace {
            text: write_use.place.text.clone(),
            rung: write_use.rung.text(),
            anchor: anchor(&write_use.rung),
            place: FileLine::of(&write_use.place),
            reset_at_end_of: write_use.reset_at_end.clone(),
        }
    }

    fn read(&self, read_use: &observe::ReadUse) -> ReadPlace {
        let (text, rung) = (read_use.place.text.clone(), read_use.rung.text());
        ReadPlace {
            text,
            rung,
            anchor: anchor(&read_use.rung),
            place: FileLine::of(&read_use.place),
        }
    }
}

fn cells_of(subject: &Subject, wanted: &AskedOperand) -> Vec<Cell> {
    let layout = &subject.symbols().layout;
    wanted.addresses.iter().filter_map(|address| layout.cell(*address)).collect()
}

/// The anchor of a rung in a page.
fn anchor(rung: &observe::RungName) -> String {
    format!("{}-{}", rung.element.name, rung.number)
}

fn test(touch: &TestTouch) -> TestPlace {
    let place = FileLine { file: touch.file.clone(), line: touch.line };
    let TestTouch { test, is_of_observer, text, .. } = touch.clone();
    TestPlace { test, is_of_observer, text, place }
}
