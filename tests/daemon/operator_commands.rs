//! The operator's commands, with the real binary at both ends of the socket.

use std::net::TcpListener;
use std::process::Command;

use rungd_test_support::running::live::{Live, ask, said};

pub const LADDER: &str = r#"
[ladder]
name = "bottling"
[tags]
jam   = { at = "C0", doc = "Bottles jammed", alarm = "Bottles jammed" }
lamp  = { at = "Y0" }
parts = { at = "CT0" }
size  = { at = "D1", initial = 12, min = 1, max = 500 }
eye   = { at = "X0" }
[[program]]
name = "Main"
rung = [
  { leg.up = ["eye"], leg.rst = ["$Off"], do = ["CNT parts preset=size"] },
  { when = ["jam"], do = ["OUT lamp"] },
  { when = ["$ForcesActive"], do = ["OUT MI2"] },
  { when = ["$On"], do = ["OUT C7"] },
]
[[program]]
name = "Drain"
autostart = true
[[program.stage]]
name = "Open"
rung = [ { when = ["X9"], do = ["JMP Closed"] } ]
[[program.stage]]
name = "Closed"
rung = [ { when = ["$On"], do = ["OUT Y5"] } ]
[[task]]
name = "Often"
rung = [ { when = ["$On"], do = ["OUT C9"] } ]
"#;

pub fn live() -> Live {
    Live::scanning(LADDER)
}

#[test]
fn reading_a_range_reads_all_its_elements() {
    let live = live();
    assert_eq!(
        live.ok("read D0..D2 Y0..Y1"),
        "\
D0    D0  0
size  D1  12
D2    D2  0
lamp  Y0  OFF
Y1    Y1  OFF
"
    );
    assert_eq!(live.ok("read CT0..CT1").lines().count(), 10);
    assert_eq!(live.ok("read --json eye..X2").matches("\"operand\"").count(), 3);
    for (asked, words) in [
        ("read D5..D2", "a range goes from low to high (write `D2..D5`)"),
        ("read D0..X5", "one memory block, not in D and X"),
        (
            "read D0..D256",
            "`D0..D256` has more than 256 operands, and one request reads at most 256",
        ),
        ("read CT0..CT99", "at most 256"),
        ("read X0..X99999", "beyond memory"),
        ("read jam..", "`jam..` is no range (write both ends"),
        ("read D0-D5", "`D0-D5` is no range (write `D0..D5`)"),
        ("read D0,D5", "(write `D0..D5` for all of them; or `D0` and `D5`, each on its own)"),
        ("write D0..D5 1", "`D0..D5` is a range: name one element of it"),
        ("force X0..X5 ON", "`X0..X5` is a range: name one element of it"),
    ] {
        let said = live.say(asked);
        assert!(said.code != 0 && said.err.contains(words), "{asked}: {said:?}");
    }
}

#[test]
fn operands_are_read_by_tag_and_by_address() {
    let live = live();
    assert_eq!(
        live.ok("read jam D1 parts.Acc"),
        "\
jam        C0       OFF
size       D1       12
parts.Acc  CT0.Acc  0
"
    );
    assert!(live.ok("read parts").contains("parts.Done    CT0.Done    OFF\n"));
    let json = live.say("read --json size Drain.Open").json();
    assert_eq!(json["mode"], "RUN");
    let size = &json["values"][0];
    assert_eq!(
        (&size["tag"], &size["address"], &size["value"]),
        (&"size".into(), &"D1".into(), &12.into())
    );
    assert_eq!(
        (&json["values"][1]["address"], &json["values"][1]["value"]),
        (&"Drain.Open".into(), &true.into())
    );
}

