//! The Debian package of the server: what it says about its libraries, and how little its unit may do.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_test_support::needs::{usable, works};

/// The most exposure of the unit, as `systemd-analyze security` rates it.
const EXPOSURE_MAX: f64 = 1.6;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn printed(command: &mut Command) -> String {
    let output = command.current_dir(root()).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it is text")
}

#[test]
fn the_package_names_every_library_and_which_parts_are_under_the_mpl() {
    let licences = printed(Command::new("packaging/third-party.sh").arg("rungd-opcua"));
    let list = licences.split("\n\n").nth(1).expect("the list");
    let mpl: Vec<&str> = list.lines().filter(|line| line.ends_with(": MPL-2.0")).collect();
    assert!(mpl.len() >= 5 && mpl.iter().all(|line| line.starts_with("async-opcua")), "{mpl:?}");
    for line in list.lines() {
        let (library, _) = line.split_once(": ").expect("a library and its licence");
        assert!(licences.contains(&format!("{library} (")), "no licence's text for {library}");
    }
    let copyright = fs::read_to_string(root().join("packaging/deb-opcua/copyright")).expect("text");
    for words in ["Files: async-opcua*", "License: MPL-2.0", "crates.io/crates/async-opcua"] {
        assert!(copyright.contains(words), "{words}");
    }
    let deny = fs::read_to_string(root().join("deny.toml")).expect("text");
    for line in mpl {
        let name = line.split(' ').next().expect("a name");
        assert!(deny.contains(&format!("crate = \"{name}\"")), "{name} in deny.toml");
    }
}

#[test]
fn the_package_finds_its_files() {
    let manifest = fs::read_to_string(root().join("opcua/Cargo.toml")).expect("text");
    let assets = manifest.split("\nassets = [\n").nth(1).expect("assets");
    let assets = assets.split("\n]").next().expect("their end");
    for asset in assets.lines().map(|line| line.trim().trim_start_matches("[\"")) {
        let path = asset.split('"').next().expect("a path");
        assert!(
            path.starts_with("target/release/") || root().join("opcua").join(path).exists(),
            "{path}"
        );
    }
}

#[test]
fn the_unit_may_do_little() {
    let unit = root().join("config/systemd/rungd-opcua.service");
    let rated = || {
        let mut command = Command::new("systemd-analyze");
        command.args(["security", "--offline=true", "--no-pager"]).arg(&unit);
        command
    };
    if !usable(works("systemd-analyze", &mut rated())) {
        return;
    }
    let said = printed(&mut rated());
    let line = said.lines().find(|line| line.contains("Overall exposure level")).expect("a level");
    let words: Vec<&str> = line.split_whitespace().collect();
    let level = words.iter().find_map(|word| word.parse::<f64>().ok()).expect("a number");
    assert!(level <= EXPOSURE_MAX, "{line}");
}
