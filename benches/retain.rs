//! Measures the times for retentive memory: the scan thread publishes its image; the store's thread
//! gathers the retained memory and encodes it as a slot.
//!
//! `cargo bench --bench retain` prints a table; `docs/speed.md` has the results. All readers share
//! the image that a scan publishes: retentive memory adds no copy.

use std::hint::black_box;
use std::time::Instant;

use rungd_engine::isa::{BitSpace, MemorySizes, Space};
use rungd_language::lower;
use rungd_language::resolve::range::Range;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::{FileId, SourceFile, Span};
use rungd_runtime::command::Forces;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{ExchangeShape, ImageCells, SafeState, ScanFacts, link};
use rungd_state::retain::RetainPlan;
use rungd_state::retain::format::{ImageStamp, put_slot};

const ROUNDS: usize = 20_000;

fn main() {
    println!("what                                             p50 us    p99 us    max us");
    publish("publish an image of 32 KiB", 4 << 10, 7 << 10);
    let sizes = MemorySizes::default();
    let text = "[[program]]\nname = \"Main\"\nrung = [ { when = [\"$On\"], do = [\"OUT C0\"] } ]\n";
    let file = SourceFile { name: "bench.toml".into(), text: text.into() };
    let options = LoadOptions { sizes, ..LoadOptions::default() };
    let (program, _) = load_ladders(&[file], &options);
    let program = program.expect("it loads");
    let (_, symbols) = lower::lower(&program);
    let (bits, words) = (symbols.layout.bit_count() as usize, symbols.layout.word_count() as usize);
    publish(&format!("publish all of memory, {} KiB", (bits + 4 * words) >> 10), bits, words);
    let span = Span { file: FileId(0), start: 0, end: 0 };
    let whole =
        |space, last| Range { space, first: 0, last, span, of_tag: false, of_record: false };
    let ranges = [
        whole(Space::Bit(BitSpace::C), 2047),
        whole(Space::Word(rungd_engine::isa::WordSpace::D), 4095),
        whole(Space::Word(rungd_engine::isa::WordSpace::V), 3071),
        whole(Space::Counter, 127),
    ];
    let plan = RetainPlan::new(&ranges, &program, &symbols);
    let (bits, words) = (vec![0; bits], vec![7; words]);
    let (mut content, mut slot) = (Vec::new(), Vec::new());
    let kib = plan.content_bytes() >> 10;
    timed(&format!("gather {kib} KiB (store's thread)"), || {
        plan.gather(black_box(&bits), black_box(&words), &mut content);
    });
    let stamp = ImageStamp { sequence: 1, scan: 2, saved_ms: 3, flags: 0, scanned_ms: 0 };
    timed(&format!("put {kib} KiB into a slot (store's thread)"), || {
        put_slot(&mut slot, 1, &stamp, black_box(&content));
    });
}

fn publish(what: &str, bits: usize, words: usize) {
    let (bits, words) = (vec![1; bits], vec![7; words]);
    let (port, mut scan, mut world) = link(ExchangeShape {
        inputs: 64,
        bits: bits.clone(),
        words: words.clone(),
        first_output: 0,
        forces_active: 0,
        safe: vec![SafeState::Off; 8],
    });
    let forces = Forces::default();
    let mut times = Vec::new();
    for now_ns in 0..ROUNDS as u64 {
        let (mode, since_ns, ending, forces) = (Mode::Run, 0, false, &forces);
        let facts = ScanFacts { scans: now_ns, now_ns, mode, since_ns, ending, forces };
        let begin = Instant::now();
        assert!(scan.publish(facts, black_box(ImageCells { bits: &bits, words: &words })));
        times.push(begin.elapsed().as_nanos() as u64);
        world.pump();
    }
    assert_eq!(port.latest().scans, ROUNDS as u64 - 1);
    told(what, times);
}

fn timed(what: &str, mut call: impl FnMut()) {
    let mut times = Vec::new();
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        call();
        times.push(begin.elapsed().as_nanos() as u64);
    }
    told(what, times);
}

fn told(what: &str, mut times: Vec<u64>) {
    times.sort_unstable();
    let us = |at: usize| times[at] as f64 / 1000.0;
    let last = times.len() - 1;
    println!("{what:46} {:9.2} {:9.2} {:9.2}", us(last / 2), us(last * 99 / 100), us(last));
}
