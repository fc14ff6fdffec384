//! The places of the parts of an expanded template: in the template's text, for one of its uses.
//!
//! The rungs of a template are resolved once for each use. A place in such a rung has the number of
//! a *layer* instead of the number of a file. A layer is one use of a template, or one argument at
//! one place of its parameter. So each place of a program is unique, and the rules do not depend on
//! templates. [`Layers::placed_findings`] turns the places of findings into places of files, adds
//! the uses that the findings are about, and reports a mistake of a template once.

use std::collections::{HashMap, HashSet};

use crate::source::finding::{Code, Finding, Severity};
use crate::source::nearest::KnownNames;
use crate::source::span::{FileId, Span};

/// The layers of a program.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    layers: Vec<Layer>,
    /// The places of arguments with a mistake that is already reported.
    wrong: HashSet<Span>,
}

#[derive(Clone, Debug)]
enum Layer {
    /// One use of a template, with the file that contains the template's text.
    Use(FileId, UsePlace),
    /// Contacts as an argument, at one place of their parameter.
    Contacts(ArgumentPlace),
    /// A name or constant as an argument, at one place of its parameter.
    Atom(ArgumentPlace),
}

/// A use: its name and place.
#[derive(Clone, Debug)]
pub(super) struct UsePlace {
    /// The whole name: `p1.lamp`.
    pub name: String,
    /// The place of the use, in the file or layer that contains it.
    pub at: Span,
    /// Whether it only serves to check a template that nothing uses.
    pub is_trial: bool,
    /// The names that hide the ladder's names in the rungs of the use.
    pub own: KnownNames,
}

impl UsePlace {
    /// Whether a whole name is exactly a name of the template, in this use.
    fn has(&self, name: &str) -> bool {
        let own = name.strip_prefix(&self.name).and_then(|rest| rest.strip_prefix('.'));
        own.is_some_and(|own| self.own.beginning_with(own).next() == Some(own))
    }
}

#[derive(Clone, Debug)]
struct ArgumentPlace {
    /// The file or layer that contains the text of the argument.
    by: FileId,
    /// The place of the parameter.
    at: Span,
}

/// The number of the first layer: no file has such a number.
const FIRST: u32 = 1 << 31;

/// A place of a finding, in files.
struct FindingPlace {
    span: Span,
    /// The layer of the use that the finding is about.
    use_file: Option<FileId>,
    /// The arguments that the finding is about.
    given: Vec<Span>,
}

/// The parts that two findings have in common if they report the same mistake for several uses.
#[derive(PartialEq, Eq, Hash)]
struct FindingKey(Code, Span, Vec<Span>);

impl Layers {
    pub(super) fn add_use(&mut self, file: FileId, used: UsePlace) -> FileId {
        self.add(Layer::Use(file, used))
    }

    /// Adds a layer for contacts as an argument in `by`, at one place of their parameter.
    pub(super) fn add_contacts(&mut self, by: FileId, at: Span) -> FileId {
        self.add(Layer::Contacts(ArgumentPlace { by, at }))
    }

    /// Adds a layer for a name or constant as an argument in `by`, at one place of its parameter.
    pub(super) fn add_atom(&mut self, by: FileId, at: Span) -> FileId {
        self.add(Layer::Atom(ArgumentPlace { by, at }))
    }

    fn add(&mut self, layer: Layer) -> FileId {
        self.layers.push(layer);
        FileId(FIRST + (self.layers.len() - 1) as u32)
    }

    /// Marks an argument whose mistake is already reported: its places need no findings.
    pub(super) fn mark_wrong(&mut self, argument: Span) {
        self.wrong.insert(argument);
    }

    fn get(&self, file: FileId) -> Option<&Layer> {
        self.layers.get(file.0.checked_sub(FIRST)? as usize)
    }

