//! The rollback of a running controller: the program that it returns to, and that it never waits
//! for files.

use std::time::{Duration, Instant};

use rungd_test_support::running::live::Live;
use rungd_test_support::running::process::until;

/// A program that writes its number to D0.
fn says(number: u32) -> String {
    format!(
        "[[program]]\nname = \"Main\"\nrung = [\n\
         {{ when = [\"$On\"], do = [\"MOVE {number} to=D0\", \"ADD D2 1 to=D2\"] }},\n]\n"
    )
}

/// Much longer than a scan, and much shorter than a stalled scan.
const WATCHDOG: &str = "scan.watchdog = \"600ms\"\n";

/// A ladder with `rungs` additional rungs. The check takes tens of milliseconds for a thousand
/// rungs.
fn long(number: u32, rungs: usize) -> String {
    let more = "{ when = [\"X0\"], do = [\"SET C9\"] },\n".repeat(rungs);
    format!("{}\n{more}]\n", says(number).trim_end().trim_end_matches(']'))
}

fn put(live: &Live, ladder: &str) {
    std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
}

/// Reloads a ladder; returns the command's output.
fn load(live: &Live, ladder: &str) -> String {
    put(live, ladder);
    live.ok("reload")
}

#[test]
fn a_rollback_within_probation_restores_the_last_program_that_passed() {
    let live = Live::start(&says(1), "", &[]);
    live.await_values("D0", "1");
    load(&live, &says(2));
    load(&live, &says(3));
    live.await_values("D0", "3");
    live.ok("rollback");
    live.await_values("D0", "1");
    assert_eq!(live.say("rollback").code, 1, "once");
}

/// The rollback skips the program before the last reload, because it was replaced within its
/// probation.
#[test]
fn a_rollback_skips_programs_replaced_within_their_probation() {
    let live = Live::start(&says(1), "reload.probation = \"1h\"\n", &[]);
    live.await_values("D0", "1");
    load(&live, &says(2));
    let controller = live.folder.join("controller.toml");
    let short = std::fs::read_to_string(&controller).unwrap().replace("\"1h\"", "\"50ms\"");
    std::fs::write(&controller, short).unwrap();
    load(&live, &says(3));
    live.line("the new program has passed its probation");
    live.ok("rollback");
    live.await_values("D0", "1");
}

/// Without probation, each program counts as having passed it.
#[test]
fn a_rollback_without_probation_restores_the_previous_program() {
    let live = Live::start(&says(1), "reload.probation = \"0ms\"\n", &[]);
    live.await_values("D0", "1");
    load(&live, &says(2));
    load(&live, &says(3));
    live.await_values("D0", "3");
    live.ok("rollback");
    live.await_values("D0", "2");
}

#[test]
fn a_rollback_restores_a_program_that_passed_its_probation() {
    let live = Live::start(&says(1), "reload.probation = \"50ms\"\n", &[]);
    live.await_values("D0", "1");
    load(&live, &says(2));
    live.line("the new program has passed its probation");
    load(&live, &says(3));
    live.ok("rollback");
    live.await_values("D0", "2");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "stalls are a debug build's")]
fn reloading_unchanged_files_changes_nothing_and_keeps_the_probation() {
    let live = Live::start_to_stall(&says(1), WATCHDOG, &["--stopped"]);
    load(&live, &says(2));
    for words in ["reload", "reload --dry-run"] {
        assert_eq!(live.ok(words), "nothing changed: the files are those of the running program\n");
    }
    assert_eq!(live.line("nothing changed")["event"], "reload-same");
    live.signal("HUP");
    live.line("SIGHUP asked for a reload: the files are those of the running program");
    live.stall();
    live.say("mode run");
    // The FAULT returns to the first program, although the second one was requested repeatedly.
    live.await_values("D0", "1");
    let line = live.line("went back to the program before the reload (FAULT: ");
    assert_eq!((&line["event"], &line["who"]), (&"rolled-back".into(), &"rungd".into()));
    assert_eq!(live.say("rollback").code, 1, "there is nothing else to go back to");
}

