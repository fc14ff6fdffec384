//! The map: the image's cell behind each coil, input and register, and the clients that may write
//! it.
//!
//! Built once from the settings, the layout and the tags' limits; all connections share it. A read
//! is answered from one snapshot, so values of two scans never mix. A write becomes one batch, or
//! is refused whole. The map has no I/O, no clock and no log: a refusal contains its reason, and
//! the connection logs it.
//!
//! An element is looked up first among those of its unit, then among those of all units. No address
//! has an element in both: `controller` refuses such a file.

use std::collections::{BTreeMap, HashMap};
use std::net::IpAddr;

use super::clients::Network;
use super::elements::{BitElement, ElementRows, ListSet, Register, RegisterPart, TableElements};
use super::number::{RegisterNumberType, WordOrder};
use super::pdu::{self, ElementRange, ModbusRequest, ModbusTable};
use super::refusal::ModbusRefusal;
use super::settings::{MappedOperands, ModbusServerSettings};
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, Layout};
use rungd_language::resolve::range::Range;
use rungd_runtime::exchange::{OperandWrite, Snapshot, WordMask};

/// Every element that a client can address, by protocol address.
#[derive(Debug)]
pub struct ModbusMap {
    /// The units that are answered; `None`: all.
    units: Option<Vec<u8>>,
    /// The elements for all units.
    common: TableElements,
    /// The elements for one unit each.
    own: BTreeMap<u8, TableElements>,
    /// The networks that each write list admits; `None`: every client.
    lists: Vec<Option<Vec<Network>>>,
    /// The coils that are copied to inputs, with the numbers of the inputs.
    inputs: Vec<(BitCell, u32)>,
    /// The names of Stages, blocks and tags with a `type`.
    names: HashMap<Address, String>,
}

/// The client of a request, and the unit that the request addresses.
#[derive(Clone, Copy, Debug)]
pub struct RequestSource {
    /// The unit identifier of the request.
    pub unit: u8,
    /// The client's address.
    pub client: IpAddr,
}

/// A read, for [`ModbusMap::read`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct TableRead {
    /// The function code, for the reply.
    pub function: u8,
    /// The elements.
    pub range: ElementRange,
}

