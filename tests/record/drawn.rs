//! Random sections and blocks; the same seed gives the same ones.

use std::sync::Arc;

use rungd_engine::{BitCell, Cell, EngineCall, ScanTimes, WordCell};
use rungd_history::record::{BlockHead, RecordBlock, RecordedFile, RecordedProgram, SectionBody};
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::{FaultReason, Mode, StopReason, Ticket};
use rungd_runtime::{Origin, TapeEntry};
pub use rungd_test_support::numbers::Numbers;

/// Parts of recordings, drawn.
pub trait DrawnRecord: Sized {
    /// A number of any size: small, large, or an end of the range.
    fn any(&mut self) -> u64;

    fn word(&mut self) -> i32;
}

impl DrawnRecord for Numbers {
    fn any(&mut self) -> u64 {
        let number = self.below(1 << 31) << 33 | self.below(1 << 31) << 2 | self.below(4);
        match self.below(6) {
            0 => [0, 1, u64::MAX, u64::MAX / 2, 1 << 63, 96][self.below(6) as usize],
            _ => number >> self.below(64),
        }
    }

    fn word(&mut self) -> i32 {
        self.any() as i32
    }
}

pub fn mode(numbers: &mut Numbers) -> Mode {
    match numbers.below(10) {
        0 => Mode::Run,
        1 => Mode::Stop(StopReason::NotStarted),
        2 => Mode::Stop(StopReason::Operator),
        3 => Mode::Stop(StopReason::NothingRestored),
        4 => Mode::Fault(FaultReason::ScanTooLong { scan_us: numbers.any() as u32 }),
        5 => Mode::Fault(FaultReason::ScanNeverEnds),
        6 => Mode::Fault(FaultReason::EnginePanic),
        7 => Mode::Stop(StopReason::Instruction),
        8 => Mode::Stop(StopReason::Signal),
        _ => Mode::Fault(FaultReason::ScanThreadGone),
    }
}

pub fn origin(numbers: &mut Numbers) -> Origin {
    match numbers.below(4) {
        0 => Origin::Inputs,
        1 => Origin::Device(numbers.any() as u32),
        2 => Origin::Batch(Ticket(numbers.any())),
        _ => Origin::Command(CommandId(numbers.any())),
    }
}

pub fn write(numbers: &mut Numbers) -> (Cell, i32) {
    let cell = numbers.any() as u32;
    match numbers.below(2) {
        0 => (Cell::Bit(BitCell(cell)), numbers.below(2) as i32),
        _ => (Cell::Word(WordCell(cell)), numbers.word()),
    }
}

fn begin(numbers: &mut Numbers, now_ns: u64) -> TapeEntry {
    let mut number = || numbers.word();
    let times =
        ScanTimes { mean_us: number(), min_us: number(), max_us: number(), last_us: number() };
    TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s: numbers.any() as i64 })
}

fn entry(numbers: &mut Numbers, now_ns: u64) -> TapeEntry {
    let (cell, value) = write(numbers);
    match numbers.below(12) {
        0 => begin(numbers, numbers.0 % (1 << 62)),
        1 => begin(numbers, now_ns),
        2 => TapeEntry::Call(EngineCall::Start { now_ns: numbers.any() >> 2 }),
        3 => TapeEntry::Call(EngineCall::RequestStop),
        4 => TapeEntry::Call(EngineCall::Terminate),
        5 => TapeEntry::Call(EngineCall::Force(cell, value)),
        6 => TapeEntry::Call(EngineCall::Release(cell)),
        7 => TapeEntry::Origin(origin(numbers)),
        8 => TapeEntry::Number(numbers.any()),
        9 => TapeEntry::Mode(mode(numbers)),
        10 => TapeEntry::Swap { generation: numbers.any() as u32 },
        _ => TapeEntry::Call(EngineCall::Write(cell, value)),
    }
}

/// A section with realistic scans, and any entries between them.
pub fn section(numbers: &mut Numbers) -> SectionBody {
    let mut entries = Vec::new();
    let mut now_us = numbers.any() % (1 << 50);
    let period_us = 1 + numbers.below(20_000);
    let mut times = ScanTimes { mean_us: 300, min_us: 290, max_us: 320, last_us: 300 };
    let local = numbers.below(1 << 40);
    // Every third section is quiet.
    let is_busy = numbers.below(3) > 0;
    for _ in 0..numbers.below(60) {
        now_us += period_us + numbers.below(60);
        times.last_us = 280 + numbers.below(50) as i32;
        times.min_us = times.min_us.min(times.last_us);
        times.max_us = times.max_us.max(times.last_us);
        let (now_ns, local_s) = (now_us * 1000, ((now_us + local) / 1_000_000) as i64);
        entries.push(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }));
        if is_busy && numbers.below(4) == 0 {
            (0..numbers.below(6)).for_each(|_| entries.push(entry(numbers, now_ns)));
        }
        entries.push(TapeEntry::Call(EngineCall::Execute));
    }
    let names = ["root", "", "Modbus client 10.0.0.7", "ä"];
    let who =
        |numbers: &mut Numbers| (origin(numbers), names[numbers.below(4) as usize].to_owned());
    SectionBody {
        mode: mode(numbers),
        unix_offset_ns: numbers.any() as i64,
        lost: numbers.any(),
        who: (0..numbers.below(3)).map(|_| who(numbers)).collect(),
        entries,
    }
}

/// A program of this generation.
pub fn program(generation: u32) -> Arc<RecordedProgram> {
    let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
    Arc::new(RecordedProgram {
        version: "0.2.0".into(),
        process_start_ns: 1_700_000_000_000_000_000,
        generation,
        source: if generation == 0 { "start".into() } else { "reload by root".into() },
        hash: "00ff".into(),
        files: vec![file("controller.toml", "[controller]\n"), file("main.toml", "rung = []\n")],
    })
}

/// A block with a section, and a base image if `state` is given.
pub fn block(
    sequence: u64,
    program: &Arc<RecordedProgram>,
    state: Option<&[u8]>,
    section: &SectionBody,
) -> RecordBlock {
    let begin_ns = 1_700_000_000_000_000_000 + sequence as i64 * 1_000_000_000;
    let head = BlockHead {
        sequence,
        number: 100 * sequence,
        scans: 100,
        begin_ns,
        end_ns: begin_ns + 990_000_000,
        follows: sequence > 0,
        end_hash: (!sequence.is_multiple_of(3)).then_some([sequence as u8; 16]),
    };
    RecordBlock::new(program.clone(), head, state, section)
}
