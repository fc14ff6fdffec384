//! The cell of every address in the image: the public cells first, space by space.
//!
//! Built once for a program by `lower`, from the memory sizes and the numbers of blocks and Stages.
//! The public bits are followed by the program's own bits (histories, powers), the public words by
//! its constants. The histories of SR and the bits of Programs whose Stages are retained are the
//! last public bits: they have no address, but retentive memory reads them in the image.

use super::image::{BitCell, Image, WordCell};
use super::record::RECORD;
use crate::isa::space::SENSAPHONE_COUNT;
use crate::isa::status::{DST_COUNT, ST_COUNT, dst as status};
use crate::isa::{
    Address, Bit, BitSpace, BlockId, DeviceBit, DeviceId, Flag, MemorySizes, Real, Space, StageId,
    Structure, Word, WordBit, WordSpace,
};

/// The number of status words that rungd 0.2 has, and of those that it does not have.
pub(super) const EARLIER_DST: u32 = status::COUNT_0_2 as u32;
const LATER_DST: u32 = DST_COUNT - EARLIER_DST;

/// The first cell of every space.
#[derive(Clone, Debug)]
pub struct Layout {
    sizes: MemorySizes,
    x: u32,
    y: u32,
    c: u32,
    mc: u32,
    mi: u32,
    st: u32,
    devices: u32,
    counter_flags: u32,
    timer_flags: u32,
    sensaphone_flags: u32,
    stages: u32,
    running: u32,
    done: u32,
    shifts: u32,
    bits: u32,
    v: u32,
    d: u32,
    r: u32,
    mhr: u32,
    mir: u32,
    dst: u32,
    counter_acc: u32,
    timer_acc: u32,
    sensaphone_acc: u32,
    sensaphone_pre: u32,
    /// The status words that rungd 0.2 does not have: behind all other words, so that those have
    /// the same cells.
    later_dst: u32,
    words: u32,
}

impl Layout {
    /// The layout for these memory sizes and numbers of blocks and Stages.
    pub fn new(sizes: &MemorySizes, blocks: u32, stages: u32) -> Layout {
        let mut next = 0;
        let mut take = |count: u32| {
            let first = next;
            next += count;
            first
        };
        // Records first, so that each begins at a multiple of its length.
        let counter_flags = take(sizes.ct * RECORD as u32);
        let timer_flags = take(sizes.t * RECORD as u32);
        let sensaphone_flags = take(SENSAPHONE_COUNT * RECORD as u32);
        let x = take(sizes.x);
        let (y, c, mc, mi) = (take(sizes.y), take(sizes.c), take(sizes.mc), take(sizes.mi));
        let st = take(ST_COUNT);
        let devices = take(sizes.devices * DeviceBit::ALL.len() as u32);
        let stages = take(stages);
        let (running, done, bits) = (take(blocks), take(blocks), take(0));
        next = 0;
        let mut take = |count: u32| {
            let first = next;
            next += count;
            first
        };
        // The `.Acc` words are in the order of the records, so that both have the same numbers.
        let (counter_acc, timer_acc) = (take(sizes.ct), take(sizes.t));
        let sensaphone_acc = take(SENSAPHONE_COUNT);
        let v = take(sizes.v);
        let (d, r, mhr, mir) = (take(sizes.d), take(sizes.r), take(sizes.mhr), take(sizes.mir));
        let (dst, sensaphone_pre) = (take(EARLIER_DST), take(SENSAPHONE_COUNT));
        let (later_dst, words) = (take(LATER_DST), take(0));
        Layout {
            sizes: sizes.clone(),
            x,
            y,
            c,
            mc,
            mi,
            st,
            devices,
            counter_flags,
            timer_flags,
            sensaphone_flags,
            stages,
            running,
            done,
            shifts: bits,
            bits,
            v,
            d,
            r,
            mhr,
            mir,
            dst,
            counter_acc,
            timer_acc,
            sensaphone_acc,
            sensaphone_pre,
            later_dst,
            words,
        }
    }

    /// The same layout with a history for each of `count` SRs.
    pub fn with_shifts(self, count: u32) -> Layout {
        Layout { bits: self.shifts + count, ..self }
    }

