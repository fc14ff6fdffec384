//! A program as the conditions of its tests see it: with the observer, and with a place for each
//! `was(x)`.
//!
//! Called by `testing`, once for each program of a test file. What is added lies behind the memory
//! of the program, so each of its addresses keeps its meaning, and no text can name what is added
//! by an address. The program itself is not changed: no controller executes this one.

use super::formula::{NumberType, type_of};
use super::program::{NamedArray, NamedOperand, Program};
use super::scope::{NamedThing, Scope};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible};
use crate::source::span::Span;
use crate::source::was;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace, BlockId, DeviceId, MemorySizes, Space, WordSpace};

/// A program with what the conditions of its tests add.
#[derive(Clone, Debug)]
pub struct ObservedProgram {
    /// The program, with memory for all that is added.
    pub program: Program,
    /// The memory sizes without what is added.
    pub sizes: MemorySizes,
    /// The block of the observer, if the test file has one.
    pub observer: Option<BlockId>,
    /// The bits and words that the rungs of the observer name.
    pub operands: Vec<NamedOperand>,
    /// The arrays that the rungs of the observer name.
    pub arrays: Vec<NamedArray>,
    /// The values that are remembered.
    pub was: Vec<Remembered>,
    /// The memory of field devices that is shown.
    pub shown: Vec<ShownOperand>,
}

/// A bit or word of a field device's own ladder, which conditions name: `tank.level`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownOperand {
    /// Its name in conditions.
    pub name: String,
    /// The device.
    pub device: DeviceId,
    /// Its place in the device's ladder, by address and by cell.
    pub address: Address,
    /// The cell.
    pub cell: Cell,
}

/// A place whose value at the end of the scan before is remembered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remembered {
    /// Its name in conditions: `was(level)`.
    pub name: String,
    /// The place: a bit or a word.
    pub place: Address,
    /// Where its earlier value is.
    pub kept: Address,
}

impl ObservedProgram {
    /// A program to which nothing is added yet. `sizes`: the memory sizes without what is added.
    pub fn bare(program: Program, sizes: MemorySizes) -> ObservedProgram {
        let (operands, arrays, was, shown) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        ObservedProgram { program, sizes, observer: None, operands, arrays, was, shown }
    }

    /// Adds a place for each operand of a device's ladder: the address of it here.
    pub fn show(&mut self, operands: &[ShownOperand]) {
        for operand in operands {
            let address = self.added(operand.address);
            self.shown.push(ShownOperand { address, ..operand.clone() });
        }
    }

    /// Adds a place for each of the names `was(x)`; a name with a mistake has none. What field
    /// devices show is there already.
    pub fn remember(&mut self, names: &[String]) {
        let scope = Scope::of(&self.program);
        for name in names {
            let of_device =
                self.shown.iter().find(|shown| was::place_in(name) == Some(&shown.name));
            let place = match of_device {
                Some(shown) => Ok(shown.address),
                None => remembered(&scope, name, Span::default()),
            };
            if let Ok(place) = place {
                let kept = self.added(place);
                self.was.push(Remembered { name: name.clone(), place, kept });
            }
        }
    }

    /// The next free element behind the memory of the program, for a value of a place.
    fn added(&mut self, place: Address) -> Address {
        let space = match place {
            Address::Word(word) if type_of(word) == NumberType::Real => Space::Word(WordSpace::R),
            Address::Word(_) => Space::Word(WordSpace::D),
            Address::Bit(_) | Address::Structure(_) => Space::Bit(BitSpace::C),
        };
        let count = space.count(&self.program.sizes);
        self.program.sizes = space.sized(&self.program.sizes, count + 1);
        space.address(space.first() + count)
    }

    /// Whether an address belongs to the program itself, and not to what is added.
    pub fn is_of_program(&self, address: Address) -> bool {
        lies_within(address, &self.sizes)
    }
}

/// Whether an address lies within memory of these sizes.
pub fn lies_within(address: Address, sizes: &MemorySizes) -> bool {
    let of_word = if let Address::Bit(Bit::InWord(bit)) = address {
        Some(Address::Word(bit.word))
    } else {
        None
    };
    Space::with_members(of_word.unwrap_or(address))
        .is_none_or(|(space, number)| number < space.first() + space.count(sizes))
}

/// The place x of a name `was(x)`.
///
/// # Errors
/// It is no bit and no word.
pub fn remembered(scope: &Scope, name: &str, span: Span) -> Result<Address, Finding> {
    let x = was::place_in(name).unwrap_or_default();
    let no_place = |message: String, help: Help| {
        Finding::new(Code::OperandType, span, message)
            .label("one bit or word belongs here")
            .help(help)
    };
    match scope.look_up(x).map(|found| found.thing) {
        Ok(NamedThing::Address(address @ (Address::Bit(_) | Address::Word(_)))) => Ok(address),
        Ok(NamedThing::Address(Address::Structure(structure))) => {
            let members = structure.members().iter();
            let members = members.map(|member| possible(format!("{x}.{member}")));
            let help = Help::from("name a member: a structure has several").with_all(members);
            Err(no_place(format!("`{x}` is a structure"), help))
        }
        Ok(NamedThing::Element(element)) => {
            let last = element.array.count - 1;
            let base = x.split('[').next().unwrap_or(x);
            let words = format!("a constant selects the element: `{{}}` to `{base}[{last}]`");
            let help = advise(&words, [possible(format!("{base}[0]"))]);
            Err(no_place(format!("the index of `{x}` is a word"), help))
        }
        Ok(_) => {
            let message = scope.address(x).err().unwrap_or_default();
            let help = advise("name one bit or one word: `{}`", [possible("D0")]);
            Err(no_place(message, help))
        }
        Err(mistake) => Err(mistake.finding(span).unwrap_or_else(|| {
            let message = format!("the declaration of `{x}` has a mistake");
            Finding::new(Code::UnknownName, span, message)
        })),
    }
}
