//! `rungd fmt`: the files that it writes, its outputs, and its exit codes.

use std::fs;
use std::io::Write;
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use rungd_test_support::needs::{Need, skip};

pub(super) fn rungd(args: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(args).current_dir(folder).env("NO_COLOR", "1").env_remove("RUNGD_LOG");
    command.output().expect("rungd runs")
}

/// A fresh folder with a folder `programs`.
pub(super) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("programs")).expect("a folder");
    folder
}

pub(super) fn said(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn check(output: &Output, code: i32, out: &str, error: &str) {
    let (stdout, stderr) = (said(&output.stdout), said(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{stdout}{stderr}");
    assert_eq!(stdout, out);
    assert!(stderr.contains(error), "{stderr}");
    assert!(!error.is_empty() || stderr.is_empty(), "{stderr}");
}

const LADDER: &str =
    "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nwhen = [\"X0\"]\ndo   = [\"OUT Y0\"]\n";
const LOOSE: &str =
    "[[program]]\nname = \"Main\"\n[[program.rung]]\ndo=[ \"OUT Y0\" ]\nwhen=[\"X0\"]\n";
const BROKEN: &str = "[[program]]\nname = \n";

#[test]
fn files_of_a_folder_are_formatted_and_named() {
    let folder = folder("fmt-folder");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write("controller.toml", "ladder=[\"programs/a.toml\"]\n");
    write("programs/a.toml", LOOSE);
    write("programs/b.toml", LADDER);
    write("a.test.toml", "ladder = [\"programs/a.toml\"]\n[[scenario]]\nname=\"a\"\nsteps=[]\n");
    write("other.toml", "[package]\nname=\"x\"\n");
    write("notes.txt", "a=1\n");
    let output = rungd(&["fmt", "."], &folder);
    check(&output, 0, "a.test.toml\ncontroller.toml\nprograms/a.toml\n", "");
    let text = |name: &str| fs::read_to_string(folder.join(name)).expect("readable");
    assert_eq!(text("programs/a.toml"), LADDER);
    assert_eq!(text("controller.toml"), "ladder = [\"programs/a.toml\"]\n");
    assert_eq!(text("other.toml"), "[package]\nname=\"x\"\n");
    check(&rungd(&["fmt", "."], &folder), 0, "", "");
    check(&rungd(&["fmt", "--check", "."], &folder), 0, "", "");
    let files = fs::read_dir(&folder).expect("readable").count();
    assert_eq!(files, 5, "a file was left behind");
}

#[test]
fn check_writes_nothing_and_shows_the_first_difference() {
    let folder = folder("fmt-check");
    fs::write(folder.join("a.toml"), LOOSE).expect("written");
    fs::write(folder.join("b.toml"), LADDER).expect("written");
    let output = rungd(&["fmt", "--check", "a.toml", "b.toml"], &folder);
    let shown = "\
a.toml:3:
-[[program.rung]]
-do=[ \"OUT Y0\" ]
-when=[\"X0\"]
+
+[[program.rung]]
+when = [\"X0\"]
+do   = [\"OUT Y0\"]
";
    check(&output, 1, shown, "");
    assert_eq!(fs::read_to_string(folder.join("a.toml")).expect("readable"), LOOSE);
}

#[test]
fn a_broken_file_is_not_changed_and_the_others_are_formatted() {
    let folder = folder("fmt-broken");
    fs::write(folder.join("a.toml"), BROKEN).expect("written");
    fs::write(folder.join("b.toml"), LOOSE).expect("written");
    fs::write(folder.join("c.toml"), b"[tags]\na = \"\xFC\"\n").expect("written");
    let output = rungd(&["fmt", "."], &folder);
    check(&output, 78, "b.toml\n", "a.toml:2:");
    check(&output, 78, "b.toml\n", "c.toml:2:6");
    check(&output, 78, "b.toml\n", "2 errors, 0 warnings\n");
    assert_eq!(fs::read_to_string(folder.join("a.toml")).expect("readable"), BROKEN);
    assert_eq!(fs::read_to_string(folder.join("b.toml")).expect("readable"), LADDER);
}

/// A file or folder that cannot be read is told, the others are formatted, and the exit code tells.
#[test]
fn an_unreadable_file_does_not_stop_the_others() {
    let folder = folder("fmt-unreadable");
    fs::write(folder.join("b.toml"), LOOSE).expect("written");
    // Larger than a file of rungd may be; it takes no space.
    let large = fs::File::create(folder.join("a.toml")).expect("made");
    large.set_len(300 << 20).expect("set");
    let output = rungd(&["fmt", "."], &folder);
    check(&output, 74, "b.toml\n", "a.toml: ");
    assert_eq!(fs::read_to_string(folder.join("b.toml")).expect("readable"), LADDER);
    fs::write(folder.join("c.toml"), LOOSE).expect("written");
    let output = rungd(&["fmt", "a.toml", "none.toml", "c.toml"], &folder);
    check(&output, 74, "c.toml\n", "none.toml: ");
    check(&output, 74, "c.toml\n", "a.toml: ");
}

/// A pipe in a folder would stop a reader for ever, and is no file of rungd.
#[test]
fn pipes_and_sockets_of_a_folder_are_skipped() {
    let folder = folder("fmt-pipe");
    fs::write(folder.join("b.toml"), LOOSE).expect("written");
    for name in ["a.toml", "c.toml", "a.test.toml"] {
        let made = Command::new("mkfifo").arg(folder.join(name)).status().expect("mkfifo runs");
        assert!(made.success());
    }
    let _socket = std::os::unix::net::UnixListener::bind(folder.join("d.toml")).expect("a socket");
    let output = rungd(&["fmt", "."], &folder);
    check(&output, 0, "b.toml\n", "");
    let output = rungd(&["test", "."], &folder);
    check(&output, 2, "", "no file in this folder is named *.test.toml");
    let output = rungd(&["fmt", "a.toml"], &folder);
    check(&output, 74, "", "it is a pipe (FIFO), not a regular file");
}

#[test]
fn a_number_with_a_quote_is_refused_with_the_finding_of_check() {
    let folder = folder("fmt-quoted");
    for value in ["1_000\"R1\"", "1_0'x'", "[1, 2_0\"\"]", "{ b = 1_0\"x\" }"] {
        let text = format!("[tags]\na = {value}\n");
        fs::write(folder.join("a.toml"), &text).expect("written");
        for command in ["fmt", "check"] {
            let output = rungd(&[command, "a.toml"], &folder);
            check(&output, 78, "", "a quote within a number");
        }
        assert_eq!(fs::read_to_string(folder.join("a.toml")).expect("readable"), text);
    }
}

#[test]
fn the_file_mode_and_links_are_kept() {
    let folder = folder("fmt-mode");
    let path = folder.join("programs/a.toml");
    fs::write(&path, LOOSE).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("set");
    symlink("programs/a.toml", folder.join("link.toml")).expect("linked");
    check(&rungd(&["fmt", "link.toml"], &folder), 0, "link.toml\n", "");
    assert_eq!(fs::read_to_string(&path).expect("readable"), LADDER);
    let mode = fs::metadata(&path).expect("there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert!(fs::symlink_metadata(folder.join("link.toml")).expect("there").is_symlink());
}

#[test]
fn a_file_with_two_hard_links_keeps_both() {
    let folder = folder("fmt-names");
    let (path, other) = (folder.join("a.toml"), folder.join("programs/b.toml"));
    fs::write(&path, LOOSE.to_owned() + &"\n".repeat(1000)).expect("written");
    fs::hard_link(&path, &other).expect("linked");
    check(&rungd(&["fmt", "a.toml"], &folder), 0, "a.toml\n", "");
    assert_eq!(fs::read_to_string(&other).expect("readable"), LADDER);
    assert_eq!(fs::metadata(&path).expect("there").nlink(), 2);
    assert_eq!(fs::read_dir(&folder).expect("readable").count(), 2, "a file was left behind");
}

#[test]
fn the_owner_of_a_file_is_kept() {
    if !rustix::process::geteuid().is_root() {
        skip(Need::Root, "only root may give a file away");
        return;
    }
    let folder = folder("fmt-owner");
    let path = folder.join("a.toml");
    fs::write(&path, LOOSE).expect("written");
    chown(&path, Some(4711), Some(4712)).expect("given away");
    check(&rungd(&["fmt", "a.toml"], &folder), 0, "a.toml\n", "");
    let about = fs::metadata(&path).expect("there");
    assert_eq!((about.uid(), about.gid()), (4711, 4712));
    assert_eq!(fs::read_to_string(&path).expect("readable"), LADDER);
}

/// A broken file without recognisable tables may still be a file of rungd, so it is reported.
#[test]
fn a_broken_file_without_foreign_keys_is_reported() {
    let folder = folder("fmt-lost");
    fs::write(folder.join("a.toml"), "[tags").expect("written");
    fs::write(folder.join("b.toml"), "[package\nname = \"x\"\n[dependencies]\n").expect("written");
    let output = rungd(&["fmt", "."], &folder);
    check(&output, 78, "", "a.toml:1:");
    check(&output, 78, "", "1 error, 0 warnings\n");
}

fn piped(args: &[&str], text: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("rungd runs");
    child.stdin.take().expect("a pipe").write_all(text.as_bytes()).expect("taken");
    child.wait_with_output().expect("it ends")
}

#[test]
fn standard_input_is_formatted_to_standard_output() {
    check(&piped(&["fmt", "-"], LOOSE), 0, LADDER, "");
    check(&piped(&["fmt", "-"], LADDER), 0, LADDER, "");
    // A character that a terminal would obey is written unchanged, as a part of the text.
    let text = "doc = \"\u{202e}\"\n";
    check(&piped(&["fmt", "-"], text), 0, text, "");
    check(&piped(&["fmt", "--check", "-"], LADDER), 0, "", "");
    check(&piped(&["fmt", "--check", "-"], "a=1\n"), 1, "<standard input>:1:\n-a=1\n+a = 1\n", "");
    check(&piped(&["fmt", "-"], BROKEN), 78, "", "<standard input>:2:");
}

#[test]
fn wrong_arguments_give_exit_code_2() {
    let folder = folder("fmt-usage");
    check(&rungd(&["fmt"], &folder), 2, "", "Usage:");
    check(
        &rungd(&["fmt", "programs"], &folder),
        2,
        "",
        "programs: no file of rungd in this folder",
    );
    check(&rungd(&["fmt", "none.toml"], &folder), 74, "", "none.toml: No such file");
}

#[test]
fn the_files_of_a_first_project_are_formatted() {
    let folder = folder("fmt-init");
    assert_eq!(rungd(&["init", "plant"], &folder).status.code(), Some(0));
    check(&rungd(&["fmt", "--check", "plant"], &folder), 0, "", "");
}