#[test]
fn a_write_is_applied_before_a_scan_and_logged_with_user_and_value() {
    let live = live();
    assert_eq!(live.ok("write size 24"), "size (D1): 24, was 12\n");
    let line = live.line("wrote 24 to size (D1)");
    let field = |name: &str| line[name].clone();
    assert_eq!((field("event"), field("level")), ("operator-write".into(), "INFO".into()));
    assert_eq!((field("what"), field("address")), ("size".into(), "D1".into()));
    assert_eq!((field("before"), field("after")), ("12".into(), "24".into()));
    let uid = Command::new("id").arg("-u").output().unwrap().stdout;
    assert_eq!(field("uid").to_string(), String::from_utf8(uid).unwrap().trim());
    assert!(field("who").is_string() && field("pid").is_u64(), "{line}");
    assert_eq!(live.ok("write jam on"), "jam (C0): ON, was OFF\n");
    live.await_values("lamp", "ON");
    assert_eq!(live.ok("write D5 -7"), "D5: -7, was 0\n");
    assert_eq!(live.ok("write T0.Acc 1m30s"), "T0.Acc: 90000, was 0\n");
    let json = live.say("write --json size 30").json();
    assert_eq!((&json["before"], &json["now"]["value"]), (&24.into(), &30.into()));
}

#[test]
fn a_write_without_lasting_effect_reports_the_reason() {
    let live = live();
    let said = live.say("write C7 off");
    assert_eq!(said.code, 0);
    assert!(said.err.contains("but the same scan overwrote it: `rungd why C7` names"), "{said:?}");
    live.ok("force size 9");
    let said = live.say("write size 10");
    assert_eq!(said.code, 1);
    assert!(said.err.contains("`size` is forced to 9"), "{said:?}");
}

#[test]
fn a_command_that_the_ladder_resets_is_told_as_taken_and_never_to_be_forced() {
    let take = "{ when = [\"C20\"], do = [\"RST C20\", \"OUT C21\"] },\n  { when = [\"jam\"]";
    let live = Live::scanning(&LADDER.replace("{ when = [\"jam\"]", take));
    let said = live.say("write C20 on");
    assert_eq!((said.code, said.out.as_str()), (0, "C20: OFF, was OFF\n"), "{said:?}");
    let taken = "note: taken: it became ON, and the ladder has turned it OFF again\n";
    assert_eq!(said.err, taken);
    assert_eq!(live.say("write --json C20 on").json()["taken"], true);
    let json = live.say("write --json C7 off").json();
    assert!(json.get("taken").is_none(), "{json}");
    assert!(!json["note"].as_str().unwrap().contains("force"), "{json}");
}

#[test]
fn impossible_commands_are_refused_with_a_reason_and_an_exit_code() {
    let live = live();
    for (command, code, words) in [
        ("read nothing_of_that_name", 2, "the shell completes them after `rungd completions`"),
        ("read siez", 2, "did you mean `size`"),
        ("write parts 3", 2, "name a member"),
        ("write size 501", 2, "`size` takes 1 to 500, not 501"),
        ("force size 0", 2, "`size` takes 1 to 500, not 0"),
        ("write jam 2", 2, "takes ON or OFF"),
        ("write size ON", 2, "takes a whole number"),
        ("write R0 1,5", 2, "a decimal comma in a number: write `1.5`"),
        ("force R0 1,5", 2, "a decimal comma in a number: write `1.5`"),
        ("write T0.Acc 1,5s", 2, "write `1s500ms`"),
        ("write $FirstScan on", 2, "it shows the state of the controller"),
        ("write parts.Done on", 2, "it can be forced"),
        ("write Drain.Open on", 2, "switched by the ladder"),
        ("force Drain.Running on", 2, "started and stopped by the ladder"),
        ("mode walk", 2, "possible values: run, stop"),
        ("unforce", 2, "`--all`"),
    ] {
        let said = live.say(command);
        assert!(said.code == code && said.err.contains(words), "{command}: {said:?}");
    }
    let refused = live.line("operator's command refused");
    assert_eq!(
        (&refused["event"], &refused["level"]),
        (&"operator-refused".into(), &"WARN".into())
    );
    let json = live.say("write --json size 501").json();
    assert_eq!(json["error"]["kind"], "bad-value");
}

