//! Realistic mistakes in the shipped plants, and the suites that find them: a copy of `config` gets
//! one mistake at a time.

use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_test_support::folder::TestFolder;

/// A mistake in a file of `config`, and the suite that finds it.
struct PlantFault {
    says: &'static str,
    file: &'static str,
    /// The text in the file, and the faulty text that replaces it.
    change: (&'static str, &'static str),
    suite: &'static str,
    /// A part of the name of the test that finds it.
    test: &'static str,
}

const FAULTS: [PlantFault; 4] = [
    PlantFault {
        says: "two registers of a map are swapped: the control word lands in the speed",
        file: "tests/boiler-house-bench.toml",
        change: (
            "{ from = \"control1\",  to = \"holding 0\" },\n    { from = \"rpm1\",      to = \"holding 1\" },",
            "{ from = \"control1\",  to = \"holding 1\" },\n    { from = \"rpm1\",      to = \"holding 0\" },",
        ),
        suite: "boiler-house-drives-plant",
        test: "a cold house",
    },
    PlantFault {
        says: "a burner is ON without flow for one scan",
        file: "programs/boiler-house.toml",
        change: (
            "when = [\"called\", \"flow\", \"drive.running\", \"!lockout\"]",
            "when = [\"called\", \"drive.running\", \"!lockout\"]",
        ),
        suite: "boiler-house-drives-plant",
        test: "whatever fails",
    },
    PlantFault {
        says: "a drive that is lost in the middle of a step goes unnoticed",
        file: "programs/boiler-house.toml",
        change: ("link = \"link\", status", "link = \"$On\", status"),
        suite: "boiler-house-drives-plant",
        test: "lost in the middle",
    },
    PlantFault {
        says: "a tag is left out of [retain]",
        file: "batch-reactor.toml",
        change: ("\"step\", \"index\", \"base\"", "\"step\", \"base\""),
        suite: "batch-reactor-plant",
        test: "a power cut in each step",
    },
];

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry").path();
        let target = to.join(entry.file_name().expect("a name"));
        match entry.is_dir() {
            true => copy(&entry, &target),
            false => drop(std::fs::copy(&entry, &target).expect("copied")),
        }
    }
}

fn run(config: &Path, fault: &PlantFault) -> (bool, String) {
    let suite = config.join(format!("tests/{}.test.toml", fault.suite));
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(["test", "--filter", fault.test]).arg(suite);
    let output = command.output().expect("rungd runs");
    (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn realistic_mistakes_are_found_by_the_suites_of_the_plants() {
    let folder = TestFolder::new("plant-faults");
    let config: PathBuf = folder.path().join("config");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config"), &config);
    for fault in FAULTS {
        let PlantFault { says, file, change: (right, wrong), .. } = fault;
        let file = config.join(file);
        let text = std::fs::read_to_string(&file).expect("text");
        assert!(text.contains(right), "{says}: {} has no {right}", file.display());
        assert!(run(&config, &fault).0, "`{}` passes without the mistake", fault.test);
        std::fs::write(&file, text.replacen(right, wrong, 1)).expect("writable");
        let (passed, said) = run(&config, &fault);
        assert!(!passed, "{says}: nothing notices it\n{said}");
        std::fs::write(&file, text).expect("writable");
    }
}