    /// The same layout with `count` bits of Programs whose Stages are retained, behind all others.
    /// Call it last.
    pub fn with_kept(self, count: u32) -> Layout {
        Layout { bits: self.bits + count, ..self }
    }

    /// The cell of an SR's history.
    pub fn shift_history(&self, number: u32) -> BitCell {
        BitCell(self.shifts + number)
    }

    /// The number of public bits.
    pub fn bit_count(&self) -> u32 {
        self.bits
    }

    /// The number of public words.
    pub fn word_count(&self) -> u32 {
        self.words
    }

    /// The public words that states of rungd 0.2 do not have.
    pub(super) fn later_words(&self) -> std::ops::Range<usize> {
        self.later_dst as usize..(self.later_dst + LATER_DST) as usize
    }

    /// The memory sizes of this layout.
    pub fn sizes(&self) -> &MemorySizes {
        &self.sizes
    }

    /// The cell of a bit that is no bit of a word.
    ///
    /// # Panics
    /// If it is a bit of a word, which has no cell of its own: [`Layout::bit_in`] takes any bit.
    #[inline(always)]
    pub fn bit(&self, bit: Bit) -> BitCell {
        BitCell(match bit {
            Bit::Space(space, n) => self.space(space) + (n - space.first()),
            Bit::Flag(structure, flag) => self.flags(structure) + flag_at(flag),
            Bit::Stage(StageId(n)) => self.stages + n,
            Bit::Running(BlockId(n)) => self.running + n,
            Bit::Done(BlockId(n)) => self.done + n,
            Bit::Device(DeviceId(n), health) => {
                self.devices + n * DeviceBit::ALL.len() as u32 + health as u32
            }
            Bit::InWord(_) => unreachable!("a bit of a word has no cell of its own"),
        })
    }

    /// The cell of any bit.
    pub fn bit_in(&self, bit: Bit) -> Cell {
        match bit {
            Bit::InWord(bit) => Cell::WordBit(self.word_bit(bit)),
            Bit::Space(..)
            | Bit::Flag(..)
            | Bit::Stage(_)
            | Bit::Running(_)
            | Bit::Done(_)
            | Bit::Device(..) => Cell::Bit(self.bit(bit)),
        }
    }

    /// The cell of a word's bit.
    pub fn word_bit(&self, bit: WordBit) -> WordBitCell {
        let is_sign = bit.word.range().0 < 0 && bit.number + 1 == bit.word.bit_count();
        let mask = if is_sign { -1 << bit.number } else { 1 << bit.number };
        WordBitCell { word: self.word(bit.word), mask }
    }

    /// The cell of a word.
    pub fn word(&self, word: Word) -> WordCell {
        WordCell(match word {
            Word::Space(WordSpace::Dst, n) if n >= EARLIER_DST => {
                self.later_dst + (n - EARLIER_DST)
            }
            Word::Space(space, n) => {
                let first = match space {
                    WordSpace::V => self.v,
                    WordSpace::D => self.d,
                    WordSpace::R => self.r,
                    WordSpace::Mhr => self.mhr,
                    WordSpace::Mir => self.mir,
                    WordSpace::Dst => self.dst,
                };
                first + (n - space.first())
            }
            Word::Acc(Structure::Counter(n)) => self.counter_acc + n,
            Word::Acc(Structure::Timer(n)) => self.timer_acc + n,
            Word::Acc(Structure::Sensaphone(n)) => self.sensaphone_acc + n,
            Word::Pre(n) => self.sensaphone_pre + n,
        })
    }

    /// The cell of a bit or word; `None` for a whole structure.
    pub fn cell(&self, address: Address) -> Option<Cell> {
        match address {
            Address::Bit(bit) => Some(self.bit_in(bit)),
            Address::Word(word) => Some(Cell::Word(self.word(word))),
            Address::Structure(_) => None,
        }
    }

    /// The distance from the cell of an address to that of the next number: the flags of a
    /// structure lie in its record.
    pub fn stride(&self, address: Address) -> u32 {
        match address {
            Address::Bit(Bit::Flag(..)) => RECORD as u32,
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => 1,
        }
    }

