//! A second reader of the XML: every contact, coil and block of a ladder is in the report, and
//! every step, transition and action of a chart.

use std::collections::BTreeMap;

use rungd_import::plcopen;
use rungd_import::write::{REPORT, files};

/// The contacts, coils, blocks and variables between `<LD>` and `</LD>`, by a search for tags.
fn counted(xml: &str) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    let prefix = xml.split("<").find_map(|tag| tag.split(['>', ' ']).next()?.strip_suffix("LD"));
    let prefix = prefix.unwrap_or_default();
    let end = format!("</{prefix}LD>");
    for ladder in xml.split(&format!("<{prefix}LD>")).skip(1) {
        let ladder = ladder.split(&end).next().unwrap();
        for tag in ladder.split('<').skip(1) {
            let tag = tag.split('>').next().unwrap();
            let name = tag.split_whitespace().next().unwrap_or_default();
            let name = name.strip_prefix(prefix).unwrap_or(name);
            let kind = match name.trim_end_matches('/') {
                "block" => {
                    let quoted = tag.split("typeName=").nth(1).unwrap_or("\"\"");
                    let quote = &quoted[..1];
                    quoted[1..].split(quote).next().unwrap().to_owned()
                }
                kind @ ("contact" | "coil" | "inVariable" | "outVariable") => kind.to_owned(),
                _ => continue,
            };
            *counts.entry(kind).or_default() += 1;
        }
    }
    charts(xml, &mut counts);
    counts
}

/// The steps, transitions, actions and links between `<SFC>` and `</SFC>`, and what leads to
/// transitions there.
fn charts(xml: &str, counts: &mut BTreeMap<String, usize>) {
    for chart in xml.split("<SFC>").skip(1) {
        let chart = chart.split("</SFC>").next().unwrap();
        let mut in_ladder = false;
        for tag in chart.split('<').skip(1) {
            let name = tag.split(['>', ' ', '/']).next().unwrap_or_default();
            match name {
                "LD" => in_ladder = true,
                "" if tag.starts_with("/LD>") => in_ladder = false,
                "step"
                | "macroStep"
                | "transition"
                | "action"
                | "jumpStep"
                | "selectionDivergence"
                | "selectionConvergence"
                | "simultaneousDivergence"
                | "simultaneousConvergence" => *counts.entry(name.to_owned()).or_default() += 1,
                "contact" | "coil" | "inVariable" | "outVariable" if !in_ladder => {
                    *counts.entry(name.to_owned()).or_default() += 1;
                }
                _ => {}
            }
        }
    }
}

/// Compares a file with the report that an import writes about it. A program with several
/// instances is in it several times.
pub fn is_complete(xml: &str) {
    let project = plcopen::read(xml).unwrap();
    let files = files(&project);
    let report = &files.iter().find(|file| file.path == REPORT).unwrap().text;
    for (name, count) in counted(xml) {
        let row = report.lines().find_map(|line| line.strip_prefix(&format!("| `{name}` | ")));
        let found: usize = row.map_or(0, |row| row.trim_end_matches(" |").parse().unwrap());
        assert!(found >= count, "{name}: {count} in the file, {found} in the report\n{report}");
    }
    let rows = report.split("## All rungs").nth(1).unwrap().lines();
    let rows = rows.filter(|row| row.starts_with("| ")).count() - 1;
    assert_eq!(rows, project.outcome.rungs.len(), "{report}");
}
