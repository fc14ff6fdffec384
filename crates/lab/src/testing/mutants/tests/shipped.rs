//! All mutants of the shipped ladders.

use std::path::{Path, PathBuf};

use expect_test::expect;

use super::{PERIOD_MS, try_all};
use crate::testing::mutants::{MutantKind, mutants};
use rungd_config::load::{controller_file, ladder_files};
use rungd_language::resolve::program::Program;
use rungd_language::source::span::SourceFile;

#[test]
fn the_table_finds_each_kind_of_mutant_by_name() {
    for kind in MutantKind::ALL {
        assert_eq!(MutantKind::from_name(kind.name()), Some(*kind));
    }
}

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(folder);
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("one"));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    files
}

/// Tries all mutants of a shipped program; returns their number as text.
fn count(name: &Path, program: &Program, files: &[SourceFile]) -> String {
    let all = mutants(program, files, PERIOD_MS);
    let again = mutants(program, files, PERIOD_MS);
    assert_eq!(format!("{all:?}"), format!("{again:?}"));
    try_all(program, &all);
    format!(
        "{}: {}
",
        name.file_stem().unwrap_or_default().display(),
        all.len()
    )
}

#[test]
fn the_shipped_ladders_have_the_recorded_mutants() {
    let mut text = String::new();
    for path in files("config").into_iter().chain(files("config/first")) {
        let loaded = controller_file(&path).expect("a controller file");
        let program = loaded.program.expect("a program");
        text += &count(&path, &program, &loaded.files);
    }
    expect![[r#"
        batch-mixer: 186
        batch-reactor: 214
        bin-emptying: 56
        boiler-house: 181
        bottling-plant: 197
        car-park: 62
        conveyor: 92
        filling-line: 222
        lift-station: 193
        lubrication: 57
        parts-bin: 72
        pump-station: 180
        rungd: 72
        sorter: 155
        temperature-loop: 91
        traffic-light: 189
        controller: 55
    "#]]
    .assert_eq(&text);
}

#[test]
fn the_library_has_the_recorded_mutants() {
    let mut text = String::new();
    for path in files("config/lib") {
        let file = path.file_name().expect("a name");
        let user = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("docs/lib/diagrams")
            .join(file);
        let loaded = ladder_files(&[path.clone(), user]).expect("readable files");
        let program = loaded.program.expect("a program");
        text += &count(&path, &program, &loaded.files);
    }
    expect![[r#"
        alternate: 15
        debounce: 23
        drive: 142
        duty: 269
        first-out: 148
        flasher: 23
        hour-meter: 27
        hysteresis: 14
        lead-lag: 163
        pid: 156
        pulse: 26
        ramp-soak: 151
        ramp: 72
        scaling: 47
        sequence: 116
        short-cycle: 47
        tick: 26
        totalizer: 117
        valve: 147
        vote: 97
        week: 200
    "#]]
    .assert_eq(&text);
}
