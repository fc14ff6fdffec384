//! Recordings from outside, as the commands of a user read them: names that forge lines, few bytes
//! that unpack to very many, pipes, and damaged files.

use std::fs;
use std::io::Write;
use std::process::{Command, Output};
use std::sync::Arc;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::cli::replay::{Place, conveyor};
use crate::record::drawn::Numbers;
use crate::record::hostile::mangle;
use rungd_engine::{Cell, EngineCall};
use rungd_history::record::{Recent, RecordBlock, RecordedProgram, Recording};
use rungd_runtime::command::CommandId;
use rungd_runtime::{Origin, TapeEntry};
use rungd_test_support::system::shell;

/// The commands that read a recording, `@`.
const COMMANDS: [&[&str]; 7] = [
    &["record", "list", "@"],
    &["record", "info", "@"],
    &["record", "verify", "@"],
    &["record", "test", "@"],
    &["replay", "@"],
    &["replay", "@", "--ladder", "new.toml"],
    &["why", "jam", "--recording", "@"],
];

/// A command with its recording.
fn of<'w>(words: &[&'w str], recording: &'w str) -> Vec<&'w str> {
    words.iter().map(|word| if *word == "@" { recording } else { *word }).collect()
}

/// Runs a command within a gigabyte of memory and a minute.
fn bounded(place: &Place, words: &[&str]) -> Output {
    limited(place, 1_000_000, words)
}

/// Runs a command within this many kB of address space and a minute.
fn limited(place: &Place, kilobytes: u32, words: &[&str]) -> Output {
    let mut command = Command::new("sh");
    let limits = format!("ulimit -v {kilobytes}; exec timeout 60 \"$0\" \"$@\"");
    command.args(["-c", &limits, env!("CARGO_BIN_EXE_rungd")]).args(words);
    command.current_dir(&place.0).env("TZ", "UTC0").env("NO_COLOR", "1").output().unwrap()
}

/// Standard output and standard error.
fn text(output: &Output) -> String {
    let both = [&output.stdout, &output.stderr];
    both.map(|bytes| String::from_utf8(bytes.clone()).unwrap()).concat()
}

/// Whether a command ended with an answer: no panic, no signal, no time-out.
fn has_answered(output: &Output) -> bool {
    let said = text(output);
    let is_ended = output.status.code().is_some_and(|code| code != 101 && code < 124);
    is_ended && !said.contains("panicked") && !said.contains("memory allocation")
}

fn file_of(blocks: &[RecordBlock]) -> Vec<u8> {
    let mut recent = Recent::new(1 << 26);
    blocks.iter().for_each(|block| recent.put(block));
    recent.write()
}

const FORGED: &str = "10 of 10 hashes equal";

/// A text that would add a line to a report, and move the cursor of a terminal.
fn forging(text: &str) -> String {
    format!("{text}\n{FORGED}\u{1b}[2K\r\n")
}

/// The program with names that forge lines: those of its file, and all texts about it.
fn forged(program: &RecordedProgram) -> Arc<RecordedProgram> {
    let mut program = program.clone();
    program.files.iter_mut().for_each(|file| file.name = forging(&file.name));
    // An alarm's text may have several lines; a report of a recording has it in one.
    let ladder = program.files[1].text.replace("stays in", &format!("stays\\n{FORGED}"));
    program.files[1].text = ladder.into();
    for text in [&mut program.version, &mut program.source, &mut program.hash] {
        *text = forging(text);
    }
    Arc::new(program)
}

/// A block with a write of a command whose sender's name forges a line.
fn with_forged_sender(block: &RecordBlock, cell: Cell) -> RecordBlock {
    let recording = Recording::of_bytes(file_of(std::slice::from_ref(block)));
    let (state, mut section) = recording.read(0).unwrap().expect("it is whole");
    let mut base = Vec::new();
    state.expect("it has a base image").write(&mut base);
    let sender = Origin::Command(CommandId(9));
    section.who.push((sender, forging("root")));
    let call = TapeEntry::Call(EngineCall::Write(cell, 77));
    section.entries.splice(0..0, [TapeEntry::Origin(sender), call]);
    RecordBlock::new(block.program.clone(), block.head.clone(), Some(&base), &section)
}

#[test]
fn names_in_a_recording_add_no_line_to_any_report() {
    let place = Place::new("forged");
    let mut line = conveyor();
    line.bytes();
    let program = forged(&line.blocks[0].program);
    line.blocks.iter_mut().for_each(|block| block.program = Arc::clone(&program));
    let last = line.blocks.len() - 1;
    line.blocks[last] = with_forged_sender(&line.blocks[last], line.cell("D0"));
    place.write("plant.rungd-log", &file_of(&line.blocks));
    let who = ["why", "D0", "--recording", "@"];
    for words in COMMANDS.into_iter().chain([&who[..]]) {
        let output = bounded(&place, &of(words, "plant.rungd-log"));
        let said = text(&output);
        assert!(has_answered(&output), "{words:?}: {said}");
        let is_forged = |line: &str| line.trim_start().starts_with(FORGED);
        assert!(!said.lines().any(is_forged), "{words:?}: {said}");
        assert!(!said.contains(['\u{1b}', '\r']), "{words:?}: {said}");
    }
    // The names are in these reports, in one line.
    for (words, shown) in [
        (COMMANDS[0], format!("plant.toml\\u{{a}}{FORGED}\\u{{1b}}")),
        (COMMANDS[1], format!("main.toml\\u{{a}}{FORGED}\\u{{1b}}")),
        (COMMANDS[4], format!("stays\\u{{a}}{FORGED} front of the eye")),
        (COMMANDS[6], format!("main.toml\\u{{a}}{FORGED}\\u{{1b}}")),
        (&who, format!("root\\u{{a}}{FORGED}\\u{{1b}}")),
    ] {
        let said = text(&place.rungd(&of(words, "plant.rungd-log")));
        assert!(said.contains(&shown), "{words:?} without {shown}: {said}");
    }
}

