//! `rungd alarms` and `rungd ack`, with the real binary at both ends of the socket: first-out
//! order, acknowledgements and their lines in the log, explanations, reloads, permissions.

use std::os::unix::process::CommandExt;
use std::process::Command;

use serde_json::Value;

use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{Live, said};

const LADDER: &str = r#"
[tags]
# A consequence, declared before its cause.
hot    = { at = "C1", alarm = "Oil is hot", priority = "critical" }
low    = { at = "C0", alarm = "Oil is low", priority = "low" }
stuck  = { at = "C2", alarm = "Gate is stuck" }
plain  = { at = "C3" }
[[template]]
name = "Pump"
rung = [ { when = ["answer"], do = ["OUT failed"] } ]
[template.parameters]
answer = { type = "contact" }
[template.tags]
failed = { type = "bit", alarm = "{name}: no answer", priority = "high" }
[[program]]
name = "Main"
rung = [
  { use = "Pump", name = "p1", with = { answer = "X1" } },
  { use = "Pump", name = "p2", with = { answer = "X2" } },
  { when = ["X5"], do = ["OUT low"] },
  { when = ["low", "!X6"], do = ["OUT hot"] },
  { when = ["stuck", "plain"], do = ["OUT Y0"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

fn live() -> Live {
    Live::scanning(LADDER)
}

/// The list in short: `p1.failed 1 unacknowledged`.
fn short(list: &Value) -> Vec<String> {
    let one = |alarm: &Value| {
        let word = |key: &str| alarm[key].as_str().expect("a word").to_owned();
        format!("{} {} {}", word("tag"), alarm["order"], word("state"))
    };
    list["alarms"].as_array().expect("a list").iter().map(one).collect()
}

fn listed(live: &Live) -> Vec<String> {
    short(&live.say("alarms --json").json())
}

#[test]
fn alarms_are_listed_in_the_order_in_which_they_rose() {
    let live = live();
    let none = "no active alarm, and none waits for an acknowledgement\n";
    assert_eq!(live.ok("alarms"), none);
    assert_eq!(live.ok("ack --all"), "no alarm waits for an acknowledgement\n");
    live.ok("write X2 on");
    live.ok("write stuck on");
    live.ok("write X1 on");
    live.ok("write X2 off");
    let all = ["stuck 2 unacknowledged", "p1.failed 3 unacknowledged", "p2.failed 1 returned"];
    assert_eq!(listed(&live), all);
    let json = live.say("alarms --json").json();
    let (stuck, failed, gone) = (&json["alarms"][0], &json["alarms"][1], &json["alarms"][2]);
    assert_eq!((&stuck["priority"], &failed["priority"]), (&"medium".into(), &"high".into()));
    assert_eq!((&failed["text"], &failed["day"]), (&"p1: no answer".into(), &1.into()));
    let scan = |of: &Value| of["scan"].as_u64().expect("a scan");
    assert!(scan(&stuck["since"]) < scan(&failed["since"]) && stuck["ended"].is_null());
    assert!(scan(&gone["since"]) < scan(&gone["ended"]));
    assert!(gone["since"]["unix_ns"].as_i64() < gone["ended"]["unix_ns"].as_i64());
    let text = live.ok("alarms");
    for words in [
        "2 active alarms, 1 returned unacknowledged\n",
        "\n  2  stuck: Gate is stuck\n     medium, NOT ACKNOWLEDGED, since 2",
        "\n  3  p1.failed: p1: no answer\n     high, NOT ACKNOWLEDGED, since 2",
        "\n  -  p2.failed: p2: no answer\n     high, NOT ACKNOWLEDGED, from 2",
        "; 1 time in the last day\n",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(
        live.ok("ack p2.failed C2"),
        "p2.failed (p2: no answer): acknowledged; it went away before\n\
         stuck (Gate is stuck): acknowledged; it stands\n"
    );
    let line = live.line("acknowledged alarm p2.failed, which went away before: p2: no answer");
    assert_eq!((&line["before"], &line["after"]), (&"returned".into(), &"normal".into()));
    let line = live.line("acknowledged alarm stuck: Gate is stuck");
    assert_eq!((&line["event"], &line["tag"]), (&"operator-ack".into(), &"stuck".into()));
    assert_eq!(
        (&line["before"], &line["after"]),
        (&"unacknowledged".into(), &"acknowledged".into())
    );
    assert!(line["who"].is_string() && line["uid"].is_u64() && line["pid"].is_u64(), "{line}");
    assert_eq!(listed(&live), ["stuck 2 acknowledged", "p1.failed 3 unacknowledged"]);
    assert!(live.ok("alarms").contains("medium, acknowledged by "));
    assert_eq!(live.ok("ack stuck"), "stuck (Gate is stuck): acknowledged already; it stands\n");
    live.ok("write stuck off");
    assert_eq!(listed(&live), ["p1.failed 3 unacknowledged"], "nothing is left to acknowledge");
    assert!(live.ok("ack stuck").contains("it does not stand: there is nothing to acknowledge"));
    assert_eq!(live.ok("ack --all").lines().count(), 1);
    assert_eq!(listed(&live), ["p1.failed 3 acknowledged"]);
}

#[test]
fn status_shows_the_priority_and_the_acknowledging_user() {
    let live = live();
    live.ok("write X1 on");
    live.await_values("Y0 C7", "OFF ON");
    assert_eq!(listed(&live), ["p1.failed 1 unacknowledged"]);
    let line = "alarms      p1.failed: p1: no answer (high, not acknowledged)\n";
    assert!(live.ok("status").contains(line));
    live.ok("ack --all");
    let json = live.say("status --json").json();
    assert_eq!(short(&json), ["p1.failed 1 acknowledged"]);
    let alarm = &json["alarms"][0];
    assert_eq!((&alarm["priority"], &alarm["day"]), (&"high".into(), &1.into()));
    assert!(alarm["acknowledged"]["who"].is_string(), "{alarm}");
    assert!(live.ok("status").contains("p1: no answer (high, acknowledged)\n"));
}

#[test]
fn a_name_that_is_no_alarm_acknowledges_nothing() {
    let live = live();
    live.ok("write stuck on");
    for (asked, words) in [
        ("ack stuck plain", "`plain` is no alarm: an alarm is a bit whose tag has the key `alarm`"),
        ("ack stuck D0", "`D0` is no alarm"),
        ("ack stuk", "nothing is called `stuk`"),
        ("ack", "name the alarms to acknowledge, or give `--all`"),
    ] {
        let said = live.say(asked);
        assert!(said.code == 2 && said.err.contains(words), "{asked}: {said:?}");
    }
    let refused = live.say("ack --json plain").json();
    assert_eq!(refused["error"]["kind"], "bad-operand");
    assert_eq!(listed(&live), ["stuck 1 unacknowledged"]);
    let json = live.say("ack --json stuck").json();
    assert_eq!(json["alarms"][0]["after"], "acknowledged");
}

#[test]
fn each_listed_alarm_shows_its_cause() {
    let live = live();
    live.ok("write X5 on");
    live.await_values("hot", "ON");
    // The recording has the scan as soon as its thread has read it.
    let text = live.await_ok("alarms");
    assert_eq!(listed(&live), ["low 1 unacknowledged", "hot 2 unacknowledged"], "{text}");
    for words in ["OUT low turned it ON", "X5 is ON", "OUT hot turned it ON", "low (C0) is ON"] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn the_shell_completes_alarms_that_can_be_acknowledged() {
    let live = live();
    live.ok("write stuck on");
    live.ok("write X1 on");
    live.ok("write X5 on");
    live.ok("ack p1.failed");
    let completed = |word: &str| {
        let mut command = live.command("");
        command.env("COMPLETE", "fish").args(["--", "rungd", "ack", word]);
        let out = said(&mut command).out;
        out.lines().map(|line| line.replace('\t', ": ")).collect::<Vec<_>>()
    };
    assert_eq!(completed("st"), ["stuck: Gate is stuck"]);
    assert!(completed("p1").is_empty(), "it is acknowledged");
    assert!(completed("pl").is_empty(), "it is no alarm");
}

#[test]
fn an_alarm_keeps_its_state_by_name_over_a_reload() {
    let live = live();
    live.ok("write stuck on");
    live.ok("ack stuck");
    live.ok("write X1 on");
    assert_eq!(listed(&live), ["stuck 1 acknowledged", "p1.failed 2 unacknowledged"]);
    let new = LADDER
        .replace("[tags]\n", "[tags]\nfirst = { at = \"C9\", alarm = \"The first one\" }\n")
        .replace("Gate is stuck", "The gate is stuck");
    std::fs::write(live.folder.join("ladder.toml"), new).expect("the ladder");
    live.ok("reload");
    live.ok("write first on");
    let all = ["stuck 1 acknowledged", "p1.failed 2 unacknowledged", "first 3 unacknowledged"];
    assert_eq!(listed(&live), all);
    assert!(live.ok("alarms").contains("  1  stuck: The gate is stuck\n"));
    std::fs::write(live.folder.join("ladder.toml"), LADDER).expect("the ladder");
    live.ok("reload");
    assert_eq!(listed(&live), all[..2]);
}

/// An alarm's bit is OFF after the termination pass of a stop, unless the bit was SET or written.
#[test]
fn a_stop_ends_alarms_that_a_coil_drives() {
    let live = live();
    live.ok("write X1 on");
    live.ok("write stuck on");
    live.ok("mode stop");
    assert_eq!(listed(&live), ["stuck 2 unacknowledged", "p1.failed 1 returned"]);
    live.ok("force stuck off");
    assert_eq!(listed(&live), ["p1.failed 1 returned", "stuck 2 returned"]);
    assert_eq!(live.ok("ack --all").lines().count(), 2);
    assert!(listed(&live).is_empty());
}

/// Needs root, to become another user.
#[test]
fn a_view_only_user_sees_alarms_and_cannot_acknowledge() {
    let uid = Command::new("id").arg("-u").output().expect("id").stdout;
    if uid != b"0\n" {
        return skip(Need::Root, "only root becomes another user");
    }
    let operator = "[operator]\nsocket = \"s\"\nmode = \"0666\"\ngroup = \"4242\"\n";
    let live = Live::start(LADDER, operator, &[]);
    live.ok("write stuck on");
    let copy = live.folder.join("rungd");
    let words = [env!("CARGO_BIN_EXE_rungd").as_ref(), copy.as_os_str()];
    assert!(Command::new("cp").args(words).status().expect("cp").success());
    let as_nobody = |words: &str, gid: u32| {
        let mut command = Command::new(&copy);
        command.args(words.split_whitespace()).env("RUNGD_SOCKET", &live.socket);
        said(command.uid(65_534).gid(gid))
    };
    // Nobody reads a recording of files that are private now, or were so when they were loaded. The
    // second program has a comment less, which the recording still contains.
    let chmod = |rights: &str| {
        let mut chmod = Command::new("chmod");
        chmod.arg(rights).arg(live.folder.join("ladder.toml"));
        assert!(chmod.status().expect("chmod").success());
    };
    let sees = |gid: u32| as_nobody("why stuck", gid);
    let public = sees(65_534);
    assert_eq!(public.code, 0, "everybody may read the files: {public:?}");
    chmod("o-r");
    assert_eq!(sees(65_534).code, 77, "loaded as public, and private since then");
    live.ok("reload");
    assert_eq!(sees(65_534).code, 77, "a reload of the same files");
    let ladder = live.folder.join("ladder.toml");
    std::fs::write(&ladder, format!("# private\n{LADDER}")).expect("a ladder");
    live.ok("reload");
    std::fs::write(&ladder, LADDER).expect("a ladder");
    chmod("o+r");
    live.ok("reload");
    let refused = sees(65_534);
    assert!(refused.code == 77 && refused.err.contains("could read when they were"), "{refused:?}");
    assert_eq!(sees(4242).code, 0, "a member of the group");
    let list = as_nobody("alarms", 65_534);
    assert!(list.code == 0 && list.out.contains("  1  stuck: Gate is stuck\n"), "{list:?}");
    let refused = as_nobody("ack stuck", 65_534);
    assert!(refused.code == 77 && refused.err.contains("may only look"), "{refused:?}");
    assert_eq!(as_nobody("ack stuck", 4242).code, 0, "a member of the group");
    assert_eq!(live.line("acknowledged alarm stuck")["uid"], 65_534);
}
