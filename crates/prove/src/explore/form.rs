//! The form of a state: what of an engine's state decides the future of the judged bits.
//!
//! `search` saves an engine's state behind a scan and loads it before the next one. Two states with
//! the same bytes have the same future, up to cells that nobody asks about. A state has: the live
//! cells that something writes (`live`), `.Acc`s up to their bounds (`caps`), the state of the
//! blocks and Stages in the cone (`elements`), and the parts of time that something reads: the
//! phase of clock bits, the scans since the start. All times are relative to the scan that has
//! ended. A loaded engine is at [`BASE_MS`], so that no time lies before its start.

use rungd_engine::isa::status::{dst, st};
use rungd_engine::isa::{Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, Cell, Engine, EngineProgram, ResumeBits, Slice};

use super::bytes::{ByteReader, ByteWriter};
use super::caps::{Cap, caps};
use super::effects::EffectCells;
use super::elements::{LoadedTime, StoredElements, TimersOf};
use super::live::live;
use super::ranges::WordRanges;
use crate::events::RetainedCell;
use crate::model::{ProofModel, Target};

/// The time of a loaded state, ms: a multiple of all periods of clock bits, and greater than all
/// times that a state holds.
const BASE_MS: u64 = 60_000 * 100_000;

/// The form of the states of a cone.
#[derive(Debug)]
pub(super) struct StateForm {
    bits: Vec<u32>,
    words: Vec<StoredWord>,
    elements: StoredElements,
    clock: StoredClock,
    /// The period, if RUN may begin again behind a scan: then a state says whether it has.
    begins_again: Option<u64>,
    /// The number of bytes of a state.
    pub size: usize,
}

#[derive(Debug)]
struct StoredWord {
    cell: u32,
    cap: Option<Cap>,
    /// Of the time that a RETURN has withheld: the timers that may get it. It is 0 while none of
    /// them times.
    timers: Option<TimersOf>,
}

/// What the cone reads of the time since the start.
#[derive(Debug)]
struct StoredClock {
    /// The longest period of the clock bits that are read, ms. All shorter ones divide it.
    phase_ms: Option<u64>,
    /// `$ScanToggle` is read.
    toggles: bool,
    /// `$ScanCounter` is read.
    counts: bool,
}

impl StateForm {
    /// The form for a cone and a target.
    pub fn new(model: &ProofModel, target: Target, start: &Engine) -> StateForm {
        let code = &model.code;
        let asked: Vec<BitCell> = model.assumed.iter().copied().chain([target.bit]).collect();
        let slice = code.slice(&asked.iter().map(|bit| Cell::Bit(*bit)).collect::<Vec<_>>());
        let written = FormWritten::of(model, &slice);
        let mut is_live = live(model, &asked.iter().map(|bit| bit.0).collect::<Vec<_>>());
        let elements = StoredElements::new(code, &slice);
        elements.bits.iter().for_each(|bit| is_live[*bit as usize] = true);
        let stored = |at: &u32| is_live[*at as usize] && written.is(*at);
        let caps = caps(code, &WordRanges::new(model, start.image()));
        let word = |cell| StoredWord {
            cell,
            cap: caps.get(&cell).copied(),
            timers: elements.withheld(cell).cloned(),
        };
        let words = code.bit_count..code.bit_count + code.word_count;
        let words = words.filter(stored).map(|at| word(at - code.bit_count));
        let mut words: Vec<StoredWord> = words.collect();
        let mut bits: Vec<u32> = (0..code.bit_count).filter(stored).collect();
        let numbers = EffectCells { bits: code.bit_count };
        // Of an image that is kept, what matters when a new process finds it.
        for RetainedCell { cell, image, .. } in &model.events.retained {
            let is_of_stages = matches!(cell, Cell::Bit(bit) if is_kept_bit(code, *bit));
            match image.filter(|_| is_of_stages || stored(&numbers.number(*cell))) {
                Some(Cell::Bit(bit)) => bits.push(bit.0),
                Some(Cell::Word(word)) => {
                    let of_word =
                        if let Cell::Word(word) = cell { caps.get(&word.0) } else { None };
                    words.push(StoredWord { cell: word.0, cap: of_word.copied(), timers: None });
                }
                Some(Cell::WordBit(_)) | None => {}
            }
        }
        bits.extend(model.events.image_is_final.map(|bit| bit.0));
        let clock = StoredClock::new(code, &slice);
        let begins_again = (!model.events.kinds.is_empty()).then_some(model.period_ms().into());
        let mut form = StateForm { bits, words, elements, clock, begins_again, size: 0 };
        let mut bytes = Vec::new();
        form.save(start, &mut bytes);
        form.size = bytes.len();
        form
    }
}

impl StateForm {
    /// The cells of a state; bits first. `bits`: the number of all bits.
    pub fn cells(&self, bits: u32) -> impl Iterator<Item = u32> {
        let words = self.words.iter().map(move |word| bits + word.cell);
        self.bits.iter().copied().chain(words)
    }

