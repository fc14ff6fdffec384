//! The real binary: exit codes, standard output and standard error.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

fn rungd(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rungd")).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Writes a file for these tests; returns its path.
fn file(name: &str, bytes: &[u8]) -> String {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).unwrap();
    path.display().to_string()
}

const GOOD: &str = "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nwhen = [\"X0\"]\n\
                    do = [\"OUT Y0\"]\n";

#[track_caller]
fn check(args: &[&str], code: i32, said: &str) {
    let output = rungd(args);
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{errors}");
    assert!(errors.contains(said), "{errors}");
    assert_eq!(text(&output.stdout), "");
    assert!(!errors.contains('\u{1b}'));
}

#[test]
fn a_correct_ladder_passes_the_check() {
    let ladder = file("good.toml", GOOD.as_bytes());
    check(&["check", &ladder], 0, "0 errors, 0 warnings\n");
}

#[test]
fn a_bad_ladder_is_refused() {
    let ladder = file("bad.toml", GOOD.replace("Y0", "Y9999").as_bytes());
    check(&["check", &ladder], 78, "error[beyond-memory]: `Y9999` lies beyond memory");
    check(&["sim", &ladder], 78, "1 error, 0 warnings\n");
}

#[test]
fn warnings_refuse_a_ladder_only_if_denied() {
    let spare = format!("{GOOD}[tags]\njam = {{ at = \"C0\" }}\n");
    let ladder = file("warned.toml", spare.as_bytes());
    check(&["check", &ladder], 0, "warning[unused-tag]");
    check(&["check", "--deny", "warnings", &ladder], 78, "error[unused-tag]");
    let allowed = format!("[ladder]\nallow = [\"unused-tag\"]\n{spare}");
    let ladder = file("allowed.toml", allowed.as_bytes());
    check(&["check", "--deny", "warnings", &ladder], 0, "0 errors, 0 warnings\n");
}

#[test]
fn a_controller_file_is_checked_with_its_ladders() {
    file("good-of-controller.toml", GOOD.as_bytes());
    let controller = "ladder = [\"good-of-controller.toml\"]\n\n[scan]\nperiod = \"0ms\"\n";
    let path = file("controller.toml", controller.as_bytes());
    check(&["check", &path], 78, "`period` is at least 100us");
    let path = file("controller-ok.toml", controller.replace("0ms", "5ms").as_bytes());
    let ladder = file("good-too.toml", GOOD.as_bytes());
    check(&["check", &path, &ladder], 0, "0 errors, 0 warnings\n");
}

#[test]
fn a_file_of_the_wrong_kind_gives_one_finding() {
    let ladder = file("other-ladder.toml", GOOD.as_bytes());
    let controller = file("other-controller.toml", b"ladder = [\"other-ladder.toml\"]\n");
    check(&["run", &ladder], 78, "this is a ladder file, not a controller file");
    check(&["run", &ladder], 78, "`ladder = [\"other-ladder.toml\"]`\n\n1 error, 0 warnings");
    check(&["sim", &controller, &ladder], 78, "this is a controller file, not a ladder file");
    let said = "names: `other-ladder.toml`\n\n1 error, 0 warnings";
    check(&["sim", &ladder, &controller], 78, said);
}

#[test]
fn a_ladder_file_given_twice_is_refused() {
    let ladder = file("once.toml", GOOD.as_bytes());
    let again = ladder.replace("/once.toml", "/./once.toml");
    check(&["check", &ladder, &again], 78, "/./once.toml: this file is named twice");
    check(&["sim", &ladder, &ladder], 78, "this file is named twice");
}

#[test]
fn a_missing_file_is_a_failure_of_the_environment() {
    check(&["check", "no-such-file.toml"], 74, "rungd: no-such-file.toml: No such file");
}

