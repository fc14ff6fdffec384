//! What is made of a resolved program, once: its book of names, and the scope, which finds the
//! meaning of a text.
//!
//! Called by the resolver and by everything that reads texts of people. The program keeps both.

use std::sync::Arc;

use super::name_book::{BlockName, NameBook, StageName};
use super::places::Places;
use super::program::{Block, OfArray, Program, Tag, TagMeaning};
use super::record::RecordPlace;
use super::scope::{BlockNames, Scope};
use rungd_engine::isa::{Address, BlockId, DeviceId, MemorySizes};

impl NameBook {
    /// The names of a program whose tags have these places.
    pub(super) fn of(program: &Program, places: Places) -> NameBook {
        let block = |block: &Block| BlockName { kind: block.kind, name: block.name.clone() };
        let stage = |(block, at): &(BlockId, usize)| {
            let (block, name) = (program.block(*block), &program.block(*block).stages[*at].name);
            let whole = format!("{}.{name}", block.name);
            StageName { block: block.id, name: name.clone(), whole }
        };
        let blocks = program.blocks.iter().map(block).collect();
        let stages = program.stages.iter().map(stage).collect();
        let mut book = NameBook::new(blocks, stages, program.devices.clone(), places);
        program.tags.iter().for_each(|tag| book.add_tag(tag));
        book
    }
}

impl Scope {
    /// The names of a resolved program.
    pub fn of(program: &Program) -> Scope {
        Scope::within(program, program.sizes.clone())
    }

    /// As [`Scope::of`], with the memory sizes that bound the addresses of texts.
    pub(super) fn within(program: &Program, sizes: MemorySizes) -> Scope {
        let mut scope = Scope::new(sizes);
        scope.set_places(program.names.places.clone());
        for (at, tag) in program.tags.iter().enumerate() {
            match tag.of_array {
                None => scope.add_tag(&tag.name, at, Some(tag.meaning)),
                Some(OfArray { array, at: 0 }) => {
                    scope.add_tag(&tag.array_name(), at, Some(TagMeaning::Array(array)));
                }
                Some(_) => {}
            }
        }
        for record in &program.records {
            scope.add_record(record.clone());
        }
        for block in &program.blocks {
            let stages = block.stages.iter().map(|stage| (stage.name.clone(), stage.id)).collect();
            scope.add_block(&block.name, BlockNames::new(block.id, block.kind, stages));
        }
        for (at, device) in program.devices.iter().enumerate() {
            scope.add_device(device, DeviceId(at as u32));
        }
        scope
    }
}

impl Program {
    /// Its names for texts that people write: tags, addresses, members, `Prog.Stage`,
    /// `Block.Running`, `Task.Done`, `$` nicknames. Made at the first call.
    pub fn scope(&self) -> &Scope {
        self.scope.get_or_init(|| Arc::new(Scope::of(self)))
    }
}

impl Program {
    /// The bits, words and structures of a record, in the order of its fields. If a word selects
    /// the record, those of all records of the array.
    pub fn record_addresses(&self, place: RecordPlace) -> Vec<Address> {
        let Some(record) = self.records.get(place.tag) else { return Vec::new() };
        let tags = record.tags(place.number()).filter_map(|tag| self.tags.get(tag));
        let address = |tag: &Tag| match tag.meaning {
            TagMeaning::Address(address) => Some(address),
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
        };
        tags.filter_map(address).collect()
    }
}