    /// Whether the program has no templates.
    pub(super) fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// The finding about an unknown name, with the nearest name of its template, if one is near.
    pub(super) fn near(&self, finding: Finding, name: &str) -> Finding {
        let at = self.place_in_rung(finding.span);
        match self.uses(at.file).next() {
            Some(used) if at == finding.span && !used.has(name) => {
                finding.near_first(name, &used.own)
            }
            Some(_) | None => finding,
        }
    }

    /// Whether a place lies in a layer, and not in a file.
    pub(crate) fn is_layered(span: Span) -> bool {
        span.file.0 >= FIRST
    }

    /// Whether a file number is the layer of an argument: a text there was passed on from an outer
    /// use.
    pub fn is_given(&self, file: FileId) -> bool {
        matches!(self.get(file), Some(Layer::Atom(_) | Layer::Contacts(_)))
    }

    /// The place of the text, in its file.
    pub fn in_file(&self, span: Span) -> Span {
        let mut file = span.file;
        while let Some(layer) = self.get(file) {
            file = match layer {
                Layer::Use(real, _) => *real,
                Layer::Contacts(given) | Layer::Atom(given) => given.by,
            };
        }
        Span { file, ..span }
    }

    /// The place in the text of the rung itself: for a place in an argument, the place of the
    /// parameter.
    pub fn place_in_rung(&self, mut span: Span) -> Span {
        while let Some(Layer::Contacts(given) | Layer::Atom(given)) = self.get(span.file) {
            span = given.at;
        }
        span
    }

    /// Whether two places begin at the same character of the author's text. `part` may be in an
    /// argument.
    pub(crate) fn begin_together(&self, part: Span, whole: Span) -> bool {
        let part = match self.get(whole.file) {
            Some(Layer::Use(..)) | None => self.place_in_rung(part),
            Some(Layer::Contacts(_) | Layer::Atom(_)) => self.text(part),
        };
        let whole = self.text(whole);
        (part.file, part.start) == (whole.file, whole.start)
    }

    /// The place in the text as its author wrote it: for contacts as an argument, their own place;
    /// for a name or constant as an argument, the place of its parameter.
    pub fn text(&self, mut span: Span) -> Span {
        loop {
            match self.get(span.file) {
                Some(Layer::Contacts(given)) => span.file = given.by,
                Some(Layer::Atom(given)) => span = given.at,
                Some(Layer::Use(..)) | None => return span,
            }
        }
    }

    /// A sort key that orders places as if the rungs of every template were written at its uses.
    pub(crate) fn order(&self, span: Span) -> Vec<(FileId, u32)> {
        let mut path = Vec::new();
        let mut at = Some(span);
        while let Some(span) = at {
            path.push((self.in_file(span).file, span.start));
            at = self.get(span.file).map(|layer| match layer {
                Layer::Use(_, used) => used.at,
                Layer::Contacts(given) | Layer::Atom(given) => given.at,
            });
        }
        path.reverse();
        path
    }

    /// Whether a place belongs to the trial of a template that nothing uses.
    pub fn is_trial(&self, span: Span) -> bool {
        self.uses(self.place_in_rung(span).file).any(|used| used.is_trial)
    }

    /// The whole name of the outermost use of a template that contains a place, with the place of
    /// that use in its file.
    pub fn outermost(&self, span: Span) -> Option<(&str, Span)> {
        let used = self.uses(self.place_in_rung(span).file).last()?;
        Some((&used.name, used.at))
    }

    /// The whole name of the innermost use of a template that contains a place: `p1.lamp`.
    pub(super) fn use_of(&self, span: Span) -> Option<&str> {
        self.uses(self.place_in_rung(span).file).next().map(|used| used.name.as_str())
    }

    /// The use of a layer, then the uses that contain it, from the inside out.
    fn uses(&self, file: FileId) -> impl Iterator<Item = &UsePlace> {
        let mut file = file;
        std::iter::from_fn(move || {
            let Layer::Use(_, used) = self.get(file)? else { return None };
            file = self.place_in_rung(used.at).file;
            Some(used)
        })
    }

