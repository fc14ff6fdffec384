//! A field device's task with a scripted driver: the times of its exchanges, its actions after
//! trouble, and its outputs in every mode and at the end.

#[allow(dead_code, reason = "each user takes what it needs")]
use crate::io::device_bench::*;
use std::sync::Arc;
use std::time::Duration;

use rungd_io::device::{DeviceHealth, ExchangeFailure, ExchangeReason};
use tokio::time::{Instant, sleep};

#[test]
fn the_task_exchanges_at_every_poll_and_the_scan_sees_the_inputs() {
    run(async {
        let mut bench = Bench::start(Script::default());
        sleep(Duration::from_millis(50)).await;
        let calls = bench.calls();
        assert_eq!(calls, [Call::Connect, poll(0, 0, 1), poll(0, 0, 1), poll(0, 0, 1)]);
        bench.rig.advance_to_now();
        bench.rig.scans(1);
        assert_eq!(bench.rig.values(&["X0", "D0", "line1.Ok", "line1.Stale"]), [1, 42, 1, 0]);
        let reading = bench.health.condition();
        assert_eq!((reading.exchanges, reading.failures, reading.trouble), (3, 0, None));
    });
}

#[test]
fn inputs_are_read_but_no_output_is_written_before_the_first_scan() {
    run(async {
        let mut bench = Bench::before_the_first_scan(Script::default());
        sleep(Duration::from_millis(30)).await;
        let first = || Call::Exchange(ExchangeReason::First, vec![0, -1, 0]);
        assert_eq!(bench.calls(), [Call::Connect, first(), first()]);
        assert!(bench.health.has_exchanged());
        bench.rig.advance_to_now();
        bench.rig.scans(1);
        assert_eq!(
            bench.rig.values(&["X0", "D0", "line1.Ok"]),
            [1, 42, 1],
            "the first scan sees it"
        );
        sleep(Duration::from_millis(1)).await;
        let changed = Call::Exchange(ExchangeReason::Change, vec![1, 42, 8]);
        assert_eq!(bench.calls(), [changed], "its outputs leave at once");
    });
}

#[test]
fn a_shutdown_before_the_first_scan_writes_no_output() {
    run(async {
        let mut bench = Bench::before_the_first_scan(Script::default());
        sleep(Duration::from_millis(1)).await;
        bench.calls();
        bench.end().await;
        assert_eq!(bench.calls(), [Call::Disconnect]);
    });
}

#[test]
fn a_changed_output_is_written_at_once() {
    run(async {
        let mut bench = Bench::start(Script::default());
        sleep(Duration::from_millis(5)).await;
        bench.calls();
        bench.rig.advance_to_now();
        bench.rig.scans(1);
        sleep(Duration::from_millis(1)).await;
        let changed = Call::Exchange(ExchangeReason::Change, vec![1, 42, 8]);
        assert_eq!(bench.timed(), [(Duration::from_millis(5), changed)]);
        bench.rig.scans(1);
        sleep(Duration::from_millis(1)).await;
        assert_eq!(bench.calls(), [], "a scan that changes nothing asks for nothing");
    });
}

#[test]
fn an_error_that_keeps_the_connection_does_not_reconnect() {
    run(async {
        let exchanges = vec![Ok(()), Err(ExchangeFailure::kept("exception 2"))];
        let mut bench = Bench::start(Script { exchanges, ..Script::default() });
        sleep(Duration::from_millis(30)).await;
        assert_eq!(bench.calls(), [Call::Connect, poll(0, 0, 1), poll(0, 0, 1)]);
        assert_eq!(bench.health.condition().trouble.as_deref(), Some("exception 2"));
        bench.rig.advance_to_now();
        bench.rig.scans(1);
        assert_eq!(bench.rig.values(&["X0", "line1.Ok", "line1.Stale"]), [1, 0, 0]);
        sleep(Duration::from_millis(20)).await;
        assert!(!bench.calls().contains(&Call::Connect));
        assert_eq!(bench.health.condition().trouble, None);
    });
}

