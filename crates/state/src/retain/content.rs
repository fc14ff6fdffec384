//! The content of an image, as bytes: elements by address, their tags, their owners and their
//! values. The format is described in `docs/retain-format.md`, *Content*.
//!
//! `plan` writes contents; this module reads them. The reader refuses the whole content if it is
//! inconsistent, even if its checksums are right.

use std::collections::{HashMap, HashSet};

use super::stages::{self, RetainedProgram};
use rungd_base::byte_source::ByteSource;
use rungd_engine::isa::{Address, BitSpace, Real, Space, WordSpace};

/// The number of bytes of a structure's bits: the bits that a program reads, then the owner's bits.
pub(crate) const RECORD_BYTES: usize = 8;

/// The spaces of elements. Each has a number in the file, which never changes.
const NUMBERS: [(u8, Space); 11] = [
    (1, Space::Bit(BitSpace::C)),
    (2, Space::Bit(BitSpace::Mc)),
    (3, Space::Bit(BitSpace::Mi)),
    (4, Space::Word(WordSpace::V)),
    (5, Space::Word(WordSpace::D)),
    (6, Space::Word(WordSpace::Mhr)),
    (7, Space::Word(WordSpace::Mir)),
    (8, Space::Counter),
    (9, Space::Timer),
    (10, Space::Sensaphone),
    (11, REALS),
];

/// The space of R words. The file holds them as binary32, memory as cells.
const REALS: Space = Space::Word(WordSpace::R);

/// Flag of a run: the program terminates these elements.
const TERMINATED: u8 = 1;

/// Flag of a tag: its name is its only address, and rungd has chosen the element.
const PLACED: u8 = 1;

/// Flag of an SR, as the owner of bits: the last state of its CLK was ON.
const CLK_ON: u8 = 1;

/// The maximum number of elements that the reader accepts: more than all of memory.
const ELEMENTS_MAX: u64 = 1 << 20;

/// One element: `D5` is number 5 of the space D.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RetainedElement {
    /// Its space.
    pub space: Space,
    /// Its number in the space.
    pub number: u32,
}

/// Neighbouring elements of one space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ElementRun {
    /// The space of all these elements.
    pub space: Space,
    /// The number of the first element.
    pub first: u32,
    /// The number of elements.
    pub count: u32,
    /// The program terminates them: its stop switches them OFF or resets them.
    pub terminated: bool,
}

impl ElementRun {
    /// The element of this number.
    pub(super) fn element(&self, number: u32) -> RetainedElement {
        RetainedElement { space: self.space, number }
    }
}

/// The value of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetainedValue {
    /// A bit: 0 or 1; a word; a structure's `.Acc`.
    pub word: i32,
    /// A Sensaphone counter's PRE; else 0.
    pub(crate) preset: i32,
    /// A structure's bits; else 0.
    pub(crate) record: [u8; RECORD_BYTES],
}

/// A text about an element: the name of a tag, or the owner of a structure or of bits.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ElementText {
    /// The text.
    pub text: String,
    /// Its element.
    pub element: RetainedElement,
}

/// A content after it was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RetainedContent {
    /// All elements with their values, in the order of the file.
    pub elements: Vec<(RetainedElement, RetainedValue)>,
    /// The names of tags.
    pub tags: Vec<ElementText>,
    /// The elements whose only address is the name of their tag.
    pub placed: HashSet<RetainedElement>,
    /// The owner of each structure, and of the first bit that an SR shifts: the instruction and its
    /// block.
    pub owners: HashMap<RetainedElement, String>,
    /// The SRs whose CLK was ON, by their texts and their first bits.
    pub clocks: HashSet<ElementText>,
    /// The elements that the program of this image terminates at a stop.
    pub terminated: HashSet<RetainedElement>,
    /// The Programs whose Stages are retained.
    pub programs: Vec<RetainedProgram>,
}