#[test]
fn a_file_that_is_not_utf_8_gives_a_finding_with_its_place() {
    let ladder = file("latin-1.toml", b"[ladder]\ndoc = \"T\xFCr\"\n");
    check(&["check", &ladder], 78, "latin-1.toml:2:9");
    check(&["check", &ladder], 78, "the file is not UTF-8 text: byte 17 is 0xFC");
}

#[test]
fn wrong_arguments_give_exit_code_2() {
    check(&["check"], 2, "Usage:");
    check(&["check", "--deny", "errors", "x.toml"], 2, "--deny");
    check(&["explain", "CNTT"], 2, "did you mean `CNT`?");
    check(&["explain", "blorp"], 2, "`blorp`: `rungd explain` lists what can be explained");
    check(&["explain", "lib:pod"], 2, "the library has no `pod`: did you mean `pid`?");
}

#[test]
fn explanations_are_printed_to_standard_output() {
    for (name, said) in [
        ("cnt", "CNT ct preset=v"),
        ("missing-leg", "# missing-leg"),
        ("lib:pid", "# lib:pid: A PID controller"),
        ("LeadLag3", "# lib:lead-lag: "),
    ] {
        let output = rungd(&["explain", name]);
        assert_eq!(output.status.code(), Some(0));
        assert!(text(&output.stdout).contains(said), "{name}");
    }
    let list = text(&rungd(&["explain"]).stdout);
    assert!(list.contains("SGCONVRG") && list.contains("unused-tag"));
}

#[test]
fn the_help_of_force_says_that_its_value_stays() {
    let help = text(&rungd(&["help", "force"]).stdout);
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let words =
        "After `unforce` the value stays until the ladder, a device or an operator writes it";
    assert!(help.contains(words), "{help}");
}

