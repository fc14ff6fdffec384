//! The size on disk of a day's recording of a plant with realistic times: a scan is up to 60 us
//! late, and its duration varies by 20 us both ways. The times come from a seed, so the figures do
//! not depend on the machine.
//!
//! ```console
//! cargo test --test commands record::size -- --nocapture
//! ```

use crate::record::drawn::Numbers;
use crate::record::line::Line;
use rungd_engine::{Cell, ScanTimes, WordCell};
use rungd_history::record::SegmentStart;
use rungd_runtime::{Origin, ScanStart, ScannedMachine};

const SECONDS: u64 = 180;

/// The first seconds are not part of the figure, because the mean scan time still changes in them.
const FIRST_SECONDS: usize = 60;
const SCANS_A_SECOND: u64 = 100;

/// Bytes on disk in a day. `change` makes the changes before a scan.
fn bytes_a_day(ladder: &str, mut change: impl FnMut(u64, &mut Numbers, &mut dyn Change)) -> u64 {
    let mut numbers = Numbers(11);
    let mut line = Line::new(ladder);
    line.start();
    let (mut sum_us, mut times) = (0, ScanTimes::default());
    let begin_ns = line.now_ns + 100_000_000;
    for number in 0..SECONDS * SCANS_A_SECOND {
        let now_ns = begin_ns + number * 10_000_000 + numbers.below(60_000);
        line.now_ns = now_ns;
        let local_s = (now_ns / 1_000_000_000) as i64 + 7200;
        let start = ScanStart { number, now_ns, times, local_s };
        ScannedMachine::begin_scan(&mut line.taped, &start);
        change(number, &mut numbers, &mut line.taped);
        line.taped.execute();
        line.taped.settle();
        line.read();
        let last_us = 300 - 20 + numbers.below(41) as i32;
        sum_us += i64::from(last_us);
        let first = number == 0;
        times = ScanTimes {
            mean_us: (sum_us / (number as i64 + 1)) as i32,
            min_us: if first { last_us } else { times.min_us.min(last_us) },
            max_us: times.max_us.max(last_us),
            last_us,
        };
    }
    let start = SegmentStart::new(&line.blocks[0].program);
    let (mut out, mut bases) = (Vec::new(), 0);
    for (at, block) in line.blocks.iter().skip(FIRST_SECONDS).enumerate() {
        // A base image every minute.
        bases += usize::from(at % 60 == 0);
        block.write(start.sum, at % 60 == 0, &mut out);
    }
    let base = line.blocks[0].bytes(true) - line.blocks[0].bytes(false);
    let blocks = line.blocks.len();
    println!("{blocks} blocks, {bases} base images of about {base} bytes, {} bytes", out.len());
    // A new segment every ten minutes.
    let segments = start.bytes.len() as u64 * 6 * 24;
    out.len() as u64 * 86_400 / (blocks - FIRST_SECONDS) as u64 + segments
}

/// Inputs that change.
trait Change {
    fn input(&mut self, x: u32, on: bool);
    fn word(&mut self, cell: u32, value: i32);
}

impl Change for rungd_runtime::Taped {
    fn input(&mut self, x: u32, on: bool) {
        self.comes_from(Origin::Device(0));
        self.set_input(x, on);
    }

    fn word(&mut self, cell: u32, value: i32) {
        self.comes_from(Origin::Device(1));
        match Cell::Word(WordCell(cell)) {
            Cell::Word(cell) => ScannedMachine::write_word(self, cell, value),
            Cell::Bit(_) | Cell::WordBit(_) => {}
        }
    }
}

const PLANTS: [(&str, &str); 2] = [
    ("bottling-plant", include_str!("../../config/programs/bottling-plant.toml")),
    ("batch-mixer", include_str!("../../config/programs/batch-mixer.toml")),
];

const MEGABYTE: u64 = 1_000_000;

#[test]
fn a_quiet_plant_takes_at_most_30_megabytes_a_day() {
    for (name, ladder) in PLANTS {
        let bytes = bytes_a_day(ladder, |_, _, _| {});
        println!("{name}, quiet: {:.1} MB a day", bytes as f64 / 1e6);
        assert!(bytes <= 30 * MEGABYTE, "{name}: {bytes}");
    }
}

#[test]
fn ten_inputs_changing_every_second_take_at_most_60_megabytes_a_day() {
    for (name, ladder) in PLANTS {
        let bytes = bytes_a_day(ladder, |scan, numbers, engine| {
            // Each of ten inputs changes once a second, at its own time.
            let which = scan % SCANS_A_SECOND / 10;
            if scan % 10 == (which * 7) % 10 {
                if which < 5 {
                    engine.input(which as u32, (scan / SCANS_A_SECOND).is_multiple_of(2));
                } else {
                    engine.word(100 + which as u32, 2000 + numbers.below(50) as i32);
                }
            }
        });
        println!("{name}, ten inputs a second: {:.1} MB a day", bytes as f64 / 1e6);
        assert!(bytes <= 60 * MEGABYTE, "{name}: {bytes}");
    }
}
