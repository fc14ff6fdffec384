//! Any PLCopen files of a folder: none causes a panic, each element is in the report.
//!
//! `RUNGD_PLCOPEN_FILES=DIR cargo test -p rungd-import plcopen::files -- --nocapture` prints the
//! counts, and the reasons for what is not translated; with `RUNGD_PLCOPEN_TEXTS=1` the ladders
//! too.

use std::collections::BTreeMap;

use rungd_import::model::Fate;
use rungd_import::plcopen;

use super::counter::is_complete;
use crate::plant;

#[test]
fn every_file_of_a_folder_is_imported_whole() {
    let Some(folder) = std::env::var_os("RUNGD_PLCOPEN_FILES") else { return };
    let (mut exact, mut different, mut todo) = (0, 0, 0);
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
            match &rung.fate {
                Fate::Exact => exact += 1,
                Fate::Different(_) => different += 1,
                Fate::Todo(why) => {
                    todo += 1;
                    *reasons.entry(why.clone()).or_default() += 1;
                }
            }
        }
        let errors = plant::errors(&project);
        let others = errors
            .lines()
            .filter(|line| line.starts_with("error") && !line.contains("imported-todo"));
        let counts = project.outcome.counts();
        let others = others.count();
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
    println!("{} files: {exact} exact, {different} different, {todo} not translated", paths.len());
    reasons.iter().for_each(|(why, count)| println!("{count:4} {why}"));
}
