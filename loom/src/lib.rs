//! Models of what threads share without locks: loom executes every order of the accesses, and every
//! value that the memory orders allow a load to see.
//!
//! `build.rs` copies the modules of `crates/runtime/src` on loom's atomics, and makes mutants of them. Each
//! model must hold for the module, and fail for each of its mutants: tests on a processor that keeps
//! more order than the language promises would see neither. Halves of an `AcqRel` that only forbid a
//! load to see a later store have no mutant: loom executes no such load.
//!
//! The rings between the threads are rtrb's, and the log's queue is the standard library's channel:
//! their own tests judge them. Run by `cargo test --manifest-path loom/Cargo.toml`.

#![cfg(test)]
#![allow(dead_code)]

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
}