    /// The findings, with places in files. A finding that is the same in several uses occurs once.
    pub fn placed_findings(&self, findings: Vec<Finding>) -> Vec<Finding> {
        if self.layers.is_empty() {
            return findings;
        }
        let (layered, mut told): (Vec<_>, Vec<_>) =
            findings.into_iter().partition(|finding| Layers::is_layered(finding.span));
        told.iter_mut().for_each(|finding| self.relate(finding));
        let mut seen: HashMap<FindingKey, Vec<FileId>> = HashMap::new();
        for finding in &told {
            let related = finding.related.iter().map(|(span, _)| *span).collect();
            seen.insert(FindingKey(finding.code, finding.span, related), Vec::new());
        }
        let mut firsts = Vec::new();
        let mut untold = Vec::new();
        for mut finding in layered {
            let Some(place) = self.place(finding.span) else {
                untold.push(finding);
                continue;
            };
            self.relate(&mut finding);
            finding.span = place.span;
            let related = finding.related.iter().map(|(span, _)| *span).chain(place.given.clone());
            let alike = FindingKey(finding.code, place.span, related.collect());
            match seen.get_mut(&alike) {
                Some(others) => others.extend(place.use_file),
                None => {
                    seen.insert(alike, place.use_file.into_iter().collect());
                    firsts.push((finding, place));
                }
            }
        }
        told.extend(firsts.into_iter().map(|(finding, place)| {
            let related = finding.related.iter().map(|(span, _)| *span).chain(place.given.clone());
            let alike = FindingKey(finding.code, place.span, related.collect());
            let uses: HashSet<FileId> = seen[&alike].iter().copied().collect();
            self.with_use(finding, &place, uses.len())
        }));
        self.tell_one_error(untold, &mut told);
        told
    }

    /// Adds the errors that were held back, if there is no other error. They were held back because
    /// the argument itself has a finding. A program with parts left out must be refused in any
    /// case.
    fn tell_one_error(&self, untold: Vec<Finding>, told: &mut Vec<Finding>) {
        let is_error = |finding: &Finding| finding.severity() == Severity::Error;
        if told.iter().any(is_error) {
            return;
        }
        for mut finding in untold.into_iter().filter(is_error) {
            self.relate(&mut finding);
            finding.span = self.in_file(finding.span);
            told.push(finding);
        }
    }

    /// Turns the related places of a finding into places of files.
    fn relate(&self, finding: &mut Finding) {
        for (span, words) in &mut finding.related {
            if let Some(used) =
                self.uses(self.place_in_rung(*span).file).find(|use_place| !use_place.is_trial)
            {
                words.push_str(&format!(" (in `{}`)", used.name));
            }
            *span = self.in_file(self.place_in_rung(*span));
        }
    }

    /// The place of a finding; `None` if it is about an argument whose mistake is already reported.
    fn place(&self, mut span: Span) -> Option<FindingPlace> {
        let mut given = Vec::new();
        loop {
            if self.wrong.contains(&span) {
                return None;
            }
            match self.get(span.file) {
                // A mistake in contacts does not depend on the place of their parameter.
                Some(Layer::Contacts(of)) => span.file = of.by,
                Some(Layer::Atom(of)) => {
                    let by = Span { file: of.by, ..span };
                    if self.wrong.contains(&by) {
                        return None;
                    }
                    given.push(self.in_file(by));
                    span = of.at;
                }
                Some(Layer::Use(file, _)) => {
                    let use_file = Some(span.file);
                    return Some(FindingPlace {
                        span: Span { file: *file, ..span },
                        use_file,
                        given,
                    });
                }
                None => return Some(FindingPlace { span, use_file: None, given }),
            }
        }
    }