#[test]
fn inputs_read_by_a_failed_exchange_are_used_unless_the_connection_is_lost() {
    for (trouble, seen) in
        [(ExchangeFailure::kept("exception 2"), 43), (ExchangeFailure::disconnected("cut"), 42)]
    {
        run(async {
            let exchanges = vec![Ok(()), Err(trouble.clone())];
            let mut bench = Bench::start(Script { exchanges, ..Script::default() });
            sleep(Duration::from_millis(10)).await;
            bench.script.lock().unwrap().inputs = vec![None, Some(1), Some(43), None];
            sleep(Duration::from_millis(15)).await;
            bench.rig.advance_to_now();
            bench.rig.scans(1);
            assert_eq!(bench.rig.values(&["X0", "D0", "line1.Ok"]), [1, seen, 0], "{trouble}");
            let told = bench.health.condition().trouble.unwrap();
            let words = match trouble.is_disconnected {
                true => "cut",
                false => "exception 2; 2 of 4 inputs are read",
            };
            assert_eq!(told, words);
        });
    }
}

#[test]
fn a_refused_output_change_is_repeated_at_the_next_poll() {
    run(async {
        let exchanges = vec![Ok(()), Err(ExchangeFailure::kept("exception 6"))];
        let mut bench = Bench::start(Script { exchanges, ..Script::default() });
        sleep(Duration::from_millis(2)).await;
        bench.calls();
        bench.rig.advance_to_now();
        for _ in 0..10 {
            bench.rig.scans(1);
            sleep(Duration::from_millis(1)).await;
        }
        let changed = Call::Exchange(ExchangeReason::Change, vec![1, 42, 8]);
        assert_eq!(bench.calls(), [changed], "once, not with every scan");
        sleep(Duration::from_millis(10)).await;
        assert_eq!(bench.calls(), [poll(1, 42, 8)]);
    });
}

#[test]
fn a_lost_connection_is_reopened_and_all_outputs_are_written() {
    run(async {
        let exchanges = vec![Ok(()), Err(ExchangeFailure::disconnected("no answer in 200 ms"))];
        let bench = Bench::start(Script { exchanges, ..Script::default() });
        sleep(Duration::from_millis(400)).await;
        let calls = bench.calls();
        let begin = [Call::Connect, poll(0, 0, 1), poll(0, 0, 1), Call::Disconnect];
        assert_eq!(calls[..4], begin);
        assert_eq!(calls[4..6], [Call::Connect, poll(0, 0, 1)]);
    });
}

#[test]
fn a_panic_of_a_driver_only_closes_its_connection() {
    run(async {
        let bug = || Err(ExchangeFailure::kept(BUG));
        let script = Script { exchanges: vec![Ok(()), bug()], ..Script::default() };
        let mut bench = Bench::start(script);
        sleep(Duration::from_millis(30)).await;
        let trouble = bench.health.condition().trouble.unwrap();
        assert!(trouble.contains("a bug in its driver"), "{trouble}");
        sleep(Duration::from_millis(370)).await;
        let calls = bench.calls();
        let begin = [Call::Connect, poll(0, 0, 1), poll(0, 0, 1), Call::Disconnect];
        assert_eq!(calls[..4], begin);
        assert_eq!(calls[4..6], [Call::Connect, poll(0, 0, 1)]);
        assert_eq!(bench.health.condition().trouble, None);
        bench.end().await;
    });
}

#[test]
fn connection_attempts_continue_for_ever_at_growing_intervals() {
    run(async {
        let refused = || Err(ExchangeFailure::disconnected("connection refused"));
        let connects = (0..200).map(|_| refused()).collect();
        let bench = Bench::start(Script { connects, ..Script::default() });
        sleep(Duration::from_secs(2000)).await;
        let times: Vec<Duration> = bench.timed().into_iter().map(|(at, _)| at).take(200).collect();
        let gaps: Vec<u128> = times.windows(2).map(|two| (two[1] - two[0]).as_millis()).collect();
        assert!(gaps.len() >= 199, "{} attempts", gaps.len() + 1);
        assert!((50..=150).contains(&gaps[0]), "{gaps:?}");
        assert!(gaps[10..].iter().all(|gap| (2500..=7500).contains(gap)), "{gaps:?}");
        assert_eq!(bench.health.condition().failures, 200);
    });
}

