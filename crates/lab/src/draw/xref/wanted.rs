//! The operand of a cross-reference: the meaning of a name as bits and words.

use rungd_engine::isa::{Address, Bit, BlockId, DeviceBit, DeviceId, StageId};
use rungd_language::resolve::mistake::sentence;
use rungd_language::resolve::program::{Program, Tag, TagMeaning};
use rungd_language::resolve::record::RecordPlace;
use rungd_language::resolve::scope::{LookUp, NamedThing};
use rungd_language::source::span::Span;

/// The meaning of a name.
#[derive(Debug, Default)]
pub(super) struct AskedOperand {
    /// The name: the tag's name, if a tag has this address.
    pub name: String,
    /// The address, or the value of a constant.
    pub address: Option<String>,
    /// The `doc` of the tag.
    pub doc: Option<String>,
    /// The place that declares the name.
    pub span: Option<Span>,
    /// The bits and words of the operand.
    pub addresses: Vec<Address>,
    /// The number of the tag, if it is a constant.
    pub constant: Option<usize>,
    /// The subroutine.
    pub subroutine: Option<BlockId>,
}

impl AskedOperand {
    /// Looks up a name.
    ///
    /// # Errors
    /// A sentence for people.
    pub fn named(program: &Program, name: &str) -> Result<AskedOperand, String> {
        let plain = AskedOperand { name: name.to_owned(), ..AskedOperand::default() };
        let LookUp { thing, tag, .. } = match program.scope().look_up(name) {
            Ok(found) => found,
            Err(mistake) => {
                let of_use = of_use(program, name);
                let why = || match mistake.finding(Span::default()) {
                    Some(finding) => sentence(&finding),
                    None => format!("`{name}` has no valid declaration"),
                };
                return match of_use.is_empty() {
                    true => Err(why()),
                    false => Ok(AskedOperand { addresses: of_use, ..plain }),
                };
            }
        };
        let wanted = match thing {
            NamedThing::Address(address) => of_address(program, plain, address),
            NamedThing::Constant(value, _) => {
                AskedOperand { address: Some(value.to_string()), constant: tag, ..plain }
            }
            NamedThing::Real(value) => {
                AskedOperand { address: Some(value.to_string()), constant: tag, ..plain }
            }
            NamedThing::Block(id) => of_block(program, plain, id),
            NamedThing::Device(id) => of_device(plain, id),
            NamedThing::Array(array) => AskedOperand {
                address: Some(array.to_string()),
                addresses: array.addresses().flat_map(Address::operands).collect(),
                ..plain
            },
            NamedThing::Record(place) => of_record(program, plain, place),
            NamedThing::Element(element) => AskedOperand {
                address: Some(element.to_string()),
                addresses: element.array.addresses().collect(),
                ..plain
            },
        };
        let tag = tag.and_then(|tag| program.tags.get(tag));
        Ok(wanted.with_tag(tag))
    }

    fn with_tag(mut self, tag: Option<&Tag>) -> AskedOperand {
        if let Some(tag) = tag {
            self.doc = tag.doc.clone();
            self.span = Some(tag.span);
        }
        self
    }
}

/// The bits and words of all tags of a use of a template.
fn of_use(program: &Program, name: &str) -> Vec<Address> {
    let is_below = |tag: &&Tag| tag.name.strip_prefix(name).is_some_and(|at| at.starts_with('.'));
    let addresses = program.tags.iter().filter(is_below).filter_map(|tag| match tag.meaning {
        TagMeaning::Address(address) => Some(address.operands()),
        TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
    });
    addresses.flatten().collect()
}

fn of_address(program: &Program, plain: AskedOperand, address: Address) -> AskedOperand {
    let tag = program.names.tag_index(address).map(|index| &program.tags[index]);
    let written = address.to_string();
    let wanted = match program.names.second_name(address) {
        Some(tag) if plain.name == written => {
            AskedOperand { name: tag.to_owned(), address: Some(written), ..plain }
        }
        Some(_) => AskedOperand { address: Some(written), ..plain },
        None => plain,
    };
    let span = match address {
        Address::Bit(Bit::Stage(StageId(at))) => {
            let (block, at) = program.stages[at as usize];
            Some(program.block(block).stages[at].span)
        }
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
    };
    AskedOperand { addresses: address.operands(), span, ..wanted }.with_tag(tag)
}

fn of_record(program: &Program, plain: AskedOperand, place: RecordPlace) -> AskedOperand {
    let record = &program.records[place.tag];
    let addresses = program.record_addresses(place);
    AskedOperand {
        addresses: addresses.into_iter().flat_map(Address::operands).collect(),
        doc: record.doc.clone(),
        span: Some(record.span),
        ..plain
    }
}

fn of_block(program: &Program, plain: AskedOperand, id: BlockId) -> AskedOperand {
    let block = program.block(id);
    if block.is_subroutine() {
        let (doc, span) = (block.doc.clone(), Some(block.span));
        return AskedOperand { subroutine: Some(id), doc, span, ..plain };
    }
    let bits = [Bit::Running(id), Bit::Done(id)].into_iter();
    let stages = block.stages.iter().map(|stage| Bit::Stage(stage.id));
    let addresses = bits.chain(stages).map(Address::Bit).collect();
    AskedOperand { addresses, span: Some(block.span), ..plain }
}

fn of_device(plain: AskedOperand, id: DeviceId) -> AskedOperand {
    let bits = DeviceBit::ALL.into_iter().map(|health| Bit::Device(id, health));
    AskedOperand { addresses: bits.map(Address::Bit).collect(), ..plain }
}