    /// The finding with the use that it is about, and the number of other uses.
    fn with_use(&self, mut finding: Finding, place: &FindingPlace, uses: usize) -> Finding {
        let is_trial =
            place.use_file.is_some_and(|use_file| self.uses(use_file).any(|used| used.is_trial));
        for given in place.given.iter().filter(|_| !is_trial) {
            finding = finding.related(*given, "given here");
        }
        let Some(layer) = place.use_file else { return finding };
        let mut others = match uses.saturating_sub(1) {
            0 => String::new(),
            1 => ", and in one more use".to_owned(),
            more => format!(", and in {more} more uses"),
        };
        match self.uses(layer).next() {
            Some(used) if used.is_trial => finding.reword(|text| {
                let text = without(text, &used.name);
                bare(&text.replace(&used.name, used.name.trim_start_matches('?')))
            }),
            Some(used) if uses > 1 => finding.reword(|text| without(text, &used.name)),
            // The right name is written in the template, without the name of the use.
            Some(used) if finding.code == Code::UnknownName => {
                finding.reword_help(|text| without(text, &used.name));
            }
            Some(_) | None => {}
        }
        for used in self.uses(layer).take_while(|use_place| !use_place.is_trial) {
            let words = format!("in the use `{}`{}", used.name, std::mem::take(&mut others));
            finding = finding.related(self.in_file(used.at), words);
        }
        finding
    }
}

/// A text without the name of a use before the names of its tags and rungs.
fn without(text: &str, name: &str) -> String {
    let mut told = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(name) {
        let (before, behind) = (&rest[..at], &rest[at + name.len()..]);
        let begins = !before.ends_with(|c: char| c.is_ascii_alphanumeric() || "_.-/".contains(c));
        told.push_str(before);
        match behind.strip_prefix(['.', '/']).filter(|_| begins) {
            Some(tag) => rest = tag,
            None => {
                told.push_str(name);
                rest = behind;
            }
        }
    }
    told + rest
}

/// A text without the `?` before the names of parameters in a trial. The `?` of a question is kept.
fn bare(text: &str) -> String {
    let mut told = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('?') {
        let (before, behind) = (&rest[..at], &rest[at + 1..]);
        told.push_str(before);
        let begins = !told.ends_with(|c: char| c.is_ascii_alphanumeric());
        if !(begins && behind.starts_with(|c: char| c.is_ascii_alphabetic())) {
            told.push('?');
        }
        rest = behind;
    }
    told + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trial_marks_are_removed_and_question_marks_are_kept() {
        assert_eq!(bare("`?a` and `b`? or `?c`?"), "`a` and `b`? or `c`?");
        assert_eq!(bare("`list[?a]`, `?b & !?c`. ms or s?"), "`list[a]`, `b & !c`. ms or s?");
    }

    /// The result for two findings at an argument marked as wrong, and for other findings.
    fn told(others: Vec<Finding>) -> Vec<String> {
        let mut layers = Layers::default();
        let given = Span { file: FileId(0), start: 40, end: 45 };
        let at = Span { file: FileId(0), start: 10, end: 11 };
        let span = Span { file: layers.add_atom(given.file, at), ..given };
        layers.mark_wrong(given);
        let held_back = |code| Finding::new(code, span, "of the argument".to_owned());
        let mut findings = vec![held_back(Code::OperandType), held_back(Code::UnusedTag)];
        findings.extend(others);
        let told = layers.placed_findings(findings).into_iter();
        told.map(|finding| format!("{} at {}", finding.message, finding.span.start)).collect()
    }

    #[test]
    fn a_finding_at_a_wrong_argument_is_hidden_only_if_another_error_exists() {
        let other = |code| vec![Finding::new(code, Span::default(), "another".to_owned())];
        assert_eq!(told(other(Code::TemplateArgument)), ["another at 0"]);
        assert_eq!(told(other(Code::UnusedTag)), ["another at 0", "of the argument at 40"]);
        assert_eq!(told(Vec::new()), ["of the argument at 40"]);
    }
}