    /// The address of a public cell; `None` for histories.
    pub fn address(&self, cell: Cell) -> Option<Address> {
        self.space_address(cell).or_else(|| match cell {
            Cell::WordBit(WordBitCell { word, mask }) => match self.address(Cell::Word(word)) {
                Some(Address::Word(word)) => {
                    word.bit(mask.trailing_zeros() as u8).map(Address::Bit)
                }
                Some(Address::Bit(_) | Address::Structure(_)) | None => None,
            },
            Cell::Bit(BitCell(at)) => {
                let structure = self.structure(at / RECORD as u32);
                let device = at.wrapping_sub(self.devices);
                let (id, health) = (device / 2, DeviceBit::ALL[device as usize % 2]);
                match structure {
                    Some(structure) => {
                        structure.member_addresses().find(|member| self.cell(*member) == Some(cell))
                    }
                    None if id < self.sizes.devices => {
                        Some(Address::Bit(Bit::Device(DeviceId(id), health)))
                    }
                    None => self.element_bit(at).map(Address::Bit),
                }
            }
            Cell::Word(WordCell(at)) => {
                let preset = at.wrapping_sub(self.sensaphone_pre);
                match self.structure(at) {
                    Some(structure) => Some(Address::Word(Word::Acc(structure))),
                    None if preset < SENSAPHONE_COUNT => Some(Address::Word(Word::Pre(preset))),
                    None => None,
                }
            }
        })
    }

    /// The bit of a Stage or a block.
    fn element_bit(&self, at: u32) -> Option<Bit> {
        match at {
            _ if (self.stages..self.running).contains(&at) => {
                Some(Bit::Stage(StageId(at - self.stages)))
            }
            _ if (self.running..self.done).contains(&at) => {
                Some(Bit::Running(BlockId(at - self.running)))
            }
            _ if (self.done..self.shifts).contains(&at) => Some(Bit::Done(BlockId(at - self.done))),
            _ => None,
        }
    }

    fn space_address(&self, cell: Cell) -> Option<Address> {
        Space::ALL.into_iter().find_map(|space| {
            let begin = match (space.address(space.first()), cell) {
                (first @ Address::Bit(_), Cell::Bit(_))
                | (first @ Address::Word(_), Cell::Word(_)) => self.cell(first)?,
                (Address::Bit(_) | Address::Word(_) | Address::Structure(_), _) => return None,
            };
            let at = match cell {
                Cell::Word(WordCell(at))
                    if space == Space::Word(WordSpace::Dst) && at >= self.later_dst =>
                {
                    at - self.later_dst + EARLIER_DST
                }
                Cell::Bit(_) | Cell::Word(_) | Cell::WordBit(_) => {
                    number(cell)?.checked_sub(number(begin)?)?
                }
            };
            let addressed = || space.address(space.first() + at);
            (at < space.count(&self.sizes)).then(addressed).filter(|found| {
                // Other words lie between the status words of rungd 0.2 and the later ones.
                self.cell(*found) == Some(cell)
            })
        })
    }

    /// The structure of a record.
    pub(super) fn structure(&self, record: u32) -> Option<Structure> {
        let counts = [
            (Structure::Counter(0), self.sizes.ct),
            (Structure::Timer(0), self.sizes.t),
            (Structure::Sensaphone(0), SENSAPHONE_COUNT),
        ];
        counts.into_iter().find_map(|(first, count)| {
            let number = record.checked_sub(self.record(first))?;
            (number < count).then(|| first.numbered(number))
        })
    }

    /// Whether a word holds a real.
    pub fn is_real(&self, cell: WordCell) -> bool {
        (self.r..self.r + self.sizes.r).contains(&cell.0)
    }

    /// The text of a cell's content: a bit as 0 or 1, a word as a number.
    pub fn text(&self, cell: Cell, content: i32) -> String {
        match cell {
            Cell::Word(word) if self.is_real(word) => Real::of_cell(content).to_string(),
            Cell::Bit(_) | Cell::Word(_) | Cell::WordBit(_) => content.to_string(),
        }
    }

