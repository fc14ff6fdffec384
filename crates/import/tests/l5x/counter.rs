//! A second reader of the XML: every rung and every instruction of a file is in the report.

use std::collections::BTreeMap;

use rungd_base::random::SplitMix64;
use rungd_import::l5x;
use rungd_import::write::{REPORT, files};

use super::file;
use super::generator::routines;

/// The instructions in all texts between `<![CDATA[` and `]]>` of rungs, by a search for names
/// before parentheses.
pub fn counted(xml: &str) -> (usize, BTreeMap<String, usize>) {
    let mut rungs = 0;
    let mut counts = BTreeMap::new();
    for piece in xml.split("<Rung ").skip(1) {
        rungs += 1;
        let Some((_, rest)) = piece.split_once("<Text>") else { continue };
        let text = rest.split("</Text>").next().unwrap();
        let text = text.trim().trim_start_matches("<![CDATA[").trim_end_matches("]]>");
        let mut name = String::new();
        let mut depth = 0;
        for letter in text.chars() {
            match letter {
                '(' if depth == 0 => {
                    *counts.entry(name.to_uppercase()).or_default() += 1;
                    depth = 1;
                }
                '(' => depth += 1,
                ')' => depth -= 1,
                letter if depth == 0 && (letter.is_alphanumeric() || letter == '_') => {
                    name.push(letter);
                    continue;
                }
                _ => {}
            }
            name.clear();
        }
    }
    (rungs, counts)
}

/// Compares a file with the report that an import writes about it.
pub fn is_complete(xml: &str) {
    let project = l5x::read(xml).unwrap();
    let files = files(&project);
    let report = &files.iter().find(|file| file.path == REPORT).unwrap().text;
    let (rungs, counts) = counted(xml);
    assert_eq!(project.outcome.rungs.len(), rungs);
    for (name, count) in counts {
        let row = format!("| `{name}` | {count} |");
        assert!(report.contains(&row), "{row}\n{report}");
    }
}

#[test]
fn every_rung_and_instruction_of_random_files_is_in_the_report() {
    let mut random = SplitMix64(7);
    for _ in 0..30 {
        let made = routines(&mut random);
        is_complete(&file(&made.tags, &made.main, &made.sub));
    }
}
