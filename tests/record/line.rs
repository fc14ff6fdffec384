//! A scan thread in virtual time with its recorder, and its blocks as a recording.

use std::hash::{DefaultHasher, Hash, Hasher};

use rungd_engine::{Engine, ScanTimes};
use rungd_history::record::{
    Recent, RecordBlock, RecordedFile, RecordedProgram, Recorder, SegmentStart, TapeClock,
};
use rungd_language::lower::lower;
use rungd_runtime::exchange::{Mode, StopReason};
use rungd_runtime::{ImageCells, ScanStart, ScannedMachine, TapeEntry, TapeReader, Taped, tape};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_test_support::run::load;

/// The wall clock at monotonic time 0.
pub const UNIX_NS: i64 = 1_700_000_000_000_000_000;

/// A program of one ladder.
pub fn recorded(ladder: &str, generation: u32) -> RecordedProgram {
    let file = RecordedFile { name: "main.toml".into(), text: ladder.into() };
    RecordedProgram {
        version: "0.2.0".into(),
        process_start_ns: UNIX_NS,
        generation,
        source: "start".into(),
        hash: "00ff".into(),
        files: vec![file],
    }
}

/// The engine of a recorded ladder.
pub fn engine(program: &RecordedProgram) -> Result<Engine, String> {
    load(&program.files[0].text).map(|program| Engine::new(lower(&program).0))
}

/// The hash of bits and words.
pub fn hashed(image: ImageCells<'_>) -> u64 {
    let mut hasher = DefaultHasher::new();
    (image.bits, image.words).hash(&mut hasher);
    hasher.finish()
}

/// A scan thread and its recorder.
pub struct Line {
    pub taped: Taped,
    pub reader: TapeReader,
    pub recorder: Recorder,
    pub blocks: Vec<RecordBlock>,
    /// All entries of the tape except states.
    pub entries: Vec<TapeEntry>,
    /// The number of each scan, and the hash of the image after it.
    pub images: Vec<(u64, u64)>,
    pub keeps_images: bool,
    pub now_ns: u64,
    number: u64,
    ladder: String,
}

impl Line {
    pub fn new(ladder: &str) -> Line {
        let program = recorded(ladder, 0);
        let engine = engine(&program).unwrap_or_else(|error| panic!("{error}"));
        let (taped, reader) = tape(engine);
        Line {
            taped,
            reader,
            recorder: Recorder::new(program),
            blocks: Vec::new(),
            entries: Vec::new(),
            images: Vec::new(),
            keeps_images: true,
            now_ns: 5_000_000_000,
            number: 1,
            ladder: ladder.into(),
        }
    }

    pub fn clock(&self) -> TapeClock {
        let unix_offset_ns = UNIX_NS;
        TapeClock { unix_ns: UNIX_NS + self.now_ns as i64, unix_offset_ns }
    }

    /// Reads the tape to its end.
    pub fn read(&mut self) {
        while let Some((entry, state)) = self.reader.take() {
            if !matches!(entry, TapeEntry::State { .. } | TapeEntry::Lost { .. }) {
                self.entries.push(entry);
            }
            self.blocks.extend(self.recorder.take(entry, state.as_deref(), self.clock()));
            state.into_iter().for_each(|state| self.reader.give_back(state));
        }
    }

    pub fn flush(&mut self) {
        self.read();
        self.blocks.extend(self.recorder.flush(self.clock()));
    }

    pub fn start(&mut self) {
        self.taped.start(self.now_ns);
        self.taped.enters(Mode::Run);
        self.taped.settle();
    }

    pub fn scan(&mut self, period_ns: u64, come_in: impl FnOnce(&mut Taped)) -> bool {
        self.now_ns += period_ns;
        let times = ScanTimes { mean_us: 300, min_us: 290, max_us: 320, last_us: 310 };
        let local_s = (self.now_ns / 1_000_000_000) as i64 + 7200;
        let start = ScanStart { number: self.number, now_ns: self.now_ns, times, local_s };
        ScannedMachine::begin_scan(&mut self.taped, &start);
        come_in(&mut self.taped);
        let last = self.taped.execute();
        if self.keeps_images {
            self.images.push((self.number, hashed(ScannedMachine::image(&self.taped))));
        }
        self.number += 1;
        self.taped.settle();
        last
    }

    /// Reloads: the changed program continues from the old one's state.
    pub fn reload(&mut self, ladder: &str, generation: u32) {
        let loaded = |ladder: &str| lower(&load(ladder).unwrap_or_else(|error| panic!("{error}")));
        let (old, new) = (loaded(&self.ladder), loaded(ladder));
        let plan = ReloadPlan::new(
            LoweredProgram { program: &old.0, symbols: &old.1 },
            LoweredProgram { program: &new.0, symbols: &new.1 },
        );
        let mut taped = Taped::new(Engine::new(new.0)).with_spares();
        taped.adopt(&mut self.taped, &plan.transfer, true, &[]);
        taped.swapped(generation);
        taped.settle();
        self.taped = taped;
        self.ladder = ladder.into();
        self.recorder.program(recorded(ladder, generation));
    }

    pub fn stop(&mut self) {
        self.taped.terminate();
        self.taped.enters(Mode::Stop(StopReason::Operator));
        self.taped.settle();
    }
}

/// The blocks as a recording on disk: only some blocks have a base image.
pub fn on_disk(blocks: &[RecordBlock]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut start: Option<(u32, SegmentStart)> = None;
    for (at, block) in blocks.iter().enumerate() {
        let generation = block.program.generation;
        let is_new = start.as_ref().is_none_or(|(of, _)| *of != generation);
        if is_new {
            start = Some((generation, SegmentStart::new(&block.program)));
            out.extend_from_slice(&start.as_ref().unwrap().1.bytes);
        }
        let sum = start.as_ref().unwrap().1.sum;
        block.write(sum, is_new || !block.head.follows || at % 5 == 4, &mut out);
    }
    out
}

pub fn in_memory(blocks: &[RecordBlock]) -> Vec<u8> {
    let mut recent = Recent::new(1 << 26);
    blocks.iter().for_each(|block| recent.put(block));
    recent.write()
}

/// A ladder that counts scans.
pub const COUNTER: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s"] },
  { when = ["X0"], do = ["OUT Y0"] },
]
"#;
