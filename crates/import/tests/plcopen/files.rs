//! Any PLCopen files of a folder: none causes a panic, each element is in the report.
//!
//! `RUNGD_PLCOPEN_FILES=DIR cargo test -p rungd-import plcopen::files -- --nocapture` prints the
//! counts, and the reasons for what is not translated; with `RUNGD_PLCOPEN_TEXTS=1` the ladders
//! too.

use std::collections::BTreeMap;

use rungd_import::model::{Fate, RungOutcome};
use rungd_import::plcopen;

use super::counter::is_complete;
use crate::plant;

#[derive(Default)]
struct RungCounts {
    exact: usize,
    different: usize,
    todo: usize,
}

/// Whether what the report lists is a part of a chart, and no network of a ladder.
fn is_of_chart(rung: &RungOutcome) -> bool {
    let kinds = ["step", "macroStep", "transition", "action", "jumpStep"];
    rung.parts.iter().any(|part| {
        kinds.contains(&part.kind.as_str())
            || ["selection", "simultaneous"].iter().any(|start| part.kind.starts_with(start))
    })
}

#[test]
fn every_file_of_a_folder_is_imported_whole() {
    let Some(folder) = std::env::var_os("RUNGD_PLCOPEN_FILES") else { return };
    let mut counts = [RungCounts::default(), RungCounts::default()];
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|one| one.unwrap().path()).collect();
    paths.sort();
    for path in &paths {
        let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let project = match plcopen::read(&text) {
            Ok(project) => project,
            Err(why) => {
                println!("{name}: {why}");
                continue;
            }
        };
        is_complete(&text);
        for rung in &project.outcome.rungs {
            let counts = &mut counts[usize::from(is_of_chart(rung))];
            match &rung.fate {
                Fate::Exact => counts.exact += 1,
                Fate::Different(_) => counts.different += 1,
                Fate::Todo(why) => {
                    counts.todo += 1;
                    *reasons.entry(why.clone()).or_default() += 1;
                }
            }
        }
        let errors = plant::errors(&project);
        let others = errors
            .lines()
            .filter(|line| line.starts_with("error") && !line.contains("imported-todo"));
        let others = others.count();
        let counts = project.outcome.counts();
        println!(
            "{name}: {} exact, {} different, {} not translated, {others} errors, {} left out",
            counts.exact,
            counts.different,
            counts.todo,
            project.outcome.left_out.len()
        );
        if others > 0 || std::env::var_os("RUNGD_PLCOPEN_TEXTS").is_some() {
            println!("{errors}\n{}", plant::texts(&project));
        }
    }
    for (name, counts) in ["networks", "parts of charts"].into_iter().zip(&counts) {
        let RungCounts { exact, different, todo } = counts;
        println!("{name}: {exact} exact, {different} different, {todo} not translated");
    }
    println!("{} files", paths.len());
    reasons.iter().for_each(|(why, count)| println!("{count:4} {why}"));
}
