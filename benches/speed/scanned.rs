//! The engine's side: the same workload, loaded from its ladder text as the daemon does.

use anyhow::bail;
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Bit, BitSpace, MemorySizes, Word, WordSpace};
use rungd_engine::{self as engine, Engine, ScanTimes, WordCell};
use rungd_language::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::finding::Severity;
use rungd_language::source::span::SourceFile;

use super::ladder;
use super::workload::{INPUTS, Outside, Workload};

/// The engine with a workload's ladder loaded.
pub struct Scanned {
    engine: Engine,
    inputs: [bool; INPUTS as usize],
    words: u32,
    first_coil: usize,
    coils: usize,
    now_ns: u64,
    times: ScanTimes,
}

impl Scanned {
    /// `window`: number of operations that are scheduled together.
    pub fn new(workload: &Workload, window: usize) -> anyhow::Result<Scanned> {
        let program = resolve(&ladder::text(workload), ladder::sizes(workload))?;
        Ok(Scanned::of(lower::lower_with(&program, window).0, workload.coils()))
    }

    /// Loads a ladder text and starts its engine.
    pub fn load(text: &str, sizes: MemorySizes, coils: usize) -> anyhow::Result<Scanned> {
        Ok(Scanned::of(lower::lower(&resolve(text, sizes)?).0, coils))
    }

    fn of(program: engine::EngineProgram, coils: usize) -> Scanned {
        let mut engine = Engine::new(program);
        engine.start(0);
        let layout = &engine.program().layout;
        Scanned {
            inputs: [false; INPUTS as usize],
            words: layout.word(Word::Space(WordSpace::D, 0)).0,
            first_coil: layout.bit(Bit::Space(BitSpace::C, 0)).0 as usize,
            coils,
            now_ns: 0,
            times: ScanTimes::default(),
            engine,
        }
    }

    /// Writes inputs and queued writes, apart from `scan`.
    pub fn outside(&mut self, outside: &Outside) {
        for x in &outside.toggles {
            let on = &mut self.inputs[usize::from(*x)];
            *on = !*on;
            self.engine.set_input(u32::from(*x), *on);
        }
        for (word, value) in &outside.writes {
            self.engine.write_word(WordCell(self.words + u32::from(*word)), *value);
        }
    }

    /// One scan, 1 ms after the previous one.
    #[inline]
    pub fn scan(&mut self) {
        self.now_ns += 1_000_000;
        self.engine.begin_scan(self.now_ns, &self.times, &LocalTime::default());
        self.engine.execute();
    }

    /// A queued write of a data word.
    pub fn put_word(&mut self, at: usize, value: i32) {
        self.engine.write_word(WordCell(self.words + at as u32), value);
    }

    /// The first data words.
    pub fn words(&self, count: usize) -> &[i32] {
        let first = self.words as usize;
        &self.engine.image().words()[first..first + count]
    }

    /// The status bits of mishaps.
    pub fn mishaps(&self) -> [u8; 4] {
        let layout = &self.engine.program().layout;
        [10, 11, 12, 13].map(|n| {
            let cell = layout.bit(Bit::Space(BitSpace::St, n));
            u8::from(self.engine.image().bit(cell))
        })
    }

    pub fn coils(&self) -> &[u8] {
        &self.engine.image().bits()[self.first_coil..self.first_coil + self.coils]
    }
}

fn resolve(text: &str, sizes: MemorySizes) -> anyhow::Result<Program> {
    let file = SourceFile { name: "bench.toml".into(), text: text.to_owned() };
    let options = LoadOptions { sizes, ..LoadOptions::default() };
    let (program, findings) = load_ladders(&[file], &options);
    let Some(program) = program else {
        let error = findings.iter().find(|f| f.severity() == Severity::Error);
        bail!("the ladder was refused: {error:?}");
    };
    Ok(program)
}
