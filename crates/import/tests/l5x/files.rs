//! Any L5X files: none causes a panic, each rung is in the report, and how many are kept.
//!
//! `RUNGD_L5X_FILES=FOLDER cargo test -p rungd-import files -- --nocapture` prints the counts of
//! the files of a folder, and the reasons for what is not translated; with `RUNGD_L5X_RUNGS=1` also
//! each rung that is not.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rungd_base::random::SplitMix64;
use rungd_import::l5x;
use rungd_import::model::Fate;
use rungd_test_support::setting::setting;

use super::file;
use super::generator::routines;
use crate::damage::damaged;
use crate::plant;

#[test]
fn the_rungs_of_the_files_of_a_folder_are_counted() {
    let Some(folder) = std::env::var_os("RUNGD_L5X_FILES") else { return };
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    let (mut exact, mut different, mut all, mut refused) = (0, 0, 0, 0);
    let entries = std::fs::read_dir(PathBuf::from(folder)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in &paths {
        let bytes = std::fs::read(path).unwrap();
        let project = match l5x::read(&String::from_utf8_lossy(&bytes)) {
            Ok(project) => project,
            Err(why) => {
                println!("{}: {why}", path.display());
                refused += 1;
                continue;
            }
        };
        let counts = project.outcome.counts();
        exact += counts.exact;
        different += counts.different;
        all += project.outcome.rungs.len();
        for rung in &project.outcome.rungs {
            if let Fate::Todo(why) = &rung.fate {
                *reasons.entry(why.clone()).or_default() += 1;
                if std::env::var_os("RUNGD_L5X_RUNGS").is_some() {
                    println!("{why} | {} {}: {}", rung.place, rung.number, rung.text);
                }
            }
        }
        let errors = plant::errors(&project);
        let others = errors.lines().filter(|line| line.starts_with("error["));
        let others: Vec<&str> = others.filter(|line| !line.contains("imported-todo")).collect();
        if !others.is_empty() {
            println!("{}: {} errors: {}", path.display(), others.len(), others[0]);
        }
    }
    reasons.iter().for_each(|(why, count)| println!("{count:6} {why}"));
    println!(
        "{} files, {refused} refused: {all} rungs, {exact} exact, {different} with a difference, \
         {} not translated",
        paths.len(),
        all - exact - different
    );
}

#[test]
fn no_damage_to_a_file_causes_a_panic() {
    let mut random = SplitMix64(11);
    for _ in 0..setting("RUNGD_L5X_DAMAGED", 20) {
        let made = routines(&mut random);
        let whole = file(&made.tags, &made.main, &made.sub);
        for text in damaged(&whole, &mut random) {
            if let Ok(project) = l5x::read(&text) {
                plant::errors(&project);
            }
        }
    }
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let bomb = "<!DOCTYPE a [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>\
                <RSLogix5000Content>&b;</RSLogix5000Content>";
    let deep = format!("<RSLogix5000Content>{}", "<a>".repeat(100_000));
    for (text, wanted) in [
        (bomb, "DTD"),
        ("<Project/>", "no L5X file: its root is `Project`"),
        (deep.as_str(), ""),
        ("", "document"),
    ] {
        let why = l5x::read(text).expect_err("it is no L5X");
        assert!(why.contains(wanted), "{why}");
    }
}

#[test]
fn instructions_that_use_each_other_are_named_and_end() {
    let own = |name: &str, other: &str| {
        format!(
            "<AddOnInstructionDefinition Name=\"{name}\"><Parameters/><LocalTags><LocalTag \
             Name=\"x\" DataType=\"{other}\"/></LocalTags><Routines><Routine Name=\"Logic\" \
             Type=\"RLL\"><RLLContent><Rung Number=\"0\" Type=\"N\"><Text><![CDATA[{other}(x);]]>\
             </Text></Rung></RLLContent></Routine></Routines></AddOnInstructionDefinition>"
        )
    };
    let text = format!(
        "<RSLogix5000Content TargetType=\"Controller\" TargetName=\"c\"><Controller Name=\"c\">\
         <AddOnInstructionDefinitions>{}{}</AddOnInstructionDefinitions></Controller>\
         </RSLogix5000Content>",
        own("One", "Two"),
        own("Two", "One")
    );
    let project = l5x::read(&text).unwrap();
    assert_eq!(project.outcome.open.len(), 2, "{:?}", project.outcome.open);
}
