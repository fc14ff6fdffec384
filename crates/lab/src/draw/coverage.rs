//! The coverage of the contacts of a ladder by tests, from the report of
//! `rungd test --coverage --json`.

use std::collections::HashMap;

use serde_json::Value;

use super::ladder::Picture;

/// A rung or branch.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct PartKey {
    /// Its block or Stage.
    pub element: String,
    /// The number of the rung.
    pub rung: u32,
    /// The number of the branch, from 1; `None`: the rung's own legs.
    pub branch: Option<u32>,
}

/// The coverage of a report.
#[derive(Debug, Default)]
pub struct CoverageMarks {
    /// For each contact, whether it was ON, and whether it was OFF.
    contacts: HashMap<PartKey, Vec<(bool, bool)>>,
    /// The rungs of the report: the name of the file without folders, and the line.
    places: HashMap<(String, u32), (String, u64)>,
}

impl CoverageMarks {
    /// Reads a report. Adds up the results of several suites.
    ///
    /// # Errors
    /// A sentence for people: the text is not such a report.
    pub fn read(report: &str) -> Result<CoverageMarks, String> {
        let what = "this is not a report of `rungd test --coverage --json`";
        let report: Value =
            serde_json::from_str(report).map_err(|error| format!("{what}: {error}"))?;
        let files = report["coverage"].as_array().ok_or(what)?;
        let mut marks = CoverageMarks::default();
        for rung in files.iter().flat_map(|file| file["rungs"].as_array()).flatten() {
            let (Some(block), Some(number)) = (rung["block"].as_str(), rung["number"].as_u64())
            else {
                return Err(what.to_owned());
            };
            let file = rung["file"].as_str().unwrap_or_default();
            let place = (own_name(file).to_owned(), rung["line"].as_u64().unwrap_or_default());
            marks.places.insert((block.to_owned(), number as u32), place);
            let branch = rung["branch"].as_u64().map(|branch| branch as u32);
            let contacts = rung["contacts"].as_array().map(Vec::as_slice).unwrap_or_default();
            let part = PartKey { element: block.to_owned(), rung: number as u32, branch };
            let seen = marks.contacts.entry(part).or_default();
            seen.resize(seen.len().max(contacts.len()), (false, false));
            for (known, contact) in seen.iter_mut().zip(contacts) {
                let seen = |way: &str| contact["seen"][way].as_bool().unwrap_or(false);
                *known = (known.0 || seen("on"), known.1 || seen("off"));
            }
        }
        Ok(marks)
    }

    /// Checks that the report belongs to this version of the ladder's text.
    ///
    /// # Errors
    /// A sentence for people: a rung is not the same, or has moved.
    pub fn fits(&self, ladder: &Picture) -> Result<(), String> {
        let mut found = 0;
        for (element, _, rungs) in ladder.elements() {
            for rung in rungs {
                let (file, line) = &rung.place;
                let Some(place) = self.places.get(&(element.clone(), rung.number as u32)) else {
                    continue;
                };
                if *place != (own_name(file).to_owned(), u64::from(*line)) {
                    let (their_file, their_line) = place;
                    return Err(format!(
                        "the report belongs to a different version of the ladder: {element}, rung \
                         {} is at {file}:{line}, and was at {their_file}:{their_line}; run `rungd \
                         test --coverage --json` again",
                        rung.number
                    ));
                }
                found += 1;
            }
        }
        match found {
            0 => Err("the report has no rung of this ladder".to_owned()),
            _ => Ok(()),
        }
    }

    /// The class and the text of a contact's mark; `None` if the contact was both ON and OFF.
    pub(super) fn mark(&self, part: &PartKey, leaf: usize) -> Option<(&'static str, &'static str)> {
        let seen = self.contacts.get(part).and_then(|contacts| contacts.get(leaf));
        match seen.copied().unwrap_or_default() {
            (true, true) => None,
            (true, false) => Some(("half", "never OFF")),
            (false, true) => Some(("half", "never ON")),
            (false, false) => Some(("unseen", "not tested")),
        }
    }
}

/// The name of a file without its folders, since a report may be made in a different folder.
fn own_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}
