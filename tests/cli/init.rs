//! `rungd init`: the files that it writes pass the check without a warning, and run.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rungd_test_support::calm::calmed;
use rungd_test_support::patience::PATIENCE;

fn command(args: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(args).current_dir(folder);
    for variable in ["RUNGD_LOG", "RUNGD_SOCKET", "JOURNAL_STREAM", "RUNTIME_DIRECTORY"] {
        command.env_remove(variable);
    }
    // No controller of a different test is in this list.
    command.env("XDG_RUNTIME_DIR", folder);
    command
}

fn rungd(args: &[&str], folder: &Path) -> Output {
    command(args, folder).output().expect("rungd runs")
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Gives a controller file a watchdog so long that a busy machine does not trip it.
fn calm_down(path: &Path) {
    let controller = fs::read_to_string(path).expect("a controller file");
    fs::write(path, calmed(&controller)).expect("written");
}

fn said(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_first_project_passes_the_check_and_runs() {
    let folder = folder("init-runs");
    let output = rungd(&["init", "plant/line1"], &folder);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output.stderr));
    assert_eq!(
        said(&output.stdout),
        "plant/line1/controller.toml\nplant/line1/programs/main.toml\nplant/line1/tests/main.test.toml\nplant/line1/README.md\n\nRun \
         it with `cd plant/line1 && rungd run controller.toml`; Ctrl-C stops it.\nIn a second \
         shell there, `rungd status` prints its state.\n`rungd test` runs the tests of its \
         ladder.\n"
    );
    let tests = rungd(&["test"], &folder.join("plant/line1"));
    assert_eq!(said(&tests.stdout), "tests/main.test.toml: 9 passed\n", "{}", said(&tests.stderr));
    let controller = "plant/line1/controller.toml";
    for files in [&[controller][..], &["lib:flasher", "plant/line1/programs/main.toml"]] {
        let output = rungd(&[&["check", "--deny", "warnings"], files].concat(), &folder);
        assert_eq!(said(&output.stderr), "0 errors, 0 warnings\n");
        assert_eq!(output.status.code(), Some(0));
    }
    calm_down(&folder.join(controller));
    let output = rungd(&["run", controller, "--scans", "130"], &folder);
    let log = said(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{log}");
    assert!(log.contains("motor is ON"), "{log}");
}

#[test]
fn the_printed_command_can_be_pasted_into_a_shell() {
    let folder = folder("init-pasted");
    for name in ["sp ace", "it's $HOME", "-dash", "ö&b;c", "two\nlines", "it's\t\u{1b}[1m\\n"] {
        let output = rungd(&["init", "--", name], &folder);
        let text = said(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{text}");
        let (_, behind) = text.split_once("Run it with `").unwrap();
        let (command, _) = behind.rsplit_once("`; Ctrl-C").unwrap();
        let command = command.replace("&& rungd ", "&& \"$0\" ");
        let script = format!("{command} --scans 2");
        calm_down(&folder.join(name).join("controller.toml"));
        let ran = Command::new("sh")
            .args(["-c", &script, env!("CARGO_BIN_EXE_rungd")])
            .current_dir(&folder)
            .env_remove("JOURNAL_STREAM")
            .env("XDG_RUNTIME_DIR", &folder)
            .output()
            .unwrap();
        assert_eq!(ran.status.code(), Some(0), "{command}: {}", said(&ran.stderr));
    }
}

#[test]
fn control_characters_in_the_directory_name_are_escaped() {
    let folder = folder("init-escape");
    let output = rungd(&["init", "dir\u{1b}[31m/pp"], &folder);
    let text = said(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{text:?}");
    assert!(!text.contains('\u{1b}'), "{text:?}");
    assert!(text.starts_with("dir\\u{1b}[31m/pp/controller.toml\n"), "{text:?}");
}

/// The answer of `rungd status` in a folder without a controller of its own: that of any other
/// folder. A controller of the same user may run on this machine, and is found from everywhere.
fn status_as_elsewhere(folder: &Path) -> Output {
    let elsewhere = self::folder("init-elsewhere");
    let deadline = Instant::now() + PATIENCE;
    loop {
        let (control, status) = (rungd(&["status"], &elsewhere), rungd(&["status"], folder));
        if control.status == status.status && !said(&status.stdout).contains("ladder      first") {
            return status;
        }
        assert!(Instant::now() < deadline, "{status:?} here, {control:?} elsewhere");
    }
}

/// `rungd status` finds the socket without a variable or an option that names it.
#[test]
fn status_finds_the_controller_of_its_folder() {
    let folder = folder("init-status");
    rungd(&["init", "."], &folder);
    status_as_elsewhere(&folder);
    let run = ["run", "controller.toml"];
    let mut child = command(&run, &folder).stderr(Stdio::null()).spawn().expect("rungd runs");
    let deadline = Instant::now() + PATIENCE;
    let status = loop {
        let status = rungd(&["status"], &folder);
        if said(&status.stdout).contains("ladder      first") || Instant::now() > deadline {
            break status;
        }
        thread::sleep(Duration::from_millis(10));
    };
    child.kill().and_then(|()| child.wait()).expect("it ends");
    assert!(said(&status.stdout).contains("ladder      first"), "{status:?}");
    // A socket that belongs to a different user is not used.
    if std::os::unix::fs::chown(folder.join("rungd.sock"), Some(65_534), None).is_ok() {
        let status = status_as_elsewhere(&folder);
        let told = said(&status.stderr);
        let is_alone = status.status.code() == Some(69);
        assert!(!is_alone || told.contains("answers at /run/rungd/rungd.sock"), "{told}");
    }
}

/// As systemd and the container start it: with a runtime folder, and unable to write beside the
/// controller file.
#[test]
fn a_service_has_its_socket_in_its_own_folder() {
    let folder = folder("init-service");
    rungd(&["init", "plant"], &folder);
    let run = folder.join("run");
    fs::create_dir(&run).expect("a folder");
    // With this folder in its place, not even root can make the lock file.
    fs::create_dir(folder.join("plant/rungd.sock.lock")).expect("a folder");
    calm_down(&folder.join("plant/controller.toml"));
    let args = ["run", "plant/controller.toml", "--scans", "3"];
    let by_hand = rungd(&args, &folder);
    assert_eq!(by_hand.status.code(), Some(74), "{}", said(&by_hand.stderr));
    let service = command(&args, &folder).env("RUNTIME_DIRECTORY", &run).output().expect("it runs");
    let log = said(&service.stderr);
    assert_eq!(service.status.code(), Some(0), "{log}");
    assert!(log.contains(&format!("{}/rungd.sock", run.display())), "{log}");
    let why = "open here and not at `rungd.sock`: a service ignores a relative `[operator] socket`";
    assert!(log.contains(why), "{log}");
}

/// The example of its README: START after a second, five parts, the lamp.
#[test]
fn the_ladder_of_a_first_project_does_what_its_readme_says() {
    let folder = folder("init-sim");
    rungd(&["init", "."], &folder);
    let stimulus = "scan,start,stop_ok,eye\n0,0,1,0\n1,1,,\n2,0,,\n3,,,1\n4,,,0\n5,,,1\n6,,,0\n\
                    7,,,1\n8,,,0\n9,,,1\n10,,,0\n11,,,1\n12,,,0\n";
    fs::write(folder.join("eye.csv"), stimulus).expect("a file");
    let watch = ["--watch", "motor,parts.Acc,batch_lamp,no_parts", "--scans", "13"];
    let sim = ["sim", "lib:flasher", "programs/main.toml", "--stimulus"];
    let output = rungd(&[&sim[..], &["eye.csv"], &watch].concat(), &folder);
    let trace = said(&output.stdout);
    let rows: Vec<&str> = trace.lines().collect();
    assert_eq!(rows[1], "0,0,0,0,0,0", "{trace}");
    assert_eq!(rows[2], "1,10,1,0,0,0", "{trace}");
    assert_eq!(rows[11], "10,100,1,4,0,0", "{trace}");
    assert_eq!(rows[12], "11,110,0,5,1,0", "{trace}");
    // Without parts: after three seconds the lamp is bright for 200 ms of each second.
    fs::write(folder.join("none.csv"), "scan,start,stop_ok\n0,0,1\n1,1,\n2,0,\n").expect("a file");
    let watch = ["--watch", "no_parts,trouble", "--scans", "500"];
    let output = rungd(&[&sim[..], &["none.csv"], &watch].concat(), &folder);
    let trace = said(&output.stdout);
    let lamp: Vec<bool> = trace.lines().skip(1).map(|row| row.ends_with(",1,1")).collect();
    let bright: Vec<usize> = (1..500).filter(|&at| lamp[at] && !lamp[at - 1]).collect();
    assert_eq!(bright, [301, 401], "{trace}");
    assert_eq!(lamp.iter().filter(|&&lit| lit).count(), 40);
}

#[test]
fn a_directory_that_is_not_empty_is_refused() {
    let folder = folder("init-refused");
    fs::write(folder.join("mine.toml"), "").expect("a file");
    let output = rungd(&["init", "."], &folder);
    assert_eq!(output.status.code(), Some(74));
    assert_eq!(
        said(&output.stderr),
        "rungd: nothing is written to .: it holds `mine.toml`; give an empty directory, or a new \
         one\n"
    );
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 1);
    let output = rungd(&["init", "mine.toml"], &folder);
    assert_eq!(output.status.code(), Some(74), "a file is no directory");
}

#[test]
fn a_fresh_repository_counts_as_empty() {
    let folder = folder("init-git");
    fs::create_dir(folder.join(".git")).expect("a folder");
    assert_eq!(rungd(&["init", "."], &folder).status.code(), Some(0));
}

/// A limit on the size of a file fails a file after the first one, as a full disk does.
#[test]
fn a_project_that_cannot_be_written_completely_leaves_no_file() {
    let folder = folder("init-full");
    let limited = |name: &str| {
        let script = format!("trap '' XFSZ; ulimit -f 5; exec \"$0\" init {name}");
        let mut command = Command::new("sh");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_rungd")]).current_dir(&folder);
        command.output().expect("sh runs")
    };
    fs::create_dir(folder.join("here")).expect("a folder");
    fs::create_dir(folder.join("here/.git")).expect("a folder");
    for (name, stays) in [("plant/line1", 0), ("here", 1)] {
        let output = limited(name);
        let words = said(&output.stderr);
        assert_eq!(output.status.code(), Some(74), "{words}");
        assert!(words.contains("; nothing is left of the project: "), "{words}");
        let left = fs::read_dir(folder.join(name)).map_or(0, Iterator::count);
        assert_eq!(left, stays, "{name}");
        let output = rungd(&["init", name], &folder);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output.stderr));
    }
}

