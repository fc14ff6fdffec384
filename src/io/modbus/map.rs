//! The map: which cell of the image each coil, input and register is, and who may write it.
//!
//! Built once from the settings, the layout and the tags' limits; the connections share it. A
//! read is answered from one snapshot, so values of two scans never mix. A write is judged whole
//! and becomes one batch, or nothing. No I/O, no clock, no log: a refusal carries its reason, and
//! the connection logs it.
//!
//! The idea that is not obvious: what the image makes of an element is settled per element when
//! the map is built (a discrete input that is an output as driven, a coil that is an input too),
//! so a request meets no ranges.

use super::pdu::{self, Request, Table};
use super::refusal::Refusal;
use crate::engine::{BitCell, Layout, WordCell};
use crate::isa::{Bit, BitSpace, Word, WordSpace};
use crate::resolve::controller::Modbus;
use crate::resolve::range::{Range, Space};
use crate::runtime::exchange::{Snapshot, Write};

/// Every element that a client can address, by PDU address.
#[derive(Debug)]
pub struct Map {
    coils: Box<[Coil]>,
    discrete: Box<[Discrete]>,
    holding: Box<[Holding]>,
    input: Box<[WordCell]>,
}

#[derive(Clone, Copy, Debug)]
struct Coil {
    cell: BitCell,
    writable: bool,
    /// The X that it becomes.
    input: Option<u32>,
}

#[derive(Clone, Copy, Debug)]
enum Discrete {
    Cell(BitCell),
    /// A Y as driven.
    Output(u32),
}

#[derive(Clone, Copy, Debug)]
struct Holding {
    cell: WordCell,
    writable: bool,
    min: i32,
    max: i32,
}

impl Map {
    /// The map of a program's memory for a server's settings. `limits` says what a word takes: its
    /// range, narrowed by the tags of its address.
    pub fn new(settings: &Modbus, layout: &Layout, limits: impl Fn(Word) -> (i32, i32)) -> Map {
        let sizes = layout.sizes();
        let bit = |space, n| layout.bit(Bit::Space(space, n));
        let coil = |n| {
            let input = settings.inputs.and_then(|(mc, x)| across(mc, x, n));
            let listed = lists(settings, Space::Bit(BitSpace::Mc), n);
            Coil { cell: bit(BitSpace::Mc, n), writable: listed || input.is_some(), input }
        };
        let discrete = |n| match settings.outputs.and_then(|(y, mi)| across(mi, y, n)) {
            Some(y) => Discrete::Output(y),
            None => Discrete::Cell(bit(BitSpace::Mi, n)),
        };
        let holding = |n| {
            let word = Word::Space(WordSpace::Mhr, n);
            let (cell, (min, max)) = (layout.word(word), limits(word));
            let writable = lists(settings, Space::Word(WordSpace::Mhr), n);
            Holding { cell, writable, min, max }
        };
        let input = |n| layout.word(Word::Space(WordSpace::Mir, n));
        Map {
            coils: (1..=sizes.mc).map(coil).collect(),
            discrete: (1..=sizes.mi).map(discrete).collect(),
            holding: (1..=sizes.mhr).map(holding).collect(),
            input: (1..=sizes.mir).map(input).collect(),
        }
    }

    /// Appends the reply to a read, from one snapshot.
    ///
    /// # Errors
    /// When an element does not exist; then nothing is appended.
    pub fn read(&self, ask: Read, snapshot: &Snapshot, reply: &mut Vec<u8>) -> Result<(), Refusal> {
        let Read { function, table, first, count } = ask;
        let bit = |cell: BitCell| snapshot.bits[cell.0 as usize] != 0;
        let word = |cell: WordCell| snapshot.words[cell.0 as usize] as u16;
        match table {
            Table::Coils => {
                let coils = stretch(&self.coils, Table::Coils, first, count)?;
                pdu::push_bits(reply, function, coils.iter().map(|coil| bit(coil.cell)));
            }
            Table::DiscreteInputs => {
                let inputs = stretch(&self.discrete, table, first, count)?;
                let value = |input: &Discrete| match *input {
                    Discrete::Cell(cell) => bit(cell),
                    Discrete::Output(y) => snapshot.outputs[y as usize] != 0,
                };
                pdu::push_bits(reply, function, inputs.iter().map(value));
            }
            Table::HoldingRegisters => {
                let registers = stretch(&self.holding, table, first, count)?;
                pdu::push_words(reply, function, registers.iter().map(|r| word(r.cell)));
            }
            Table::InputRegisters => {
                let registers = stretch(&self.input, table, first, count)?;
                pdu::push_words(reply, function, registers.iter().map(|cell| word(*cell)));
            }
        }
        Ok(())
    }