impl ModbusMap {
    /// The map of a program's memory for a server's settings. `limits` returns the least and
    /// greatest value of a word: its range, narrowed by the tags of its address.
    pub fn new(
        settings: &ModbusServerSettings,
        layout: &Layout,
        limits: impl Fn(Word) -> (i32, i32),
    ) -> ModbusMap {
        let make = ElementSources { settings, layout, limits: &limits };
        let mut map = ModbusMap {
            units: settings.units.clone(),
            common: TableElements::default(),
            own: BTreeMap::new(),
            lists: settings.lists.iter().map(|list| list.clients.clone()).collect(),
            inputs: Vec::new(),
            names: HashMap::new(),
        };
        if settings.standard_map {
            map.common = make.standard();
        }
        for entry in &settings.entries {
            let places = match entry.unit {
                None => &mut map.common,
                Some(unit) => map.own.entry(unit).or_default(),
            };
            make.add(entry, places);
            let first = entry.operands.first;
            let of_block =
                matches!(first, Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_)));
            if of_block || entry.operands.is_placed {
                map.names.insert(entry.operands.first, entry.operands.to_string());
            }
        }
        if let Some((mc, x)) = settings.inputs {
            let cell = |n| layout.bit(Bit::Space(BitSpace::Mc, n));
            map.inputs = (mc.first..=mc.last).map(cell).zip(x.first..).collect();
        }
        map
    }

    /// Whether a unit identifier is answered.
    pub(crate) fn answers(&self, unit: u8) -> bool {
        self.units.as_ref().is_none_or(|units| units.contains(&unit))
    }

    /// Appends the reply to a read, from one snapshot.
    ///
    /// # Errors
    /// If an element does not exist; then nothing is appended.
    pub(crate) fn read(
        &self,
        unit: u8,
        ask: TableRead,
        snapshot: &Snapshot,
        reply: &mut Vec<u8>,
    ) -> Result<(), ModbusRefusal> {
        let TableRead { function, range } = ask;
        if range.table.is_bits() {
            let bits = self.bits(unit, range)?;
            pdu::push_bits(reply, function, bits.iter().map(|bit| bit.shown(snapshot)));
        } else {
            let words = self.words(unit, range)?;
            pdu::push_words(reply, function, words.iter().map(|word| word.shown(snapshot)));
        }
        Ok(())
    }

    /// The batch of a write; for a read, an empty batch.
    ///
    /// # Errors
    /// If an element does not exist or is not writable by the client, or a tag does not allow a
    /// value. Then nothing is written.
    pub(crate) fn writes(
        &self,
        asker: RequestSource,
        request: &ModbusRequest<'_>,
    ) -> Result<Vec<OperandWrite>, ModbusRefusal> {
        match *request {
            ModbusRequest::Read { .. } => Ok(Vec::new()),
            ModbusRequest::WriteCoils { packed, .. } => {
                self.coil_writes(asker, request.place(), packed)
            }
            ModbusRequest::WriteRegisters { values, .. }
            | ModbusRequest::ReadWrite { values, .. } => {
                self.register_writes(asker, request.place(), values)
            }
            ModbusRequest::MaskWrite { and, or, .. } => {
                self.mask(asker, request.place(), WordMask { and, or })
            }
        }
    }

    fn coil_writes(
        &self,
        asker: RequestSource,
        coils: ElementRange,
        packed: &[u8],
    ) -> Result<Vec<OperandWrite>, ModbusRefusal> {
        let coils = self.bits(asker.unit, coils)?;
        let admitted = self.admitted(asker.client);
        for coil in &coils {
            may_write(Address::Bit(coil.bit), coil.lists, admitted)?;
        }
        let values = packed.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 != 0));
        let mut writes = Vec::with_capacity(coils.len() * 2);
        for (coil, on) in coils.iter().zip(values) {
            writes.push(OperandWrite::of_bit(coil.cell, on));
            writes.extend(coil.input.map(|x| OperandWrite::Input(x, on)));
        }
        Ok(writes)
    }

    fn register_writes(
        &self,
        asker: RequestSource,
        registers: ElementRange,
        values: &[u8],
    ) -> Result<Vec<OperandWrite>, ModbusRefusal> {
        let registers = self.words(asker.unit, registers)?;
        let admitted = self.admitted(asker.client);
        for register in &registers {
            may_write(Address::Word(register.word), register.lists, admitted)?;
        }
        // Both halves of a value are neighbours in the map, so only the ends of a request can
        // separate them.
        let ends =
            [(registers.first(), RegisterPart::Second), (registers.last(), RegisterPart::First)];
        let parted = ends.iter().find_map(|(end, part)| end.filter(|it| it.part == *part));
        if let Some(register) = parted {
            return Err(ModbusRefusal::HalfOf(register.word));
        }
        let mut values = values.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]]));
        let mut writes = Vec::with_capacity(registers.len());
        for register in registers.iter().filter(|register| register.part != RegisterPart::Second) {
            let Some(first) = values.next() else { break };
            let second = if register.part == RegisterPart::First { values.next() } else { None };
            writes.push(OperandWrite::Word(register.cell, register.value(first, second)?));
        }
        Ok(writes)
    }

    fn mask(
        &self,
        asker: RequestSource,
        register: ElementRange,
        mask: WordMask,
    ) -> Result<Vec<OperandWrite>, ModbusRefusal> {
        let registers = self.words(asker.unit, register)?;
        let admitted = self.admitted(asker.client);
        let mut writes = Vec::with_capacity(1);
        for register in registers {
            may_write(Address::Word(register.word), register.lists, admitted)?;
            if register.part != RegisterPart::Whole {
                return Err(ModbusRefusal::HalfOf(register.word));
            }
            if !register.takes_mask() {
                return Err(ModbusRefusal::NoMask(register.word));
            }
            let signed = register.kind == RegisterNumberType::I16;
            writes.push(OperandWrite::Masked { cell: register.cell, mask, signed });
        }
        Ok(writes)
    }

    /// The operands of a request, in the notation of an author: `MHR10..MHR12`.
    pub fn place(&self, unit: u8, request: &ModbusRequest<'_>) -> String {
        let ElementRange { table, first, count } = request.place();
        let (first, last) = (u32::from(first), u32::from(first) + u32::from(count.max(1)) - 1);
        let (low, high) = (self.name(unit, table, first), self.name(unit, table, last));
        if low == high { low } else { format!("{low}..{high}") }
    }

    fn name(&self, unit: u8, table: ModbusTable, at: u32) -> String {
        let address = match table {
            ModbusTable::Coils | ModbusTable::DiscreteInputs => {
                let bit = self.element(unit, at, |places| places.bits(table));
                bit.map(|bit| Address::Bit(bit.bit))
            }
            ModbusTable::HoldingRegisters | ModbusTable::InputRegisters => {
                let word = self.element(unit, at, |places| places.words(table));
                word.map(|word| Address::Word(word.word))
            }
        };
        let Some(address) = address else { return format!("{} {at}", table.name()) };
        self.called(address)
    }

    /// The name of a Stage, a block or a tag with a `type`; for any other address, the address
    /// itself.
    pub(crate) fn called(&self, address: Address) -> String {
        self.names.get(&address).cloned().unwrap_or_else(|| address.to_string())
    }

    /// The values of the image's inputs before a client has written any: the values of their coils.
    pub(crate) fn first_inputs<'a>(
        &'a self,
        first: &'a Snapshot,
    ) -> impl Iterator<Item = (u32, bool)> {
        self.inputs.iter().map(move |(cell, x)| (*x, first.bit(*cell)))
    }

    /// The lists that admit a client.
    fn admitted(&self, client: IpAddr) -> ListSet {
        let admits = |clients: &Option<Vec<Network>>| {
            clients.as_ref().is_none_or(|all| all.iter().any(|network| network.admits(client)))
        };
        let lists = self.lists.iter().zip(0..ListSet::BITS);
        lists.fold(0, |all, (list, at)| all | ListSet::from(admits(list)) << at)
    }

    fn bits(&self, unit: u8, range: ElementRange) -> Result<Vec<&BitElement>, ModbusRefusal> {
        self.elements(unit, range, |places| places.bits(range.table))
    }

    fn words(&self, unit: u8, range: ElementRange) -> Result<Vec<&Register>, ModbusRefusal> {
        self.elements(unit, range, |places| places.words(range.table))
    }

    /// The elements of a request, if all exist.
    fn elements<'a, T: 'a>(
        &'a self,
        unit: u8,
        ElementRange { table, first, count }: ElementRange,
        rows: impl Fn(&'a TableElements) -> &'a ElementRows<T> + Copy,
    ) -> Result<Vec<&'a T>, ModbusRefusal> {
        let first = u32::from(first);
        let element = |at| {
            self.element(unit, at, rows).ok_or(ModbusRefusal::NoSuchElement { table, address: at })
        };
        (first..first + u32::from(count)).map(element).collect()
    }

    fn element<'a, T: 'a>(
        &'a self,
        unit: u8,
        at: u32,
        rows: impl Fn(&'a TableElements) -> &'a ElementRows<T>,
    ) -> Option<&'a T> {
        let own = self.own.get(&unit).and_then(|places| rows(places).at(at));
        own.or_else(|| rows(&self.common).at(at))
    }
}

