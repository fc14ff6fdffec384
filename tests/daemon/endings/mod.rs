//! The ways in which a controller ends. Remote I/O in a separate process with its own clock records
//! the value of each output and the time of each change.
//!
//! The ladder drives four outputs at each of two devices: a coil that is OFF outside RUN, a coil
//! that is ON, a coil that is held, and a word with a safe value. A register at the first device
//! changes with every scan; its last change marks the last moment of RUN. The second device has a
//! watchdog. This file states the values that each output must take. The table of `docs/endings.md`
//! has the times; `cargo test --test controller daemon::endings -- --ignored --nocapture` makes it.

mod page;
mod run;
mod watcher;
mod ways;

use run::{IN_RUN, SAFE, Story, play, play_away};
use rungd_test_support::needs::{Need, python, skip, usable};
use ways::{Fate, WAYS, Way};

/// The number of runs of each way in CI.
const ROUNDS: u32 = 2;
/// The number of simultaneous runs for the page.
const LANES: u32 = 4;
/// The number of runs of each way, for the page.
const ROUNDS_OF_THE_PAGE: u32 = 100;

/// Whether this way can be tested here; otherwise the reason is printed.
fn may(way: Way) -> bool {
    if !usable(python()) {
        return false;
    }
    if way.wants_faults() && !cfg!(debug_assertions) {
        skip(Need::Faults, "a build without debug assertions has no faults on purpose");
        return false;
    }
    true
}

fn check(way: Way) {
    if !may(way) {
        return;
    }
    for _ in 0..ROUNDS {
        let mut stories = (0..10).map(|_| play(way));
        let story = stories.find(|story| !story.was_held_up(way)).expect("a machine less busy");
        judge(way, &story);
    }
}

/// Compares the values of each output with those that the way demands. Does not check times.
fn judge(way: Way, story: &Story) {
    let [plain, guarded] = &story.outputs;
    let context = format!("{way:?}: {:?} {:?}\n{:#?}", plain, guarded, story.log);
    let values = |[off, on, held, word]: [&[u64]; 4]| [off, on, held, word].map(<[u64]>::to_vec);
    let safe = values([&[0], &[1], &[], &[17]]);
    let still = values([&[], &[], &[], &[]]);
    // The device's watchdog switches OFF the outputs that are ON: after the safe values, or
    // directly after RUN.
    let safe_then_dropped = values([&[0], &[1, 0], &[0], &[17, 0]]);
    let dropped = values([&[0], &[], &[0], &[0]]);
    let expected = match way.fate() {
        Fate::Safe => (safe.clone(), safe),
        Fate::SafeThenGone(_) => (safe, safe_then_dropped),
        Fate::AsTheyWere => (still, dropped),
        Fate::InRun => (still.clone(), still),
    };
    assert_eq!((&plain.values(), &guarded.values()), (&expected.0, &expected.1), "{context}");
    let code = match way.fate() {
        Fate::SafeThenGone(code) => Some(code),
        _ => None,
    };
    assert_eq!(story.code, code, "{context}");
    if way.fate() == Fate::InRun {
        // Two coils of the other device show `.Ok` and `.Stale` of the lost one.
        let stale = if way == Way::PanicInDriver { vec![] } else { vec![1, 0] };
        assert!(story.ok == [0, 1] || way == Way::PanicInDriver, "{context}");
        assert_eq!(story.stale, stale, "{context}");
    }
    let comes_back = way.comes_back() && !story.faulted;
    assert_eq!(story.last, [1, 0, 1, 1234].map(|v| comes_back.then_some(v)), "{context}");
}

