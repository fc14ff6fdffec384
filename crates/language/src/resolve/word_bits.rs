//! Looks up the bits of words: `status.3`, `recipe[2].0`, `list[step].0`.
//!
//! Part of the scope. The number of the bit stands last. A bit of an element that a word selects is
//! an element of an array too: of the same bit of neighbouring words.

use super::array::{Array, ArrayElement};
use super::mistake::{Mistake, address_mistake, mistake};
use super::scope::{LookUp, NamedThing, Scope};
use crate::source::finding::Code;
use crate::source::fix::{advise, possible};
use rungd_engine::isa::address_text::{self, AddressError};
use rungd_engine::isa::{Address, Bit};

impl Scope {
    /// Looks up a name that ends with a number. `None` if what is before the number cannot have
    /// bits and has a mistake of its own: of a name that nothing declares, or a block.
    pub(super) fn bit_in(&self, name: &str) -> Option<Result<LookUp, Mistake>> {
        let (base, digits) = address_text::split_bit(name)?;
        let found = match self.look_up(base) {
            Ok(found) => found,
            Err(mistake) if base.contains('[') => return Some(Err(mistake)),
            Err(_) => return None,
        };
        let wrong = |error| address_mistake(name, error);
        let thing = match found.thing {
            NamedThing::Address(address) if base.contains(',') => {
                Err(wrong(AddressError::NoBits(address)))
            }
            NamedThing::Address(address) => address_text::bit_of(address, digits)
                .map(|bit| NamedThing::Address(Address::Bit(bit)))
                .map_err(wrong),
            NamedThing::Element(element) => {
                let bit = address_text::bit_of(element.array.element(0), digits);
                bit.map(|bit| NamedThing::Element(element.bit(bit))).map_err(wrong)
            }
            NamedThing::Array(array) => Err(of_whole(name, base, array)),
            NamedThing::Constant(..) | NamedThing::Real(_) => Err(of_constant(base)),
            NamedThing::Record(place) => {
                let message = format!("`{base}` is {}: it has no bits", place.words());
                Err(mistake(Code::UnknownMember, message, self.name_a_field(base, place)))
            }
            NamedThing::Block(_) | NamedThing::Device(_) => return None,
        };
        Some(thing.map(|thing| LookUp { thing, ..found }))
    }
}

impl ArrayElement {
    /// The bit of the element with the number that a bit of the first element has.
    fn bit(self, first: Bit) -> ArrayElement {
        let bit = first.of_word().map(|bit| bit.number);
        ArrayElement { array: Array { bit, ..self.array }, ..self }
    }
}

fn of_constant(base: &str) -> Mistake {
    let message = format!("`{base}` is a constant: it has no bits");
    mistake(Code::UnknownMember, message, "only words in memory have bits")
}

fn of_whole(name: &str, base: &str, array: Array) -> Mistake {
    let behind = &name[base.len()..];
    let message = format!("`{base}` is an array, and `{behind}` is a bit of one word");
    let help = match array.is_bits() {
        true => advise("name one element: `{}`", [possible(format!("{base}[0]"))]),
        false => {
            let bit = possible(format!("{base}[0]{behind}"));
            advise("a bit of an element is `{}`", [bit])
        }
    };
    mistake(Code::UnknownMember, message, help)
}
