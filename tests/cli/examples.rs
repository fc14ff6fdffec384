//! The examples in `config/`, tested like an acceptance test by a plant's engineer.
//!
//! `tests/scenarios/` has a folder for each scenario: `args` (the ladder and the options of `rungd
//! sim`), `stimulus.csv`, and `expected.csv`, which was derived by hand, not recorded. Each row of
//! it has the scan from which some operands have new values, these values, and the reason. A value
//! must hold in every scan until the next value in its column. An empty cell changes nothing; after
//! `*` any value passes. So the test fails if a lamp is dark for one scan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The header and the rows of `expected.csv`, split into cells; the cell `why` may contain commas.
fn expected(folder: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(folder.join("expected.csv")).expect("expected.csv");
    let mut lines = text.lines();
    let header: Vec<String> =
        lines.next().expect("a header").split(',').map(str::to_owned).collect();
    assert_eq!(header.first().map(String::as_str), Some("scan"));
    assert_eq!(header.last().map(String::as_str), Some("why"), "each row says why");
    let row = |line: &str| -> Vec<String> {
        let cells: Vec<String> = line.splitn(header.len(), ',').map(str::to_owned).collect();
        assert_eq!(cells.len(), header.len(), "{}: {line}", folder.display());
        cells
    };
    let rows = lines.map(row).collect();
    (header, rows)
}

/// Runs `rungd sim` and returns the trace's rows: the scan's name, and the watched values.
fn trace(folder: &Path, watch: &[String]) -> Vec<(String, Vec<String>)> {
    let args = std::fs::read_to_string(folder.join("args")).expect("args");
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .current_dir(root())
        .arg("sim")
        .args(args.split_whitespace())
        .arg("--stimulus")
        .arg(folder.join("stimulus.csv"))
        .args(["--watch", &watch.join(",")])
        .output()
        .expect("rungd runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", folder.display());
    let text = String::from_utf8(output.stdout).expect("CSV is text");
    let row = |line: &str| {
        let mut cells = line.split(',').map(str::to_owned);
        let scan = cells.next().expect("a scan");
        (scan, cells.skip(1).collect())
    };
    text.lines().skip(1).map(row).collect()
}

/// Every difference between a scenario's expected values and the simulator's trace.
fn differences(folder: &Path) -> Vec<String> {
    let (header, rows) = expected(folder);
    let operands = &header[1..header.len() - 1];
    let mut pending: BTreeMap<&str, &Vec<String>> =
        rows.iter().map(|row| (row[0].as_str(), row)).collect();
    assert_eq!(pending.len(), rows.len(), "{}: a scan stands twice", folder.display());
    let mut wanted = vec!["*"; operands.len()];
    let mut why = "";
    let mut found = Vec::new();
    for (scan, values) in trace(folder, operands) {
        if let Some(row) = pending.remove(scan.as_str()) {
            for (wanted, cell) in wanted.iter_mut().zip(&row[1..]) {
                *wanted = if cell.is_empty() { *wanted } else { cell };
            }
            why = row.last().expect("why");
        }
        for ((operand, value), wanted) in operands.iter().zip(&values).zip(&wanted) {
            if *wanted != "*" && value != wanted {
                found.push(format!("scan {scan}: {operand} is {value}, not {wanted} ({why})"));
            }
        }
    }
    found.extend(pending.keys().map(|scan| format!("scan {scan} was never simulated")));
    found
}

#[test]
fn scenarios_match_their_expected_traces() {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(root().join("tests/scenarios"))
        .expect("tests/scenarios")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    assert!(folders.len() >= 11);
    let mut failures = String::new();
    for folder in &folders {
        let found = differences(folder);
        if !found.is_empty() {
            let name = folder.file_name().unwrap_or_default().display();
            let first: Vec<String> = found.iter().take(12).cloned().collect();
            failures.push_str(&format!("{name}:\n  {}\n", first.join("\n  ")));
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}