/// A segment with this program, before packing.
fn segment(program: impl Iterator<Item = Vec<u8>>) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    program.for_each(|part| packed.write_all(&part).unwrap());
    let packed = packed.finish().unwrap();
    let mut bytes = b"rungd record\r\n\x1A\n".to_vec();
    for number in [1, packed.len() as u32, crc32fast::hash(&packed)] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes.extend(packed);
    bytes
}

fn number(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 0x7F {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// The beginning of a program with this number of files.
fn program(files: u64) -> Vec<u8> {
    let text = |text: &str| [number(text.len() as u64), text.as_bytes().to_vec()].concat();
    let start = 7_i64.to_le_bytes().to_vec();
    [text("1.0"), start, number(0), text("start"), text("00ff"), number(files)].concat()
}

const MILLION: usize = 1_000_000;

/// 80 kB that claim forty million empty files, of which each would take some fifty bytes.
fn many_files() -> Vec<u8> {
    let files = 40 * MILLION as u64;
    let nothing = std::iter::repeat_n(vec![0; 2 * MILLION], 40);
    segment(std::iter::once(program(files)).chain(nothing))
}

#[test]
fn few_bytes_that_claim_millions_of_files_cost_little_memory() {
    let place = Place::new("many_files");
    let bomb = many_files();
    assert!(bomb.len() < 500_000, "{}", bomb.len());
    // Scans of an innocent program follow.
    let whole = fs::read(place.0.join("plant.rungd-log")).unwrap();
    place.write("plant.rungd-log", &[bomb, whole].concat());
    for words in COMMANDS {
        let output = bounded(&place, &of(words, "plant.rungd-log"));
        let said = text(&output);
        assert!(output.status.success() && has_answered(&output), "{words:?}: {said}");
        let flaw = "warning: plant.rungd-log: the program at byte 0 is not one of rungd";
        assert!(said.contains(flaw), "{words:?}: {said}");
    }
}

/// Twelve programs with texts of 16 MB each: a list does not keep the texts.
#[test]
fn listing_recordings_reads_only_their_heads() {
    let place = Place::new("large_programs");
    let large = |letter: u8| {
        let text = std::iter::repeat_n(vec![letter; MILLION], 16);
        let begin = [program(1), number(1), vec![b'a'], number(16 * MILLION as u64)].concat();
        segment(std::iter::once(begin).chain(text))
    };
    let mut bytes: Vec<u8> = (b'a'..=b'l').flat_map(large).collect();
    bytes.extend(fs::read(place.0.join("plant.rungd-log")).unwrap());
    place.write("plant.rungd-log", &bytes);
    let output = limited(&place, 200_000, &["record", "list", "plant.rungd-log"]);
    let said = text(&output);
    assert!(output.status.success() && said.contains("scans 1 to 2000"), "{said}");
    assert!(!said.contains("warning"), "{said}");
}

#[test]
fn a_pipe_named_like_a_recording_blocks_no_command() {
    let place = Place::new("pipe");
    assert!(shell(&["mkfifo", place.0.join("pipe.rungd-log").to_str().unwrap()]));
    for words in COMMANDS {
        let output = bounded(&place, &of(words, "pipe.rungd-log"));
        let said = text(&output);
        assert!(has_answered(&output) && !output.status.success(), "{words:?}: {said}");
        assert!(said.contains("not a regular file"), "{words:?}: {said}");
        // In a folder, the other recordings are read.
        let output = bounded(&place, &of(words, "."));
        let said = text(&output);
        assert!(output.status.success(), "{words:?}: {said}");
        assert!(said.contains("pipe.rungd-log: it is not a regular file"), "{words:?}: {said}");
    }
}

#[test]
fn every_command_answers_about_a_damaged_recording() {
    let place = Place::new("mangled");
    let whole = fs::read(place.0.join("plant.rungd-log")).unwrap();
    let mut answers = 0;
    for seed in 0..6 {
        let mut bytes = whole.clone();
        mangle(&mut bytes, &mut Numbers(seed));
        place.write("plant.rungd-log", &bytes);
        for words in [COMMANDS[1], COMMANDS[2], COMMANDS[5], COMMANDS[6]] {
            let output = bounded(&place, &of(words, "plant.rungd-log"));
            assert!(has_answered(&output), "{seed} {words:?}: {}", text(&output));
            answers += u32::from(!output.stdout.is_empty());
        }
    }
    assert!(answers > 12, "most damage leaves something to read: {answers}");
}
