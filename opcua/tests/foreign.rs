//! A foreign client, asyncua, against the server and running controllers: `foreign.py`, `plant.py`
//! and `hostile.py`, each in a folder of its own. They need `rungd` beside `rungd-opcua`, and Python
//! with asyncua.

use std::path::Path;
use std::process::Command;

use rungd_test_support::needs::{python_can, usable};

/// Runs a script at a port of its own, and counts what passed.
fn passes(name: &str, port: u16, parts: usize) {
    let server = Path::new(env!("CARGO_BIN_EXE_rungd-opcua"));
    let beside = server.with_file_name("rungd");
    let rungd = std::env::var_os("RUNGD_BIN").map_or(beside, Into::into);
    assert!(rungd.exists(), "{}: `cargo build` makes it", rungd.display());
    let python = std::env::var_os("RUNGD_PYTHON").unwrap_or_else(|| "python3".into());
    let python = Path::new(&python);
    if !usable(python_can(python, "Python with asyncua", "import asyncua, cryptography")) {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("opcua-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/{name}.py"));
    let ran = Command::new(python)
        .arg(script)
        .args([&rungd, server, &folder])
        .env("OPCUA_PORT", port.to_string())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output();
    let ran = ran.expect("Python runs");
    let said = String::from_utf8_lossy(&ran.stdout);
    let passed = said.lines().filter(|line| line.starts_with("ok ")).count();
    let error = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success() && passed == parts, "{said}\n{error}");
}

#[test]
fn a_foreign_client_reads_writes_subscribes_and_acknowledges() {
    passes("foreign", 48_411, 9);
}

#[test]
fn a_foreign_client_sees_programs_lost_devices_shelves_and_the_past_of_a_plant() {
    passes("plant", 48_421, 6);
}

#[test]
fn strangers_and_hostile_clients_take_nothing_and_keep_nobody_out() {
    passes("hostile", 48_431, 14);
}
