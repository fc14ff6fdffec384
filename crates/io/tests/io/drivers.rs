//! The recipe for a driver (`CONTRIBUTING.md`), as far as a test can check it. Every driver's
//! folder has a row in the table. Every name in the table has a case of findings, a start, and a
//! row on the page.

use std::fs;
use std::path::{Path, PathBuf};

use rungd_config::controller;
use rungd_config::controller::device::drivers::{DRIVERS, names};
use rungd_language::source::span::FileId;

fn root(path: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}

fn text(path: &str) -> String {
    fs::read_to_string(root(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn every_driver_folder_has_a_row_in_the_table() {
    let entries = fs::read_dir(root("crates/config/src/controller/device"))
        .expect("the folder of all drivers");
    let folders = entries.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_dir());
    let folders: Vec<_> =
        folders.map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(folders.len(), DRIVERS.len(), "{folders:?}");
    let table = text("crates/config/src/controller/device/drivers.rs");
    for folder in &folders {
        assert!(table.contains(&format!("{folder}::keys::")), "no row for `{folder}`");
    }
}

#[test]
fn every_driver_has_findings_a_start_and_a_page() {
    let cases = fs::read_dir(root("tests/ui")).expect("the cases of findings");
    let cases = cases.map(|entry| entry.expect("an entry").path().join("controller.toml"));
    let cases: Vec<_> = cases.filter_map(|path| fs::read_to_string(path).ok()).collect();
    let (page, start) = (text("docs/devices.md"), text("src/daemon/devices.rs"));
    for name in names() {
        let has_driver = |case: &String| {
            case.lines().any(|line| {
                line.split_once('=').is_some_and(|(key, value)| {
                    key.trim() == "driver" && value.trim().starts_with(&format!("\"{name}\""))
                })
            })
        };
        assert!(cases.iter().any(has_driver), "tests/ui has no case of `{name}`");
        assert!(page.contains(&format!("`{name}`")), "docs/devices.md has no row for `{name}`");
        assert!(start.contains(&format!("\"{name}\"")), "daemon/devices.rs does not say `{name}`");
    }
}

/// A driver rejects the keys of other drivers as unknown. An unknown driver has no findings about
/// keys.
#[test]
fn a_driver_accepts_only_its_own_keys() {
    let findings = |driver: &str, key: &str| {
        let text = format!(
            "ladder = [\"l.toml\"]\n[[device]]\nname = \"d\"\ndriver = \"{driver}\"\n{key}\nmap = []\n"
        );
        let (_, findings) = controller::read(&text, FileId(0));
        findings.into_iter().map(|finding| finding.message).collect::<Vec<_>>()
    };
    let own = [
        ("modbus-tcp", "address = \"10.0.0.1\""),
        ("modbus-rtu", "port = \"/dev/ttyUSB0\""),
        ("gpio", "chip = \"/dev/gpiochip0\""),
        ("simulated", "seed = 2"),
        ("ladder", "period = \"20ms\""),
    ];
    assert_eq!(own.map(|(name, _)| name).to_vec(), names());
    for (owner, key) in own {
        for driver in names() {
            let unknown = findings(driver, key).iter().any(|text| text.contains("has no key"));
            assert_eq!(unknown, driver != owner, "{driver}: {key}");
        }
        assert_eq!(findings("none-such", key), ["no driver is called `none-such`"]);
    }
}