fn may_write(what: Address, lists: ListSet, admitted: ListSet) -> Result<(), ModbusRefusal> {
    match (lists, lists & admitted) {
        (0, _) => Err(ModbusRefusal::NotWritable(what)),
        (_, 0) => Err(ModbusRefusal::NotByThisClient(what)),
        _ => Ok(()),
    }
}

/// The data from which elements are made.
struct ElementSources<'a> {
    settings: &'a ModbusServerSettings,
    layout: &'a Layout,
    limits: &'a dyn Fn(Word) -> (i32, i32),
}

impl ElementSources<'_> {
    fn standard(&self) -> TableElements {
        let sizes = self.layout.sizes();
        let bits =
            |space, count| (1..=count).map(|n| self.bit(Bit::Space(space, n))).collect::<Vec<_>>();
        let words = |space, count| {
            let order = WordOrder::default();
            let word = |n| {
                let (kind, part) = (RegisterNumberType::U16, RegisterPart::Whole);
                self.register(Word::Space(space, n), kind, order, part)
            };
            (1..=count).map(word).collect::<Vec<_>>()
        };
        let mut places = TableElements::default();
        places.coils.add(0, bits(BitSpace::Mc, sizes.mc));
        places.discrete.add(0, bits(BitSpace::Mi, sizes.mi));
        places.holding.add(0, words(WordSpace::Mhr, sizes.mhr));
        places.input.add(0, words(WordSpace::Mir, sizes.mir));
        places
    }

    fn add(&self, entry: &MappedOperands, places: &mut TableElements) {
        let (mut bits, mut words) = (Vec::new(), Vec::new());
        for address in entry.operands.addresses() {
            match address {
                Address::Bit(bit) => bits.push(self.bit(bit)),
                Address::Word(word) => {
                    let kind = entry.kind.unwrap_or_else(|| RegisterNumberType::of(word));
                    let parts = match kind.registers() {
                        1 => &[RegisterPart::Whole][..],
                        _ => &[RegisterPart::First, RegisterPart::Second],
                    };
                    let register = |part| self.register(word, kind, entry.order, part);
                    words.extend(parts.iter().map(|part| register(*part)));
                }
                Address::Structure(_) => {}
            }
        }
        let first = u32::from(entry.address);
        match entry.table {
            ModbusTable::Coils => places.coils.add(first, bits),
            ModbusTable::DiscreteInputs => places.discrete.add(first, bits),
            ModbusTable::HoldingRegisters => places.holding.add(first, words),
            ModbusTable::InputRegisters => places.input.add(first, words),
        }
    }

    fn bit(&self, bit: Bit) -> BitElement {
        let ModbusServerSettings { inputs, outputs, .. } = *self.settings;
        let (mut input, mut output) = (None, None);
        match bit {
            Bit::Space(BitSpace::Mc, n) => input = inputs.and_then(|(mc, x)| across(mc, x, n)),
            Bit::Space(BitSpace::Mi, n) => output = outputs.and_then(|(y, mi)| across(mi, y, n)),
            Bit::Space(BitSpace::Y, n) => output = Some(n),
            Bit::Space(..)
            | Bit::Flag(..)
            | Bit::Stage(_)
            | Bit::Running(_)
            | Bit::Done(_)
            | Bit::Device(..)
            | Bit::InWord(_) => {}
        }
        // Every client may write a coil that is copied to an input, as if the coil were in
        // `writable`.
        let lists = self.lists(Address::Bit(bit)) | ListSet::from(input.is_some());
        BitElement { bit, cell: self.layout.bit_in(bit), output, lists, input }
    }

    fn register(
        &self,
        word: Word,
        kind: RegisterNumberType,
        order: WordOrder,
        part: RegisterPart,
    ) -> Register {
        let (cell, limits) = (self.layout.word(word), (self.limits)(word));
        let lists = self.lists(Address::Word(word));
        Register { word, cell, kind, part, order, lists, limits }
    }

    /// The lists that contain an operand.
    fn lists(&self, address: Address) -> ListSet {
        let lists = self.settings.lists.iter().zip(0..ListSet::BITS);
        lists.fold(0, |all, (list, at)| {
            let held = list.ranges.iter().any(|range| range.hold(address));
            all | ListSet::from(held) << at
        })
    }
}

/// The element of `to` that corresponds to an element of `from`; both ranges have the same length.
fn across(from: Range, to: Range, n: u32) -> Option<u32> {
    (from.first..=from.last).contains(&n).then(|| to.first + (n - from.first))
}
