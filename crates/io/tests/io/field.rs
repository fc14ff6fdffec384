//! Field devices from a scan's view: whole images, their age, and the inputs of a lost device
//! (`docs/devices.md`). The engine and the scanner run on a simulated clock; the test acts as the
//! devices.

#[allow(dead_code, reason = "each user takes what it needs")]
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use crate::io::rig::{MS, PERIOD_NS, Rig, rig};
use rungd_runtime::DeviceEdge;
use rungd_runtime::exchange::{FaultReason, Mode, Snapshot, StopReason};
use rungd_runtime::wiring::{last_words, outgoing};

#[test]
fn the_next_scan_sees_a_whole_input_image() {
    let mut rig = rig(false);
    rig.deliver(1, 0, 70_000, 5);
    rig.scans(1);
    assert_eq!(
        rig.values(&["X0", "X3", "D0", "V0", "Y2", "Y3", "D1"]),
        [1, 0, 70_000, 6, 1, 0, 70_000]
    );
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale", "Y0", "Y1"]), [1, 0, 1, 0]);
    assert_eq!(rig.told(), [(0, DeviceEdge::Present)]);
}

#[test]
fn the_first_scan_takes_the_newest_of_several_images() {
    let mut rig = rig(false);
    for d0 in 1..=3 {
        rig.deliver(0, 0, d0, 0);
    }
    rig.scans(1);
    assert_eq!(rig.value("D0"), 3);
}

#[test]
fn every_scan_takes_the_newest_of_several_images() {
    let mut rig = rig(false);
    for round in 1..4 {
        for n in 0..10 {
            rig.deliver(0, 0, 100 * round + n, 0);
        }
        rig.scans(1);
        assert_eq!(rig.values(&["D0", "line1.Ok"]), [100 * round + 9, 1]);
    }
}

#[test]
fn inputs_have_their_initial_values_before_the_first_exchange() {
    let mut rig = rig(true);
    rig.scans(5);
    assert_eq!(rig.values(&["X3", "Y3", "line1.Ok", "line1.Stale"]), [1, 1, 0, 0]);
    assert_eq!(rig.told(), []);
    rig.scans(7);
    assert_eq!(rig.values(&["X3", "line1.Ok", "line1.Stale"]), [1, 0, 1]);
    assert_eq!(rig.told(), [(11, DeviceEdge::Absent)], "told once, after `loss-after`");
    rig.scans(20);
    rig.deliver(1, 0, 0, 0);
    rig.scans(1);
    let back = DeviceEdge::Back { lost_ns: 320 * MS, scans: 32 };
    assert_eq!(rig.told(), [(32, back)]);
    assert_eq!(rig.values(&["X0", "X3"]), [1, 0]);
}

#[test]
fn a_device_input_overwrites_a_value_written_by_the_ladder() {
    let mut rig = rig(false);
    rig.deliver(0, 0, 1, 7);
    rig.scans(5);
    assert_eq!(rig.value("V0"), 8, "7 at the input step of every scan");
}

#[test]
fn an_input_value_beyond_the_range_of_its_cell_is_limited() {
    let mut rig = rig(false);
    rig.deliver(17, -1, i32::MIN, -5);
    rig.scans(1);
    assert_eq!(rig.values(&["X0", "X3", "D0"]), [1, 1, i32::MIN]);
    assert_eq!(rig.value("V0"), 1, "0, and one more by the ladder");
    rig.deliver(0, 0, 0, 70_000);
    rig.scans(1);
    assert_eq!(rig.value("V0"), 65_535);
}

#[test]
fn an_error_turns_ok_off_at_once_and_a_good_exchange_turns_it_on() {
    let mut rig = rig(true);
    rig.deliver(1, 0, 5, 0);
    rig.scans(1);
    rig.line().trouble();
    rig.scans(1);
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale", "X0", "D0"]), [0, 0, 1, 5]);
    rig.deliver(1, 0, 5, 0);
    rig.scans(1);
    assert_eq!(rig.value("line1.Ok"), 1);
    assert_eq!(rig.told(), [(0, DeviceEdge::Present)], "no edge: it was never lost");
}

fn lost(zero_on_loss: bool) -> Rig {
    let mut rig = rig(zero_on_loss);
    rig.deliver(1, 1, 5, 9);
    rig.scans(1);
    rig.told();
    rig.scans(10);
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale"]), [1, 0], "100 ms old: not lost yet");
    rig.scans(1);
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale"]), [0, 1]);
    assert_eq!(rig.told(), [(11, DeviceEdge::Lost)]);
    rig
}

