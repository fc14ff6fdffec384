//! The program of a running controller, made from the files in its recording.

use std::collections::HashMap;
use std::sync::Arc;

use rungd_config::controller::Controller;
use rungd_engine::Cell;
use rungd_engine::isa::Address;
use rungd_history::observe::{CompareText, Subject};
use rungd_history::playback::subject_and_settings;
use rungd_history::record::RecordedProgram;
use rungd_lab::draw::ladder::{Picture, RungPicture};
use rungd_language::resolve::program::TagMeaning;
use rungd_language::resolve::value_texts::ValueTexts;

/// A program with its ladder, its controller settings and the places of its contacts.
#[derive(Debug)]
pub struct LiveProgram {
    /// The recording of the program: its process, its number in the process, its files.
    pub recorded: Arc<RecordedProgram>,
    /// The program in the form for `observe`.
    pub subject: Arc<Subject>,
    /// Its ladder in the form for `draw`.
    pub picture: Picture,
    /// The settings of its controller file.
    pub controller: Option<Controller>,
    /// The parts, by block or Stage, then by rung and branch.
    parts: HashMap<String, HashMap<PartNumber, PartPlace>>,
    /// The compares, by their numbers among the contacts.
    compares: HashMap<u32, CompareText>,
}

/// A rung of a block or Stage, and a branch of the rung; `None`: the rung itself.
type PartNumber = (u32, Option<u32>);

/// The place of a rung or branch among the parts of the program.
#[derive(Clone, Copy, Debug)]
struct PartPlace {
    /// The number of the part.
    part: u32,
    /// The number of the first contact.
    first: u32,
}

/// A tag, for a list of tags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveTag<'p> {
    /// Its name.
    pub name: &'p str,
    /// Its address.
    pub address: String,
    /// Its `doc`.
    pub doc: Option<&'p str>,
    /// The unit of its value.
    pub unit: Option<&'p str>,
    /// The texts of its values.
    pub texts: Option<&'p ValueTexts>,
    /// The members of a structure, as operands.
    pub members: Vec<String>,
}

impl LiveProgram {
    /// Makes a program from its files.
    ///
    /// # Errors
    /// This version of rungd cannot load them.
    pub fn of(recorded: Arc<RecordedProgram>) -> Result<LiveProgram, String> {
        let (subject, controller) = subject_and_settings(&recorded)?;
        let subject = Arc::new(subject);
        let picture = Picture::of(&subject);
        let mut parts: HashMap<String, HashMap<PartNumber, PartPlace>> = HashMap::new();
        for (part, contact) in (0..).zip(subject.contacts()) {
            let of_element = parts.entry(contact.element).or_default();
            of_element
                .insert((contact.rung, contact.branch), PartPlace { part, first: contact.first });
        }
        let compares = subject.compares().into_iter();
        let compares = compares.map(|compare| (compare.contact, compare.text)).collect();
        Ok(LiveProgram { recorded, subject, picture, controller, parts, compares })
    }

    /// The number of the first contact of a rung or branch, among the contacts of the program.
    pub fn first_contact(&self, element: &str, rung: u32, branch: Option<u32>) -> Option<u32> {
        self.place(element, rung, branch).map(|place| place.first)
    }

    /// The form of the values of a compare, by its number among the contacts of the program.
    pub fn compare(&self, contact: u32) -> Option<CompareText> {
        self.compares.get(&contact).copied()
    }

    /// The number of a rung or branch, among the parts of the program.
    pub fn part(&self, element: &str, rung: u32, branch: Option<u32>) -> Option<u32> {
        self.place(element, rung, branch).map(|place| place.part)
    }

    fn place(&self, element: &str, rung: u32, branch: Option<u32>) -> Option<&PartPlace> {
        self.parts.get(element)?.get(&(rung, branch))
    }

    /// The rungs of a block, or of a Stage with its Program's name.
    pub fn rungs(&self, element: &str) -> Option<&[RungPicture]> {
        self.picture.blocks.iter().find_map(|block| {
            if block.name == element {
                return Some(&*block.rungs);
            }
            let stage = element.strip_prefix(&*block.name)?.strip_prefix('.')?;
            let found = block.stages.iter().find(|known| known.name == stage)?;
            Some(&*found.rungs)
        })
    }

    /// The words in the compares and instructions of a rung, as operands.
    pub fn words(&self, element: &str, rung: usize) -> Vec<String> {
        self.named(element, rung, |part| self.subject.words(part))
    }

    /// The outputs in a rung, as operands.
    pub fn outputs(&self, element: &str, rung: usize) -> Vec<String> {
        self.named(element, rung, |part| self.subject.outputs(part))
    }

    fn named(&self, element: &str, rung: usize, cells: impl Fn(u32) -> Vec<Cell>) -> Vec<String> {
        let rung = rung as u32;
        let branches = (1..).map(Some);
        let parts = std::iter::once(None)
            .chain(branches)
            .map_while(|branch| self.place(element, rung, branch).map(|place| place.part));
        let cells = parts.flat_map(cells);
        let mut names: Vec<String> = Vec::new();
        for name in cells.map(|cell| self.subject.operand(cell).name) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The tags with an address, in file order.
    pub fn tags(&self) -> impl Iterator<Item = LiveTag<'_>> {
        self.subject.program().tags.iter().filter_map(|tag| {
            let TagMeaning::Address(address) = tag.meaning else { return None };
            let members = address.named_operands(&tag.name).map(|(name, _)| name);
            let is_structure = matches!(address, Address::Structure(_));
            Some(LiveTag {
                name: &tag.name,
                address: address.to_string(),
                doc: tag.doc.as_deref(),
                unit: tag.unit.as_ref().map(|unit| unit.text.as_str()),
                texts: tag.texts.as_deref(),
                members: members.filter(|_| is_structure).collect(),
            })
        })
    }
}
