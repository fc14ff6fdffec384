//! `rungd monitor` in a real terminal, tmux, with a real controller: its pages, a force, its ends.
//!
//! Without tmux the tests print the reason and pass, unless `RUNGD_REQUIRE` names `programs`.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use rungd_test_support::needs::{Need, skip, usable, works};
use rungd_test_support::running::live::{Live, PATIENCE, folder, run};

const LADDER: &str = r#"
[tags]
stop  = { at = "X0" }
motor = { at = "Y0" }
level = { at = "D0" }
jam   = { at = "C0", alarm = "The belt is jammed" }

[[program]]
name = "Main"

[[program.rung]]
name = "run"
when = ["!stop"]
do   = ["OUT motor"]

[[program.rung]]
when = ["level > 500"]
do   = ["OUT jam"]
"#;

/// A terminal that runs a shell script.
struct Tmux {
    server: String,
}

impl Tmux {
    /// Starts the monitor. After its end the script prints the exit code and the input settings of
    /// the terminal.
    fn start(folder: &Path, arguments: &str) -> Option<Tmux> {
        if !usable(works("tmux", Command::new("tmux").arg("-V"))) {
            return None;
        }
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let server = format!("rungd-{}-{number}", std::process::id());
        let rungd = env!("CARGO_BIN_EXE_rungd");
        let script = format!(
            "echo before; sh -c 'echo $$ > pid; exec {rungd} monitor --socket s {arguments}'; \
             echo ended with $?; stty -a | grep -ow -e '-*icanon' -e '-*echo'; exec sleep 900"
        );
        let tmux = Tmux { server };
        let mut command = tmux.command(&["-f", "/dev/null", "new-session", "-d"]);
        command.args(["-x", "80", "-y", "24"]).arg("-c").arg(folder).arg(script);
        command.env("RUNGD_FAULTS", folder.join("faults")).env("NO_COLOR", "1");
        command.env("RUST_BACKTRACE", "0");
        command.env("LC_ALL", "C.UTF-8").env_remove("TMUX");
        let said = command.output().unwrap();
        assert!(said.status.success(), "{said:?}");
        Some(tmux)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new("tmux");
        command.args(["-u", "-L", &self.server]).args(arguments);
        command
    }

