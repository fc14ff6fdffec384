//! Models of what threads share without locks: loom executes every order of the accesses, and every
//! value that the memory orders allow a load to see.
//!
//! `build.rs` copies modules of rungd on loom's atomics, and makes mutants of them. Each
//! model must hold for the module, and fail for each of its mutants: tests on a processor that keeps
//! more order than the language promises would see neither. Halves of an `AcqRel` that only forbid a
//! load to see a later store have no mutant: loom executes no such load.
//!
//! The rings between the threads are rtrb's, and the log's channel is the standard library's: their
//! own tests judge them; here a queue under a lock stands for them. Run by
//! `cargo test --manifest-path loom/Cargo.toml`.

#![cfg(test)]
#![allow(dead_code)]

mod mpsc;

include!(concat!(env!("OUT_DIR"), "/modules.rs"));

/// An image that one thread writes is read whole, never older than the one before.
macro_rules! images_are_whole {
    ($module:ident) => {
        loom::model(|| {
            use $module::{LatestInput, latest};
            let (mut writer, mut reader) = latest(2);
            let writing = loom::thread::spawn(move || {
                for n in 1..=2 {
                    writer.write(&[LatestInput { value: n, read_ns: n as u64 }; 2]);
                }
            });
            let mut before = 0;
            for _ in 0..2 {
                reader.refresh();
                let inputs: Vec<_> = reader.inputs().collect();
                let first = inputs[0].value;
                let is_whole = |of: &LatestInput| of.value == first && of.read_ns == first as u64;
                assert!(inputs.iter().all(is_whole), "{inputs:?}");
                assert!(first >= before, "{first} after {before}");
                before = first;
            }
            writing.join().unwrap();
            reader.refresh();
            assert!(reader.inputs().all(|input| input.value == 2), "the newest");
        })
    };
}

/// A scan is too long, or missing, for both threads or for none; the end of the thread is seen only
/// after all that it did.
macro_rules! both_sides_agree {
    ($module:ident) => {
        loom::model(|| {
            use $module::{Beat, Life};
            let beat = loom::sync::Arc::new(Beat::default());
            beat.expect(50);
            let scanning = {
                let beat = loom::sync::Arc::clone(&beat);
                loom::thread::spawn(move || {
                    let is_there = beat.arrive();
                    beat.begin(100);
                    let is_in_time = beat.end();
                    beat.pulse();
                    beat.set_life(Life::Ended);
                    (is_there, is_in_time)
                })
            };
            let is_missed = beat.awaited().is_some_and(|due_ns| beat.miss(due_ns));
            let is_tripped = beat.trip(200, 10);
            if beat.life() == Life::Ended {
                assert_eq!(beat.pulses(), 1, "it has ended");
            }
            let (is_there, is_in_time) = scanning.join().unwrap();
            assert_eq!((is_there, is_in_time), (!is_missed, !is_tripped));
        })
    };
}

/// A scan thread that was stuck comes back in FAULT, and another time goes on in RUN. Whoever saw it
/// stuck finds the gate as it left it. No input and no count of writes is lost.
macro_rules! gate_tells_the_mode {
    ($module:ident) => {
        back_in_fault!($module);
        back_in_run!($module);
        counts_of_writes!($module);
        inputs_of_a_word!($module);
    };
}

macro_rules! back_in_fault {
    ($module:ident) => {
        loom::model(|| {
            let gate = loom::sync::Arc::new($module::ScanGate::new(0));
            gate.set_running(true);
            gate.set_stuck();
            let back = {
                let gate = loom::sync::Arc::clone(&gate);
                loom::thread::spawn(move || {
                    gate.set_running(false);
                    // The monitor hears of it through a ring: here it is the same thread.
                    assert!(gate.hear());
                })
            };
            assert!(!gate.is_open(), "it is stuck, or in FAULT");
            back.join().unwrap();
            assert!(!gate.is_stuck() && !gate.is_open());
        })
    };
}

macro_rules! back_in_run {
    ($module:ident) => {
        loom::model(|| {
            let gate = loom::sync::Arc::new($module::ScanGate::new(0));
            let monitor = {
                let gate = loom::sync::Arc::clone(&gate);
                loom::thread::spawn(move || gate.set_stuck())
            };
            gate.set_running(true);
            monitor.join().unwrap();
            assert!(!gate.is_open(), "no sign of life yet");
            gate.hear();
            assert!(gate.is_open(), "it is in RUN");
        })
    };
}

