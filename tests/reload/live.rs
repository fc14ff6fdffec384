//! `rungd reload` and `rungd rollback` of a running controller; the example of `docs/reload.md`.

use rungd_test_support::running::live;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixDatagram, UnixStream};
use std::path::Path;
use std::time::{Duration, Instant};

use rungd_test_support::metronome::HeldUp;
use rungd_test_support::running::live::Live;
use rungd_test_support::running::process::{Plant, Running, until};
use rungd_test_support::shown::lines_match;
use serde_json::Value;

const LADDER: &str = r#"
[tags]
lamp = { at = "Y0", log = "change" }
jam = { at = "C7", alarm = "Bottles jammed" }
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["OUT lamp", "SET jam", "ADD D2 1 to=D2"] },
  { leg.up = ["$ScanToggle"], leg.rst = ["$Off"], do = ["CNT CT0 preset=12"] },
]
"#;

fn write(live: &Live, name: &str, text: &str) {
    std::fs::write(live.folder.join(name), text).unwrap();
}

/// The blocks of the page in this language.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let open = format!("```{language}\n");
    page.split(&open).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

fn is_shown(shown: &str, said: &str) -> bool {
    lines_match(&shown.lines().collect::<Vec<_>>(), &said.lines().collect::<Vec<_>>())
}

#[test]
fn the_example_of_the_page_prints_what_the_page_shows() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reload.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (files, said) = (blocks(&page, "toml"), blocks(&page, "text"));
    let live = Live::start(files[0], "", &[]);
    live.await_values("T3.Timing Y1", "ON ON");
    write(&live, "ladder.toml", files[1]);
    let dry = live.ok("reload --dry-run");
    assert!(is_shown(said[0], &dry), "{dry}");
    live.await_values("Drain.Running Y1", "ON ON");
    let done = live.ok("reload");
    assert!(is_shown(said[1], &done), "{done}");
    live.await_values("Y1", "OFF");
    assert_eq!(live.say("read Drain.Running").code, 2);
    live.line("Program Drain is gone and was terminated");
    let line = live.line("reloaded: the new program scans, without a stop");
    assert_eq!((&line["event"], &line["level"]), (&"reload-done".into(), &"INFO".into()));
}

#[test]
fn bad_files_change_nothing_and_the_command_prints_the_findings() {
    let live = Live::start(LADDER, "", &[]);
    live.await_values("Y0", "ON");
    write(&live, "ladder.toml", &LADDER.replace("CNT CT0", "CNT CT0 nonsense"));
    for words in ["reload", "reload --dry-run"] {
        let said = live.say(words);
        assert_eq!(said.code, 78, "{said:?}");
        assert!(said.err.contains("ladder.toml:9"), "{said:?}");
        assert!(said.err.ends_with("nothing is changed\n"), "{said:?}");
    }
    let line = live.line("the files cannot be run as they are; nothing changed: ");
    assert_eq!((&line["event"], &line["level"]), (&"reload-refused".into(), &"ERROR".into()));
    let message = line["message"].as_str().unwrap();
    assert!(
        message.contains("ladder.toml:9:") && message.ends_with("(1 error, 0 warnings)"),
        "{message}"
    );
    let line = live.line("nonsense");
    assert_eq!((&line["event"], &line["level"]), (&"reload-finding".into(), &"INFO".into()));
    std::fs::remove_file(live.folder.join("controller.toml")).unwrap();
    assert_eq!(live.say("reload").code, 78);
    live.await_values("Y0", "ON");
}