    /// The batch that a write comes to; of a read, nothing.
    ///
    /// # Errors
    /// When an element does not exist or is not writable, or a tag does not allow a value. Then
    /// nothing is written.
    pub fn writes(&self, request: &Request<'_>) -> Result<Vec<Write>, Refusal> {
        match *request {
            Request::Read { .. } => Ok(Vec::new()),
            Request::WriteCoils { first, count, packed } => self.coil_writes(first, count, packed),
            Request::WriteRegisters { first, values } => self.register_writes(first, values),
        }
    }

    fn coil_writes(&self, first: u16, count: u16, packed: &[u8]) -> Result<Vec<Write>, Refusal> {
        let coils = stretch(&self.coils, Table::Coils, first, count)?;
        if let Some(at) = coils.iter().position(|coil| !coil.writable) {
            return Err(not_writable(Table::Coils, first, at));
        }
        let values = packed.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 != 0));
        let mut writes = Vec::with_capacity(coils.len() * 2);
        for (coil, on) in coils.iter().zip(values) {
            writes.push(Write::Bit(coil.cell, on));
            writes.extend(coil.input.map(|x| Write::Input(x, on)));
        }
        Ok(writes)
    }

    fn register_writes(&self, first: u16, values: &[u8]) -> Result<Vec<Write>, Refusal> {
        let table = Table::HoldingRegisters;
        let registers = stretch(&self.holding, table, first, (values.len() / 2) as u16)?;
        if let Some(at) = registers.iter().position(|register| !register.writable) {
            return Err(not_writable(table, first, at));
        }
        let values = values.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]]));
        let mut writes = Vec::with_capacity(registers.len());
        for ((at, register), value) in registers.iter().enumerate().zip(values) {
            let &Holding { cell, min, max, .. } = register;
            if !(min..=max).contains(&i32::from(value)) {
                let element = element(first, at);
                return Err(Refusal::BeyondLimits { element, value, min, max });
            }
            writes.push(Write::Word(cell, i32::from(value)));
        }
        Ok(writes)
    }

    /// What the inputs of the image are before a client has written any: their coils' values.
    pub fn first_inputs<'a>(&'a self, first: &'a Snapshot) -> impl Iterator<Item = (u32, bool)> {
        let value = |cell: BitCell| first.bits[cell.0 as usize] != 0;
        self.coils.iter().filter_map(move |coil| Some((coil.input?, value(coil.cell))))
    }
}

/// A read, as [`Map::read`] takes it.
#[derive(Clone, Copy, Debug)]
pub struct Read {
    /// The function code, for the reply.
    pub function: u8,
    /// Of which table.
    pub table: Table,
    /// From which address.
    pub first: u16,
    /// How many.
    pub count: u16,
}

/// Whether an element is listed as writable.
fn lists(settings: &Modbus, space: Space, n: u32) -> bool {
    let holds = |range: &Range| range.space == space && (range.first..=range.last).contains(&n);
    settings.writable.iter().any(holds)
}

/// The element of `to` that stands for an element of `from`; both ranges are equally long.
fn across(from: Range, to: Range, n: u32) -> Option<u32> {
    (from.first..=from.last).contains(&n).then(|| to.first + (n - from.first))
}