/// The type of a value. An element takes only a value of its own type.
pub(super) fn type_name(space: Space) -> &'static str {
    match space {
        Space::Bit(_) => "a bit",
        Space::Word(WordSpace::V | WordSpace::Mhr | WordSpace::Mir) => "a 16-bit word",
        Space::Word(WordSpace::D | WordSpace::Dst) => "a 32-bit word",
        REALS => "a real",
        Space::Counter => "a counter",
        Space::Timer => "a timer",
        Space::Sensaphone => "a Sensaphone counter",
    }
}

/// The number of bytes of a value.
pub(super) fn value_bytes(space: Space) -> usize {
    match space {
        Space::Bit(_) => 1,
        Space::Word(_) => 4,
        Space::Counter | Space::Timer => 4 + RECORD_BYTES,
        Space::Sensaphone => 8 + RECORD_BYTES,
    }
}

/// The range of a word's cell, or of a structure's `.Acc`.
pub(super) fn range(space: Space) -> (i32, i32) {
    match space {
        Space::Bit(_) => (0, 1),
        Space::Word(WordSpace::V | WordSpace::Mhr | WordSpace::Mir) => (0, 0xFFFF),
        Space::Word(WordSpace::D | WordSpace::Dst) | Space::Counter | Space::Timer => {
            (i32::MIN, i32::MAX)
        }
        REALS => WordSpace::R.range(),
        Space::Sensaphone => (i32::from(i16::MIN), i32::from(i16::MAX)),
    }
}

/// The text of a word's value, from its cell.
pub(super) fn text(space: Space, cell: i32) -> String {
    if space == REALS { Real::of_cell(cell).to_string() } else { cell.to_string() }
}

/// Appends the value of a word as the file holds it.
pub(super) fn put_word(bytes: &mut Vec<u8>, space: Space, cell: i32) {
    if space == REALS {
        bytes.extend(Real::of_cell(cell).number().to_le_bytes());
    } else {
        bytes.extend(cell.to_le_bytes());
    }
}

/// The cell of a real from the file. An infinity becomes the nearest real, a NaN becomes 0.
fn cell_of(number: f32) -> i32 {
    let number = if number.is_nan() { 0.0 } else { f64::from(number) };
    Real::stored(number).real.cell()
}

fn number_of(space: Space) -> u8 {
    let row = NUMBERS.iter().find(|(_, numbered)| *numbered == space);
    row.expect("an element can be retained").0
}

fn space_of(number: u8) -> Option<Space> {
    NUMBERS.iter().find(|(space_number, _)| *space_number == number).map(|(_, space)| *space)
}

/// The element at an address, if it can be retained.
pub(super) fn element_of(at: Address) -> Option<RetainedElement> {
    let (space, number) = Space::of(at)?;
    Space::RETAINABLE.contains(&space).then_some(RetainedElement { space, number })
}

/// An address in the form of the ladder: `CT8`.
pub fn address(element: RetainedElement) -> String {
    format!("{}{}", element.space.name(), element.number)
}

/// The lists before the values.
pub(super) struct ContentLists<'a> {
    pub runs: &'a [ElementRun],
    pub tags: &'a [ElementText],
    /// The elements whose only address is the name of their tag.
    pub placed: &'a HashSet<RetainedElement>,
    pub owners: &'a [ElementText],
    /// The texts and first bits of SRs.
    pub shifts: &'a [ElementText],
}

/// The bytes before the values. Apart from the states of the clocks, they are the same in every
/// image until the program changes.
#[derive(Clone, Debug)]
pub(super) struct Preamble {
    bytes: Vec<u8>,
    /// The place of each SR's flags.
    clocks: Vec<usize>,
}

impl Preamble {
    pub(super) fn new(lists: &ContentLists<'_>) -> Preamble {
        let mut bytes = Vec::new();
        put_runs(&mut bytes, lists.runs);
        put_u32(&mut bytes, lists.tags.len());
        for tag in lists.tags {
            put_text(&mut bytes, tag, if lists.placed.contains(&tag.element) { PLACED } else { 0 });
        }
        put_u32(&mut bytes, lists.owners.len() + lists.shifts.len());
        lists.owners.iter().for_each(|owner| put_text(&mut bytes, owner, 0));
        let mut clocks = Vec::new();
        for shift in lists.shifts {
            clocks.push(bytes.len() + 1);
            put_text(&mut bytes, shift, 0);
        }
        Preamble { bytes, clocks }
    }

