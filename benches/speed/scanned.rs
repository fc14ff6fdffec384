//! The engine's side: the same workload from its ladder text, as the daemon would load it.

use anyhow::bail;
use rungd::engine::{Engine, ScanTimes, WordCell};
use rungd::isa::{Bit, BitSpace, Word, WordSpace};
use rungd::lower;
use rungd::resolve::{LoadOptions, load_ladders};
use rungd::source::finding::Severity;
use rungd::source::span::SourceFile;

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
    pub fn new(workload: &Workload) -> anyhow::Result<Scanned> {
        let sizes = ladder::sizes(workload);
        Scanned::load(&ladder::text(workload), sizes, workload.coils())
    }

    /// From text to an engine that has been started.
    pub fn load(
        text: &str,
        sizes: rungd::isa::MemorySizes,
        coils: usize,
    ) -> anyhow::Result<Scanned> {
        let file = SourceFile { name: "bench.toml".into(), text: text.to_owned() };
        let options = LoadOptions { sizes, ..LoadOptions::default() };
        let (program, findings) = load_ladders(&[file], &options);
        let Some(program) = program else {
            let error = findings.iter().find(|f| f.severity() == Severity::Error);
            bail!("the ladder was refused: {error:?}");
        };
        let mut engine = Engine::new(lower::lower(&program).0);
        engine.start(0);
        let layout = &engine.program().layout;
        Ok(Scanned {
            inputs: [false; INPUTS as usize],
            words: layout.word(Word::Space(WordSpace::D, 0)).0,
            first_coil: layout.bit(Bit::Space(BitSpace::C, 0)).0 as usize,
            coils,
            now_ns: 0,
            times: ScanTimes::default(),
            engine,
        })
    }

    /// Inputs and queued writes; they do not depend on what `scan` does first.
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

    /// One scan, 1 ms after the last.
    #[inline]
    pub fn scan(&mut self) {
        self.now_ns += 1_000_000;
        self.engine.begin_scan(self.now_ns, &self.times);
        self.engine.execute();
    }

    pub fn coils(&self) -> &[u8] {
        &self.engine.image().bits()[self.first_coil..self.first_coil + self.coils]
    }
}
