//! What happens to the controller in a proof, with known answers.

use super::environment::{answers, violated, words};

/// A machine that goes on after a power cut, because nobody waits for a press of the button.
const MACHINE: &str = r#"
[tags]
button  = { at = "X0" }
resume  = { at = "X1" }
running = { at = "C0" }
pressed = { at = "C1" }
valve   = { at = "Y0" }
[[program]]
name = "Main"
rung = [
  { when = ["button"], do = ["SET running", "SET pressed"] },
  { when = ["running"], do = ["OUT valve"] },
]
"#;

/// The same, which waits for `resume`.
const WAITING: &str = r#"
[tags]
button  = { at = "X0" }
resume  = { at = "X1" }
running = { at = "C0" }
waiting = { at = "C1" }
valve   = { at = "Y0" }
[[program]]
name = "Main"
rung = [
  { when = ["$FirstScan"], do = ["SET waiting"] },
  { when = ["resume", "!$FirstScan"], do = ["RST waiting"] },
  { when = ["button"], do = ["SET running"] },
  { when = ["running", "!waiting"], do = ["OUT valve"] },
]
"#;

/// An observer that knows whether an operator has resumed since the start.
const UNTIL_RESUME: &str = r#"
always = ["!(waits & valve)"]
[[observer.rung]]
when = ["$FirstScan"]
do   = ["SET waits"]
[[observer.rung]]
when = ["resume", "!$FirstScan"]
do   = ["RST waits"]
[observer.tags]
waits = { type = "bit" }
"#;

/// A test file about a machine whose operation is retained.
fn retained(lines: &str, interval: &str, events: &str) -> String {
    format!("{lines}\n[retain]\ntags = [\"running\"]\n{interval}[prove]\nevents = [\"{events}\"]\n")
}

#[test]
fn what_is_retained_goes_on_over_a_power_cut_and_a_restart() {
    let line = "always = [\"!valve | pressed\"]";
    for (event, steps) in [
        ("power-cut", "\"set button 1\",\n    \"run 1 scans\",\n    \"power-cut\",\n"),
        ("restart", "\"set button 1\",\n    \"restart\",\n"),
    ] {
        for interval in ["interval = \"10ms\"\n", ""] {
            let found = &answers(MACHINE, &retained(line, interval, event))[0];
            let (scan, scenario) = violated(found);
            assert_eq!(scan, 2, "{scenario}");
            assert!(scenario.contains(steps), "{scenario}");
        }
        let nothing = format!("{line}\n[prove]\nevents = [\"{event}\"]\n");
        assert_eq!(words(MACHINE, &nothing), ["proved"]);
    }
    assert_eq!(words(MACHINE, &retained(line, "", "stop")), ["proved"]);
}

#[test]
fn memory_goes_on_over_a_stop_and_outputs_begin_with_the_first_scan() {
    let lines = "always = [\"!$FirstScan | !valve | button\", \"!$LastScan | !valve\"]\n\
                 [prove]\nevents = [\"stop\"]\n";
    let found = answers(MACHINE, lines);
    let (scan, scenario) = violated(&found[0]);
    assert_eq!(scan, 2, "{scenario}");
    assert!(scenario.contains("\"stop\",\n    \"start\",\n"), "{scenario}");
    let (scan, scenario) = violated(&found[1]);
    assert_eq!(scan, 1, "{scenario}");
    assert!(scenario.contains("\"stop\",\n]"), "{scenario}");
    assert!(found[0].text().contains("  may happen: stop\n"), "{}", found[0].text());
}

#[test]
fn nothing_opens_after_a_power_cut_until_an_operator_resumes() {
    let all = "power-cut\", \"restart\", \"stop";
    let found = answers(WAITING, &retained(UNTIL_RESUME, "interval = \"10ms\"\n", all));
    assert_eq!(found[0].word(), "proved", "{found:#?}");
    let told = "  may happen: power-cut, restart, stop\n  a power cut finds the retained values of \
                the last scan\n";
    assert!(found[0].text().contains(told), "{}", found[0].text());
    let found = answers(MACHINE, &retained(UNTIL_RESUME, "", all));
    let (scan, scenario) = violated(&found[0]);
    assert_eq!(scan, 1, "{scenario}");
}

#[test]
fn the_observer_is_no_part_of_the_controller_and_goes_on() {
    // It counts starts; the second one needs a scan that is no first one.
    let observed = "always = [\"starts.Acc < 2\"]\n[observer.tags]\nstarts = { type = \"counter\" }\n\
                    [[observer.rung]]\nleg.up = [\"$FirstScan\"]\nleg.rst = [\"$Off\"]\n\
                    do = [\"CNT starts preset=2\"]\n[prove]\nevents = [\"EVENT\"]\n";
    for event in ["power-cut", "restart", "stop"] {
        let found = &answers(MACHINE, &observed.replace("EVENT", event))[0];
        let (scan, scenario) = violated(found);
        assert_eq!(scan, 3, "{scenario}");
    }
    // Its timer times while the controller begins again.
    let timed = "always = [\"!while.Done\"]\n[observer.tags]\nwhile = { type = \"timer\" }\n\
                 [[observer.rung]]\nwhen = [\"$FirstScan\"]\ndo = [\"TMR while preset=30ms\"]\n\
                 [prove]\nevents = [\"restart\"]\n";
    let found = answers(MACHINE, timed);
    let (scan, scenario) = violated(&found[0]);
    assert_eq!(scan, 4, "{scenario}");
}

