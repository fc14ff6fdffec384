//! Tests of loads whose time limit ends, at each step of a load.

use std::path::Path;

use crate::load::controller_file_within;
use crate::progress::{Progress, Step};

const LADDER: &str = "[tags]\nlamp = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\n\
                      rung = [ { when = [\"X0\"], do = [\"OUT lamp\"] } ]\n";

/// A folder with a controller file and a ladder file, removed at the end of the test.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new() -> Folder {
        let folder = std::env::temp_dir().join(format!("rungd-ended-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("controller.toml"), "ladder = [\"ladder.toml\"]\n").unwrap();
        std::fs::write(folder.join("ladder.toml"), LADDER).unwrap();
        Folder(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_load_whose_time_is_over_ends_with_the_step_that_it_is_at() {
    let folder = Folder::new();
    let name = |file: &str| folder.0.join(file).display().to_string();
    let (controller, ladder) = (name("controller.toml"), name("ladder.toml"));
    let steps = [
        Step::Reading(controller.clone()),
        Step::Parsing(controller.clone()),
        Step::Reading(ladder.clone()),
        Step::Parsing(ladder),
        Step::Names,
        Step::Settings,
        Step::Rule("owned-twice"),
        Step::Rule("out-lost-on-jump-back"),
        Step::Rule("unused-tag"),
    ];
    for step in steps {
        let progress = Progress::over_at(step.clone());
        let loaded = controller_file_within(Path::new(&controller), &progress).unwrap();
        assert!(loaded.program.is_none() && loaded.controller.is_none(), "{step}");
        assert_eq!(progress.current(), Some(step), "it began no further step");
    }
    let loaded = controller_file_within(Path::new(&controller), &Progress::new()).unwrap();
    assert!(loaded.program.is_some() && loaded.findings.is_empty(), "{:?}", loaded.findings);
}