/// The requests arrive while the process is stopped, so both are there when it continues.
#[test]
fn one_of_two_simultaneous_dry_runs_is_refused() {
    let live = Live::start(LADDER, "", &[]);
    let clients = [live.connect(), live.connect()];
    for mut client in &clients {
        client.write_all(b"{\"do\":\"status\"}\n").unwrap();
        assert!(answer(client)["ok"].is_object());
    }
    live.signal("STOP");
    let status = format!("/proc/{}/status", live.child.id());
    until(|| std::fs::read_to_string(&status).unwrap().contains("State:\tT"));
    for mut client in &clients {
        client.write_all(b"{\"do\":\"reload\",\"dry_run\":true}\n").unwrap();
    }
    live.signal("CONT");
    let (done, refused): (Vec<Value>, Vec<Value>) =
        clients.iter().map(answer).partition(|answer| answer["ok"].is_object());
    assert_eq!((done.len(), refused.len()), (1, 1), "{done:?} {refused:?}");
    assert_eq!(done[0]["ok"]["dry_run"], true);
    assert_eq!(refused[0]["error"]["kind"], "refused");
    let message = refused[0]["error"]["message"].as_str().unwrap();
    assert!(message.contains("dry run"), "{message}");
    live.ok("reload --dry-run");
}