/// Whether the controller has a thread that reads the files of a reload.
fn is_reading(live: &Live) -> bool {
    let threads = std::fs::read_dir(format!("/proc/{}/task", live.child.id())).unwrap().flatten();
    let mut names = threads.map(|thread| std::fs::read_to_string(thread.path().join("comm")));
    names.any(|name| name.is_ok_and(|name| name.trim() == "rungd-reload"))
}

#[test]
fn a_rollback_cancels_a_reload_that_is_still_reading() {
    // The rollback ends the reload, however slow the machine is.
    let live = Live::start(&says(1), "", &["--reload-limit", "5m"]);
    live.await_values("D0", "1");
    load(&live, &says(2));
    live.await_values("D0", "2");
    put(&live, &long(3, if cfg!(debug_assertions) { 30_000 } else { 80_000 }));
    let mut reload = live.command("reload").spawn().unwrap();
    until(|| is_reading(&live));
    let begin = Instant::now();
    live.ok("rollback");
    let took = begin.elapsed();
    assert!(reload.try_wait().unwrap().is_none(), "it reads still: {took:?}");
    live.await_values("D0", "1");
    assert_eq!(reload.wait().unwrap().code(), Some(1));
    live.line("the previous program was put back while the files were read");
    live.await_values("D0", "1");
}

#[test]
fn a_reload_that_takes_too_long_is_refused_and_the_next_one_succeeds() {
    let live = Live::start(&says(1), "", &["--reload-limit", "2s"]);
    live.await_values("D0", "1");
    put(&live, &long(2, 160_000));
    let said = live.say("reload");
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.err.contains("not read and checked within 2s"), "{said:?}");
    assert!(said.err.contains("What took longest was "), "{said:?}");
    // On a busy machine reading may take longest; only then does the message name the disk.
    let was_reading = said.err.contains("What took longest was reading ");
    assert_eq!(said.err.contains("disk"), was_reading, "{said:?}");
    put(&live, &says(3));
    // On a busy machine even a short file may exceed the limit.
    until(|| {
        let said = live.say("reload");
        assert!(said.code == 0 || said.err.contains("not read and checked within 2s"), "{said:?}");
        said.code == 0
    });
    live.await_values("D0", "3");
}

#[test]
fn a_reload_refuses_a_pipe_in_place_of_a_ladder() {
    let live = Live::start(&says(1), "", &[]);
    live.await_values("D0", "1");
    let ladder = live.folder.join("ladder.toml");
    std::fs::remove_file(&ladder).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&ladder).status().unwrap().success());
    let said = live.say("reload");
    assert_eq!(said.code, 78);
    assert!(said.err.contains("it is a pipe (FIFO), not a regular file"), "{said:?}");
    std::fs::remove_file(&ladder).unwrap();
    load(&live, &says(2));
    live.await_values("D0", "2");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "stalls are a debug build's")]
fn a_manual_rollback_keeps_the_mode() {
    let controller = format!("{WATCHDOG}reload.probation = \"0ms\"\n");
    let live = Live::start_to_stall(&says(1), &controller, &["--stopped"]);
    load(&live, &says(2));
    live.stall();
    live.say("mode run");
    live.await_mode("FAULT");
    let said = live.await_ok("rollback");
    assert!(
        said.contains("the mode is FAULT, and nothing is scanned until `rungd mode run`"),
        "{said}"
    );
    let line = live.line("the mode stays FAULT: run `rungd mode run` next");
    assert_eq!((&line["event"], &line["mode"]), (&"rolled-back".into(), &"FAULT".into()));
    assert_eq!(live.say("status --json").json()["mode"], "FAULT");
    live.ok("mode run");
    live.await_values("D0", "1");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "stalls are a debug build's")]
