//! The operator's socket from outside: its owner, its permissions, and the places that are refused.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use super::operator_commands::{LADDER, live};
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{self, Live, run, said};

#[test]
fn a_missing_controller_is_reported() {
    let folder = live::folder(LADDER, "");
    let socket = folder.join("nothing-here");
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let said = said(command.arg("status").arg("--socket").arg(&socket));
    assert_eq!(said.code, 69);
    assert!(
        said.err.contains("no rungd answers at") && said.err.contains("is it running?"),
        "{said:?}"
    );
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn a_socket_in_use_is_kept_and_a_stale_socket_is_replaced() {
    let mut live = live();
    let second = said(&mut run(&live.folder, &[]));
    assert_eq!(second.code, 74);
    assert!(second.err.contains("another rungd answers there"), "{second:?}");
    live.ok("read size");
    // A killed controller leaves its socket behind.
    live.child.kill().unwrap();
    live.child.wait().unwrap();
    assert!(live.socket.exists());
    assert_eq!(live.say("read size").code, 69);
    assert_eq!(said(&mut run(&live.folder, &["--scans", "3"])).code, 0);
    assert!(!live.socket.exists(), "an orderly end takes it away");
    std::fs::write(&live.socket, "a file").unwrap();
    let third = said(&mut run(&live.folder, &["--scans", "3"]));
    assert!(third.code == 74 && third.err.contains("not a socket is there"), "{third:?}");
    assert_eq!(std::fs::read(&live.socket).unwrap(), b"a file");
    // A lock file beside another program's file may have a meaning, as `/etc/passwd.lock` has.
    let strange = live.folder.join("passwd");
    std::fs::write(&strange, "a file").unwrap();
    let fourth = said(run(&live.folder, &["--scans", "3"]).env("RUNGD_SOCKET", &strange));
    assert_eq!(fourth.code, 74, "the controller file says where: {fourth:?}");
    std::fs::write(live.folder.join("controller.toml"), "ladder = [\"ladder.toml\"]\n").unwrap();
    let fifth = said(run(&live.folder, &["--scans", "3"]).env("RUNGD_SOCKET", &strange));
    assert!(fifth.code == 0 && fifth.err.contains("the operator's socket cannot be"), "{fifth:?}");
    assert!(!live.folder.join("passwd.lock").exists());
}

#[test]
fn a_lock_that_is_not_a_file_refuses_the_start_without_hanging() {
    let folder = live::folder(LADDER, RETAINED);
    let lock = folder.join("s.lock");
    assert!(Command::new("mkfifo").arg(&lock).status().unwrap().success());
    let said = said(&mut run(&folder, &["--scans", "3"]));
    assert!(said.code == 74 && said.err.contains("s.lock is not a file"), "{said:?}");
    assert_eq!(files(&folder), ["controller.toml", "ladder.toml", "s.lock"]);
    let _ = std::fs::remove_dir_all(folder);
}

const RETAINED: &str = "[operator]\nsocket = \"s\"\n[retain]\nfile = \"memory\"\nranges = [\"D2\"]\n\
                        cold-start = \"run\"\n";

fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// The lock is held but no controller answers. The refused start must not touch retained memory.
#[test]
fn a_start_refused_by_a_lock_leaves_no_files() {
    let folder = live::folder(LADDER, RETAINED);
    let lock = File::create(folder.join("s.lock")).unwrap();
    lock.try_lock().unwrap();
    let refused = said(&mut run(&folder, &["--scans", "3"]));
    assert!(refused.code == 74 && refused.err.contains("another rungd answers"), "{refused:?}");
    assert_eq!(files(&folder), ["controller.toml", "ladder.toml", "s.lock"]);
    drop(lock);
    assert_eq!(said(&mut run(&folder, &["--scans", "3"])).code, 0);
    assert_eq!(files(&folder), ["controller.toml", "ladder.toml", "memory", "s.lock"]);
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn the_controller_runs_without_a_default_socket_that_cannot_be_made() {
    let folder = live::folder(LADDER, "[operator]\nmode = \"0600\"\n");
    let mut command = run(&folder, &["--scans", "3"]);
    let said = said(command.env("RUNTIME_DIRECTORY", folder.join("nowhere")));
    assert!(said.code == 0 && said.err.contains("commands are not available"), "{said:?}");
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn an_unknown_socket_group_refuses_the_start() {
    let folder = live::folder(LADDER, "[operator]\nsocket = \"s\"\ngroup = \"no-such-group\"\n");
    let said = said(&mut run(&folder, &["--scans", "3"]));
    assert!(said.code == 78 && said.err.contains("no group `no-such-group`"), "{said:?}");
    let _ = std::fs::remove_dir_all(folder);
}

/// Needs root, to become another user.
#[test]
fn the_socket_permits_requests_by_user() {
    let uid = Command::new("id").arg("-u").output().unwrap().stdout;
    if uid != b"0\n" {
        return skip(Need::Root, "only root becomes another user");
    }
    let closed = Live::start(LADDER, "[operator]\nsocket = \"s\"\nmode = \"0600\"\n", &[]);
    let nobody = |live: &Live, words: &str, gid: u32| {
        // Only root may be able to read the build's folder, so the ladder's folder gets a copy. A
        // separate process makes the copy, so that no child of a different test has the copy open
        // for writing when it is started.
        let copy = live.folder.join("rungd");
        if !copy.exists() {
            let words = [env!("CARGO_BIN_EXE_rungd").as_ref(), copy.as_os_str()];
            assert!(Command::new("cp").args(words).status().unwrap().success());
        }
        let mut command = Command::new(copy);
        command.args(words.split_whitespace()).env("RUNGD_SOCKET", &live.socket);
        said(command.uid(65_534).gid(gid))
    };
    let said = nobody(&closed, "status", 65_534);
    assert!(said.code == 77 && said.err.contains("members of the socket's group"), "{said:?}");
    let open = "[operator]\nsocket = \"s\"\nmode = \"0666\"\ngroup = \"4242\"\n";
    let open = Live::start(LADDER, open, &[]);
    assert_eq!(nobody(&open, "read size", 65_534).code, 0, "who can open it may read");
    let changes = ["write size 5", "force lamp on", "unforce --all", "mode stop", "log-level warn"];
    for command in changes.into_iter().chain(["reload --dry-run", "reload"]) {
        let said = nobody(&open, command, 65_534);
        assert!(said.code == 77 && said.err.contains("may only look"), "{said:?}");
    }
    assert_eq!(open.line("operator's command refused")["uid"], 65_534);
    assert_eq!(nobody(&open, "write size 5", 4242).code, 0, "a member of the group");
    assert_eq!(open.line("wrote 5 to size")["uid"], 65_534);
}
