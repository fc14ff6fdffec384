//! The names of cells for people: tags, addresses, Stages, blocks, status words.

use std::collections::HashMap;

use super::answer::OperandName;
use rungd_engine::isa::status::{BIT_NICKNAMES, word_nickname};
use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockId, DeviceId, Health, StageId, Structure, Word, WordSpace,
};
use rungd_engine::{Cell, Layout};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Program, TagMeaning};

/// The names of a program's cells.
#[derive(Debug)]
pub(super) struct CellNames {
    /// The first tag of each cell, with its `doc`; for a structure, the tags of its members.
    tags: HashMap<Cell, (String, Option<String>)>,
    /// The bits without a written address: those of blocks, Stages and field devices.
    own: HashMap<Cell, Bit>,
}

impl CellNames {
    pub fn new(program: &Program, symbols: &Symbols) -> CellNames {
        let layout = &symbols.layout;
        let mut names = CellNames { tags: HashMap::new(), own: HashMap::new() };
        for tag in &program.tags {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            match address {
                Address::Structure(structure) => names.members(layout, structure, &tag.name),
                Address::Bit(_) | Address::Word(_) => {
                    if let Some(cell) = layout.cell(address) {
                        let name = || (tag.name.clone(), tag.doc.clone());
                        names.tags.entry(cell).or_insert_with(name);
                    }
                }
            }
        }
        for block in (0..program.blocks.len() as u32).map(BlockId) {
            names.own(layout, Bit::Running(block));
            names.own(layout, Bit::Done(block));
        }
        (0..program.stages.len() as u32).for_each(|at| names.own(layout, Bit::Stage(StageId(at))));
        for device in (0..program.sizes.devices).map(DeviceId) {
            Health::ALL.into_iter().for_each(|of| names.own(layout, Bit::Device(device, of)));
        }
        names
    }

    fn members(&mut self, layout: &Layout, structure: Structure, tag: &str) {
        for (member, address) in structure.members().iter().zip(structure.member_addresses()) {
            if let Some(cell) = layout.cell(address) {
                self.tags.entry(cell).or_insert_with(|| (format!("{tag}.{member}"), None));
            }
        }
    }

    fn own(&mut self, layout: &Layout, bit: Bit) {
        self.own.insert(Cell::Bit(layout.bit(bit)), bit);
    }

    /// The address of a cell.
    pub fn address(&self, layout: &Layout, cell: Cell) -> Option<Address> {
        self.own.get(&cell).map(|bit| Address::Bit(*bit)).or_else(|| layout.address(cell))
    }

    /// The operand of a cell.
    pub fn operand(&self, symbols: &Symbols, cell: Cell) -> OperandName {
        let address = self.address(&symbols.layout, cell);
        let tag = self.tags.get(&cell);
        let own = address.map(|address| self.written(symbols, address));
        let real = matches!(cell, Cell::Word(word) if symbols.layout.is_real(word));
        OperandName {
            cell,
            name: tag.map(|(name, _)| name.clone()).or(own.clone()).unwrap_or_default(),
            address: own.filter(|own| tag.is_some_and(|(name, _)| name != own)),
            doc: tag.and_then(|(_, doc)| doc.clone()),
            is_bit: matches!(cell, Cell::Bit(_)),
            is_real: real,
            is_time: matches!(address, Some(Address::Word(Word::Acc(Structure::Timer(_))))),
        }
    }

    fn written(&self, symbols: &Symbols, address: Address) -> String {
        match address {
            Address::Bit(Bit::Space(BitSpace::St, n)) => {
                let name = BIT_NICKNAMES.get(n as usize);
                name.map_or_else(|| address.to_string(), |name| (*name).to_owned())
            }
            Address::Bit(Bit::Device(DeviceId(n), health)) => {
                let device = symbols.devices.get(n as usize).map_or("device", String::as_str);
                format!("{device}.{}", health.name())
            }
            Address::Bit(bit) => symbols.identity.bit(bit),
            Address::Word(Word::Space(WordSpace::Dst, n)) => {
                word_nickname(n).map_or_else(|| address.to_string(), str::to_owned)
            }
            Address::Word(_) | Address::Structure(_) => symbols.identity.places.say(address),
        }
    }
}
