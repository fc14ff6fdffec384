//! The shipped ladders: those that are exported do the same, and the list of what is refused.

use std::path::{Path, PathBuf};

use expect_test::expect_file;
use rungd_base::random::SplitMix64;
use rungd_config::load;
use rungd_language::resolve::program::Program;

use super::judge::Judge;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The TOML files of a folder, in order of their names.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join(folder)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().ends_with(".toml"));
    paths.retain(|path| !path.to_string_lossy().ends_with(".test.toml"));
    paths.sort();
    paths
}

/// The program of a controller file or ladder, if it is one and has no errors.
fn program(path: &Path) -> Option<Program> {
    let loaded = match load::is_controller_file(path).ok()? {
        true => load::controller_file(path),
        false => {
            let text = std::fs::read_to_string(path).ok()?;
            let library = text.lines().find_map(|line| {
                let at = line.find("lib:")?;
                let end = line[at..].find(|c: char| "\" `,;.)".contains(c));
                Some(line[at..].split_at(end?).0.to_owned())
            });
            let own = path.file_name()?.to_string_lossy().into_owned();
            let of_use = own.strip_suffix("-use.toml").map(|name| format!("lib:{name}"));
            let diagram = path.to_string_lossy().contains("docs/lib/");
            let stem = path.file_stem()?.to_string_lossy().into_owned();
            let of_page = diagram.then(|| format!("lib:{stem}"));
            let library = of_use.or(of_page).or(library).map(PathBuf::from);
            let paths: Vec<PathBuf> = library.into_iter().chain([path.to_owned()]).collect();
            load::ladder_files(&paths)
        }
    };
    loaded.ok()?.program
}

#[test]
fn shipped_ladders_do_the_same_behind_an_export_or_are_refused_by_name() {
    let mut lines = Vec::new();
    let (mut done, mut all) = (0, 0);
    for folder in ["config", "config/lib/tests", "docs/instructions/diagrams", "docs/lib/diagrams"]
    {
        for path in files(folder) {
            let name = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
            let Some(program) = program(&path) else { continue };
            all += 1;
            let judge = Judge { name: &name, program: &program, scans: 50, step_ms_max: 400 };
            match judge.judge(&mut SplitMix64(7)) {
                Ok(()) => {
                    done += 1;
                    lines.push(format!("{name}: the same"));
                }
                Err(mut refused) => {
                    refused.sort();
                    refused.dedup();
                    lines.push(format!("{name}: refused: {}", refused.join("; ")));
                }
            }
        }
    }
    lines.push(format!("{done} of {all} ladders are exported\n"));
    expect_file!["shipped.txt"].assert_eq(&lines.join("\n"));
}