#[test]
fn the_help_of_rollback_describes_the_program_that_it_restores() {
    let help = text(&rungd(&["rollback", "--help"]).stdout);
    let words = help.split("\n\nUsage:").next().unwrap();
    expect_test::expect![[r#"
        Goes back to the last program before the running one that passed its probation

        The program of the start counts as passed, and with `[reload] probation = "0ms"` every program.
        Programs that another reload replaced within their probation are skipped. It can be done once after
        a reload. No file is read."#]].assert_eq(words);
}

#[test]
fn a_pipe_is_read_once() {
    use std::io::Write;
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let piped = std::process::Stdio::piped;
    command.args(["check", "/dev/stdin"]).stdin(piped()).stderr(piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(GOOD.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(errors.contains("0 errors"), "{errors}");
}

/// A command that opened a pipe without a writer would wait forever.
#[test]
fn pipes_and_devices_are_refused_without_waiting() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-file");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let pipe = folder.join("ladder.toml");
    assert!(Command::new("mkfifo").args(["-m", "600"]).arg(&pipe).status().unwrap().success());
    let controller = folder.join("controller.toml");
    std::fs::write(&controller, "ladder = [\"ladder.toml\"]\n").unwrap();
    let [pipe, controller] = [&pipe, &controller].map(|path| path.to_str().unwrap());
    for words in [
        &["check", pipe][..],
        &["check", controller],
        &["sim", pipe],
        &["run", pipe],
        &["run", controller],
        &["check", "/dev/zero"],
        &["edge", pipe],
        &["draw", pipe],
        &["draw", "config/programs/conveyor.toml", "--coverage", pipe],
        &["fmt", pipe],
        &["record", "info", pipe],
        &["web", "--listen", "127.0.0.1:0", "--users-file", pipe],
        &["web", "--listen", "127.0.0.1:0", "--tls-cert", pipe, "--tls-key", pipe],
        &["web", "passwd", "anna", "--remove", "--users-file", pipe],
        &["fleet", "status", "--broker", "mqtt://[::1]:1", "--user", "a", "--password-file", pipe],
    ] {
        // `timeout` exits with 124 if it has to end the command.
        let mut command = Command::new("timeout");
        command.arg("20").arg(env!("CARGO_BIN_EXE_rungd")).args(words).stdin(Stdio::null());
        let output = command.output().unwrap();
        let errors = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(1..=78)), "{words:?} {output:?}");
        let what = if words[1] == "/dev/zero" { "a device" } else { "a pipe (FIFO)" };
        assert!(errors.contains(&format!("it is {what}, not a regular file")), "{errors}");
    }
}

/// A name with a line end could add a line to an answer.
#[test]
fn line_breaks_in_arguments_are_printed_escaped() {
    let odd = "none\nrungd: all is well\u{1b}[2J";
    for words in [
        &["status", "--socket", odd][..],
        &["web", "--socket", odd, "--listen", "127.0.0.1:0", "--users-file", odd],
        &["web", "passwd", odd, "--remove", "--users-file", "/tmp/none\nrungd: all is well"],
        &["check", odd],
        &["sim", odd],
        &["run", odd],
        &["run", odd, "--log-format", "json"],
        &["fmt", odd],
        &["test", odd],
        &["draw", odd],
        &["replay", odd],
        &["record", "info", odd],
        &["init", odd, odd],
        &["edge", odd],
        &["mode", odd],
        &["web", "--listen", odd],
        &[odd],
    ] {
        let mut command = Command::new("timeout");
        command.arg("20").arg(env!("CARGO_BIN_EXE_rungd")).args(words).stdin(Stdio::null());
        let output = command.output().unwrap();
        assert_ne!(output.status.code(), Some(124), "{words:?}");
        for said in [text(&output.stdout), text(&output.stderr)] {
            let forged = said.lines().any(|line| line.starts_with("rungd: all is well"));
            assert!(!forged && !said.contains("\u{1b}[2J"), "{words:?}: {said}");
        }
    }
}

/// The places of a command according to CONTRIBUTING.md.
#[test]
fn every_command_has_a_source_file_a_help_and_a_page() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let read = |path: PathBuf| std::fs::read_to_string(path).unwrap();
    let entries = std::fs::read_dir(root.join("docs")).unwrap();
    let files = entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let pages: String = files.map(read).collect();
    let help = text(&rungd(&["--help"]).stdout);
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let listed = listed.take_while(|line| !line.is_empty());
    let rows = listed.filter(|line| !line.starts_with("   "));
    let names = rows.filter_map(|line| line.split_whitespace().next());
    let names: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(names.len() > 15, "{help}");
    for name in names {
        // Three commands are in the file of the command that they undo.
        let file = match name {
            "unforce" => "force".to_owned(),
            "rollback" => "reload".to_owned(),
            "unshelve" => "shelve".to_owned(),
            name => name.replace('-', "_"),
        };
        assert!(root.join(format!("src/cli/{file}.rs")).exists(), "{name} has no file");
        let page = format!("rungd {name}");
        assert!(pages.contains(&page), "no page shows `{page}`");
        let help = text(&rungd(&["help", name]).stdout);
        let usage = help.lines().find(|line| line.starts_with("Usage: "));
        assert!(usage.is_some_and(|usage| usage.contains(&page)), "{name}: {help}");
        assert!(help.lines().next().is_some_and(|first| first.len() > 15), "{name}: {help}");
    }
}

#[test]
fn a_mistyped_or_habitual_command_gets_a_tip_with_the_right_one() {
    for (args, tip) in [
        (&["version"][..], "tip: `rungd --version` prints the version"),
        (&["-v"], "tip: `rungd --version` prints the version"),
        (&["help", "version"], "tip: `rungd --version` prints the version"),
        (&["--verson"], "'--version'"),
        (&["start"], "tip: `rungd run CONTROLLER.toml` runs a controller"),
        (&["help", "chek"], "tip: `check` is a command: `rungd help check`"),
        (&["chek"], "'check'"),
        (&["zzzz"], "tip: `rungd help` lists the commands"),
    ] {
        check(args, 2, tip);
    }
    for args in [&["-V"][..], &["--version"], &["help", "check"]] {
        assert_eq!(rungd(args).status.code(), Some(0), "{args:?}");
    }
}
