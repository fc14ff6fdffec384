//! Element documentation as the tags of a ladder.

use std::collections::{BTreeMap, HashSet};

use super::form::{BEGIN, END, FLAGS, OtherElement, begins, other_element, plain_name};
use crate::csv::{CsvRecord, records};
use crate::model::{ForeignProject, LadderFile, Outcome, ProjectTag};
use crate::names::GivenNames;
use rungd_engine::isa::MemorySizes;
use rungd_engine::isa::address_text::{AddressError, parse};

/// Most elements of a file.
const ELEMENTS_MAX: usize = 100_000;
/// Warnings about tags that no ladder names yet.
const HABITS: [&str; 2] = ["unused-tag", "never-written"];

/// An element with its documentation.
struct DocumentedElement {
    element: String,
    nickname: String,
    extra: String,
    description: String,
}

/// The project of the documentation in a file: its tags, and an empty program.
///
/// # Errors
/// The file has none, or a line that says none; the reason has the line.
pub fn read(text: &str) -> Result<ForeignProject, String> {
    let elements = elements(text)?;
    let mut work = DocumentedTags::default();
    work.names.fresh("Main");
    for element in &elements {
        work.add(element);
    }
    let mut outcome = Outcome { renamed: work.names.renamed.clone(), ..Outcome::default() };
    for (reason, names) in work.without_place {
        outcome.open.push(format!("{}: {reason}: {}", names.len(), names.join(", ")));
    }
    if work.system > 0 {
        outcome.left_out.push(format!(
            "{} elements of the system, which rungd documents itself ($On, $FirstScan …)",
            work.system
        ));
    }
    let ladder = LadderFile {
        allow: HABITS.to_vec(),
        tags: work.tags,
        ..LadderFile::empty_main("The elements of a Do-more")
    };
    Ok(ForeignProject {
        name: "main".to_owned(),
        origin: "Do-more element documentation".to_owned(),
        period_ms: 10,
        files: vec![ladder],
        outcome,
        ..ForeignProject::default()
    })
}

/// The elements between the lines that begin and end the documentation.
fn elements(text: &str) -> Result<Vec<DocumentedElement>, String> {
    let mut before = 0;
    let mut rows = text.lines().skip_while(|line| {
        before += 1;
        !begins(line)
    });
    if rows.next().is_none() {
        return Err(format!("no element documentation: no line is `{BEGIN}`"));
    }
    let inner: Vec<&str> = rows.take_while(|line| line.trim() != END).collect();
    let mut elements = Vec::new();
    for CsvRecord { line, fields } in records(&inner.join("\n"))? {
        let line = before + line;
        if elements.len() == ELEMENTS_MAX {
            return Err(format!("line {line}: at most {ELEMENTS_MAX} elements are read"));
        }
        let has_flags = fields.get(1).is_some_and(|field| field.trim().starts_with(FLAGS));
        let field = |at: usize| {
            let at = if has_flags && at > 0 { at + 1 } else { at };
            fields.get(at).map_or("", |field| field.trim()).to_owned()
        };
        let wanted = if has_flags { 5 } else { 4 };
        if fields.len() < 2 || fields.len() > wanted || field(0).is_empty() {
            return Err(format!(
                "line {line}: an element has its name, nickname, extra info and description, each \
                 in quotation marks"
            ));
        }
        elements.push(DocumentedElement {
            element: field(0),
            nickname: field(1),
            extra: field(2),
            description: field(3),
        });
    }
    Ok(elements)
}

/// The tags of elements.
#[derive(Default)]
struct DocumentedTags {
    names: GivenNames,
    tags: Vec<ProjectTag>,
    taken: HashSet<String>,
    system: usize,
    /// The elements without a place here, by the reason.
    without_place: BTreeMap<String, Vec<String>>,
}

impl DocumentedTags {
    fn add(&mut self, element: &DocumentedElement) {
        let text = element.element.replacen(':', ".", 1);
        let sizes = MemorySizes::default();
        let at = match parse(&text, &sizes) {
            Ok(_) => text,
            Err(AddressError::LeadingZero(right) | AddressError::Case(right)) => right,
            Err(AddressError::UnknownNickname) => return self.system += 1,
            Err(error) => return self.leave(element, &error),
        };
        match parse(&at, &sizes).ok().and_then(other_element) {
            Some(OtherElement::System) => return self.system += 1,
            Some(OtherElement::Word) => {
                let why = "N is a word of a Do-more, and a Sensaphone counter here; give it a type";
                return self.without(element, why.to_owned());
            }
            None => {}
        }
        if !self.taken.insert(at.clone()) {
            return self.without(element, "documented twice; the first one counts".to_owned());
        }
        let name = match element.nickname.is_empty() {
            true => self.names.fresh(&plain_name(&at)),
            false => self.names.take(&element.nickname),
        };
        let mut doc = element.description.clone();
        if !element.extra.is_empty() {
            doc += &format!(" [{}]", element.extra);
        }
        let doc = doc.trim().to_owned();
        self.tags.push(ProjectTag { name, at: Some(at), doc, ..ProjectTag::default() });
    }

    fn leave(&mut self, element: &DocumentedElement, error: &AddressError) {
        let why = match error {
            AddressError::BeyondMemory { space, last, .. } => {
                format!("beyond {space}{last}, the last one without [memory] in a controller file")
            }
            AddressError::NotAnAddress
            | AddressError::Case(_)
            | AddressError::LeadingZero(_)
            | AddressError::UnknownMember(_)
            | AddressError::UnknownNickname
            | AddressError::SensaphoneElement
            | AddressError::NoBits(_)
            | AddressError::UnknownBit(_) => {
                "no element of rungd: give it a type, or bring it by the map of a device".to_owned()
            }
        };
        self.without(element, why);
    }

    fn without(&mut self, element: &DocumentedElement, why: String) {
        let DocumentedElement { element, nickname, .. } = element;
        let name = format!("{element} {nickname}").trim().to_owned();
        self.without_place.entry(why).or_default().push(name);
    }
}