    /// Writes the state of an engine behind a scan.
    pub fn save(&self, engine: &Engine, to: &mut Vec<u8>) {
        let (bits, words) = (engine.image().bits(), engine.image().words());
        let mut to = ByteWriter::new(to);
        to.bit(engine.stops());
        let begins = self.begins_again.is_some() && engine.scans() == 0;
        if self.begins_again.is_some() {
            to.bit(begins);
        }
        self.bits.iter().for_each(|bit| to.bit(bits[*bit as usize] != 0));
        for StoredWord { cell, cap, timers } in &self.words {
            let is_kept = timers.as_ref().is_none_or(|timers| timers.time(bits));
            let value = if is_kept { words[*cell as usize] } else { 0 };
            to.number(cap.map_or(value, |cap| cap.capped(value)).cast_unsigned());
        }
        if let Some(phase_ms) = self.clock.phase_ms {
            let since_ms = (engine.now_ns().saturating_sub(engine.start_ns())) / 1_000_000;
            to.number(if begins { 0 } else { (since_ms % phase_ms) as u32 });
        }
        self.elements.save(engine, &mut to);
        if self.clock.toggles {
            to.bit(engine.scans() % 2 == 1);
        }
        if self.clock.counts {
            to.number(engine.scans() as u32);
        }
    }

    /// Whether the next scan of an engine depends on the time since the scan before.
    pub fn measures_time(&self, engine: &Engine) -> bool {
        let begins = self.begins_again.is_some() && engine.scans() == 0;
        !begins && (self.clock.phase_ms.is_some() || self.elements.measure_time(engine))
    }

    /// Puts a state in an engine, which has executed a scan before; returns the timestamp of the
    /// state's scan, ns. If RUN has begun again behind it, it begins a period later.
    pub fn load(&self, engine: &mut Engine, from: &[u8]) -> u64 {
        let mut from = ByteReader::new(from);
        let stops = from.bit();
        let begins_after_ms = self.begins_again.filter(|_| from.bit());
        let cells = engine.cells_mut();
        self.bits.iter().for_each(|bit| cells.bits[*bit as usize] = u8::from(from.bit()));
        for word in &self.words {
            cells.words[word.cell as usize] = from.number().cast_signed();
        }
        let phase_ms = self.clock.phase_ms.map_or(0, |_| from.number());
        let now_ms = BASE_MS + u64::from(phase_ms) - begins_after_ms.unwrap_or(0);
        self.elements.load(engine, LoadedTime { now_ms }, &mut from);
        let odd = self.clock.toggles && from.bit();
        let scans = if self.clock.counts { u64::from(from.number()) } else { 2 + u64::from(odd) };
        engine.resume_after(if begins_after_ms.is_some() { 0 } else { scans }, stops);
        now_ms * 1_000_000
    }
}

impl StoredClock {
    fn new(code: &EngineProgram, slice: &Slice) -> StoredClock {
        let reads = |bit| slice.knows(Cell::Bit(code.layout.bit(Bit::Space(BitSpace::St, bit))));
        let periods = [
            (st::ONE_MINUTE, 60_000),
            (st::ONE_SECOND, 1_000),
            (st::HUNDRED_MS, 100),
            (st::FIFTY_MS, 50),
        ];
        let counter = Word::Space(WordSpace::Dst, dst::SCAN_COUNTER);
        StoredClock {
            phase_ms: periods.iter().find(|(bit, _)| reads(*bit)).map(|(_, period)| *period),
            toggles: reads(st::SCAN_TOGGLE),
            counts: slice.knows(Cell::Word(code.layout.word(counter))),
        }
    }
}

/// Whether a bit says what is kept of a Program's Stages.
fn is_kept_bit(code: &EngineProgram, BitCell(bit): BitCell) -> bool {
    let bits = |kept: &ResumeBits| kept.first..kept.first + ResumeBits::bits(kept.stages);
    code.kept.iter().any(|kept| bits(kept).contains(&bit))
}

/// The cells that steps of the cone write.
struct FormWritten {
    is_written: Vec<bool>,
}

impl FormWritten {
    fn of(model: &ProofModel, slice: &Slice) -> FormWritten {
        let code = &model.code;
        let mut is_written = vec![false; (code.bit_count + code.word_count) as usize];
        let tables = &slice.program.tables;
        let steps = tables.batches.len() + tables.terminations.len() + code.blocks.len();
        for step in 0..steps {
            let written = slice.wiring.written(step);
            written.iter().for_each(|cell| is_written[*cell as usize] = true);
        }
        for input in &model.inputs {
            is_written[EffectCells { bits: code.bit_count }.number(input.cell) as usize] = true;
        }
        if let Some(down) = model.events.down {
            is_written[(code.bit_count + down.word.0) as usize] = true;
        }
        FormWritten { is_written }
    }

    fn is(&self, cell: u32) -> bool {
        self.is_written[cell as usize]
    }
}
