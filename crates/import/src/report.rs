//! `import-report.md`: what became of every rung, and what a person has to do.
//!
//! Made of [`crate::model::Outcome`]. Nothing is left out: a rung of the original is in one of the
//! three counts, and its parts are counted.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::model::{Fate, ForeignProject, Outcome, RungOutcome, UnwrittenTag};

/// The numbers of a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rungs that do the same, to the scan.
    pub exact: usize,
    /// Rungs that do the same but for a named difference.
    pub different: usize,
    /// Rungs with a stub in their place.
    pub todo: usize,
}

impl Outcome {
    /// The numbers of rungs by what became of them.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for rung in &self.rungs {
            match rung.fate {
                Fate::Exact => counts.exact += 1,
                Fate::Different(_) => counts.different += 1,
                Fate::Todo(_) => counts.todo += 1,
            }
        }
        counts
    }

    /// Whether something is left for a person to do before the program is whole.
    pub fn is_open(&self) -> bool {
        self.counts().todo > 0 || !self.open.is_empty()
    }
}

/// The text of the report.
pub fn text(project: &ForeignProject) -> String {
    let outcome = &project.outcome;
    let mut text = format!("# Import of {}\n\n{}\n", line(&project.name), line(&project.origin));
    counted(&mut text, outcome);
    list(&mut text, "Open", &outcome.open);
    by_reason(&mut text, "Not translated", outcome, |fate| match fate {
        Fate::Todo(reason) => vec![reason.clone()],
        Fate::Exact | Fate::Different(_) => Vec::new(),
    });
    by_reason(&mut text, "Kept with a difference", outcome, |fate| match fate {
        Fate::Different(names) => names.clone(),
        Fate::Exact | Fate::Todo(_) => Vec::new(),
    });
    list(&mut text, "Differences of the whole project", &outcome.differences);
    list(&mut text, "Parts in other languages", &outcome.left_out);
    let about = "Tags that nothing writes\n\nThe program reads them. The map of a field device \
                 brings inputs; an operator sets the others.";
    of_devices(&mut text, about, &outcome.unwritten);
    let about = "Outputs of modules\n\nThe program writes them. The map of a field device takes \
                 them to the plant.";
    of_devices(&mut text, about, &outcome.outputs);
    if !outcome.renamed.is_empty() {
        text += "\n## Names that changed\n\n| in the original | here |\n|---|---|\n";
        for name in &outcome.renamed {
            let _ = writeln!(text, "| `{}` | `{}` |", line(&name.from), name.to);
        }
    }
    parts(&mut text, outcome);
    all_rungs(&mut text, outcome);
    text
}

/// A table of tags that devices bring or take.
fn of_devices(text: &mut String, about: &str, tags: &[UnwrittenTag]) {
    if tags.is_empty() {
        return;
    }
    let _ = write!(text, "\n## {about}\n\n| tag | in the original | source |\n|---|---|---|\n");
    for tag in tags {
        let was = line(&tag.was);
        let _ = writeln!(text, "| `{}` | `{was}` | {} |", tag.name, line(&tag.source));
    }
}

fn counted(text: &mut String, outcome: &Outcome) {
    let counts = outcome.counts();
    let _ = write!(
        text,
        "\n| rungs | number |\n|---|---|\n| kept exactly | {} |\n| kept with a named difference \
         | {} |\n| not translated | {} |\n| all | {} |\n",
        counts.exact,
        counts.different,
        counts.todo,
        outcome.rungs.len()
    );
    *text += match outcome.is_open() {
        true => {
            "\n`rungd check` refuses the project until a person has replaced what is not \
             translated.\n"
        }
        false => "\nNothing is open.\n",
    };
}

fn list(text: &mut String, title: &str, lines: &[String]) {
    if !lines.is_empty() {
        let _ = writeln!(text, "\n## {title}\n");
        lines.iter().for_each(|one| text.push_str(&format!("- {}\n", line(one))));
    }
}

/// The rungs of a kind of fate, by its reasons.
fn by_reason(
    text: &mut String,
    title: &str,
    outcome: &Outcome,
    reasons: impl Fn(&Fate) -> Vec<String>,
) {
    let mut found: BTreeMap<String, Vec<&RungOutcome>> = BTreeMap::new();
    for rung in &outcome.rungs {
        for reason in reasons(&rung.fate) {
            found.entry(reason).or_default().push(rung);
        }
    }
    if found.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## {title}");
    for (reason, rungs) in found {
        let _ = writeln!(text, "\n{}: {}\n", line(&reason), rungs.len());
        for rung in rungs {
            let _ = writeln!(text, "- {} {}: `{}`", rung.place, rung.number, line(&rung.text));
        }
    }
}

/// The parts of all rungs.
fn parts(text: &mut String, outcome: &Outcome) {
    let mut sums: BTreeMap<&str, usize> = BTreeMap::new();
    for part in outcome.rungs.iter().flat_map(|rung| &rung.parts) {
        *sums.entry(&part.kind).or_default() += part.count;
    }
    if !sums.is_empty() {
        *text += "\n## Parts of the rungs\n\n| part | number |\n|---|---|\n";
        sums.iter().for_each(|(part, sum)| text.push_str(&format!("| `{part}` | {sum} |\n")));
    }
}

fn all_rungs(text: &mut String, outcome: &Outcome) {
    *text += "\n## All rungs\n\n| place | number | became |\n|---|---|---|\n";
    for rung in &outcome.rungs {
        let became = match &rung.fate {
            Fate::Exact => "exact".to_owned(),
            Fate::Different(names) => line(&names.join("; ")),
            Fate::Todo(reason) => format!("**not translated**: {}", line(reason)),
        };
        let _ = writeln!(text, "| {} | {} | {became} |", line(&rung.place), rung.number);
    }
}

/// A text of the original in one line of Markdown.
fn line(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let plain = |c: char| match c {
        '`' => '\'',
        '|' => '¦',
        c if c.is_control() => ' ',
        c => c,
    };
    words.join(" ").chars().map(plain).collect()
}