/// The next line that a client receives.
fn answer(client: &UnixStream) -> Value {
    let mut line = String::new();
    BufReader::new(client).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

#[test]
fn a_reload_of_a_changed_comment_reports_no_difference() {
    let live = Live::start(LADDER, "", &[]);
    live.await_values("Y0", "ON");
    write(&live, "ladder.toml", &format!("# Another day.\n{LADDER}"));
    let none = "no difference in what the program does\n";
    let said = live.ok("reload --dry-run");
    assert!(said.starts_with(none) && said.ends_with("\ndry run: nothing was done\n"), "{said}");
    let said = live.ok("reload");
    assert!(said.starts_with(none) && said.contains("\n`ladder` runs now"), "{said}");
}

#[test]
fn a_reload_reports_changed_safe_values() {
    let live = Live::start(LADDER, "", &[]);
    live.ok("mode stop");
    let controller = std::fs::read_to_string(live.folder.join("controller.toml")).unwrap();
    write(&live, "controller.toml", &format!("{controller}[outputs]\non = [\"Y3..Y4\"]\n"));
    for words in ["reload --dry-run", "reload"] {
        let said = live.ok(words);
        assert!(said.starts_with("no difference in what the program does\n"), "{said}");
        assert!(said.contains("\nY3..Y4 outside RUN OFF → ON\n"), "{said}");
    }
}

#[test]
fn a_manual_rollback_works_once() {
    let live = Live::start(LADDER, "", &[]);
    live.await_values("Y0", "ON");
    assert_eq!(live.say("rollback").code, 1);
    live.ok("force D9 42");
    let other = LADDER.replace("OUT lamp", "OUT Y5")
        + "[[program]]\nname = \"New\"\nautostart = \
        true\nrung = [ { when = [\"$On\"], do = [\"OUT Y6\"] } ]\n";
    write(&live, "ladder.toml", &other);
    live.ok("reload");
    live.await_values("Y0 Y5 Y6 New.Running D9", "OFF ON ON ON 42");
    let said = live.say("rollback");
    assert!(said.out.contains("Program New is gone and was terminated"), "{said:?}");
    assert!(said.err.contains("a rollback changes no file"), "{said:?}");
    live.await_values("Y0 Y5 Y6 D9 $ForcesActive", "ON OFF OFF 42 ON");
    let line = live.line("went back to the program before the reload (asked for)");
    assert_eq!((&line["event"], &line["level"]), (&"rolled-back".into(), &"WARN".into()));
    assert_eq!(live.say("rollback").code, 1);
    let status = live.say("status --json").json();
    assert_eq!(status["forces"][0]["address"], "D9");
}

/// Checks the number of scans, done or skipped, in a second.
fn assert_scanned_every_20_ms(live: &Live) {
    let mut stream = live.connect();
    let mut points = || {
        let asked = Instant::now();
        let status = live::ask(&mut stream, r#"{"do":"status"}"#)["ok"].clone();
        let number = |value: &Value| value.as_u64().unwrap();
        (number(&status["scans"]) + number(&status["scan"]["skipped"]), asked, Instant::now())
    };
    let (held_up, first) = (HeldUp::of(live.child.id()), points());
    std::thread::sleep(Duration::from_millis(1000));
    let (last, held_up) = (points(), HeldUp::of(live.child.id()).since(&held_up));
    let made = last.0 - first.0;
    let due = |time: Duration| time.as_millis() as u64 / 20;
    let (least, most) = (due((last.1 - first.2).saturating_sub(held_up)), due(last.2 - first.1));
    assert!((least / 2..=most + 2).contains(&made), "{made} of {least} to {most}");
}

#[test]
fn settings_that_need_a_restart_are_named_and_others_are_applied() {
    let before = "[scan]\nperiod = \"10ms\"\nwatchdog = \"30s\"\n";
    let live = Live::start(LADDER, before, &[]);
    live.await_values("Y0", "ON");
    let controller = std::fs::read_to_string(live.folder.join("controller.toml")).unwrap();
    let controller = controller.replace(before, "");
    let scan = "[scan]\nperiod = \"20ms\"\nwatchdog = \"20s\"\n[log]\nstatistics = \"7s\"\n";
    let changed = format!(
        "{controller}[outputs]\non = [\"Y9\"]\n{scan}[web]\nwrite = [\"D2\", \"D5\"]\n\
         [reload]\nprobation = \"30s\"\n"
    );
    write(&live, "controller.toml", &changed);
    let said = live.ok("reload");
    assert!(said.contains("`[web] write`: pages may write D2, D5\n"), "{said}");
    assert!(said.contains("probation 10s → 30s\n"), "{said}");
    assert!(said.contains("needs a restart: `[log] statistics`\n"), "{said}");
    assert!(said.contains("Y9 outside RUN OFF → ON\n"), "{said}");
    assert!(said.contains("scan period 10ms → 20ms\nscan watchdog 30s → 20s\n"), "{said}");
    assert_eq!(live.line("needs a restart")["event"], "reload-restart");
    assert!(live.ok("status").contains("every 20ms, watchdog 20s"));
    assert_scanned_every_20_ms(&live);
    // The active alarm remains, and is not reported again.
    let before = live.line("reloaded: the new program");
    assert_eq!(before["level"], "INFO");
    live.ok("mode stop");
    write(&live, "controller.toml", &format!("{controller}[memory]\nD = 100\n"));
    assert_eq!(live.say("reload").code, 78);
    live.ok("mode run");
    live.line("RUN: scanning every 20ms");
}

/// Scans that are far apart, and a watchdog that comes too late because systemd's watchdog comes
/// first.
const LONG: &str = "[scan]\nperiod = \"20m\"\nwatchdog = \"700ms\"\n";

#[test]
fn a_long_period_delays_neither_the_systemd_watchdog_nor_commands() {
    let before = "[scan]\nwatchdog = \"500ms\"\n";
    let folder = live::folder(LADDER, before);
    let notify = UnixDatagram::bind(folder.join("n")).unwrap();
    notify.set_read_timeout(Some(live::PATIENCE)).unwrap();
    let mut command = live::run(&folder, &[]);
    // `WATCHDOG_PID` would have to be the process's number; rungd compares it only if it is set.
    command.env("WATCHDOG_USEC", "800000").env_remove("WATCHDOG_PID");
    command.env("NOTIFY_SOCKET", folder.join("n"));
    let live = Live::of(folder, command);
    live.await_values("Y0", "ON");
    let controller = std::fs::read_to_string(live.folder.join("controller.toml")).unwrap();
    write(&live, "controller.toml", &controller.replace(before, LONG));
    let said = live.ok("reload");
    assert!(said.contains("scan period 10ms → 20m"), "{said}");
    assert!(said.contains("warning: `[scan] watchdog` is 700ms, and systemd ends"), "{said}");
    // Discard the messages of the short period. Three further messages cannot all have been under
    // way at that time.
    notify.set_nonblocking(true).unwrap();
    while notify.recv(&mut [0; 512]).is_ok() {}
    notify.set_nonblocking(false).unwrap();
    let mut fed = 0;
    while fed < 3 {
        let mut text = [0; 512];
        let count = notify.recv(&mut text).unwrap();
        fed += u32::from(text[..count].starts_with(b"WATCHDOG=1"));
    }
    let scans = || live.say("status --json").json()["scans"].as_u64().unwrap();
    let before = scans();
    live.ok("force D9 44");
    live.await_values("D9 $ForcesActive", "44 ON");
    assert!(live.ok("unforce D9").contains("not forced"));
    assert!(live.ok("reload").contains("nothing changed"));
    let waits = live.say("write D9 45").err;
    assert!(waits.contains("45 is written with the next scan; a scan comes every 20m"), "{waits}");
    let told = live.line("asked to write to D9: 45 is written with the next scan");
    assert_eq!((&told["before"], &told["after"]), (&"44".into(), &"45".into()), "{told}");
    assert!(told["message"].as_str().unwrap().ends_with("until then it is 44"), "{told}");
    assert_eq!(scans(), before, "nothing was scanned for all that");
    assert_eq!(live.ok("mode stop"), "STOP (an operator requested it), was RUN\n");
    assert_eq!(scans(), before + 1, "the last scan");
    live.await_values("D9", "45");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "stalls are a debug build's")]
fn a_program_that_faults_on_probation_is_rolled_back_and_scans_continue() {
    let live = Live::start_to_stall(LADDER, "scan.watchdog = \"600ms\"\n", &[]);
    live.await_values("Y0", "ON");
    let sha256 = || live.say("status --json").json()["ladder"]["sha256"].clone();
    let old = sha256();
    write(&live, "ladder.toml", &LADDER.replace("OUT lamp", "OUT Y5"));
    live.ok("reload");
    live.await_values("Y0 Y5", "OFF ON");
    live.stall();
    let line = live.line("went back to the program before the reload (FAULT: ");
    assert_eq!((&line["event"], &line["who"]), (&"rolled-back".into(), &"rungd".into()));
    live.await_values("Y0 Y5", "ON OFF");
    assert_eq!((sha256(), live.say("status --json").json()["mode"].clone()), (old, "RUN".into()));
}

#[test]
fn systemd_is_notified_of_the_start_and_the_end_of_a_reload() {
    let folder = live::folder(LADDER, "");
    let notify = folder.join("notify");
    let socket = UnixDatagram::bind(&notify).unwrap();
    socket.set_read_timeout(Some(live::PATIENCE)).unwrap();
    let mut child = live::run(&folder, &[]).env("NOTIFY_SOCKET", &notify).spawn().unwrap();
    let hear = |part: &str| {
        let mut bytes = [0; 4096];
        loop {
            let count = socket.recv(&mut bytes).unwrap();
            let text = String::from_utf8_lossy(&bytes[..count]).into_owned();
            if text.contains(part) {
                return text;
            }
        }
    };
    hear("READY=1");
    std::fs::write(folder.join("ladder.toml"), "nonsense").unwrap();
    let pid = child.id().to_string();
    std::process::Command::new("kill").args(["-s", "HUP", &pid]).status().unwrap();
    let text = hear("RELOADING=1");
    let since = text.split_once("MONOTONIC_USEC=").expect("in the same datagram").1;
    assert!(since.trim().parse::<u64>().unwrap() > 0);
    hear("READY=1");
    std::process::Command::new("kill").args(["-s", "TERM", &pid]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let _ = std::fs::remove_dir_all(&folder);
}

/// `rungd reload` as in the systemd unit, of a controller with these lines in `[operator]`.
fn reloaded_by_the_unit(operator: &str) -> (Running, live::Said) {
    let plant = Plant::new(LADDER, &format!("[operator]\n{operator}\n"));
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN: scanning every");
    std::fs::write(plant.0.join("ladder.toml"), format!("{LADDER}# edited\n")).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("reload").arg("--controller").arg(plant.0.join("controller.toml"));
    command.args(["--pid", &running.pid()]);
    ["RUNGD_SOCKET", "RUNTIME_DIRECTORY"].iter().for_each(|name| {
        command.env_remove(name);
    });
    let said = live::said(&mut command);
    running.line("reloaded: the new program");
    (running, said)
}

#[test]
fn a_reload_reads_the_socket_from_the_controller_file() {
    let (_running, said) = reloaded_by_the_unit("socket = \"op\"");
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
    assert!(said.out.contains("runs now: the swap"), "{said:?}");
}

#[test]
fn a_reload_without_a_socket_sends_a_signal_and_reports_it() {
    let (_running, said) = reloaded_by_the_unit("enabled = false");
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.err.contains("SIGHUP is sent, and the log has the outcome"), "{said:?}");
}

/// A program with `before` tags of a type before `own`, which only an operator writes.
fn own_after(before: usize) -> String {
    let tag = |name: &str| format!("{name} = {{ type = \"int\", spare = true }}\n");
    let tags = (0..before).map(|n| tag(&format!("a{n}"))).collect::<String>();
    let rung = "{ when = [\"$On\"], do = [\"ADD D2 1 to=D2\"] }";
    format!("[tags]\n{tags}{}[[program]]\nname = \"Main\"\nrung = [ {rung} ]\n", tag("own"))
}

/// Asks for a change, and reloads `next` while the change waits for its scan; on a slow machine the
/// scan may come first. The result is the answer to the change.
fn changed_by_a_reload(live: &Live, change: &Value, next: &str) -> Value {
    write(live, "ladder.toml", next);
    let mut client = live::connect(&live.socket);
    client.write_all(format!("{change}\n").as_bytes()).unwrap();
    live.ok("reload");
    answer(&client)
}

#[test]
fn a_pending_change_is_answered_from_the_reloaded_program() {
    let live = Live::start(&own_after(400), "[scan]\nperiod = \"900ms\"\nwatchdog = \"5s\"\n", &[]);
    let to = |value: u64| serde_json::json!({"do": "write", "operand": "own", "value": value});
    // `own` moves to the place of a different tag, and back.
    for (value, before) in [(7, 0), (8, 400), (9, 3)] {
        let answer = changed_by_a_reload(&live, &to(value), &own_after(before));
        assert_eq!(answer["ok"]["now"]["value"], value, "{answer}");
        assert_eq!(
            (&answer["ok"]["note"], &answer["ok"]["now"]["forced"]),
            (&Value::Null, &false.into())
        );
        live.line(&format!("wrote {value} to own: it was "));
    }
    // Whether the reload or the scan comes first depends on the machine: until the reload does.
    let (gone, deadline) = (own_after(0).replace("own", "other"), Instant::now() + live::PATIENCE);
    let message = loop {
        let answer = changed_by_a_reload(&live, &to(10), &gone);
        if let Some(message) = answer["error"]["message"].as_str() {
            break message.to_owned();
        }
        assert_eq!(answer["ok"]["now"]["value"], 10, "{answer}");
        assert!(Instant::now() < deadline, "each scan comes before the reload");
        write(&live, "ladder.toml", &own_after(0));
        live.ok("reload");
    };
    assert!(message.contains("does not have the named operand"), "{message}");
    let line = live.line("; a reload has removed it meanwhile");
    assert!(line["message"].as_str().unwrap().contains("asked to write 10 to own: it was "));
    assert_eq!((&line["event"], &line["after"]), (&"operator-write".into(), &"gone".into()));
    // Forces are released in the program that runs then.
    write(&live, "ladder.toml", &own_after(400));
    live.ok("reload");
    live.ok("force own 5");
    let release = serde_json::json!({"do": "unforce-all"});
    let answer = changed_by_a_reload(&live, &release, &own_after(1));
    let released = answer["ok"]["values"].as_array().unwrap_or_else(|| panic!("{answer}"));
    let [own] = &released[..] else { panic!("{answer}") };
    assert_eq!((&own["operand"], &own["value"]), (&"own".into(), &5.into()));
}

/// The force of a tag with a `type` belongs to the name, and a reload gives its place to a
/// different tag.
#[test]
fn a_force_of_a_typed_tag_is_shown_only_by_its_own_name() {
    let ladder = |tags: &str| {
        format!(
            "[tags]\n{tags}[[program]]\nname = \"Main\"\nrung = [ {{ when = [\"beta\"], do = \
             [\"OUT gamma\"] }} ]\n"
        )
    };
    let tags = "beta = { type = \"bit\" }\ngamma = { type = \"bit\" }\n";
    let live = Live::start(&ladder(tags), "", &[]);
    live.ok("force beta on");
    live.ok("force gamma on");
    let more = format!("alpha = {{ type = \"bit\" }}\n{tags}");
    std::fs::write(live.folder.join("ladder.toml"), ladder(&more)).unwrap();
    live.ok("reload");
    for tag in ["gamma", "beta"] {
        let said = live.ok(&format!("unforce {tag}"));
        assert!(said.ends_with(", was ON, forced\n"), "{said}");
        let said = live.say(&format!("unforce {tag}"));
        let note = match tag {
            "gamma" => "it was not forced; forced now: beta",
            _ => "it was not forced; nothing is forced",
        };
        assert!(said.err.contains(note), "{said:?}");
    }
}

/// The texts of rungs, the values of constants, and the warnings that the new files bring.
#[test]
fn the_reload_report_lists_every_change() {
    let rungs = |size: &str, lamp: &str, last: &str| {
        format!(
            r#"
[tags]
size = {{ value = {size} }}
eye = {{ at = "X0" }}
stop = {{ at = "X1" }}
lamp = {{ at = "Y0" }}
count = {{ at = "CT0" }}

[[program]]
name = "Main"

[[program.rung]]
name = "count"
leg.up = ["eye"]
leg.rst = ["stop"]
do = ["CNT count preset=size"]

[[program.rung]]
name = "lamp"
when = [{lamp}]  # with a comment
do = ["OUT lamp"]

{last}
"#
        )
    };
    let side = "[[program]]\nname = \"Side\"\nrung = [{ when = [\"eye\"], do = [\"OUT Y5\"] }]\n";
    let gone = "[[program.rung]]\nname = \"horn\"\nwhen = [\"stop\"]\ndo = [\"OUT Y1\"]\n";
    let gone = format!("{gone}\n{side}");
    let second = ", { when = [\"fall(eye)\"], do = [\"SET C7\", \"OUT Y2\"] }]";
    let new = side.replace("}]", &format!("}}{second}"));
    let live = Live::start(&rungs("12", "\"count.Done\"", &gone), "", &[]);
    live.await_values("CT0.Done", "OFF");
    write(&live, "ladder.toml", &rungs("10", "\"count.Done\", \"!stop\"", &new));
    let said = live.ok("reload --dry-run");
    let expected = [
        "2 rungs edited, 1 new, 1 gone",
        "Main, rung count: its text is the same; a constant, an address or an argument in it is not",
        "Main, rung lamp: when count.Done → count.Done, !stop",
        "Side, rung 2 is new: when fall(eye); do SET C7, OUT Y2",
        "Main, rung horn is gone: when stop; do OUT Y1",
        "constant size 12 → 10",
    ];
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines[..expected.len()], expected, "{said}");
    let warnings: Vec<&&str> =
        lines.iter().filter(|line| line.contains("(set-never-reset)")).collect();
    assert_eq!(warnings.len(), 1, "{said}");
    assert!(
        warnings[0].starts_with("warning: ") && warnings[0].contains("ladder.toml:25: "),
        "{said}"
    );
    live.ok("reload");
    live.line("Main, rung lamp: when count.Done → count.Done, !stop");
    let line = live.line("(set-never-reset)");
    assert_eq!((&line["event"], &line["level"]), (&"reload-warning".into(), &"WARN".into()));
    assert!(!live.ok("reload --dry-run").contains("set-never-reset"), "the files are the same");
}