#[test]
fn a_shutdown_writes_the_safe_values_once_more() {
    run(async {
        let mut bench = Bench::start(Script::default());
        sleep(Duration::from_millis(1)).await;
        bench.rig.advance_to_now();
        bench.rig.scans(1);
        sleep(Duration::from_millis(1)).await;
        bench.calls();
        bench.end().await;
        let last = Call::Exchange(ExchangeReason::Last, vec![0, -1, 8]);
        assert_eq!(bench.calls(), [last, Call::Disconnect]);
    });
}

#[test]
fn a_shutdown_tries_to_reach_an_absent_device_for_two_seconds() {
    run(async {
        let connects = (0..99).map(|_| Err(ExchangeFailure::disconnected("no route"))).collect();
        let mut bench = Bench::start(Script { connects, ..Script::default() });
        sleep(Duration::from_millis(500)).await;
        bench.calls();
        let begun = Instant::now();
        bench.end().await;
        assert_eq!(begun.elapsed(), Duration::from_secs(2));
        let calls = bench.calls();
        let attempts = calls.iter().filter(|call| **call == Call::Connect).count();
        assert!((5..=20).contains(&attempts), "{calls:?}");
        assert_eq!(calls.last(), Some(&Call::Disconnect));
    });
}

#[test]
fn a_shutdown_writes_to_a_device_that_returns_within_two_seconds() {
    run(async {
        let connects = (0..99).map(|_| Err(ExchangeFailure::disconnected("no route"))).collect();
        let mut bench = Bench::start(Script { connects, ..Script::default() });
        sleep(Duration::from_millis(500)).await;
        let (begun, script) = (Instant::now(), Arc::clone(&bench.script));
        tokio::task::spawn_local(async move {
            sleep(Duration::from_millis(1200)).await;
            script.lock().unwrap().connects.clear();
        });
        bench.end().await;
        assert!((1200..1900).contains(&begun.elapsed().as_millis()), "{:?}", begun.elapsed());
        let calls = bench.calls();
        assert_eq!(calls[calls.len() - 3..], [Call::Connect, last(), Call::Disconnect]);
    });
}

#[test]
fn a_hanging_connection_attempt_does_not_block_a_shutdown() {
    run(async {
        let mut bench = Bench::start(Script { hangs: 3, ..Script::default() });
        sleep(Duration::from_millis(1)).await;
        bench.calls();
        bench.end().await;
        let calls = bench.calls();
        assert_eq!(calls[calls.len() - 3..], [Call::Connect, last(), Call::Disconnect]);
    });
}

#[test]
fn a_shutdown_repeats_refused_safe_values() {
    run(async {
        let mut bench = Bench::start(Script::default());
        sleep(Duration::from_millis(1)).await;
        bench.calls();
        let busy = || Err(ExchangeFailure::kept("exception 6"));
        bench.script.lock().unwrap().exchanges = vec![busy(), busy(), busy()];
        bench.end().await;
        assert_eq!(bench.calls(), [last(), last(), last(), last(), Call::Disconnect]);
    });
}

#[test]
fn a_shutdown_does_not_wait_for_a_device_without_outputs() {
    run(async {
        let connects = (0..99).map(|_| Err(ExchangeFailure::disconnected("no route"))).collect();
        let mut bench = Bench::of_sources(Script { connects, ..Script::default() }, Vec::new());
        sleep(Duration::from_millis(500)).await;
        let begun = Instant::now();
        bench.end().await;
        assert_eq!(begun.elapsed(), Duration::ZERO);
    });
}

/// Changes the outputs by a scan that has the device's inputs.
fn scan(bench: &mut Bench) {
    bench.rig.advance_to_now();
    bench.rig.scans(1);
}

/// The last exchange of a controller that scanned twice.
fn last() -> Call {
    Call::Exchange(ExchangeReason::Last, vec![0, -1, 1])
}