    /// Writes the bytes to an empty buffer, with the states of the clocks in the order of the SRs.
    pub(super) fn put(&self, into: &mut Vec<u8>, clocks: impl Iterator<Item = u8>) {
        into.extend_from_slice(&self.bytes);
        for (at, clock) in self.clocks.iter().zip(clocks) {
            into[*at] = if clock == 0 { 0 } else { CLK_ON };
        }
    }

    /// The number of its bytes.
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }
}

fn put_runs(bytes: &mut Vec<u8>, runs: &[ElementRun]) {
    put_u32(bytes, runs.len());
    for run in runs {
        let flags = if run.terminated { TERMINATED } else { 0 };
        bytes.extend_from_slice(&[number_of(run.space), flags, 0, 0]);
        bytes.extend_from_slice(&run.first.to_le_bytes());
        bytes.extend_from_slice(&run.count.to_le_bytes());
    }
}

fn put_text(bytes: &mut Vec<u8>, ElementText { text, element }: &ElementText, flags: u8) {
    let length = u16::try_from(text.len()).expect("names are shorter than 64 KiB");
    bytes.extend_from_slice(&[number_of(element.space), flags]);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(&element.number.to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}

fn put_u32(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend_from_slice(&(count as u32).to_le_bytes());
}

/// Reads a content; `None` if it is inconsistent.
pub fn read(bytes: &[u8]) -> Option<RetainedContent> {
    let mut reader = ByteSource(bytes);
    let mut runs = Vec::new();
    let mut total = 0;
    for _ in 0..reader.u32()? {
        let head = reader.take(4)?;
        let (space, terminated) = (space_of(head[0])?, head[1] & TERMINATED != 0);
        let run = ElementRun { space, first: reader.u32()?, count: reader.u32()?, terminated };
        run.first.checked_add(run.count)?;
        total += u64::from(run.count);
        if total > ELEMENTS_MAX {
            return None;
        }
        runs.push(run);
    }
    let tags = reader.texts()?;
    let placed = |tag: &FlaggedText| (tag.flags & PLACED != 0).then_some(tag.named.element);
    let placed = tags.iter().filter_map(placed).collect();
    let tags = tags.into_iter().map(|tag| tag.named).collect();
    let (mut owners, mut clocks) = (HashMap::new(), HashSet::new());
    for FlaggedText { named, flags } in reader.texts()? {
        if matches!(named.element.space, Space::Bit(_)) && flags & CLK_ON != 0 {
            clocks.insert(named.clone());
        }
        owners.insert(named.element, named.text);
    }
    let (mut elements, mut terminated) = (Vec::new(), HashSet::new());
    for run in runs {
        for number in run.first..run.first + run.count {
            let element = run.element(number);
            if run.terminated {
                terminated.insert(element);
            }
            elements.push((element, reader.value(run.space)?));
        }
    }
    let programs = stages::read(&mut reader)?;
    let content = RetainedContent { elements, tags, placed, owners, clocks, terminated, programs };
    reader.0.is_empty().then_some(content)
}

/// A text about an element, with its flags.
struct FlaggedText {
    named: ElementText,
    flags: u8,
}

/// The forms of a content, read from bytes.
trait ContentSource: Sized {
    fn texts(&mut self) -> Option<Vec<FlaggedText>>;

    fn value(&mut self, space: Space) -> Option<RetainedValue>;
}

impl ContentSource for ByteSource<'_> {
    fn texts(&mut self) -> Option<Vec<FlaggedText>> {
        let mut texts = Vec::new();
        for _ in 0..self.u32()? {
            let head = self.take(4)?;
            let space = space_of(head[0])?;
            let length = usize::from(u16::from_le_bytes([head[2], head[3]]));
            let number = self.u32()?;
            let text = self.take(length.next_multiple_of(4))?;
            let text = std::str::from_utf8(&text[..length]).ok()?;
            let element = RetainedElement { space, number };
            let named = ElementText { text: text.to_owned(), element };
            texts.push(FlaggedText { named, flags: head[1] });
        }
        Some(texts)
    }

    fn value(&mut self, space: Space) -> Option<RetainedValue> {
        let (low, high) = range(space);
        let clamped = |word: i32| word.clamp(low, high);
        let word = match value_bytes(space) {
            1 => i32::from(self.byte()?),
            _ if space == REALS => cell_of(f32::from_bits(self.u32()?)),
            _ => self.i32()?,
        };
        let mut value = RetainedValue { word: clamped(word), preset: 0, record: [0; RECORD_BYTES] };
        if space == Space::Sensaphone {
            value.preset = clamped(self.i32()?);
        }
        if matches!(space, Space::Counter | Space::Timer | Space::Sensaphone) {
            for (bit, byte) in value.record.iter_mut().zip(self.take(RECORD_BYTES)?) {
                *bit = u8::from(*byte != 0);
            }
        }
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inconsistent_content_is_refused() {
        let runs = [ElementRun {
            space: Space::Word(WordSpace::D),
            first: 3,
            count: 2,
            terminated: false,
        }];
        let level = RetainedElement { space: Space::Word(WordSpace::D), number: 4 };
        let tags = [ElementText { text: "level".to_owned(), element: level }];
        let placed = HashSet::from([level]);
        let c9 = RetainedElement { space: Space::Bit(BitSpace::C), number: 9 };
        let shifts = ["SR in Main", "SR in Main, 2"]
            .map(|text| ElementText { text: text.to_owned(), element: c9 });
        let lists = ContentLists {
            runs: &runs,
            tags: &tags,
            placed: &placed,
            owners: &[],
            shifts: &shifts,
        };
        let mut bytes = Vec::new();
        Preamble::new(&lists).put(&mut bytes, [0, 1].into_iter());
        bytes.extend_from_slice(&[1, 0, 0, 0, 254, 255, 255, 255]);
        let content = read(&bytes).unwrap();
        assert_eq!(content.elements[1].1.word, -2);
        assert_eq!((&content.tags[..], &content.placed), (&tags[..], &placed));
        assert_eq!(content.clocks, HashSet::from([shifts[1].clone()]));
        for cut in 0..bytes.len() {
            assert_eq!(read(&bytes[..cut]), None, "cut at {cut}");
        }
        for at in 0..bytes.len() {
            for value in [0, 1, 0x7F, 0xFF] {
                let mut other = bytes.clone();
                other[at] = value;
                let _ = read(&other);
            }
        }
        assert_eq!(read(&[0xFF; 64]), None);
    }

    #[test]
    fn values_out_of_range_are_limited_and_the_later_of_two_values_counts() {
        let run = |count| ElementRun {
            space: Space::Word(WordSpace::V),
            first: 3,
            count,
            terminated: false,
        };
        let mut bytes = Vec::new();
        let placed = HashSet::new();
        let runs = [run(2), run(1)];
        let lists =
            ContentLists { runs: &runs, tags: &[], placed: &placed, owners: &[], shifts: &[] };
        Preamble::new(&lists).put(&mut bytes, std::iter::empty());
        [-5, 70_000, 9].iter().for_each(|word: &i32| bytes.extend(word.to_le_bytes()));
        let content = read(&bytes).unwrap();
        let words: Vec<_> =
            content.elements.iter().map(|(at, value)| (at.number, value.word)).collect();
        assert_eq!(words, [(3, 0), (4, 0xFFFF), (3, 9)]);
        let counts: HashMap<_, _> = content.elements.into_iter().collect();
        let element = RetainedElement { space: Space::Word(WordSpace::V), number: 3 };
        assert_eq!(counts[&element].word, 9, "as the plan takes them");
    }

    #[test]
    fn every_space_that_can_be_retained_has_a_number() {
        let mut numbered = NUMBERS.map(|(_, space)| space);
        let mut retainable = Space::RETAINABLE;
        numbered.sort_unstable();
        retainable.sort_unstable();
        assert_eq!(numbered, retainable);
        for (number, space) in NUMBERS {
            assert_eq!((number_of(space), space_of(number)), (number, Some(space)));
        }
        assert_eq!([0, 12, 255].map(space_of), [None; 3]);
    }
}
