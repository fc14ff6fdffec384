//! `docs/record-format.md`: the reader on the page reads every entry that rungd writes.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use crate::record::drawn::{Numbers, block, program, section};
use crate::record::line::{Line, engine, on_disk};
use rungd_engine::{BitCell, Cell, EngineCall, EngineState, WordCell};
use rungd_history::record::{Recording, SectionBody, SegmentStart, state_hash};
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::{FaultReason, Mode, StopReason, Ticket};
use rungd_runtime::{Origin, ScannedMachine, TapeEntry};
use rungd_test_support::needs::{self, usable};

/// The output of the page's reader for a file.
fn printed_by_the_reader(name: &str, bytes: &[u8]) -> Option<String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-format").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("recording"), bytes).unwrap();
    let page = include_str!("../../docs/record-format.md");
    let script = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    std::fs::write(folder.join("reader.py"), script).unwrap();
    let mut python = Command::new("python3");
    if !usable(needs::python()) {
        return None;
    }
    let output = python.args(["reader.py", "recording"]).current_dir(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The same output, made with rungd's own reader.
fn printed(bytes: &[u8]) -> String {
    let recording = Recording::of_bytes(bytes.to_vec());
    assert_eq!(recording.flaws.len(), 0);
    let mut out = String::new();
    for at in 0..recording.count() {
        let program = recording.program(at);
        if at == 0 || recording.program(at - 1) != program {
            let (version, start_ns) = (&program.version, program.process_start_ns);
            let (generation, source, hash) = (program.generation, &program.source, &program.hash);
            writeln!(out, "program {version} {start_ns} {generation} {source} {hash}").unwrap();
            for file in &program.files {
                writeln!(out, "file {} {}", file.name, file.text.chars().count()).unwrap();
            }
        }
        let head = recording.head(at);
        let follows = u8::from(head.follows);
        let hash = head.end_hash.map_or("-".to_owned(), hex);
        writeln!(
            out,
            "block {} {} {} {} {} {follows} {hash}",
            head.sequence, head.number, head.scans, head.begin_ns, head.end_ns
        )
        .unwrap();
        let (state, section) = recording.read(at).unwrap().expect("it is whole");
        if let Some(state) = state {
            put_state(&mut out, &state, &recording, at);
        }
        put_section(&mut out, &section);
    }
    out
}

fn hex(hash: [u8; 16]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn put_state(out: &mut String, state: &EngineState, recording: &Recording, at: usize) {
    let mut engine = engine(recording.program(at)).unwrap();
    assert!(engine.resume(state));
    let (bits, words) = (engine.image().bits(), engine.image().words());
    let on: u64 = bits.iter().map(|bit| u64::from(*bit)).sum();
    let sum: i64 = words.iter().map(|word| i64::from(*word)).sum();
    let (now_ns, scans, hash) = (state.now_ns(), state.scans(), hex(state_hash(state)));
    let (bits, words) = (bits.len(), words.len());
    writeln!(out, "state {now_ns} {scans} {bits} {on} {words} {sum} {hash}").unwrap();
}

fn put_section(out: &mut String, section: &SectionBody) {
    let SectionBody { unix_offset_ns, lost, .. } = section;
    writeln!(out, "section {} {unix_offset_ns} {lost}", mode(section.mode)).unwrap();
    for (origin, who) in &section.who {
        writeln!(out, "who {} {who}", self::origin(*origin)).unwrap();
    }
    section.entries.iter().for_each(|entry| writeln!(out, "{}", line(entry)).unwrap());
}

fn line(entry: &TapeEntry) -> String {
    match *entry {
        TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }) => {
            let (mean, min, max) = (times.mean_us, times.min_us, times.max_us);
            format!("begin {now_ns} {mean} {min} {max} {} {local_s}", times.last_us)
        }
        TapeEntry::Call(EngineCall::Start { now_ns }) => format!("start {now_ns}"),
        TapeEntry::Call(EngineCall::RequestStop) => "request stop".into(),
        TapeEntry::Call(EngineCall::Execute) => "execute".into(),
        TapeEntry::Call(EngineCall::Terminate) => "terminate".into(),
        TapeEntry::Call(EngineCall::Write(at, value)) => format!("write {} {value}", cell(at)),
        TapeEntry::Call(EngineCall::Force(at, value)) => format!("force {} {value}", cell(at)),
        TapeEntry::Call(EngineCall::Release(at)) => format!("release {}", cell(at)),
        TapeEntry::Origin(at) => format!("origin {}", origin(at)),
        TapeEntry::Number(number) => format!("number {number}"),
        TapeEntry::Mode(to) => format!("mode {}", mode(to)),
        TapeEntry::Swap { generation } => format!("swap {generation}"),
        TapeEntry::Lost { steps } => format!("lost {steps}"),
        TapeEntry::State { .. } => panic!("a section has no states"),
    }
}

