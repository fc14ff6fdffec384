//! `rungd man` and `rungd completions`: they match the present command line, and `man` and the
//! shells can read them, if these are installed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use rungd_config::load::library::FILES;
use rungd_test_support::needs::{self, usable, works};

fn rungd(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rungd")).args(args).output().expect("rungd runs")
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).expect("text")
}

/// The subcommands that `rungd --help` lists.
fn subcommands() -> Vec<String> {
    let help = text(rungd(&["--help"]).stdout);
    let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next());
    let names = list
        .expect("a list")
        .lines()
        .filter(|line| line.starts_with("  "))
        .filter(|line| !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn every_subcommand_has_a_man_page() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("man");
    let _ = fs::remove_dir_all(&folder);
    let output = rungd(&["man", folder.to_str().expect("a path")]);
    assert_eq!(output.status.code(), Some(0), "{}", text(output.stderr));
    let names = subcommands();
    assert!(names.len() >= 7, "{names:?}");
    for name in &names {
        let page = fs::read_to_string(folder.join(format!("rungd-{name}.1"))).expect("a page");
        assert!(page.contains(".SH \"EXIT STATUS\""), "{page}");
    }
    let page = fs::read_to_string(folder.join("rungd.1")).expect("rungd.1");
    for name in names.iter().map(|name| name.replace('-', "\\-")) {
        assert!(page.contains(&format!("rungd\\-{name}(1)")), "{name}: {page}");
    }
    assert!(!page.contains("man(1)\n"), "hidden: {page}");
    if !usable(needs::man(Path::new("man"))) {
        return;
    }
    for entry in fs::read_dir(&folder).expect("pages") {
        let path = entry.expect("a page").path();
        let mut man = Command::new("man");
        man.args(["--warnings", "-l"]).arg(&path).env("LC_ALL", "C.UTF-8");
        let man = man.output().expect("man runs");
        assert!(man.status.success() && man.stderr.is_empty(), "{}", text(man.stderr));
    }
}

/// Writes a shell's script to a file for this test; returns its path.
fn completions(shell: &str, test: &str) -> PathBuf {
    let script = text(rungd(&["completions", shell]).stdout);
    assert!(script.contains(&format!("COMPLETE=\"{shell}\"")) || shell == "fish", "{script}");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("completions-{test}.{shell}"));
    fs::write(&file, script).expect("a file");
    file
}

#[test]
fn shells_accept_their_completion_scripts() {
    for shell in ["bash", "zsh", "fish"] {
        let file = completions(shell, "read");
        if !usable(works(shell, Command::new(shell).arg("--version"))) {
            continue;
        }
        let status = Command::new(shell).arg("-n").arg(&file).stdout(Stdio::null()).status();
        assert!(status.expect("it runs").success(), "{shell} does not read it");
    }
    // The script calls rungd itself.
    let mut asked = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let asked = asked.env("COMPLETE", "fish").args(["--", "rungd", ""]).output().expect("it runs");
    let offered = text(asked.stdout);
    for name in subcommands() {
        assert!(offered.lines().any(|line| line.split('\t').next() == Some(&name)), "{name}");
    }
    assert_eq!(rungd(&["completions", "cobol"]).status.code(), Some(2));
}

/// Calls the completion as bash does while a line is typed.
#[test]
fn bash_completes_commands_and_argument_values() {
    let file = completions("bash", "asked").display().to_string();
    let bin = Path::new(env!("CARGO_BIN_EXE_rungd")).parent().expect("a folder").display();
    let complete = |words: &str, last: &str| {
        let script = format!(
            "PATH={bin}:$PATH; source '{file}'; COMP_WORDS=({words}); \
             COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMP_TYPE=9; \
             _clap_complete_rungd rungd '{last}'; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        );
        let output = Command::new("bash").args(["-c", &script]).output().expect("bash runs");
        text(output.stdout).lines().map(|line| line.trim().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(complete("rungd sch", "sch"), ["schema"]);
    assert_eq!(
        complete("rungd schema ''", ""),
        ["ladder", "controller", "test", "edge", "opcua", "--help"]
    );
    assert_eq!(complete("rungd explain sqr", "sqr"), ["sqrt"]);
    let library = complete("rungd explain lib", "lib");
    let files: Vec<String> = FILES.iter().map(|file| format!("lib:{}", file.name)).collect();
    assert_eq!(library, files);
    let all = complete("rungd ''", "");
    assert!(all.contains(&"run".to_owned()) && !all.contains(&"man".to_owned()), "{all:?}");
}