macro_rules! ways {
    ($($name:ident = $way:expr;)*) => { $(#[test] fn $name() { check($way); })* };
}

ways! {
    outputs_are_as_documented_after_an_orderly_stop = Way::LastScan;
    outputs_are_as_documented_after_a_stop_by_an_operator = Way::Operator;
    outputs_are_as_documented_after_a_stop_instruction = Way::Instruction;
    outputs_are_as_documented_after_a_watchdog_fault = Way::Watchdog;
    outputs_are_as_documented_after_a_panic_in_the_scan = Way::PanicInScan;
    outputs_are_as_documented_after_a_panic_of_the_scan_thread = Way::PanicInThread;
    outputs_are_as_documented_after_a_panic_of_the_monitor = Way::PanicInMonitor;
    outputs_are_as_documented_after_a_panic_of_a_driver = Way::PanicInDriver;
    outputs_are_as_documented_after_a_panic_of_the_main_thread = Way::PanicInShell;
    outputs_are_as_documented_after_sigterm = Way::Terminate;
    outputs_are_as_documented_after_sigint = Way::Interrupt;
    outputs_are_as_documented_after_sigkill = Way::Kill;
    outputs_are_as_documented_after_sigstop = Way::Stand;
    outputs_are_as_documented_after_sigsegv = Way::Segment;
    outputs_are_as_documented_after_a_device_falls_silent = Way::Silent;
    outputs_are_as_documented_after_a_device_is_cut_off = Way::Cut;
}

/// The ways that write the safe values once more at the end, with their exit codes.
const LAST_WORDS: [(Way, i32); 3] =
    [(Way::Terminate, 0), (Way::PanicInMonitor, 70), (Way::PanicInShell, 70)];

#[test]
fn a_device_that_returns_during_the_shutdown_is_made_safe() {
    for (way, code) in LAST_WORDS {
        if !may(way) {
            continue;
        }
        let away =
            (0..20).find_map(|_| play_away(way, true)).expect("the device came back in time");
        assert_eq!((away.outputs, away.code), (SAFE, Some(code)), "{way:?}: {:#?}", away.log);
        assert!(!away.log.iter().any(|line| line.contains(UNSAFE)), "{way:?}: {:#?}", away.log);
    }
}

#[test]
fn a_device_that_does_not_return_during_the_shutdown_is_named() {
    for (way, code) in LAST_WORDS {
        if !may(way) {
            continue;
        }
        let away = play_away(way, false).expect("no time limit applies");
        assert_eq!((away.outputs, away.code), (IN_RUN, Some(code)), "{way:?}: {:#?}", away.log);
        let told: Vec<_> = away.log.iter().filter(|line| line.contains(UNSAFE)).collect();
        assert!(matches!(told[..], [one] if one.contains("plain")), "{way:?}: {:#?}", away.log);
    }
}

/// A line of the log about a device whose outputs could not be made safe.
const UNSAFE: &str = "\"device-unsafe\"";

/// Runs a way a number of times, [`LANES`] runs at the same time, because a run mostly waits.
fn many(way: Way, rounds: u32) -> Vec<Story> {
    let run_lane = |lane: u32| {
        let own = (0..rounds).filter(move |round| round % LANES == lane);
        own.map(|_| {
            let story = play(way);
            judge(way, &story);
            story
        })
        .collect::<Vec<_>>()
    };
    std::thread::scope(|scope| {
        let lanes: Vec<_> = (0..LANES).map(|at| scope.spawn(move || run_lane(at))).collect();
        lanes.into_iter().flat_map(|lane| lane.join().expect("every run passes")).collect()
    })
}

#[test]
#[ignore = "a hundred times each: a quarter of an hour, and the table of docs/endings.md"]
fn write_the_table_of_measured_endings_to_the_page() {
    let rounds = std::env::var("RUNGD_ENDINGS").map(|text| text.parse().expect("a number"));
    let rounds = rounds.unwrap_or(ROUNDS_OF_THE_PAGE);
    let mut rows = Vec::new();
    for way in WAYS.into_iter().filter(|way| may(*way)) {
        let stories = many(way, rounds);
        rows.push(page::row(way, &stories));
        eprintln!("{}", rows[rows.len() - 1]);
    }
    page::write(&rows, rounds);
}