#[test]
fn a_shutdown_reconnects_to_a_device_in_back_off() {
    run(async {
        let connects = (0..9).map(|_| Err(ExchangeFailure::disconnected("refused"))).collect();
        let mut bench = Bench::start(Script { connects, ..Script::default() });
        sleep(Duration::from_millis(460)).await;
        bench.calls();
        // The peer is back while the task waits for its next attempt.
        bench.script.lock().unwrap().connects.clear();
        let begun = Instant::now();
        bench.end().await;
        assert_eq!(bench.calls(), [Call::Connect, last(), Call::Disconnect]);
        assert_eq!(begun.elapsed(), Duration::ZERO);
    });
}

#[test]
fn a_shutdown_reconnects_if_the_current_or_last_exchange_fails() {
    run(async {
        let lost = || Err(ExchangeFailure::disconnected("no answer in 200 ms"));
        let exchanges = vec![lost(), lost()];
        let mut bench = Bench::start(Script { exchanges, ..Script::default() });
        sleep(Duration::from_millis(1)).await;
        assert_eq!(bench.calls(), [Call::Connect, poll(0, 0, 1), Call::Disconnect]);
        bench.end().await;
        let again = [Call::Connect, last(), Call::Disconnect];
        assert_eq!(bench.calls(), [&again[..], &again].concat(), "the first one fails too");
    });
}

#[test]
fn a_shutdown_takes_at_most_two_seconds_with_any_driver() {
    run(async {
        let requests = (1, Duration::from_secs(60));
        let mut bench = Bench::start(Script { requests, ..Script::default() });
        sleep(Duration::from_millis(1)).await;
        bench.calls();
        let begun = Instant::now();
        bench.end().await;
        assert_eq!(begun.elapsed(), Duration::from_secs(1), "the exchange under way is abandoned");
        let again = [Call::Disconnect, Call::Connect, last(), Call::Disconnect];
        assert_eq!(bench.calls(), again);
    });
}

#[test]
fn an_output_change_is_written_between_requests_of_a_long_exchange() {
    run(async {
        let requests = (40, Duration::from_millis(150));
        let mut bench = Bench::start(Script { requests, ..Script::default() });
        sleep(Duration::from_millis(10)).await;
        bench.rig.port.set_input(0, true);
        bench.rig.scans(1);
        sleep(Duration::from_millis(150)).await;
        assert_eq!(bench.timed()[2], (Duration::from_millis(150), poll(1, 0, 2)));
        // The exchange continues where it was. Its six seconds count from its first part, not from
        // its second.
        sleep(Duration::from_millis(5830)).await;
        assert_eq!((bench.health.condition().exchanges, bench.calls().len()), (0, 0));
        sleep(Duration::from_millis(20)).await;
        let reading = bench.health.condition();
        assert_eq!((reading.exchanges, reading.took), (1, Duration::from_secs(6)));
    });
}

#[test]
fn outputs_that_change_at_every_scan_do_not_starve_inputs() {
    run(async {
        let requests = (40, Duration::from_millis(150));
        let mut bench = Bench::start(Script { requests, ..Script::default() });
        for _ in 0..610 {
            sleep(Duration::from_millis(10)).await;
            bench.rig.scans(1);
        }
        assert_eq!(bench.health.condition().exchanges, 1);
    });
}

#[test]
fn a_shutdown_and_the_first_scan_interrupt_a_long_exchange() {
    run(async {
        let requests = (40, Duration::from_millis(150));
        let mut bench = Bench::before_the_first_scan(Script { requests, ..Script::default() });
        sleep(Duration::from_millis(10)).await;
        scan(&mut bench);
        sleep(Duration::from_millis(150)).await;
        let first = Call::Exchange(ExchangeReason::First, vec![0, -1, 0]);
        assert_eq!(bench.calls(), [Call::Connect, first, poll(0, 0, 1)]);
        let begun = Instant::now();
        bench.end().await;
        assert!(begun.elapsed() <= Duration::from_millis(150), "{:?}", begun.elapsed());
        assert_eq!(bench.calls(), [last(), Call::Disconnect]);
    });
}

#[test]
fn a_flapping_device_writes_at_most_20_log_lines() {
    let health = DeviceHealth::new("line1", "scripted", String::new());
    let told = (0..50).filter(|_| health.may_tell().is_some()).count();
    assert_eq!(told, 20);
}