/// The elements of a request, if all exist.
fn stretch<T>(elements: &[T], table: Table, first: u16, count: u16) -> Result<&[T], Refusal> {
    let stretch = usize::from(first)..usize::from(first) + usize::from(count);
    let refusal = Refusal::NoSuchElement { table, count: elements.len() as u32 };
    elements.get(stretch).ok_or(refusal)
}

fn not_writable(table: Table, first: u16, at: usize) -> Refusal {
    Refusal::NotWritable { table, element: element(first, at) }
}

fn element(first: u16, at: usize) -> u32 {
    u32::from(first) + at as u32 + 1
}

#[cfg(test)]
mod tests {
    use super::super::tests::{loopback, range};
    use super::*;
    use crate::isa::MemorySizes;
    use crate::runtime::exchange::{Mode, StopReason};

    /// MC1..MC8, MI1..MI4, MHR1..MHR4, MIR1..MIR2. MC1, MC2 and MHR1..MHR3 are listed; MC3 and
    /// MC4 are X0 and X1; Y0 and Y1 are MI2 and MI3; a tag limits MHR2 to 5..=9.
    fn small() -> (Map, Layout) {
        let sizes = MemorySizes { mc: 8, mi: 4, mhr: 4, mir: 2, ..MemorySizes::default() };
        let layout = Layout::new(&sizes, 1, 0);
        let [mc, x, y, mi] = [BitSpace::Mc, BitSpace::X, BitSpace::Y, BitSpace::Mi].map(Space::Bit);
        let settings = Modbus {
            writable: vec![range(mc, 1, 2), range(Space::Word(WordSpace::Mhr), 1, 3)],
            inputs: Some((range(mc, 3, 4), range(x, 0, 1))),
            outputs: Some((range(y, 0, 1), range(mi, 2, 3))),
            ..loopback()
        };
        let limits = |word| match word {
            Word::Space(WordSpace::Mhr, 2) => (5, 9),
            other => other.range(),
        };
        (Map::new(&settings, &layout, limits), layout)
    }

    fn write(pdu: &[u8]) -> Result<Vec<Write>, u8> {
        let request = pdu::parse(pdu).expect("a well-formed request");
        small().0.writes(&request).map_err(|refusal| refusal.exception() as u8)
    }

    fn coil(n: u32, on: bool) -> Write {
        Write::Bit(small().1.bit(Bit::Space(BitSpace::Mc, n)), on)
    }

    fn register(n: u32, value: i32) -> Write {
        Write::Word(small().1.word(Word::Space(WordSpace::Mhr, n)), value)
    }

    #[test]
    fn only_what_is_listed_can_be_written() {
        assert_eq!(write(&[5, 0, 0, 0xff, 0]), Ok(vec![coil(1, true)]));
        assert_eq!(write(&[5, 0, 4, 0xff, 0]), Err(2), "MC5 is not listed");
        assert_eq!(write(&[5, 0, 8, 0xff, 0]), Err(2), "MC9 does not exist");
        assert_eq!(write(&[5, 0xff, 0xff, 0xff, 0]), Err(2));
        assert_eq!(write(&[15, 0, 0, 0, 5, 1, 0x1f]), Err(2), "the last of five is not listed");
        assert_eq!(write(&[15, 0xff, 0xff, 0, 2, 1, 3]), Err(2));
        assert_eq!(write(&[6, 0, 0, 0x12, 0x34]), Ok(vec![register(1, 0x1234)]));
        assert_eq!(write(&[6, 0, 3, 0, 0]), Err(2), "MHR4 is not listed");
        assert_eq!(write(&[6, 0, 4, 0, 0]), Err(2), "MHR5 does not exist");
    }

