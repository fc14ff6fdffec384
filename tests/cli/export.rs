//! `rungd export` as a user runs it: its answers and exit codes. What an export does is judged in
//! `crates/import/tests/export`.

use std::fs;

use super::fmt::{rungd, said};
use rungd_test_support::folder::TestFolder;

const LADDER: &str = "[ladder]\ndevices = [\"rack\"]\n[tags]\nlow = { at = \"X0\" }\n\
                      [[program]]\nname = \"Main\"\nrung = [{ when = [\"low\", \"rack.Ok\", \
                      \"$Hour < 6\"], do = [\"OUT Y0\"] }]\n";

#[test]
fn what_comes_from_outside_of_the_ladder_is_listed() {
    let folder = TestFolder::new("export-outside");
    fs::write(folder.path().join("pump.toml"), LADDER).unwrap();
    let made = rungd(&["export", "pump.toml", "-o", "pump.xml"], folder.path());
    assert_eq!(
        said(&made.stdout),
        "pump.xml: 1 rung\n\
         rack_Ok: the other controller has to write it: `rack.Ok` here\n\
         Hour: the other controller has to write it: `$Hour` here\n",
        "{}",
        said(&made.stderr)
    );
    assert_eq!(made.status.code(), Some(0));
}

#[test]
fn one_ladder_always_gives_the_same_file() {
    let folder = TestFolder::new("export-again");
    fs::write(folder.path().join("pump.toml"), LADDER).unwrap();
    let texts = ["one.xml", "two.xml"].map(|name| {
        rungd(&["export", "pump.toml", "-o", name], folder.path());
        fs::read_to_string(folder.path().join(name)).unwrap()
    });
    assert_eq!(texts[0], texts[1]);
}

#[test]
fn a_ladder_with_errors_and_a_file_of_another_controller_are_not_exported() {
    let folder = TestFolder::new("export-refused");
    fs::write(folder.path().join("bad.toml"), LADDER.replace("Y0", "Y9999")).unwrap();
    fs::write(folder.path().join("belt.L5X"), "<RSLogix5000Content/>").unwrap();
    for (file, code, reason) in [
        ("bad.toml", 78, "error[beyond-memory]"),
        ("belt.L5X", 2, "`rungd import` it first, and export what that writes"),
        ("none.toml", 74, "none.toml"),
    ] {
        let refused = rungd(&["export", file, "-o", "out.xml"], folder.path());
        assert_eq!(refused.status.code(), Some(code), "{file}");
        assert!(said(&refused.stderr).contains(reason), "{}", said(&refused.stderr));
        assert!(!folder.path().join("out.xml").exists());
    }
}