#[test]
fn a_lost_device_holds_its_inputs() {
    let rig = lost(false);
    assert_eq!(rig.values(&["X0", "X3", "D0", "V0"]), [1, 1, 5, 10]);
}

#[test]
fn a_lost_device_zeroes_its_inputs_if_configured() {
    let rig = lost(true);
    assert_eq!(rig.values(&["X0", "X3", "D0", "V0"]), [0, 0, 0, 1]);
}

/// For a number of scans, exchanges that read X0 and D0 and fail to read X3 and V0.
fn parts(rig: &mut Rig, scans: u64, x0: i32, d0: i32) {
    for _ in 0..scans {
        rig.deliver_part([Some(x0), None, Some(d0), None]);
        rig.scans(1);
    }
}

const BITS: [&str; 2] = ["line1.Ok", "line1.Stale"];
const INPUTS: [&str; 4] = ["X0", "X3", "D0", "V0"];

#[test]
fn unread_inputs_become_stale_individually() {
    for (zero_on_loss, old) in [(false, [1, 10]), (true, [0, 1])] {
        let mut rig = rig(zero_on_loss);
        rig.deliver(1, 1, 5, 9);
        rig.scans(1);
        parts(&mut rig, 1, 0, 6);
        assert_eq!(rig.values(&BITS), [0, 0], "at once");
        assert_eq!(rig.values(&INPUTS), [0, 1, 6, 10]);
        parts(&mut rig, 9, 1, 7);
        assert_eq!(rig.values(&INPUTS), [1, 1, 7, 10], "100 ms old: not lost yet");
        parts(&mut rig, 1, 1, 8);
        assert_eq!(rig.values(&BITS), [0, 1]);
        assert_eq!(rig.values(&INPUTS), [1, old[0], 8, old[1]]);
        parts(&mut rig, 100, 0, 9);
        assert_eq!(rig.values(&INPUTS), [0, old[0], 9, old[1]], "those that are read stay live");
        rig.deliver(1, 1, 10, 11);
        rig.scans(1);
        assert_eq!(rig.values(&BITS), [1, 0]);
        assert_eq!(rig.values(&INPUTS), [1, 1, 10, 12]);
        // No input is read any more: all of them become old together.
        rig.scans(11);
        assert_eq!(rig.values(&BITS), [0, 1]);
        let all = if zero_on_loss { [0, 0, 0, 1] } else { [1, 1, 10, 12] };
        assert_eq!(rig.values(&INPUTS), all);
    }
}

#[test]
fn an_input_that_was_never_read_has_its_initial_value() {
    let mut rig = rig(true);
    parts(&mut rig, 30, 1, 5);
    assert_eq!(rig.values(&INPUTS), [1, 1, 5, 30], "X3 is `initial = true`, V0 the ladder's");
    assert_eq!(rig.values(&BITS), [0, 1]);
    assert_eq!(rig.told(), [(11, DeviceEdge::Absent)]);
    rig.deliver(1, 0, 5, 0);
    rig.scans(1);
    assert_eq!((rig.values(&BITS), rig.value("X3")), (vec![1, 0], 0));
}

#[test]
fn refused_outputs_do_not_make_the_inputs_stale() {
    let mut rig = rig(true);
    rig.deliver(1, 1, 5, 9);
    for n in 0..30 {
        rig.deliver_part([Some(1), Some(1), Some(n), Some(9)]);
        rig.scans(1);
    }
    assert_eq!((rig.values(&BITS), rig.values(&INPUTS)), (vec![0, 1], vec![1, 1, 29, 10]));
}

#[test]
fn a_returning_device_reports_how_long_it_was_lost() {
    let mut rig = lost(true);
    rig.scans(312 - 1);
    rig.deliver(1, 0, 6, 0);
    rig.scans(1);
    let back = DeviceEdge::Back { lost_ns: 3120 * MS, scans: 312 };
    assert_eq!(rig.told(), [(323, back)]);
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale", "X0", "D0"]), [1, 0, 1, 6]);
}

