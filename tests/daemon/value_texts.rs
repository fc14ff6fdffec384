//! Texts of values, with the real binary: shown beside the number wherever a person reads it, and
//! not where a program reads numbers.

use std::fs;

use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
[ladder]
name = "texts"
[tags]
step  = { at = "D1", min = 0, max = 3, texts = { 0 = "idle", 1 = "dosing", 2 = "mixing" }, log = "change" }
also  = { at = "D1" }
valve = { at = "Y0", texts = { 0 = "shut", 1 = "open" }, log = "change" }
speed = { type = "int", unit = "rpm", texts = { 0 = "standing still" } }
lanes = { type = "int", count = 2, texts = { 0 = "free", 1 = "taken" } }
plain = { at = "D9" }
[[program]]
name = "Main"
rung = [
  { when = ["step == 1", "also < 2"], do = ["OUT valve"] },
  { when = ["speed > 5", "lanes[0] > 0", "plain > 1"], do = ["OUT C5"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

fn live() -> Live {
    Live::scanning(LADDER)
}

#[test]
fn commands_show_the_text_of_a_value_beside_it() {
    let live = live();
    assert_eq!(
        live.ok("read step also D1 valve speed lanes plain"),
        "\
step      D1  0 (idle)
step      D1  0 (idle)
step      D1  0 (idle)
valve     Y0  OFF (shut)
speed         0 rpm (standing still)
lanes[0]      0 (free)
lanes[1]      0 (free)
plain     D9  0
"
    );
    assert_eq!(live.ok("write step 1"), "step (D1): 1 (dosing), was 0 (idle)\n");
    live.await_values("valve", "ON");
    assert_eq!(live.ok("write step 3"), "step (D1): 3, was 1 (dosing)\n", "3 has no text");
    let watched = live.ok("watch step valve speed --count 1");
    assert!(watched.ends_with(" step=3 valve=OFF(shut) speed=0rpm(standing_still)\n"), "{watched}");
    assert_eq!(
        live.ok("write step=2 plain=1"),
        "step (D1): 2 (mixing), was 3\nplain (D9): 1, was 0\n"
    );
    assert_eq!(live.ok("force valve on"), "valve (Y0): ON (open), forced, was OFF (shut)\n");
    assert!(live.say("write valve off").err.contains("`valve` is forced to ON (open)"));
    let status = live.ok("status");
    assert!(status.contains("valve  Y0  ON (open)  forced"), "{status}");
    live.ok("unforce valve");
    let json = live.say("read step valve plain --json").json();
    assert_eq!(
        (&json["values"][0]["value"], &json["values"][0]["text"]),
        (&2.into(), &"mixing".into())
    );
    assert!(json["values"][2].get("text").is_none(), "{json}");
    let json = live.say("write step 0 --json").json();
    assert_eq!((&json["before_text"], &json["now"]["text"]), (&"mixing".into(), &"idle".into()));
    let set = live.ok("read --file - step speed lanes");
    assert!(
        set.ends_with("step = 0  # idle\nspeed = 0  # rpm, standing still\nlanes = [0, 0]\n"),
        "{set}"
    );
}

#[test]
fn the_log_and_why_show_the_text_of_a_value() {
    let live = live();
    live.ok("write step 1");
    // The change, its scan and its command are logged by different threads.
    let [word, bit, _] = live.lines([
        "step is 1 (dosing), was 0 (idle)",
        "valve is ON (open)",
        "wrote 1 (dosing) to step (D1): it was 0 (idle), and is 1 (dosing)",
    ]);
    assert_eq!(
        (&word["from"], &word["to"], &bit["event"]),
        (&0.into(), &1.into(), &"tag-on".into())
    );
    let why = live.ok("why valve");
    assert!(why.contains("valve (Y0) is ON (open)") && why.contains("step = 1 (dosing)"), "{why}");
    let json = live.say("why valve --json").json();
    assert_eq!(json["operand"]["text"], "open");
    let change = live.ok("why step");
    assert!(change.contains("step (D1) is 1 (dosing)"), "{change}");
}

#[test]
fn a_failed_test_shows_the_text_of_a_value() {
    let live = live();
    let suite = "ladder = [\"ladder.toml\"]\n[[scenario]]\nname = \"doses\"\n\
                 steps = [\"set step 1\", \"run 2 scans\", \"expect: step == 2 & !valve\"]\n";
    let path = live.folder.join("texts.test.toml");
    fs::write(&path, suite).unwrap();
    let said = live.say(&format!("test {}", path.display()));
    assert!(said.code != 0, "{said:?}");
    assert!(said.out.contains("1 (dosing)") && said.out.contains("ON (open)"), "{said:?}");
    let trace = live.folder.join("trace.csv");
    live.ok(&format!(
        "sim {} --for 20ms --watch step,valve --trace {}",
        live.folder.join("ladder.toml").display(),
        trace.display()
    ));
    let trace = fs::read_to_string(trace).unwrap();
    assert!(!trace.contains("idle") && !trace.contains("shut"), "a trace has numbers: {trace}");
}