    #[test]
    fn a_value_beyond_a_tags_limits_refuses_the_whole_write() {
        assert_eq!(write(&[6, 0, 1, 0, 4]), Err(3));
        assert_eq!(write(&[6, 0, 1, 0, 5]), Ok(vec![register(2, 5)]));
        assert_eq!(write(&[6, 0, 1, 0, 9]), Ok(vec![register(2, 9)]));
        assert_eq!(write(&[6, 0, 1, 0, 10]), Err(3));
        assert_eq!(write(&[16, 0, 0, 0, 2, 4, 0, 1, 0, 10]), Err(3));
        let both = vec![register(1, 0xffff), register(2, 7)];
        assert_eq!(write(&[16, 0, 0, 0, 2, 4, 0xff, 0xff, 0, 7]), Ok(both));
    }

    #[test]
    fn a_coil_of_the_image_is_writable_and_an_input() {
        let writes = vec![
            coil(2, true),
            coil(3, false),
            Write::Input(0, false),
            coil(4, true),
            Write::Input(1, true),
        ];
        assert_eq!(write(&[15, 0, 1, 0, 3, 1, 0b101]), Ok(writes));
    }

    fn snapshot(layout: &Layout) -> Snapshot {
        Snapshot {
            generation: 0,
            safe: [].into(),
            since_ns: 0,
            forces: Default::default(),
            scans: 1,
            now_ns: 0,
            mode: Mode::Stop(StopReason::NotStarted),
            bits: vec![0; layout.bit_count() as usize].into(),
            words: vec![0; layout.word_count() as usize].into(),
            outputs: vec![0; 2048].into(),
            tickets_done: 0,
        }
    }

    fn read(snapshot: &Snapshot, pdu: &[u8]) -> Result<Vec<u8>, u8> {
        let Ok(Request::Read { table, first, count }) = pdu::parse(pdu) else {
            panic!("no read: {pdu:?}")
        };
        let mut reply = Vec::new();
        let ask = Read { function: pdu[0], table, first, count };
        let done = small().0.read(ask, snapshot, &mut reply);
        done.map(|()| reply).map_err(|refusal| refusal.exception() as u8)
    }

    #[test]
    fn reads_show_each_table_to_its_end_and_no_further() {
        let layout = small().1;
        let mut image = snapshot(&layout);
        let mut set = |bit, on: bool| image.bits[layout.bit(bit).0 as usize] = u8::from(on);
        set(Bit::Space(BitSpace::Mc, 1), true);
        set(Bit::Space(BitSpace::Mc, 8), true);
        set(Bit::Space(BitSpace::Mi, 1), true);
        set(Bit::Space(BitSpace::Mi, 2), true);
        image.words[layout.word(Word::Space(WordSpace::Mhr, 4)).0 as usize] = 0xabcd;
        image.words[layout.word(Word::Space(WordSpace::Mir, 1)).0 as usize] = 5;
        image.outputs[1] = 1;
        assert_eq!(read(&image, &[1, 0, 0, 0, 8]), Ok(vec![1, 1, 0x81]));
        assert_eq!(read(&image, &[1, 0, 0, 0, 9]), Err(2));
        assert_eq!(read(&image, &[1, 0, 8, 0, 1]), Err(2));
        let as_driven = Ok(vec![2, 1, 0b0101]);
        assert_eq!(read(&image, &[2, 0, 0, 0, 4]), as_driven, "MI2 is Y0 (OFF), MI3 is Y1 (ON)");
        assert_eq!(read(&image, &[3, 0, 2, 0, 2]), Ok(vec![3, 4, 0, 0, 0xab, 0xcd]));
        assert_eq!(read(&image, &[3, 0, 3, 0, 2]), Err(2));
        assert_eq!(read(&image, &[4, 0, 0, 0, 2]), Ok(vec![4, 4, 0, 5, 0, 0]));
        assert_eq!(read(&image, &[4, 0xff, 0xff, 0, 125]), Err(2));
    }

    #[test]
    fn inputs_of_the_image_begin_as_their_coils() {
        let (map, layout) = small();
        let mut image = snapshot(&layout);
        image.bits[layout.bit(Bit::Space(BitSpace::Mc, 4)).0 as usize] = 1;
        assert_eq!(map.first_inputs(&image).collect::<Vec<_>>(), [(0, false), (1, true)]);
    }
}