#[test]
fn unchanged_values_keep_a_device_ok() {
    let mut rig = rig(true);
    for _ in 0..50 {
        rig.deliver(1, 0, 5, 0);
        rig.scans(1);
    }
    assert_eq!(rig.values(&["line1.Ok", "line1.Stale", "D0"]), [1, 0, 5]);
}

#[test]
fn outputs_follow_the_scan_in_run_and_are_safe_outside_run() {
    let mut rig = rig(false);
    rig.deliver(1, 0, 42, 7);
    rig.scans(1);
    let sources = &rig.sources;
    let out = |image: &Snapshot| {
        let mut values = [9; 3];
        outgoing(sources, image, &mut values);
        values
    };
    let running = rig.port.latest();
    assert_eq!(out(&running), [1, 42, 8]);
    for mode in [Mode::Stop(StopReason::Operator), Mode::Fault(FaultReason::ScanNeverEnds)] {
        // The image as the link to the outside shows it: its Y outputs are already safe.
        let mut outputs = running.outputs.clone();
        outputs[2] = 0;
        let image = Snapshot { mode, outputs, ..(*running).clone() };
        assert_eq!(out(&image), [0, -1, 8]);
    }
    let mut values = [9; 3];
    last_words(sources, &running, &mut values);
    assert_eq!(values, [0, -1, 8], "at the end of the process, though it shows RUN");
}

/// A driver on a separate thread alternately succeeds and fails, as fast as it can. A scan with
/// `.Ok` never has inputs of two exchanges.
#[test]
fn a_partial_exchange_does_not_count_as_complete() {
    let (exchanges, wells) =
        if cfg!(debug_assertions) { (20_000, 100) } else { (1_000_000, 5_000) };
    let mut rig = rig(false);
    let (given, over) = (AtomicI32::new(0), AtomicBool::new(false));
    let mut line = rig.take_line();
    std::thread::scope(|scope| {
        let (given, over) = (&given, &over);
        scope.spawn(move || {
            for n in (1..i32::MAX).take_while(|_| !over.load(Ordering::Relaxed)) {
                line.deliver(&[n & 1, n & 1, n, n & 0x7fff].map(Some), u64::MAX);
                line.well(u64::MAX);
                line.trouble();
                line.deliver(&[None, Some(0), Some(-n), None], u64::MAX);
                given.store(n, Ordering::Relaxed);
            }
        });
        let mut looked = 0;
        while given.load(Ordering::Relaxed) < exchanges || looked < wells {
            rig.clock.0.set(rig.clock.0.get() + PERIOD_NS);
            rig.scans(1);
            let seen = rig.values(&["X0", "X3", "D0", "V0", "line1.Ok"]);
            if seen[4] == 1 {
                let n = seen[2];
                assert_eq!(seen[..4], [n & 1, n & 1, n, (n & 0x7fff) + 1], "scan of {n}");
                looked += 1;
            }
        }
        over.store(true, Ordering::Relaxed);
    });
}

/// A driver on a separate thread delivers patterns as fast as it can; no scan has half a pattern.
#[test]
fn no_image_is_torn() {
    let (exchanges, scans) =
        if cfg!(debug_assertions) { (100_000, 2_000) } else { (1_000_000, 20_000) };
    let mut rig = rig(false);
    let (given, over) = (AtomicI32::new(0), AtomicBool::new(false));
    let mut line = rig.take_line();
    let looked = std::thread::scope(|scope| {
        let (given, over) = (&given, &over);
        scope.spawn(move || {
            for n in (1..i32::MAX).take_while(|_| !over.load(Ordering::Relaxed)) {
                line.deliver(&[n & 1, n & 1, n, n & 0x7fff].map(Some), u64::MAX);
                line.well(u64::MAX);
                given.store(n, Ordering::Relaxed);
            }
        });
        let mut looked = 0;
        while given.load(Ordering::Relaxed) < exchanges || looked < scans {
            rig.clock.0.set(rig.clock.0.get() + PERIOD_NS);
            rig.scans(1);
            let seen = rig.values(&["X0", "X3", "D0", "V0"]);
            if seen[2] > 0 {
                let n = seen[2];
                assert_eq!(seen, [n & 1, n & 1, n, (n & 0x7fff) + 1], "scan of {n}");
                looked += 1;
            }
        }
        over.store(true, Ordering::Relaxed);
        looked
    });
    let given = given.into_inner();
    eprintln!("{given} exchanges, {looked} scans looked, none torn");
}