macro_rules! counts_of_writes {
    ($module:ident) => {
        loom::model(|| {
            const MAX: usize = 3;
            let gate = loom::sync::Arc::new($module::ScanGate::new(0));
            let queue = loom::sync::Arc::new(loom::sync::Mutex::new(Vec::new()));
            let take = |gate: &$module::ScanGate, queue: &loom::sync::Mutex<Vec<usize>>| {
                let taken = queue.lock().unwrap().pop();
                if let Some(writes) = taken {
                    gate.release(writes);
                }
            };
            let scanning = {
                let (gate, queue) = (loom::sync::Arc::clone(&gate), loom::sync::Arc::clone(&queue));
                loom::thread::spawn(move || (0..2).for_each(|_| take(&gate, &queue)))
            };
            for writes in [2, 1, 2] {
                if gate.reserve(writes, MAX) {
                    let mut queue = queue.lock().unwrap();
                    queue.push(writes);
                    assert!(queue.iter().sum::<usize>() <= MAX, "more than a scan applies");
                }
            }
            scanning.join().unwrap();
            (0..3).for_each(|_| take(&gate, &queue));
            assert!(gate.reserve(MAX, MAX) && !gate.reserve(1, MAX), "nothing waits");
        })
    };
}

macro_rules! inputs_of_a_word {
    ($module:ident) => {
        loom::model(|| {
            let gate = loom::sync::Arc::new($module::ScanGate::new(4));
            gate.set_input(3, true);
            let other = {
                let gate = loom::sync::Arc::clone(&gate);
                loom::thread::spawn(move || {
                    gate.set_input(0, true);
                    gate.set_input(3, false);
                })
            };
            gate.set_input(1, true);
            gate.set_input(2, true);
            gate.set_input(1, false);
            other.join().unwrap();
            let words: Vec<_> = gate.inputs().map(|word| (word.present, word.values)).collect();
            assert_eq!(words, [(0b1111, 0b0101)]);
        })
    };
}

/// Each line is received or counted as dropped, once; the count of waiting lines ends at 0 and never
/// falls below it.
macro_rules! lines_are_counted_once {
    ($module:ident) => {
        one_sends_and_one_receives!($module);
        two_send!($module);
    };
}

const AT_ONCE: std::time::Duration = std::time::Duration::ZERO;

macro_rules! one_sends_and_one_receives {
    ($module:ident) => {
        loom::model(|| {
            use $module::{LogRoom, line_channel};
            let (sender, receiver) = line_channel::<u8>(LogRoom { details: 1, lines: 1 });
            let sending = {
                let sender = sender.clone();
                loom::thread::spawn(move || {
                    sender.send(1, false);
                    sender.send(2, true);
                })
            };
            let take = || u64::from(receiver.receive(AT_ONCE).is_ok());
            let mut received = take();
            assert!(sender.waiting() <= 2, "below 0");
            // A report that cannot be written is made again.
            receiver.count_dropped(receiver.take_dropped());
            let told = receiver.take_dropped();
            sending.join().unwrap();
            received += take();
            assert_eq!(sender.waiting(), 0);
            assert_eq!(received + told + receiver.take_dropped(), 2);
        })
    };
}

macro_rules! two_send {
    ($module:ident) => {
        loom::model(|| {
            use $module::{LogRoom, line_channel};
            let (sender, receiver) = line_channel::<u8>(LogRoom { details: 1, lines: 1 });
            assert!(sender.send(1, false));
            let sending = {
                let sender = sender.clone();
                loom::thread::spawn(move || sender.send(2, false))
            };
            assert!(!sender.send(3, true), "there is no room");
            assert!(!sending.join().unwrap(), "there is no room");
            assert!(receiver.receive(AT_ONCE).is_ok());
            assert_eq!((sender.waiting(), receiver.take_dropped()), (0, 2));
        })
    };
}

/// A test for the module, and one for each mutant, which must fail the same model.
macro_rules! judge {
    ($model:ident, $module:ident, [$($mutant:ident),*]) => {
        #[test]
        fn $module() {
            $model!($module);
        }
        $(
            #[test]
            #[should_panic]
            fn $mutant() {
                $model!($mutant);
            }
        )*
    };
}

mod models {
    use super::*;

    judge!(
        images_are_whole,
        latest,
        [
            latest_writer_relaxed,
            latest_writer_without_release,
            latest_reader_relaxed,
            latest_reader_without_acquire,
            latest_reader_keeps_its_buffer
        ]
    );
    judge!(
        both_sides_agree,
        beat,
        [
            beat_end_in_two_steps,
            beat_arrive_in_two_steps,
            beat_life_without_release,
            beat_life_without_acquire
        ]
    );
    judge!(
        gate_tells_the_mode,
        gate,
        [
            gate_hear_without_release,
            gate_stuck_without_acquire,
            gate_mode_read_first,
            gate_monitor_writes_the_mode,
            gate_reserve_in_two_steps,
            gate_release_in_two_steps,
            gate_input_on_in_two_steps,
            gate_input_off_in_two_steps
        ]
    );
    judge!(
        lines_are_counted_once,
        log_channel,
        [
            log_channel_counted_after_it_is_sent,
            log_channel_sent_in_two_steps,
            log_channel_dropped_in_two_steps,
            log_channel_told_in_two_steps,
            log_channel_told_again_in_two_steps
        ]
    );
}
