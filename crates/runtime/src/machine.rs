//! The machine that the scanner executes: the engine, reduced to the few calls of a scan.
//!
//! A trait, so that pacing, faults and stops are tested with a machine whose scans take a given
//! time. It adds nothing to the behaviour of the engine.

use super::exchange::OperandWrite;
use super::mode::Mode;
use super::origin::Origin;
use super::unwired::UnwiredInputs;
use rungd_base::calendar::LocalTime;
use rungd_engine::{BitCell, BlockEvent, Cell, Engine, MathEvent, ScanTimes, Transfer, WordCell};

/// All bits and words of a machine.
#[derive(Clone, Copy, Debug)]
pub struct ImageCells<'a> {
    /// The bits, each in a byte.
    pub bits: &'a [u8],
    /// The words.
    pub words: &'a [i32],
}

impl ImageCells<'_> {
    /// A bit (0 or 1) or word.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(bit) => i32::from(self.bits[bit.0 as usize]),
            Cell::Word(word) => self.words[word.0 as usize],
            Cell::WordBit(bit) => i32::from(bit.is_on(self.words[bit.word.0 as usize])),
        }
    }
}

/// The machine that is scanned: the engine, or a stand-in in tests.
pub trait ScannedMachine {
    /// RUN begins.
    fn start(&mut self, now_ns: u64);
    /// Step 1 of a scan.
    fn begin_scan(&mut self, start: &ScanStart);
    /// Step 2: sets one X.
    fn set_input(&mut self, x: u32, on: bool);
    /// Step 3, for every queued write.
    fn write_bit(&mut self, cell: BitCell, on: bool);
    /// Step 3, for every queued write.
    fn write_word(&mut self, cell: WordCell, value: i32);
    /// Steps 4 to 7; true if this was the last scan.
    fn execute(&mut self) -> bool;
    /// Makes the next scan the last one.
    fn request_stop(&mut self);
    /// Whether a stop was requested, by a caller or by the program.
    fn stops(&self) -> bool;
    /// The termination passes after the last scan.
    fn terminate(&mut self);
    /// Forces a bit or word: it keeps this value until it is released.
    fn force(&mut self, cell: Cell, value: i32);
    /// Ends a force.
    fn release(&mut self, cell: Cell);
    /// Takes over the state of `old`; parts that the new program does not have are terminated in
    /// `old` first. `running`: whether scans continue.
    fn adopt(&mut self, old: &mut Self, transfer: &Transfer, running: bool, forces: &[Cell])
    where
        Self: Sized;
    /// All bits and words.
    fn image(&self) -> ImageCells<'_>;
    /// The changes of blocks in the last scan or in `terminate`, and the number of dropped changes.
    fn events(&self) -> (&[BlockEvent], u32);
    /// The MATHs that had a mishap in the last scan.
    fn maths(&self) -> &[MathEvent];

    /// Of 64 X from `first` on: those whose value may differ from the given one. The lowest bit is
    /// that of `first`.
    fn differing_inputs(&self, _first: u32, _values: u64) -> u64 {
        u64::MAX
    }
    /// Step 2, for up to 64 X: sets those whose value differs. Most inputs keep their value from
    /// scan to scan.
    fn set_inputs(&mut self, inputs: UnwiredInputs) {
        let differing = self.differing_inputs(inputs.first, inputs.values);
        for (x, on) in (UnwiredInputs { given: inputs.given & differing, ..inputs }).each() {
            self.set_input(x, on);
        }
    }

    /// Step 3: one write of a batch.
    fn write_operand(&mut self, write: &OperandWrite) {
        match *write {
            OperandWrite::Bit(cell, on) => self.write_bit(cell, on),
            OperandWrite::Word(cell, value) => self.write_word(cell, value),
            OperandWrite::WordBit(bit, on) => self.write(Cell::WordBit(bit), on.into()),
            OperandWrite::Masked { cell, mask, signed } => {
                let held = self.image().words[cell.0 as usize];
                self.write_word(cell, mask.apply(held, signed));
            }
            OperandWrite::Input(x, on) => self.set_input(x, on),
        }
    }

    /// Step 3: one queued write of a bit or word. A bit of a word is changed in the word as it now
    /// is, and the whole word is written.
    fn write(&mut self, cell: Cell, value: i32) {
        match cell {
            Cell::Bit(bit) => self.write_bit(bit, value != 0),
            Cell::Word(word) => self.write_word(word, value),
            Cell::WordBit(bit) => {
                let held = self.image().words[bit.word.0 as usize];
                self.write_word(bit.word, bit.put(held, value != 0));
            }
        }
    }

    /// Sets the origin of the writes, forces and releases that follow.
    fn comes_from(&mut self, _: Origin) {}
    /// The controller enters a mode.
    fn enters(&mut self, _: Mode) {}
    /// The machine has adopted the memory of the old one; the number is that of the new program.
    fn swapped(&mut self, _: u32) {}
    /// The step is over, and its image is published.
    fn settle(&mut self) {}
}

/// The start of a scan: step 1.
#[derive(Clone, Copy, Debug)]
pub struct ScanStart {
    /// Its number, as in the log: the first scan of a process is 1.
    pub number: u64,
    /// Its timestamp, monotonic.
    pub now_ns: u64,
    /// The scan times for the status words.
    pub times: ScanTimes,
    /// Local time, as seconds since 1970-01-01 00:00:00 of the local clock.
    pub local_s: i64,
}

impl ScannedMachine for Engine {
    fn start(&mut self, now_ns: u64) {
        Engine::start(self, now_ns);
    }

    fn begin_scan(&mut self, start: &ScanStart) {
        let ScanStart { now_ns, times, local_s, .. } = start;
        Engine::begin_scan(self, *now_ns, times, &LocalTime::of(*local_s));
    }

    fn set_input(&mut self, x: u32, on: bool) {
        Engine::set_input(self, x, on);
    }

    fn differing_inputs(&self, first: u32, values: u64) -> u64 {
        Engine::differing_inputs(self, first, values)
    }

    fn write_bit(&mut self, cell: BitCell, on: bool) {
        Engine::write_bit(self, cell, on);
    }

    fn write_word(&mut self, cell: WordCell, value: i32) {
        Engine::write_word(self, cell, value);
    }

    fn execute(&mut self) -> bool {
        Engine::execute(self).last
    }

    fn request_stop(&mut self) {
        Engine::request_stop(self);
    }

    fn stops(&self) -> bool {
        Engine::stops(self)
    }

    fn terminate(&mut self) {
        Engine::terminate(self);
    }

    fn force(&mut self, cell: Cell, value: i32) {
        match cell {
            Cell::Bit(bit) => self.force_bit(bit, value != 0),
            Cell::Word(word) => self.force_word(word, value),
            Cell::WordBit(_) => unreachable!("a bit of a word is never forced"),
        }
    }

    fn release(&mut self, cell: Cell) {
        match cell {
            Cell::Bit(bit) => self.release_bit(bit),
            Cell::Word(word) => self.release_word(word),
            Cell::WordBit(_) => unreachable!("a bit of a word is never forced"),
        }
    }

    fn adopt(&mut self, old: &mut Engine, transfer: &Transfer, running: bool, forces: &[Cell]) {
        Engine::adopt(self, old, transfer, running, forces);
    }

    fn image(&self) -> ImageCells<'_> {
        let image = Engine::image(self);
        ImageCells { bits: image.bits(), words: image.words() }
    }

    fn events(&self) -> (&[BlockEvent], u32) {
        (Engine::events(self), self.events_dropped())
    }

    fn maths(&self) -> &[MathEvent] {
        Engine::maths(self)
    }
}