fn cell(cell: Cell) -> String {
    match cell {
        Cell::Bit(BitCell(at)) => format!("bit {at}"),
        Cell::Word(WordCell(at)) => format!("word {at}"),
        Cell::WordBit(_) => panic!("a recording has whole words alone"),
    }
}

fn origin(origin: Origin) -> String {
    match origin {
        Origin::Inputs => "inputs 0".into(),
        Origin::Device(at) => format!("device {at}"),
        Origin::Batch(Ticket(at)) => format!("batch {at}"),
        Origin::Command(CommandId(at)) => format!("command {at}"),
    }
}

fn mode(mode: Mode) -> String {
    match mode {
        Mode::Run => "0".into(),
        Mode::Stop(StopReason::NotStarted) => "1".into(),
        Mode::Stop(StopReason::Instruction) => "2".into(),
        Mode::Stop(StopReason::Signal) => "3".into(),
        Mode::Stop(StopReason::ScanLimit) => "4".into(),
        Mode::Stop(StopReason::Operator) => "5".into(),
        Mode::Stop(StopReason::CommandLine) => "6".into(),
        Mode::Stop(StopReason::RestartGuard) => "7".into(),
        Mode::Stop(StopReason::NothingRestored) => "8".into(),
        Mode::Fault(FaultReason::ScanTooLong { scan_us }) => format!("16/{scan_us}"),
        Mode::Fault(FaultReason::ScanNeverEnds) => "17".into(),
        Mode::Fault(FaultReason::ScanNeverBegins) => "18".into(),
        Mode::Fault(FaultReason::EnginePanic) => "19".into(),
        Mode::Fault(FaultReason::ScanThreadGone) => "20".into(),
    }
}

fn assert_printed(name: &str, bytes: &[u8]) {
    let Some(text) = printed_by_the_reader(name, bytes) else { return };
    let expected = printed(bytes);
    for (at, (found, expected)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "line {at}");
    }
    assert_eq!(text.len(), expected.len());
}

#[test]
fn the_reader_of_the_page_reads_a_recording() {
    let mut line = Line::new(
        r#"
[[program]]
name = "Main"
rung = [ { when = ["X0"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s", "OUT Y0"] } ]
[[program.stage]]
name = "A"
rung = [ { when = ["X1"], do = ["OUT Y1"] } ]
[[task]]
name = "Job"
rung = [ { when = ["$On"], do = ["OUT Y2"] } ]
"#,
    );
    line.start();
    let mut numbers = Numbers(2);
    for scan in 0..400 {
        if scan == 150 {
            line.taped.comes_from(Origin::Command(CommandId(1)));
            line.recorder.note(Origin::Command(CommandId(1)), "root");
            line.taped.force(Cell::Word(WordCell(7)), -40);
            line.taped.force(Cell::Bit(BitCell(40)), 1);
            line.taped.settle();
        }
        line.scan(10_000_000 + numbers.below(60_000), |taped| {
            taped.comes_from(Origin::Device(0));
            taped.set_input(0, scan / 20 % 2 == 0);
            taped.comes_from(Origin::Batch(Ticket(scan)));
            ScannedMachine::write_word(taped, WordCell(30), numbers.below(50) as i32);
        });
        line.read();
    }
    line.stop();
    line.flush();
    assert_printed("run", &on_disk(&line.blocks));
    // A recording whose end is torn off.
    let bytes = on_disk(&line.blocks);
    let Some(text) = printed_by_the_reader("torn", &bytes[..bytes.len() - 5]) else { return };
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("torn at "), "{last}");
    assert!(printed(&bytes).starts_with(text.strip_suffix(&format!("{last}\n")).unwrap()));
}

#[test]
fn the_reader_of_the_page_reads_sections_of_every_kind() {
    let mut numbers = Numbers(4);
    let mut bytes = Vec::new();
    for sequence in 0..60 {
        let program = program(sequence as u32 / 20);
        let start = SegmentStart::new(&program);
        if sequence % 20 == 0 {
            bytes.extend_from_slice(&start.bytes);
        }
        let section = section(&mut numbers);
        block(sequence, &program, None, &section).write(start.sum, true, &mut bytes);
    }
    assert_printed("drawn", &bytes);
}