#[test]
fn a_force_is_visible_to_modbus_in_forces_active_and_in_status() {
    let listen = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let controller =
        format!("[operator]\nsocket = \"s\"\n[modbus-server]\nlisten = \"{listen}\"\n");
    let live = Live::start(LADDER, &controller, &[]);
    let mut modbus = std::net::TcpStream::connect(listen).unwrap();
    let mut inputs = || {
        use std::io::{Read, Write};
        modbus.write_all(&[0, 1, 0, 0, 0, 6, 1, 2, 0, 0, 0, 2]).unwrap();
        let mut reply = [0; 10];
        modbus.read_exact(&mut reply).unwrap();
        reply[9]
    };
    assert_eq!(inputs(), 0);
    assert_eq!(live.ok("force MI1 on"), "MI1: ON, forced, was OFF\n");
    live.await_values("$ForcesActive MI2", "ON ON");
    assert_eq!(inputs(), 0b11);
    let status = live.say("status --json").json();
    assert_eq!(status["forces"][0]["address"], "MI1");
    assert_eq!(status["devices"]["modbus"]["clients"], 1);
    assert!(live.ok("read MI1").ends_with("ON  forced\n"));
    assert_eq!(live.line("forced MI1 to ON")["event"], "operator-force");
    assert_eq!(live.ok("unforce MI1"), "MI1: not forced, ON, was ON, forced\n");
    live.await_values("$ForcesActive MI2", "OFF OFF");
    assert_eq!(inputs(), 0b01, "it stays as it was until something writes it");
    assert_eq!(live.line("ended the force of MI1")["event"], "operator-unforce");
    live.ok("force jam on");
    live.ok("force parts.Acc 7");
    live.ok("force eye on");
    assert!(live.ok("unforce --all").starts_with("3 not forced any more:\n"));
    assert_eq!(live.ok("unforce --all"), "nothing was forced\n");
    assert!(live.say("unforce jam").err.contains("it was not forced; nothing is forced"));
}

#[test]
fn a_driver_does_not_change_a_forced_input() {
    let rule = "[operator]\nsocket = \"s\"\n[[simulated-device]]\ninput = \"eye\"\npulse = \"20ms\"\nevery = \"40ms\"\n";
    let live = Live::start(LADDER, rule, &[]);
    assert!(live.say("write eye on").err.contains("the simulated device moves `eye`"));
    live.ok("force eye off");
    let held = live.ok("read parts.Acc");
    let out = live.ok("watch eye parts.Acc --interval 50ms --count 6");
    assert!(out.lines().all(|line| line.contains(" eye=OFF,forced ")), "{out}");
    let last = out.lines().last().unwrap().rsplit('=').next().unwrap();
    assert!(held.trim_end().ends_with(last), "nothing was counted: {held} {out}");
    let status = live.ok("status");
    assert!(status.contains("simulated device: 1 rules"), "{status}");
}

#[test]
fn watch_prints_one_line_per_interval_without_a_terminal() {
    let live = live();
    let out = live.ok("watch jam size --count 3 --interval 50ms");
    assert_eq!(out.lines().count(), 3);
    assert!(
        out.lines().all(|line| line.starts_with("RUN scan=") && line.ends_with(" jam=OFF size=12"))
    );
    let out = live.ok("watch --json jam --count 2 --interval 50ms");
    assert!(out.lines().all(|line| line.starts_with("{\"mode\":\"RUN\"")), "{out}");
}

