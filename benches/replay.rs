//! Measures `rungd replay` with a thousand seconds of a plant of 500 rungs at 10 ms.
//!
//! `cargo bench --bench replay` writes a recording, and prints the speed that the command itself
//! reports, for the recorded ladder and for a changed one. `docs/speed.md` has the results. Ten
//! inputs change every second, and a word every 0.1 s. The recording is as on disk, with one base
//! image per minute.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use rungd_config::load::recorded_files;
use rungd_engine::isa::{Word, WordSpace};
use rungd_engine::{Engine, ScanTimes};
use rungd_history::record::{
    RecordBlock, RecordedFile, RecordedProgram, Recorder, SegmentStart, TapeClock,
};
use rungd_language::lower::lower;
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{ScanStart, ScannedMachine, tape};

const SCANS: u64 = 100_000;
const PERIOD_NS: u64 = 10_000_000;
const BEGIN_NS: i64 = 1_795_341_600_000_000_000;
const BASE_EVERY: usize = 60;

fn main() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (recording, changed) = (folder.join("500.rungd-log"), folder.join("changed.toml"));
    let bytes = record();
    println!("recorded: {SCANS} scans of 500 rungs, {} bytes", bytes.len());
    std::fs::write(&recording, bytes).expect("the folder can be written");
    std::fs::write(&changed, ladder("3s")).expect("the folder can be written");
    for _ in 0..3 {
        replay(&[recording.as_os_str()]);
    }
    replay(&[recording.as_os_str(), "--ladder".as_ref(), changed.as_os_str()]);
}

fn replay(arguments: &[&std::ffi::OsStr]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.arg("replay").args(arguments).output().expect("rungd runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for line in text.lines().filter(|line| line.contains("real time")) {
        println!("{line}");
    }
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
}

/// 500 rungs: on-delays, counters, contacts and formulas in equal parts.
fn ladder(preset: &str) -> String {
    let mut text = "[[program]]\nname = \"Main\"\nrung = [\n".to_owned();
    for n in 0..125 {
        let (a, b, c) = (n % 40, (n + 7) % 40, (n + 13) % 40);
        let _ = writeln!(
            text,
            "  {{ when = [\"X{a}\", \"!X{b}\"], do = [\"ONDTMR T{n} preset={preset} output=C{n}\"] }},\n  \
             {{ leg.up = [\"X{b}\"], leg.rst = [\"X{c}\", \"X{a}\"], do = [\"CNT CT{n} preset=9\"] }},\n  \
             {{ when = [\"C{n} | CT{n}.Done\", \"!X{c}\", \"D0 < {n}\"], do = [\"OUT Y{n}\"] }},\n  \
             {{ when = [\"X{a}\"], do = [\"MATH D{target} = (D0 - {n}) * 5 / 3 + CT{n}.Acc\"] }},",
            target = n + 10,
        );
    }
    text.push_str("]\n");
    text
}

fn record() -> Vec<u8> {
    let files =
        [("plant.toml", "ladder = [\"main.toml\"]\n".to_owned()), ("main.toml", ladder("2s"))];
    let sources = files.clone().map(|(name, text)| SourceFile { name: name.to_owned(), text });
    let loaded = recorded_files(&sources);
    let program = loaded.program.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    let (mut taped, mut reader) = tape(Engine::new(lower(&program).0));
    let files = files.map(|(name, text)| RecordedFile { name: name.to_owned(), text: text.into() });
    let mut recorder = Recorder::new(RecordedProgram {
        version: env!("CARGO_PKG_VERSION").into(),
        process_start_ns: BEGIN_NS,
        generation: 0,
        source: "start".into(),
        hash: "00ff".into(),
        files: files.to_vec(),
    });
    let mut blocks = Vec::new();
    taped.start(0);
    taped.enters(Mode::Run);
    taped.settle();
    let level = lower(&program).1.layout.word(Word::Space(WordSpace::D, 0));
    for scan in 0..SCANS {
        let now_ns = scan * PERIOD_NS;
        let local_s = BEGIN_NS / 1_000_000_000 + (now_ns / 1_000_000_000) as i64;
        let start = ScanStart { number: scan + 1, now_ns, times: ScanTimes::default(), local_s };
        taped.begin_scan(&start);
        for x in 0..40 {
            taped.set_input(x, (scan + u64::from(x) * 10) / 400 % 2 == 1);
        }
        if scan % 10 == 0 {
            ScannedMachine::write_word(&mut taped, level, (scan / 10 % 200) as i32);
        }
        taped.execute();
        taped.settle();
        let clock = TapeClock { unix_ns: BEGIN_NS + now_ns as i64, unix_offset_ns: BEGIN_NS };
        while let Some((entry, state)) = reader.take() {
            blocks.extend(recorder.take(entry, state.as_deref(), clock));
            state.into_iter().for_each(|state| reader.give_back(state));
        }
    }
    on_disk(&blocks)
}

fn on_disk(blocks: &[RecordBlock]) -> Vec<u8> {
    let Some(first) = blocks.first() else { return Vec::new() };
    let start = SegmentStart::new(&first.program);
    let mut out = start.bytes.clone();
    for (at, block) in blocks.iter().enumerate() {
        block.write(start.sum, at % BASE_EVERY == 0, &mut out);
    }
    out
}
