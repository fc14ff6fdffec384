//! Two versions of a ladder as rungs: what was edited, what is new, what is gone.
//!
//! Called by `rungd draw --diff`. Rungs are paired as a reload pairs them; a pair that is drawn the
//! same is no difference. Only rungs are compared: settings, tags and their values are not.

use std::fmt::Write as _;
use std::sync::Arc;

use super::ladder::{Picture, RungPicture};
use super::text::{self, WireStyle};
use rungd_history::observe::Subject;
use rungd_language::lower::identity::RungText;
use rungd_language::source::wording::counted;
use rungd_state::reload::{LoweredProgram, RungDifference, rung_differences};

/// The text of the differences; lines of the old ladder begin with `-`, those of the new one with
/// `+`. `has_names`: the names of rungs are no numbers.
pub fn difference(old: &Subject, new: &Subject, style: WireStyle, has_names: bool) -> String {
    let lowered = |subject| LoweredProgram {
        program: Subject::code(subject),
        symbols: Subject::symbols(subject),
    };
    let (before, now) = (Version::of(old, style), Version::of(new, style));
    let (mut edited, mut added, mut gone) = (0, 0, 0);
    let mut all = Vec::new();
    for difference in rung_differences(lowered(old), lowered(new), has_names) {
        let (was, is) = match &difference {
            RungDifference::Edited(was, is) => (before.find(was), now.find(is)),
            RungDifference::New(is) => (None, now.find(is)),
            RungDifference::Gone(was) => (before.find(was), None),
        };
        let word = match (&was, &is) {
            (Some(was), Some(is)) if was.lines == is.lines => continue,
            (Some(_), Some(_)) => (&mut edited, "edited"),
            (None, Some(_)) => (&mut added, "new"),
            (Some(_), None) => (&mut gone, "gone"),
            (None, None) => continue,
        };
        *word.0 += 1;
        let is_gone = is.is_none();
        all.push(TextOfRung {
            is_gone,
            at: is.or(was).map_or(0, |rung| rung.at),
            text: String::new(),
        });
        let Some(last) = all.last_mut() else { continue };
        let shown = is.or(was);
        let (said, place) = shown.map_or(("", String::new()), |rung| (rung.said, rung.place()));
        let _ = writeln!(last.text, "{said} is {}  {place}", word.1);
        for (sign, rung) in [('-', was), ('+', is)] {
            let lines = rung.map_or(&[][..], |rung| rung.lines);
            lines.iter().for_each(|line| last.text += &format!("{sign} {line}\n"));
        }
    }
    all.sort_by_key(|rung| (rung.is_gone, rung.at));
    let mut text: String = all.iter().map(|rung| format!("{}\n", rung.text)).collect();
    let _ = match all.is_empty() {
        true => writeln!(text, "no rung differs"),
        false => writeln!(text, "{} edited, {added} new, {gone} gone", counted(edited, "rung")),
    };
    text
}

/// The text of a rung that differs, with its place in the order.
struct TextOfRung {
    is_gone: bool,
    at: usize,
    text: String,
}

/// A version of the ladder.
struct Version<'s> {
    rungs: &'s [RungText],
    pictures: Vec<RungPicture>,
    lines: Vec<Vec<String>>,
}

/// A rung of a version.
#[derive(Clone, Copy)]
struct FoundRung<'v> {
    at: usize,
    said: &'v str,
    lines: &'v Vec<String>,
    picture: &'v RungPicture,
}

impl FoundRung<'_> {
    fn place(&self) -> String {
        format!("{}:{}", self.picture.place.0, self.picture.place.1)
    }
}

impl Version<'_> {
    fn of(subject: &Subject, style: WireStyle) -> Version<'_> {
        let mut pictures = Vec::new();
        // In the order in which the rungs are lowered.
        for block in Picture::of(subject).blocks {
            pictures.extend(block.rungs);
            pictures.extend(block.stages.into_iter().flat_map(|stage| stage.rungs));
        }
        let lines = pictures.iter().map(|rung| text::lines(&rung.grid, style)).collect();
        Version { rungs: &subject.symbols().identity.rungs, pictures, lines }
    }

    fn find(&self, rung: &RungText) -> Option<FoundRung<'_>> {
        let at = self.rungs.iter().position(|own| Arc::ptr_eq(&own.said, &rung.said))?;
        let (lines, picture) = (self.lines.get(at)?, self.pictures.get(at)?);
        Some(FoundRung { at, said: &self.rungs[at].said, lines, picture })
    }
}
