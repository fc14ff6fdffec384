//! All mutants of the shipped ladders.

use std::path::{Path, PathBuf};

use expect_test::expect;

use super::{PERIOD, try_all};
use crate::testing::mutants::retained::retained;
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

/// Tries all mutants of the rungs of a shipped program; returns their number as text.
fn count(name: &Path, program: &Program, files: &[SourceFile]) -> String {
    let all = mutants(program, files, PERIOD);
    let again = mutants(program, files, PERIOD);
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
        text += count(&path, &program, &loaded.files).trim_end();
        let controller = loaded.controller.expect("settings");
        let entries = retained(&controller, &loaded.files).len();
        text += &if entries > 0 { format!(", [retain] {entries}\n") } else { "\n".to_owned() };
    }
    expect![[r#"
        batch-mixer: 190
        batch-reactor: 215, [retain] 8
        bin-emptying: 56
        boiler-house: 185
        bottling-plant: 200
        car-park: 64
        conveyor: 94
        filling-line: 224, [retain] 7
        lift-station: 198
        lubrication: 58
        parts-bin: 75
        pump-station: 187, [retain] 2
        rungd: 75
        sorter: 157, [retain] 6
        temperature-loop: 92
        traffic-light: 198
        controller: 57
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
        debounce: 25
        drive: 145
        duty: 274
        first-out: 148
        flasher: 25
        hour-meter: 28
        hysteresis: 14
        iec: 168
        lead-lag: 163
        pid: 157
        plant-belt: 162
        plant-drive: 108
        plant-lag: 55
        plant-motor: 78
        plant-tank: 64
        plant-valve: 58
        pulse: 27
        ramp-soak: 151
        ramp: 73
        scaling: 48
        sequence: 118
        short-cycle: 50
        tick: 27
        totalizer: 118
        valve: 151
        vote: 98
        week: 200
    "#]]
    .assert_eq(&text);
}