#[test]
fn status_shows_every_part() {
    let live = live();
    let text = live.ok("status");
    for words in [
        "rungd 0.",
        "ladder      bottling: 3 blocks, 7 rungs",
        "mode        RUN for",
        "every 10ms",
        "controller  ",
        "alarms      none",
        "posture     timer slack 1 ns: granted",
        "execution   last",
        "lateness    last",
        "Program Main: running",
        "Program Drain: running; Stages ON: Open",
        "Task Often: not running",
        "forces      none",
        "devices     none",
        "from info on; 0 lines and 0 records dropped",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let at = |words: &str| text.find(words).unwrap();
    let asked = ["mode  ", "ladder  ", "alarms  ", "forces  ", "devices  ", "scan  ", "log  "];
    assert!(asked.is_sorted_by_key(|words| at(words)), "what is asked first comes first: {text}");
    assert!(!text.contains(" us  #") && live.ok("status --histogram").contains(" us  #"));
    live.ok("force jam on");
    live.await_values("lamp", "ON");
    let alarm = "alarms      jam: Bottles jammed (medium, not acknowledged)\n";
    assert!(live.ok("status").contains(alarm));
    live.ok("unforce jam");
    let json = live.say("status --json").json();
    assert_eq!((&json["mode"], &json["period_us"]), (&"RUN".into(), &10_000.into()));
    let bars = json["scan"]["execution"]["histogram"].as_array().unwrap();
    let counted: u64 = bars.iter().map(|bar| bar["count"].as_u64().unwrap()).sum();
    assert!(counted > 0 && counted.abs_diff(json["scan"]["scans"].as_u64().unwrap()) <= 1);
    assert_eq!(live.say("status --require-run").code, 0);
    live.ok("mode stop");
    assert_eq!(live.say("status --require-run").code, 1);
    assert!(live.ok("status").contains("STOP (an operator requested it) for"));
}

#[test]
fn a_change_of_the_log_level_is_logged_with_its_user() {
    let live = live();
    assert_eq!(live.ok("log-level warn"), "warn, was info\n");
    assert_eq!(live.line("set the log's level to warn, was info")["event"], "operator-log-level");
    live.ok("write size 33");
    live.say("write size 0");
    let next = live.line("operator's command refused");
    assert_eq!(next["level"], "WARN");
    assert_eq!(live.say("log-level --json debug").json()["before"], "warn");
    live.line("set the log's level to debug, was warn");
    live.ok("read size");
    live.line("operator's client connected");
}

#[test]
fn control_characters_in_texts_of_a_ladder_are_escaped() {
    let text = "Bottles \\u001b[2J\\u009b1mjammed\\u202e";
    let live = Live::start(&LADDER.replace("Bottles jammed", text), "", &[]);
    live.ok("force jam on");
    live.await_values("lamp", "ON");
    let mut complete = live.command("");
    complete.env("COMPLETE", "fish").args(["--", "rungd", "force", "j"]);
    let shown = [live.ok("status"), live.ok("status --json"), said(&mut complete).out];
    for text in &shown {
        assert!(text.contains("jammed"), "{text}");
        assert!(!text.contains(['\u{1b}', '\u{9b}', '\u{202e}']), "{text:?}");
    }
    assert!(shown[0].contains("Bottles \\u{1b}[2J\\u{9b}1mjammed\\u{202e}"), "{}", shown[0]);
}

#[test]
fn line_breaks_in_texts_of_a_ladder_add_no_line_to_an_answer() {
    let text = "jammed\\n  mode        RUN for 1h";
    let live = Live::start(
        &LADDER.replace("Bottles jammed", text).replace("\"bottling\"", "\"a\\nb\""),
        "",
        &[],
    );
    live.ok("force jam on");
    live.await_values("lamp", "ON");
    live.ok("mode stop");
    let status = live.ok("status");
    let modes = status.lines().filter(|line| line.starts_with("  mode")).count();
    assert!(modes == 1 && status.contains("jam: jammed\\u{a}  mode "), "{status}");
    let mut ladder = std::fs::read_to_string(live.folder.join("ladder.toml")).unwrap();
    ladder.push_str("# edited\n");
    std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
    let reloaded = live.ok("reload");
    assert!(reloaded.contains("`a\\u{a}b` is loaded"), "{reloaded}");
}

#[test]
fn the_shell_completes_tags_and_addresses_of_the_running_ladder() {
    let live = live();
    let complete = |words: &str| {
        let mut command = live.command("");
        command.env("COMPLETE", "fish").arg("--").args(words.split(' '));
        said(&mut command).out
    };
    assert!(complete("rungd read si").contains("size"), "{}", complete("rungd read si"));
    let members = complete("rungd write parts.");
    assert!(members.contains("parts.Acc") && members.contains("parts.Done"), "{members}");
    assert!(complete("rungd write jam=ON si").contains("size="), "further values of a change");
    assert!(complete("rungd force j").contains("Bottles jammed"));
    assert!(complete("rungd mode r").contains("run"));
}

#[test]
fn the_requests_of_the_page_are_answered() {
    let ladder = LADDER.replace("size  =", "bin_size = { at = \"D2\" }\nsize  =");
    let keeps = "[retain]\nranges = [\"D2\"]\ncold-start = \"run\"\n";
    let live = Live::start(&ladder, keeps, &[]);
    live.await_values("C7", "ON");
    let page = include_str!("../../docs/operator.md");
    let lines = page.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    let mut stream = live.connect();
    // Makes a program to go back to: any changed byte makes a different program.
    std::fs::write(live.folder.join("ladder.toml"), format!("{ladder}\n# edited\n")).unwrap();
    ask(&mut stream, r#"{"do":"reload","dry_run":false}"#);
    for line in lines.lines() {
        let answer = ask(&mut stream, line);
        assert!(answer["ok"].is_object(), "{line}: {answer}");
    }
}

#[test]
fn any_program_can_send_requests_to_the_socket() {
    let live = live();
    let mut stream = live.connect();
    let answer = ask(&mut stream, r#"{"do":"read","operands":["size"]}"#);
    assert_eq!(answer["ok"]["values"][0]["value"], 12);
    let answer = ask(&mut stream, r#"{"do":"write","operand":"size","value":13}"#);
    assert_eq!(answer["ok"]["now"]["value"], 13);
    let answer = ask(&mut stream, r#"{"do":"force","operand":"lamp","value":true}"#);
    assert_eq!(answer["ok"]["now"]["forced"], true);
    let answer = ask(&mut stream, r#"{"do":"dance"}"#);
    assert_eq!(answer["error"]["kind"], "bad-request");
    assert_eq!(ask(&mut stream, r#"{"do":"status"}"#)["ok"]["protocol"], 1);
    let answer =
        ask(&mut stream, &format!(r#"{{"do":"read","operands":[{}"X0"]}}"#, "\"D0\",".repeat(256)));
    assert!(answer["error"]["message"].as_str().unwrap().contains("at most 256"), "{answer}");
}

const DASHES: &str = r#"
[ladder]
devices = ["line-1"]
[[program]]
name = "Main"
rung = [ { when = ["drain-pump.Running"], do = ["OUT Y0"] } ]
[[program]]
name = "drain-pump"
autostart = true
[[program.stage]]
name = "half-open"
rung = [ { when = ["line-1.Ok"], do = ["OUT Y1"] } ]
"#;

const DASHED_DEVICE: &str = "[[device]]\nname = \"line-1\"\ndriver = \"modbus-tcp\"\naddress = \
                             \"127.0.0.1:1\"\nmap = [ { from = \"discrete 0..3\", to = \"X0..X3\" } ]\n";

#[test]
fn a_name_with_a_dash_is_an_operand_and_not_a_range() {
    let live = Live::start(DASHES, DASHED_DEVICE, &[]);
    live.await_values("drain-pump.Running drain-pump.half-open Y0", "ON ON ON");
    assert_eq!(
        live.ok("watch drain-pump.Running --count 1").split(' ').next_back(),
        Some("drain-pump.Running=ON\n")
    );
    assert!(live.ok("force line-1.Ok ON").starts_with("line-1.Ok: ON, forced"));
    live.await_values("line-1.Ok Y1", "ON ON");
    assert!(live.ok("unforce line-1.Ok").starts_with("line-1.Ok: not forced"));
    for (asked, words) in [
        ("write drain-pump.Running ON", "a block is started and stopped by the ladder"),
        ("write drain-pump 1", "`drain-pump` is a block: `drain-pump.Running` is its bit"),
        (
            "read drain-pmup.Running",
            "nothing is called `drain-pmup` (did you mean `drain-pump.Running`?)",
        ),
        ("force drain-pump.half-opne ON", "has no stage `half-opne`"),
        ("read D0-D5", "`D0-D5` is no range (write `D0..D5`)"),
        ("force D0-D5 1", "`D0-D5` is a range: name one element of it"),
    ] {
        let said = live.say(asked);
        assert!(said.code == 2 && said.err.contains(words), "{asked}: {said:?}");
    }
    assert_eq!(live.ok("read D0..D1").lines().count(), 2);
    let names = ask(&mut live.connect(), r#"{"do":"names","prefix":"drain-pump."}"#);
    let names = names["ok"]["names"].as_array().unwrap();
    let names: Vec<_> = names.iter().filter_map(|name| name["name"].as_str()).collect();
    assert_eq!(names, ["drain-pump.Running", "drain-pump.half-open"]);
}

#[test]
fn forces_are_shown_and_released_by_the_present_names_of_their_addresses() {
    let live = live();
    live.ok("force size 20");
    let reload = |from: &str, to: &str| {
        std::fs::write(live.folder.join("ladder.toml"), LADDER.replace(from, to)).unwrap();
        live.ok("reload")
    };
    let forces = || {
        let status = live.say("status --json").json();
        let names = status["forces"].as_array().unwrap().iter().map(|force| {
            (
                force["tag"].as_str().map(str::to_owned),
                force["address"].as_str().unwrap().to_owned(),
            )
        });
        names.collect::<Vec<_>>()
    };
    let is = |tag: Option<&str>| vec![(tag.map(str::to_owned), "D1".to_owned())];

    let said = reload("size  = { at = \"D1\"", "size  = { at = \"D2\"");
    assert!(said.contains("the force stays on D1; size (D2) is not forced"), "{said}");
    assert_eq!(forces(), is(None));
    let said = live.say("unforce size");
    assert_eq!(said.out, "size (D2): not forced, 12, was 12\n");
    let note = "it was not forced; D1 is forced; it was called `size` when it was forced: \
                `rungd unforce D1`";
    assert!(said.err.contains(note), "{said:?}");

    let said = reload("size", "width");
    assert!(said.contains("width (D1) is new: 12, but stays 20 (forced)"), "{said}");
    assert_eq!(forces(), is(Some("width")));
    let said = reload("size", "girth");
    assert!(said.contains("tag width (D1) was renamed to girth; the force stays on it"), "{said}");
    assert_eq!(forces(), is(Some("girth")));
    let said = live.say("unforce width");
    assert!(said.err.contains("nothing is called `width`"), "{said:?}");
    assert!(said.err.contains("forced now: girth (D1) (`rungd unforce --all`"), "{said:?}");
    let said = live.say("unforce size");
    assert!(said.code == 2 && said.err.contains("nothing is called `size`"), "{said:?}");
    let note = "D1 is forced; it was called `size` when it was forced: `rungd unforce D1`";
    assert!(said.err.contains(note), "{said:?}");
    let without = LADDER.replace("preset=size", "preset=12");
    let without: String = without
        .lines()
        .filter(|line| !line.starts_with("size "))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(live.folder.join("ladder.toml"), without).unwrap();
    let said = live.ok("reload");
    assert!(said.contains("tag girth is gone; the force stays on D1"), "{said}");
    assert_eq!(forces(), is(None));
    assert_eq!(live.ok("unforce D1"), "D1: not forced, 20, was 20, forced\n");
    assert_eq!(forces(), []);
}
