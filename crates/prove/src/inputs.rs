//! The inputs of a ladder: what comes from outside before each scan.
//!
//! Called by `question` and `equal`, which let them have any value, and by `mistake`. Which of them
//! may change in a proof, and how a test sets them, is said there.

use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace, status};
use rungd_engine::{Cell, Layout};
use rungd_lab::testing::Suite;
use rungd_language::resolve::program::Program;

/// The addresses that a ladder names. A bit of a word is its word.
pub(crate) fn addresses(program: &Program) -> impl Iterator<Item = Address> {
    let whole = |address| {
        let Address::Bit(Bit::InWord(bit)) = address else { return address };
        Address::Word(bit.word)
    };
    let named = program.operands.iter().map(move |operand| whole(operand.address));
    named.chain(of_arrays(program))
}

/// The addresses in its arrays.
pub(crate) fn of_arrays(program: &Program) -> impl Iterator<Item = Address> {
    program.arrays.iter().flat_map(|named| named.array.addresses())
}

/// Whether an address is an X, or a word of the date or time of day.
pub(crate) fn is_input(address: &Address) -> bool {
    match address {
        Address::Bit(Bit::Space(BitSpace::X, _)) => true,
        Address::Word(Word::Space(WordSpace::Dst, n)) => status::dst::is_of_clock(*n),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
    }
}

/// Whether it is an input, or a time of scans.
pub(crate) fn is_given(address: &Address) -> bool {
    let Address::Word(Word::Space(WordSpace::Dst, n)) = address else { return is_input(address) };
    status::dst::is_given(*n)
}

/// Whether an address is a time of scans.
pub(crate) fn is_scan_time(address: &Address) -> bool {
    matches!(address, Address::Word(Word::Space(WordSpace::Dst, n)) if status::dst::is_of_scans(*n))
}

/// The addresses that a program and the conditions of a test file name. `layout`: the cells of the
/// conditions.
pub(crate) fn named(
    suite: &Suite,
    program: &Program,
    layout: &Layout,
) -> impl Iterator<Item = Address> {
    let proof = &suite.proof;
    let of_conditions = suite.always[0].iter().chain(&proof.assume).chain(&proof.can);
    let of_conditions = of_conditions
        .flat_map(|condition| condition.operands.iter().map(|(_, cell)| *cell))
        .filter_map(|cell| match cell {
            Cell::WordBit(bit) => layout.address(Cell::Word(bit.word)),
            Cell::Bit(_) | Cell::Word(_) => layout.address(cell),
        });
    addresses(program).chain(of_conditions)
}

/// What field devices bring.
pub(crate) fn brought(suite: &Suite) -> impl Iterator<Item = Address> {
    let devices = suite.programs[0].controller.devices.iter();
    devices.flat_map(|device| device.inputs.iter().map(|input| input.address))
}

/// The number of an X.
pub(crate) fn x_number(address: Address) -> Option<u32> {
    match address {
        Address::Bit(Bit::Space(BitSpace::X, n)) => Some(n),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
    }
}

/// The least and the greatest content of a bit or word; `None`: of a structure.
pub(crate) fn range(address: Address) -> Option<(i32, i32)> {
    match address {
        Address::Bit(_) => Some((0, 1)),
        Address::Word(word @ Word::Space(WordSpace::Dst, n)) => {
            Some(status::dst::clock_range(n).unwrap_or(word.range()))
        }
        Address::Word(word) => Some(word.range()),
        Address::Structure(_) => None,
    }
}