/// Paths that are not UTF-8: what works, works; what cannot work says why.
#[test]
fn a_path_that_is_not_utf_8_is_refused_with_that_reason() {
    let folder = folder("init-bytes");
    let name = OsStr::from_bytes(b"line\xff");
    let run = |words: &[&OsStr]| {
        let mut command = command(&[], &folder);
        command.args(words).output().expect("rungd runs")
    };
    let refused = |output: &Output| {
        let words = said(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(words.contains("the name is not UTF-8 text"), "{words}");
    };
    refused(&run(&[OsStr::new("init"), name]));
    assert!(!folder.join(name).exists());
    assert_eq!(rungd(&["init", "plant"], &folder).status.code(), Some(0));
    fs::rename(folder.join("plant"), folder.join(name)).expect("renamed");
    let controller = Path::new(name).join("controller.toml");
    refused(&run(&[OsStr::new("run"), controller.as_os_str(), OsStr::new("--scans=2")]));
    for words in [
        &[OsStr::new("check"), controller.as_os_str()][..],
        &[OsStr::new("test"), name],
        &[OsStr::new("fmt"), name],
        &[OsStr::new("sim"), controller.as_os_str(), OsStr::new("--scans=2")],
    ] {
        let output = run(words);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", said(&output.stderr));
    }
}
