//! The view socket: it answers every look, refuses every change, and has a group of its own.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use super::operator_commands::{LADDER, live};
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{self, Live, Said, run, said};
use rungd_test_support::running::operator::Operator;
use serde_json::from_str;

#[test]
fn the_view_socket_refuses_every_change_and_answers_every_read() {
    let mut live = live();
    let mut view = Operator::at(&live.folder.join("s-view"));
    for change in [
        r#"{"do":"write","operand":"size","value":5}"#,
        r#"{"do":"force","operand":"lamp","value":true}"#,
        r#"{"do":"unforce","operand":"lamp"}"#,
        r#"{"do":"unforce-all"}"#,
        r#"{"do":"mode","to":"stop"}"#,
        r#"{"do":"ack","alarms":["jam"]}"#,
        r#"{"do":"ack-all"}"#,
        r#"{"do":"reload"}"#,
        r#"{"do":"reload","dry_run":true}"#,
        r#"{"do":"rollback"}"#,
        r#"{"do":"log-level","level":"debug"}"#,
        r#"{"do":"retain-save"}"#,
    ] {
        let answer = view.ask(&from_str(change).unwrap());
        assert_eq!(answer["error"]["kind"], "not-permitted", "{change}: {answer}");
        let why = answer["error"]["message"].as_str().unwrap();
        assert!(why.contains("operator's socket, ") && why.contains("/s"), "{why}");
    }
    let refused = live.line("operator's command refused: this is the view socket");
    assert_eq!(refused["level"], "WARN", "{refused}");
    for look in [
        r#"{"do":"status"}"#,
        r#"{"do":"read","operands":["size"]}"#,
        r#"{"do":"alarms"}"#,
        r#"{"do":"metrics"}"#,
        r#"{"do":"names","prefix":"ja"}"#,
        r#"{"do":"recording"}"#,
    ] {
        assert!(view.ask(&from_str(look).unwrap())["ok"].is_object(), "{look}");
    }
    assert_eq!(live.ok("read size"), "size  D1  12\n");
    // A command that changes something goes to the operator's socket.
    live.ok("write size 13");
    live.end();
    assert!(!live.folder.join("s-view").exists(), "an orderly end takes it away");
}

#[test]
fn a_removed_view_socket_is_recreated() {
    let live = live();
    let path = live.folder.join("s-view");
    fs::remove_file(&path).unwrap();
    live.line("the view socket");
    live.line("the view socket is open; it refuses every change");
    assert!(path.exists());
}

#[test]
fn only_a_configured_view_socket_is_required_for_a_start() {
    let in_the_way = live::folder(LADDER, "");
    fs::write(in_the_way.join("s-view"), "a file").unwrap();
    let without = said(&mut run(&in_the_way, &["--scans", "3"]));
    assert!(without.code == 0 && without.err.contains("no socket for looks alone"), "{without:?}");
    assert_eq!(fs::read(in_the_way.join("s-view")).unwrap(), b"a file");
    let named = live::folder(LADDER, "[operator]\nsocket = \"s\"\nview-socket = \"no/v\"\n");
    let refused = said(&mut run(&named, &["--scans", "3"]));
    assert!(
        refused.code == 74 && refused.err.contains("`[operator] view-socket` cannot be"),
        "{refused:?}"
    );
    let group = "[operator]\nsocket = \"s\"\nview-group = \"no-such-group\"\n";
    let unknown = live::folder(LADDER, group);
    let refused = said(&mut run(&unknown, &["--scans", "3"]));
    assert!(
        refused.code == 78 && refused.err.contains("`[operator] view-group`: this machine has no"),
        "{refused:?}"
    );
    for folder in [in_the_way, named, unknown] {
        let _ = fs::remove_dir_all(folder);
    }
}

/// Runs a command as the user nobody with this group. Needs root.
fn as_nobody(live: &Live, words: &str, gid: u32) -> Said {
    // Only root may be able to read the build's folder. A separate process makes the copy, so that
    // no child of a different test has it open for writing.
    let copy = live.folder.join("rungd");
    if !copy.exists() {
        let words = [env!("CARGO_BIN_EXE_rungd").as_ref(), copy.as_os_str()];
        assert!(Command::new("cp").args(words).status().unwrap().success());
    }
    let mut command = Command::new(copy);
    command.args(words.split_whitespace()).env("RUNGD_SOCKET", &live.socket);
    said(command.uid(65_534).gid(gid))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().unwrap().stdout == b"0\n"
}

fn group_of(path: &Path) -> (u32, u32) {
    let facts = fs::metadata(path).unwrap();
    (facts.gid(), facts.mode() & 0o777)
}

#[test]
fn the_view_group_can_read_everything_and_change_nothing() {
    if !is_root() {
        return skip(Need::Root, "only root becomes another user");
    }
    let keys = "[operator]\nsocket = \"s\"\ngroup = \"4241\"\nview-group = \"4242\"\n";
    let live = Live::start(LADDER, keys, &[]);
    live.await_values("C7", "ON");
    assert_eq!(group_of(&live.socket), (4241, 0o660));
    assert_eq!(group_of(&live.folder.join("s-view")), (4242, 0o660));
    // Its members see the scan log too, whatever the rights of the ladder's files.
    fs::set_permissions(live.folder.join("ladder.toml"), Permissions::from_mode(0o600)).unwrap();
    for look in ["status", "read size", "why C7", "metrics"] {
        let looked = as_nobody(&live, look, 4242);
        assert_eq!(looked.code, 0, "{look}: {looked:?}");
    }
    for change in ["write size 5", "force lamp on", "mode stop", "ack --all"] {
        let refused = as_nobody(&live, change, 4242);
        assert_eq!(refused.code, 77, "{change}: {refused:?}");
    }
    assert_eq!(as_nobody(&live, "read size", 65_534).code, 77, "neither group");
    assert_eq!(as_nobody(&live, "write size 5", 4241).code, 0, "the operator's group");
    assert_eq!(as_nobody(&live, "why C7", 4241).code, 0, "the operator's group");
}

#[test]
fn the_environment_sets_the_group_of_the_view_socket_if_the_group_exists() {
    if !is_root() {
        return skip(Need::Root, "only root gives a socket to a strange group");
    }
    for (named, group) in [("4243", 4243), ("no-such-group", 4240)] {
        let folder = live::folder(LADDER, "[operator]\nsocket = \"s\"\ngroup = \"4240\"\n");
        let mut command = run(&folder, &[]);
        command.env("RUNGD_VIEW_GROUP", named);
        let live = Live::of(folder, command);
        assert_eq!(group_of(&live.folder.join("s-view")).0, group, "{named}");
    }
}
