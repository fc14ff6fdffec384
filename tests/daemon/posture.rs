//! `[realtime]` with the real binary: the requests to the machine, the permissions that it grants,
//! and `strict`.
//!
//! If a test needs a refusal, the binary runs as `nobody` or with limits set by `prlimit`. Some of
//! this needs root. Without root, the permissions of an ordinary user decide.

use rungd_test_support::calm::calm;
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::patience::PATIENCE;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::Value;

const LADDER: &str = "[[program]]\nname = \"Main\"\n\
     [[program.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT Y0\"]\n";

/// A controller with a `[realtime]` table, in a folder that every user may read.
fn plant(realtime: &str) -> PathBuf {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let name =
        format!("rungd-posture-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("ladder.toml"), LADDER).unwrap();
    let controller = calm(&format!("ladder = [\"ladder.toml\"]\n[realtime]\n{realtime}"));
    std::fs::write(folder.join("controller.toml"), controller).unwrap();
    // Runs a copy, because other users may have no access to the build's folder. `cp` makes the
    // copy: if this process opened it for writing, a child started by a different test at that
    // moment could inherit the open file, and the copy could not be executed.
    let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_rungd")).arg(&folder).status();
    assert!(copied.unwrap().success());
    folder
}

/// Runs three scans, with a prefix that sets limits; returns the exit code and the log.
fn run(prefix: &[&str], folder: &Path) -> (Option<i32>, Vec<Value>) {
    let mut words = prefix.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    words.push(folder.join("rungd").display().to_string());
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).arg("run").arg(folder.join("controller.toml"));
    command.args(["--scans", "3", "--log-format", "json"]).env_remove("RUNGD_LOG");
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    std::fs::remove_dir_all(folder).unwrap();
    (output.status.code(), lines)
}

/// A prefix that removes every privilege and every real-time limit.
fn unprivileged() -> Vec<&'static str> {
    let limits = ["prlimit", "--rtprio=0:0", "--memlock=65536:65536"];
    if is_root() {
        let nobody = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"];
        return limits.into_iter().chain(nobody).chain(["--inh-caps=-all"]).collect();
    }
    limits.to_vec()
}

fn is_root() -> bool {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata("/proc/self").unwrap().uid() == 0
}

fn event<'a>(lines: &'a [Value], name: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["event"] == name).collect()
}

fn text<'a>(line: &'a Value, field: &str) -> &'a str {
    line[field].as_str().unwrap_or_default()
}

const ALL: &str = "policy = \"fifo\"\npriority = 80\ncpus = [1000]\nlock-memory = true\n\
     cpu-latency = \"0us\"\n";

#[test]
fn a_refused_posture_is_reported_with_reason_and_remedy() {
    let (code, lines) = run(&unprivileged(), &plant(ALL));
    assert_eq!(code, Some(0), "{lines:#?}");
    let [posture] = event(&lines, "posture")[..] else { panic!("{lines:#?}") };
    let asked = "memory locked, CPU latency of 0 us, timer slack 1 ns, CPU 1000, \
                 SCHED_FIFO priority 80";
    assert_eq!((text(posture, "asked"), text(posture, "granted")), (asked, "timer slack 1 ns"));
    let refused = event(&lines, "posture-refused");
    let told: Vec<_> = refused.iter().map(|line| (text(line, "what"), &line["level"])).collect();
    let warn = Value::from("WARN");
    let what = ["memory locked", "CPU latency of 0 us", "CPU 1000", "SCHED_FIFO priority 80"];
    assert_eq!(told, what.map(|what| (what, &warn)));
    let remedies =
        ["LimitMEMLOCK=infinity", "/dev/cpu_dma_latency", "CPUAffinity=", "LimitRTPRIO=80"];
    for (line, remedy) in refused.iter().zip(remedies) {
        assert!(text(line, "message").contains(remedy), "{line}");
    }
}

#[test]
fn a_refused_strict_posture_refuses_the_start_with_reason_and_remedy() {
    let asked = "policy = \"rr\"\npriority = 12\nlock-memory = true\nstrict = true\n";
    let (code, lines) = run(&unprivileged(), &plant(asked));
    assert_eq!(code, Some(78), "{lines:#?}");
    let last = text(lines.last().unwrap(), "message");
    let words = [
        "`[realtime]` is strict",
        "SCHED_RR priority 12 (Operation not permitted",
        "LimitRTPRIO=12",
        "memory locked (the limit on locked memory is not infinite",
        "LimitMEMLOCK=infinity",
        "docs/running.md",
    ];
    for word in words {
        assert!(last.contains(word), "no `{word}` in {last}");
    }
    assert!(lines.iter().all(|line| !text(line, "message").starts_with("RUN")), "{lines:#?}");
}

#[test]
fn a_granted_strict_posture_starts_the_controller() {
    if !is_root() {
        return skip(Need::Root, "handing a capability to another user wants root");
    }
    // For a service, LimitRTPRIO= grants the same. A test seldom has the right to raise a limit.
    let prefix = "setpriv --reuid=65534 --regid=65534 --clear-groups --inh-caps=+sys_nice \
                  --ambient-caps=+sys_nice --bounding-set=-all,+sys_nice";
    let prefix: Vec<_> = prefix.split_whitespace().collect();
    for (policy, name) in [("fifo", "SCHED_FIFO"), ("rr", "SCHED_RR")] {
        let asked = format!("policy = \"{policy}\"\npriority = 80\ncpus = [0]\nstrict = true\n");
        let (code, lines) = run(&prefix, &plant(&asked));
        assert_eq!(code, Some(0), "{lines:#?}");
        let granted = format!("timer slack 1 ns, CPU 0, {name} priority 80");
        assert_eq!(text(event(&lines, "posture")[0], "granted"), granted);
    }
}

#[test]
fn only_the_scan_thread_has_the_realtime_policy() {
    if !is_root() {
        return skip(Need::Root, "SCHED_FIFO wants root or a limit");
    }
    let folder = plant("policy = \"fifo\"\npriority = 7\ncpus = [0]\nlock-memory = true\n");
    let mut command = Command::new(folder.join("rungd"));
    command.arg("run").arg(folder.join("controller.toml"));
    let null = std::process::Stdio::null();
    let mut child = command.stderr(null).spawn().unwrap();
    let threads = || -> Vec<(String, String, String)> {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", child.id())).unwrap();
        let read = |task: std::io::Result<std::fs::DirEntry>| {
            let task = task.ok()?.path();
            let stat = std::fs::read_to_string(task.join("stat")).ok()?;
            let (name, rest) = stat.split_once('(')?.1.rsplit_once(") ")?;
            // Field 41 of proc_pid_stat(5); `rest` begins with field 3.
            let policy = rest.split(' ').nth(38)?.to_owned();
            let status = std::fs::read_to_string(task.join("status")).ok()?;
            let cpus = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
            Some((name.to_owned(), policy, cpus.trim().to_owned()))
        };
        tasks.filter_map(read).collect()
    };
    let deadline = std::time::Instant::now() + PATIENCE;
    while !threads().iter().any(|thread| thread.0 == "rungd-monitor") {
        assert!(std::time::Instant::now() < deadline, "{:?}", threads());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let threads = threads();
    child.kill().unwrap();
    child.wait().unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    let (scan, others): (Vec<_>, Vec<_>) = threads.iter().partition(|t| t.0 == "rungd-scan");
    assert_eq!(scan, [&("rungd-scan".into(), "1".into(), "0".into())]);
    assert!(others.len() >= 2 && others.iter().all(|thread| thread.1 == "0"), "{others:?}");
}
