//! A foreign client, asyncua, against the server and a running controller: `foreign.py`, in a folder
//! of its own. It needs `rungd` beside `rungd-opcua`, and Python with asyncua.

use std::path::Path;
use std::process::Command;

use rungd_test_support::needs::{python_can, usable};

#[test]
fn a_foreign_client_reads_writes_subscribes_and_signs_in() {
    let server = Path::new(env!("CARGO_BIN_EXE_rungd-opcua"));
    let beside = server.with_file_name("rungd");
    let rungd = std::env::var_os("RUNGD_BIN").map_or(beside, Into::into);
    assert!(rungd.exists(), "{}: `cargo build` makes it", rungd.display());
    let python = std::env::var_os("RUNGD_PYTHON").unwrap_or_else(|| "python3".into());
    let python = Path::new(&python);
    if !usable(python_can(python, "Python with asyncua", "import asyncua, cryptography")) {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("opcua-foreign");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign.py");
    let ran = Command::new(python).arg(script).args([&rungd, server, &folder]).output();
    let ran = ran.expect("Python runs");
    let said = String::from_utf8_lossy(&ran.stdout);
    let passed = said.lines().filter(|line| line.starts_with("ok ")).count();
    let error = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success() && passed == 9, "{said}\n{error}");
}