fn a_program_reloaded_in_fault_is_rolled_back_only_manually() {
    let live = Live::start_to_stall(&says(1), WATCHDOG, &[]);
    live.await_values("D0", "1");
    live.stall();
    live.await_mode("FAULT");
    put(&live, &says(2));
    live.await_ok("reload");
    assert_eq!(live.say("status --json").json()["mode"], "FAULT");
    live.ok("mode run");
    live.await_values("D0", "2");
    live.stall();
    live.await_mode("FAULT");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(live.say("status --json").json()["mode"], "FAULT", "nothing moves by itself");
    live.await_ok("rollback");
}

/// The scan hangs for longer than a reload waits for its answer.
#[test]
#[cfg_attr(not(debug_assertions), ignore = "stalls are a debug build's")]
fn a_late_swap_is_recorded_before_any_later_swap() {
    let controller = "scan.watchdog = \"9s\"\nreload.probation = \"0ms\"\n";
    let live = Live::start_to_stall(&says(1), controller, &[]);
    live.await_values("D0", "1");
    live.hang();
    put(&live, &says(2));
    let said = live.say("reload");
    assert!(
        said.err.contains("no scan has processed it in time; it may still be done"),
        "{said:?}"
    );
    for words in ["reload", "rollback"] {
        put(&live, &says(3));
        let said = live.say(words);
        assert_eq!(said.code, 1, "{said:?}");
        let why = if words == "reload" { "still waits for the scan thread" } else { "nothing to" };
        assert!(said.err.contains(why), "{said:?}");
    }
    live.go_on();
    let line = live.line("reloaded: the new program is loaded (FAULT");
    assert_eq!(line["event"], "reload-done");
    live.ok("mode run");
    live.await_values("D0", "2");
    live.ok("reload");
    live.await_values("D0", "3");
    live.ok("rollback");
    live.await_values("D0", "2");
}

#[test]
fn a_reload_warns_of_a_moved_tag() {
    let tagged = |at: &str| {
        format!("[tags]\nLevel = {{ at = \"{at}\" }}\n{}", says(1).replace("D2 1", "D2 Level"))
    };
    let live = Live::start(&tagged("V10"), "", &[]);
    live.ok("write V10 17");
    live.ok("force V20 3");
    let said = load(&live, &tagged("V20"));
    let words = "tag Level moved from V10 to V20: V20 keeps its own value 3 (forced); V10's was 17";
    assert!(said.contains(&format!("warning: {words}\n")), "{said}");
    let line = live.line(words);
    assert_eq!((&line["event"], &line["level"]), (&"reload-warning".into(), &"WARN".into()));
}

#[test]
fn a_reload_can_remove_ranges_of_retentive_memory() {
    let live = Live::start(
        &says(1),
        "[retain]\nfile = \"kept\"\nranges = [\"D100..D101\"]\ncold-start = \"run\"\n",
        &[],
    );
    live.ok("write D100 17");
    live.ok("retain save");
    let show = || live.ok(&format!("retain show {}", live.folder.join("kept").display()));
    assert!(show().contains("D100"), "{}", show());
    let controller = live.folder.join("controller.toml");
    let text = std::fs::read_to_string(&controller).unwrap();
    std::fs::write(&controller, text.replace("\"D100..D101\"", "")).unwrap();
    let said = live.ok("reload");
    assert!(said.contains("retained elements 2 → 0") && !said.contains("restart"), "{said}");
    let said = live.say("retain save");
    assert!(said.code == 1 && said.err.contains("the last image stays"), "{said:?}");
    assert!(show().contains("D100"), "{}", show());
    std::fs::write(&controller, text).unwrap();
    let said = live.ok("reload");
    assert!(said.contains("retained elements 0 → 2") && !said.contains("restart"), "{said}");
    live.ok("retain save");
    assert!(show().contains("D100"), "{}", show());
    let text = std::fs::read_to_string(&controller).unwrap();
    std::fs::write(&controller, text.replace("\"D100..D101\"", "\"D102\", \"D109\"")).unwrap();
    let said = live.ok("reload");
    assert!(said.contains("\nretained ranges D100..D101 → D102 D109\n"), "{said}");
}
