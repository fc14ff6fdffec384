//! `rungd shelve` and `rungd unshelve`, with the real binary: lists, refusals, the log, the ends of
//! shelves, restarts and power cuts, reloads, a file that is damaged or cannot be written.

use std::fs;

use serde_json::Value;

use rungd_test_support::running::live::{Live, Said, ask, run, said};

const LADDER: &str = r#"
[tags]
low    = { at = "C0", alarm = "Oil is low" }
stuck  = { at = "C1", alarm = "Gate is stuck", group = "Gate" }
fire   = { at = "C2", alarm = "Fire", priority = "critical" }
always = { at = "X0", initial = true }
worn   = { at = "C3", alarm = "Belt is worn" }
[[program]]
name = "Main"
rung = [
  { when = ["always"], do = ["OUT worn"] },
  { when = ["low | stuck | fire"], do = ["OUT Y0"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

/// The list in short: `worn acknowledged`, `low shelved`.
fn listed(live: &Live) -> Vec<String> {
    let list = live.say("alarms --json").json();
    let one = |alarm: &Value| {
        let shelf = &alarm["shelved"];
        let state = match (shelf.is_null(), shelf["until_ns"].is_null()) {
            (true, _) => alarm["state"].as_str().expect("a state"),
            (false, false) => "shelved",
            (false, true) => "out",
        };
        format!("{} {state}", alarm["tag"].as_str().expect("a tag"))
    };
    list["alarms"].as_array().expect("a list").iter().map(one).collect()
}

/// `rungd shelve` with a reason.
fn shelve(live: &Live, words: &str, why: &str) -> Said {
    said(live.command(&format!("shelve {words}")).args(["--why", why]))
}

#[test]
fn a_shelved_alarm_stays_in_the_list_with_who_and_why_until_it_is_brought_back() {
    let live = Live::scanning(LADDER);
    live.ok("ack worn");
    live.ok("write low on");
    let said = shelve(&live, "low stuck --for 8h", "Filter is changed");
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.out.starts_with("low (Oil is low): shelved until "), "{}", said.out);
    assert_eq!(shelve(&live, "worn --out-of-service", "New belt on Friday").code, 0);
    assert_eq!(listed(&live), ["low shelved", "stuck shelved", "worn out"]);
    let page = live.ok("alarms");
    assert!(page.starts_with("no active alarm, 2 shelved, 1 out of service\n"), "{page}");
    assert!(page.contains("medium, Gate, SHELVED by "), "{page}");
    assert!(page.contains(": Filter is changed; now ON, since "), "{page}");
    assert!(page.contains(": New belt on Friday; now ON, since "), "{page}");
    let status = live.ok("status");
    assert!(status.contains("low: Oil is low (medium, shelved)"), "{status}");
    assert!(status.contains("worn: Belt is worn (medium, out of service)"), "{status}");
    assert_eq!(live.ok("ack --all"), "no alarm waits for an acknowledgement\n");
    assert!(live.ok("ack low").contains("it is shelved: there is nothing to acknowledge"));
    assert!(live.ok("unshelve low").contains("back from its shelf; it stands"));
    assert!(live.ok("unshelve worn stuck").contains("worn (Belt is worn): back in service"));
    assert!(live.ok("unshelve stuck").contains("it was not shelved"));
    assert_eq!(listed(&live), ["low unacknowledged", "worn unacknowledged"]);
    let [shelved, out, back] =
        live.lines(["shelved alarm low for 8h00m", "took alarm worn out of service", "brought"]);
    assert_eq!((&shelved["why"], &out["tag"]), (&"Filter is changed".into(), &"worn".into()));
    assert_eq!((&back["event"], &back["tag"]), (&"operator-unshelve".into(), &"low".into()));
}

#[test]
fn critical_alarms_wrong_times_and_reasons_are_refused_and_nothing_is_shelved() {
    let live = Live::scanning(LADDER);
    live.ok("ack worn");
    let critical = shelve(&live, "low fire --for 1h", "Test");
    assert!(critical.code == 1 && critical.err.contains("shelve-critical = true"), "{critical:?}");
    for (words, why) in [
        ("low --for 169h", "Test"),
        ("low --for 0s", "Test"),
        ("low --for soon", "Test"),
        ("low", "Test"),
        ("low --for 1h --out-of-service", "Test"),
        ("low --for 1h", ""),
        ("low --for 1h", "two\nlines"),
        ("low --for 1h", "\u{1b}[2J"),
        ("low --for 1h", &"x".repeat(201)),
        ("no_such --for 1h", "Test"),
        ("C7 --for 1h", "Test"),
    ] {
        let refused = shelve(&live, words, why);
        assert!([1, 2].contains(&refused.code), "{words} {why:?}: {refused:?}");
    }
    assert_eq!(listed(&live), ["worn acknowledged"]);
}

#[test]
fn a_shelf_ends_by_itself_and_the_alarm_has_to_be_acknowledged() {
    let live = Live::scanning(LADDER);
    live.ok("ack worn");
    assert_eq!(shelve(&live, "worn --for 1ms", "Short").code, 0);
    let line = live.line("alarm worn is no longer shelved: its time is over");
    assert_eq!(line["event"], "alarm-unshelved");
    assert_eq!(listed(&live), ["worn unacknowledged"]);
}

#[test]
fn the_shell_completes_what_each_command_can_do_with_an_alarm() {
    let live = Live::scanning(LADDER);
    live.ok("write low on");
    live.ok("write stuck on");
    live.ok("ack worn");
    assert_eq!(shelve(&live, "stuck --for 8h", "Gate").code, 0);
    let completed = |words: &str| {
        let mut command = live.command("");
        command.env("COMPLETE", "fish").args(["--", "rungd"]).args(words.split(' ')).arg("");
        let out = said(&mut command).out;
        let named = out.lines().filter(|line| line.contains('\t') && !line.starts_with('-'));
        let mut tags: Vec<String> =
            named.filter_map(|line| line.split('\t').next().map(str::to_owned)).collect();
        tags.sort();
        tags
    };
    assert_eq!(completed("ack"), ["low"], "nobody acknowledges a shelved one");
    assert_eq!(completed("shelve"), ["low", "worn"], "also one that is acknowledged");
    assert_eq!(completed("unshelve"), ["stuck"]);
}

/// A controller after the end of another one in the same folder.
fn again(live: &Live) -> Live {
    let again = Live::of(live.folder.clone(), run(&live.folder, &[]));
    again.await_values("C7", "ON");
    again
}

#[test]
fn a_power_cut_and_a_restart_keep_shelves_and_acknowledgements() {
    let mut live = Live::scanning(LADDER);
    live.ok("ack worn");
    assert_eq!(shelve(&live, "low --for 8h", "Filter").code, 0);
    assert_eq!(shelve(&live, "stuck --out-of-service", "No gate yet").code, 0);
    let expected = ["worn acknowledged", "low shelved", "stuck out"];
    assert_eq!(listed(&live), expected);
    live.signal("KILL");
    live.child.wait().expect("it ends");
    let mut second = again(&live);
    assert_eq!(listed(&second), expected);
    second.end();
    let mut third = again(&live);
    assert_eq!(listed(&third), expected);
    third.ok("unshelve low stuck");
    third.end();
    let fourth = again(&live);
    assert_eq!(listed(&fourth), ["worn acknowledged"]);
}

#[test]
fn a_restart_without_a_shelved_alarm_says_so_and_leaves_its_unknown_text_out() {
    let mut live = Live::scanning(LADDER);
    assert_eq!(shelve(&live, "stuck --for 8h", "No gate").code, 0);
    live.end();
    let without = LADDER.replace("alarm = \"Gate is stuck\", group = \"Gate\"", "spare = true");
    fs::write(live.folder.join("ladder.toml"), without).expect("written");
    let next = again(&live);
    let line = next.line("alarm stuck is no longer shelved: the program does not have it");
    let message = line["message"].as_str().expect("a message");
    assert!(message.ends_with(" ago: No gate"), "{message}");
}

#[test]
fn a_damaged_file_is_renamed_and_every_alarm_is_there() {
    let mut live = Live::scanning(LADDER);
    live.ok("ack worn");
    assert_eq!(shelve(&live, "worn --for 8h", "Belt").code, 0);
    live.signal("KILL");
    live.child.wait().expect("it ends");
    let file = live.folder.join("controller.alarms");
    let whole = fs::read(&file).expect("it is there");
    for (at, damage) in
        [b"{\"format\":1,".to_vec(), vec![0; 5000], whole[..40].to_vec()].into_iter().enumerate()
    {
        fs::write(&file, &damage).expect("written");
        let mut next = Live::of(live.folder.clone(), run(&live.folder, &[]));
        next.await_values("C7", "ON");
        assert_eq!(listed(&next), ["worn unacknowledged"]);
        let aside = live.folder.join(format!("controller.alarms.aside-{}", at + 1));
        assert_eq!(fs::read(&aside).expect("it is kept"), damage);
        next.signal("KILL");
        next.child.wait().expect("it ends");
        // Its end would remove the folder.
        std::mem::forget(next);
    }
}

#[test]
fn a_shelf_that_cannot_be_written_is_told() {
    let live = Live::scanning(LADDER);
    fs::create_dir(live.folder.join("controller.alarms")).expect("a folder");
    let told = shelve(&live, "low --for 1h", "Test");
    assert_eq!(told.code, 74, "{told:?}");
    assert!(told.err.contains("a restart of rungd would forget it"), "{told:?}");
    assert_eq!(listed(&live), ["worn unacknowledged", "low shelved"]);
    assert_eq!(live.line("a restart would forget shelves")["event"], "alarm-file");
}

#[test]
fn a_reload_keeps_shelves_but_of_alarms_that_are_gone_or_critical() {
    let live = Live::start(LADDER, "[alarms]\nshelve-critical = true\n", &[]);
    live.await_values("C7", "ON");
    live.ok("ack worn");
    assert_eq!(shelve(&live, "fire low stuck --out-of-service", "Test").code, 0);
    let without = LADDER.replace("alarm = \"Gate is stuck\", group = \"Gate\"", "spare = true");
    fs::write(live.folder.join("ladder.toml"), without).expect("written");
    live.ok("reload");
    live.line("alarm stuck is no longer out of service: the program does not have it");
    assert_eq!(listed(&live), ["worn acknowledged", "low out", "fire out"]);
    let file = live.folder.join("controller.toml");
    let controller = fs::read_to_string(&file).expect("it is there");
    fs::write(&file, controller.replace("critical = true", "critical = false")).expect("written");
    let said = live.ok("reload");
    assert!(said.contains("`[alarms] shelve-critical` true → false"), "{said}");
    live.line("alarm fire is no longer out of service: it is critical");
    assert_eq!(listed(&live), ["worn acknowledged", "low out"]);
}

#[test]
fn a_shelf_of_a_user_of_pages_names_both() {
    let live = Live::scanning(LADDER);
    let mut stream = live.connect();
    let line = r#"{"do":"shelve","alarms":["low"],"for_ms":60000,"why":"Test","for_user":"anna"}"#;
    let answer = ask(&mut stream, line);
    let who = answer["ok"]["alarms"][0]["after"]["who"].as_str().expect("a name").to_owned();
    assert!(who.starts_with("anna by "), "{answer}");
    for wrong in [
        r#"{"do":"shelve","alarms":["low"],"for_ms":0,"why":"Test"}"#,
        r#"{"do":"shelve","alarms":["low"],"for_ms":18446744073709551615,"why":"Test"}"#,
        r#"{"do":"shelve","alarms":["low"],"for_ms":60000,"why":"a\u0007b"}"#,
        r#"{"do":"shelve","alarms":["low"],"for_ms":60000}"#,
        r#"{"do":"unshelve","alarms":["nothing"]}"#,
    ] {
        let answer = ask(&mut stream, wrong);
        assert!(answer["error"].is_object(), "{wrong}: {answer}");
    }
}