    fn screen(&self) -> String {
        let output = self.command(&["capture-pane", "-p"]).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn keys(&self, keys: &[&str]) {
        assert!(self.command(&["send-keys"]).args(keys).status().unwrap().success());
    }

    /// Waits until all of these are on the screen.
    fn awaits(&self, words: &[&str]) -> String {
        self.until(&format!("{words:?}"), |screen| words.iter().all(|of| screen.contains(of)))
    }

    fn until(&self, what: &str, is_there: impl Fn(&str) -> bool) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let screen = self.screen();
            if is_there(&screen) {
                return screen;
            }
            assert!(Instant::now() < deadline, "not on the screen: {what}\n{screen}");
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// Waits until the monitor has ended with this code, and the terminal is as it was.
    fn awaits_end(&self, code: i32) -> String {
        let screen = self.awaits(&["before", &format!("ended with {code}")]);
        let screen = match screen.contains("echo") {
            true => screen,
            false => self.awaits(&["icanon", "echo"]),
        };
        let words: Vec<&str> = screen.lines().map(str::trim).collect();
        assert!(words.contains(&"icanon") && words.contains(&"echo"), "{screen}");
        assert!(!screen.contains("Watch"), "{screen}");
        screen
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        let _ = self.command(&["kill-server"]).stderr(Stdio::null()).status();
    }
}

#[test]
fn the_monitor_shows_forces_and_leaves_a_clean_screen() {
    let live = Live::start(LADDER, "", &[]);
    let Some(tmux) = Tmux::start(&live.folder, "stop level") else { return };
    tmux.awaits(&["RUN for", "every 10ms", "● Program Main: running", "▶Watch", "stop", "OFF"]);

    live.ok("write level 600");
    tmux.awaits(&["alarms: 1", "● jam: The belt is jammed", "NOT ACKNOWLEDGED"]);
    tmux.keys(&["Tab", "Tab", "k"]);
    tmux.awaits(&["▶Alarms", "Acknowledge jam?", "present value: ON"]);
    tmux.keys(&["y"]);
    tmux.awaits(&["jam: now acknowledged", "  medium, acknowledged"]);
    tmux.keys(&["BTab", "BTab"]);

    tmux.keys(&["l"]);
    tmux.awaits(&[
        "Main (Program, always runs)",
        "┣━]●/[━━━━",
        "━(●)─",
        "conducts, and power reaches",
    ]);
    tmux.keys(&["Escape"]);

    tmux.awaits(&["▶Watch"]);
    tmux.keys(&["Home", "f"]);
    tmux.awaits(&["Force stop", "present value: OFF", "new value: ON_"]);
    tmux.keys(&["Enter"]);
    tmux.awaits(&["Force stop?", "present value: OFF", "new value: ON, forced until"]);
    assert!(live.ok("read stop").contains("OFF"), "nothing before the answer");
    tmux.keys(&["y"]);
    tmux.awaits(&["stop (X0): ON, forced, was OFF", "forces: 1"]);
    assert!(live.ok("read stop").contains("ON  forced"));

    tmux.keys(&["l"]);
    tmux.awaits(&["stop is ON, forced; does not conduct; power reaches it", "( )"]);
    tmux.keys(&["w"]);
    tmux.awaits(&["Why: stop", "stop (X0) is ON", "force"]);

    // A different program is loaded: the monitor draws its ladder, with its own power.
    let ladder = LADDER.replace("\"run\"", "\"halt\"").replace("!stop", "stop & !motor");
    std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
    live.ok("reload");
    tmux.keys(&["Escape"]);
    tmux.awaits(&["▶1. halt", "stop is ON, forced; conducts, and power reaches it", "]●["]);

    tmux.keys(&["?"]);
    tmux.awaits(&["Everywhere"]);
    assert!(tmux.command(&["resize-window", "-x", "110", "-y", "40"]).status().unwrap().success());
    tmux.awaits(&["Everywhere", "arrows scroll"]);
    tmux.keys(&["q"]);
    tmux.awaits_end(0);
}

#[test]
fn the_monitor_reconnects_to_a_restarted_controller() {
    let folder = folder(LADDER, "");
    let Some(tmux) = Tmux::start(&folder, "") else { return };
    tmux.awaits(&["no rungd answers at s"]);
    let mut live = Live::of(folder.clone(), run(&folder, &[]));
    tmux.awaits(&["RUN for", "alarms: 0"]);
    live.end();
    tmux.awaits(&["NO ANSWER for", "the values shown are old"]);
    let again = Live::of(folder.clone(), run(&folder, &[]));
    tmux.until("an answer", |screen| !screen.contains("NO ANSWER"));
    tmux.keys(&["C-c"]);
    tmux.awaits_end(0);
    drop((again, live));
}

#[test]
fn a_signal_and_a_panic_restore_the_terminal() {
    let live = Live::start(LADDER, "", &[]);
    for signal in ["TERM", "HUP", "INT"] {
        let Some(tmux) = Tmux::start(&live.folder, "") else { return };
        tmux.awaits(&["RUN for"]);
        let pid = std::fs::read_to_string(live.folder.join("pid")).unwrap();
        assert!(Command::new("kill").args(["-s", signal, pid.trim()]).status().unwrap().success());
        tmux.awaits_end(0);
    }
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a release build has no faults");
    }
    let Some(tmux) = Tmux::start(&live.folder, "") else { return };
    tmux.awaits(&["RUN for"]);
    std::fs::write(live.folder.join("faults"), "page").unwrap();
    let screen = tmux.awaits_end(70);
    assert!(screen.contains("a fault on purpose") && screen.contains("bug in rungd"), "{screen}");
}

#[test]
fn the_monitor_without_a_terminal_suggests_another_command() {
    let output = Command::new(env!("CARGO_BIN_EXE_rungd")).arg("monitor").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("needs a terminal") && said.contains("rungd watch"), "{said}");
}