    /// The first flag cell of a structure.
    fn flags(&self, structure: Structure) -> u32 {
        self.record(structure) * RECORD as u32
    }

    /// The number of a structure's record; its `.Acc` is the word with the same number.
    pub fn record(&self, structure: Structure) -> u32 {
        let record = RECORD as u32;
        match structure {
            Structure::Counter(n) => self.counter_flags / record + n,
            Structure::Timer(n) => self.timer_flags / record + n,
            Structure::Sensaphone(n) => self.sensaphone_flags / record + n,
        }
    }

    /// The number of structures: their records come before all other bits, and their `.Acc`s before
    /// all other words.
    pub fn structure_count(&self) -> u32 {
        self.sensaphone_acc + SENSAPHONE_COUNT
    }

    /// The bits of a structure's record: its flags, then its owner's private state.
    pub fn record_bits(&self, structure: Structure) -> std::ops::Range<u32> {
        let first = self.flags(structure);
        first..first + RECORD as u32
    }

    fn space(&self, space: BitSpace) -> u32 {
        match space {
            BitSpace::X => self.x,
            BitSpace::Y => self.y,
            BitSpace::C => self.c,
            BitSpace::Mc => self.mc,
            BitSpace::Mi => self.mi,
            BitSpace::St => self.st,
        }
    }
}

/// The cell of a bit or a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Cell {
    Bit(BitCell),
    Word(WordCell),
    WordBit(WordBitCell),
}

/// A bit of a word's cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WordBitCell {
    /// The word.
    pub word: WordCell,
    /// The bit in the content of the cell. For the sign of a word of 16 bits, all bits above it
    /// too: the cell has 32 bits, and its content has the sign of the word.
    pub mask: i32,
}

impl WordBitCell {
    /// Whether the bit is ON in the content of its word.
    #[inline(always)]
    pub fn is_on(self, content: i32) -> bool {
        content & self.mask != 0
    }

    /// The same bit of a different word.
    pub fn with_word(self, word: Cell) -> Option<Cell> {
        match word {
            Cell::Word(word) => Some(Cell::WordBit(WordBitCell { word, ..self })),
            Cell::Bit(_) | Cell::WordBit(_) => None,
        }
    }

    /// The content of its word with the bit ON or OFF.
    #[inline(always)]
    pub fn put(self, content: i32, on: bool) -> i32 {
        if on { content | self.mask } else { content & !self.mask }
    }
}

impl Cell {
    /// Whether it holds a bit: 0 or 1.
    pub fn is_bit(self) -> bool {
        match self {
            Cell::Bit(_) | Cell::WordBit(_) => true,
            Cell::Word(_) => false,
        }
    }

    /// Whether a write of one of the two can change the other: they are the same, or a word and its
    /// bit.
    pub fn overlaps(self, other: Cell) -> bool {
        self == other || self.whole() == other || self == other.whole()
    }

    /// For a bit of a word, the word's cell; else itself.
    pub fn whole(self) -> Cell {
        match self {
            Cell::WordBit(bit) => Cell::Word(bit.word),
            Cell::Bit(_) | Cell::Word(_) => self,
        }
    }
}

impl Image {
    /// A bit (0 or 1) or a word.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(bit) => i32::from(self.bit(bit)),
            Cell::Word(word) => self.word(word),
            Cell::WordBit(bit) => i32::from(bit.is_on(self.word(bit.word))),
        }
    }
}

fn number(cell: Cell) -> Option<u32> {
    match cell {
        Cell::Bit(BitCell(at)) | Cell::Word(WordCell(at)) => Some(at),
        Cell::WordBit(_) => None,
    }
}

/// A flag's place in its structure's record. Counters and timers: Done, Reset, Zero, and DnDone or
/// Timing; Sensaphone counters: CU, CD, DN, OV, UN.
fn flag_at(flag: Flag) -> u32 {
    match flag {
        Flag::Done | Flag::Cu => 0,
        Flag::Reset | Flag::Cd => 1,
        Flag::Zero | Flag::Dn => 2,
        Flag::DnDone | Flag::Timing | Flag::Ov => 3,
        Flag::Un => 4,
    }
}