#[test]
fn what_is_remembered_begins_with_memory_as_started() {
    let line = "always = [\"!was(running) | running\"]";
    let lost = format!("{line}\n[prove]\nevents = [\"power-cut\", \"restart\", \"stop\"]\n");
    for test in [retained(line, "", "power-cut"), lost] {
        assert_eq!(words(MACHINE, &test), ["proved"]);
    }
}

/// A counter of presses, and an observer that knows the largest number.
const COUNTED: &str = r#"
[tags]
press = { at = "X0" }
count = { at = "D0", max = 2 }
[[program]]
name = "Main"
rung = [{ when = ["rise(press)"], do = ["ADD count 1 to=count"] }]
"#;

#[test]
fn an_image_is_that_of_the_last_scan_or_an_earlier_one_by_its_interval() {
    let observed = "always = [\"count >= most\"]\n[observer.tags]\nmost = { type = \"int\" }\n\
                    [[observer.rung]]\nwhen = [\"count > most\"]\ndo = [\"MOVE count to=most\"]\n\
                    [retain]\ntags = [\"count\"]\nINTERVAL[prove]\nevents = [\"power-cut\"]\n";
    let test = |interval| observed.replace("INTERVAL", interval);
    assert_eq!(words(COUNTED, &test("interval = \"10ms\"\n")), ["proved"]);
    let found = &answers(COUNTED, &test(""))[0];
    let (_, scenario) = violated(found);
    assert!(scenario.contains("\"power-cut\""), "{scenario}");
    let told = "a power cut finds the retained values of the last scan or of any earlier one: images \
                are 1000 ms apart";
    assert!(found.text().contains(told), "{}", found.text());
}

#[test]
fn retained_stages_go_on_over_a_power_cut() {
    let ladder = r#"
[[program]]
name = "Main"
[[program.stage]]
name = "Idle"
rung = [{ when = ["X0"], do = ["JMP Fill"] }]
[[program.stage]]
name = "Fill"
rung = [{ when = ["$On"], do = ["OUT Y0", "SET C0"] }]
"#;
    let test = |stages| {
        format!(
            "always = [\"!Y0 | C0\", \"!($FirstScan & Main.Fill) | X0\"]\n[retain]\nstages = [{stages}]\n\
             interval = \"10ms\"\n[prove]\nevents = [\"power-cut\"]\n"
        )
    };
    assert_eq!(words(ladder, &test("\"Main\"")), ["proved", "violated"]);
    assert_eq!(words(ladder, &test("")), ["proved", "proved"]);
}

/// A batch that waited too long without power is thrown away.
const BATCH: &str = r#"
[tags]
button  = { at = "X0" }
running = { at = "C0" }
waste   = { at = "C1" }
[[program]]
name = "Main"
rung = [
  { when = ["button", "!waste"], do = ["SET running"] },
  { when = ["$FirstScan", "running", "$DownSeconds > 600"], do = ["RST running", "SET waste"] },
]
"#;

#[test]
fn a_new_process_finds_any_time_without_one() {
    let lines = "always = [\"!waste\", \"!waste | !running\", \"$DownSeconds <= 600 | running\"]\n";
    for (event, step) in [("power-cut", "power-cut for 601s"), ("restart", "restart for 601s")] {
        let test = retained(lines, "interval = \"10ms\"\n", event);
        let found = answers(BATCH, &test);
        let (scan, scenario) = violated(&found[0]);
        assert_eq!(scan, 2, "{scenario}");
        assert!(scenario.contains(step), "{scenario}");
        assert_eq!(found[1].word(), "proved", "{}", found[1].text());
        assert_eq!(violated(&found[2]).0, 2);
        let told = "  a new process finds any `$DownSeconds`\n";
        assert!(found[0].text().contains(told), "{}", found[0].text());
        // Where nothing is retained, a process does not know how long there was none.
        let nothing = format!("{lines}\n[prove]\nevents = [\"{event}\"]\n");
        assert_eq!(words(BATCH, &nothing), ["proved"; 3]);
    }
    assert_eq!(words(BATCH, &retained(lines, "", "stop")), ["proved"; 3]);
}

#[test]
fn a_time_without_a_process_may_be_longer_than_a_step_can_say() {
    let ladder = BATCH.replace("> 600", "> 5000000");
    let line = "always = [\"!waste\"]\n";
    for event in ["power-cut", "restart"] {
        let test = retained(line, "interval = \"10ms\"\n", event);
        assert_eq!(words(&ladder, &test), ["not decided"]);
    }
}

#[test]
fn a_start_with_retained_memory_finds_any_time_without_a_process() {
    let lines = "always = [\"!waste | $FirstScan\", \"$DownSeconds < 5\"]\n[retain]\n\
                 tags = [\"running\"]\n[prove]\nfrom = \"retained\"\n";
    // A scenario begins with no time without a process.
    assert_eq!(words(BATCH, lines), ["not decided"; 2]);
}
