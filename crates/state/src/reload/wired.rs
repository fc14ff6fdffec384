//! Whether a new program keeps the cells to which field devices are wired.
//!
//! The wiring of a device stays over a reload, by cells. Addresses keep their cells. But the bits
//! of blocks and Stages have names instead of addresses, and their cells depend on the number of
//! blocks and Stages before them. And a tag with a `type` gets a place that no file names: it may
//! be moved away from its wire, or another tag to it. All of that is refused, because a device
//! would take the wrong element.

use rungd_engine::isa::{Address, Bit, BlockId, StageId};
use rungd_language::lower::Symbols;
use rungd_language::resolve::name_book::NameBook;

/// The reason why a program cannot be reloaded; `None`: it keeps all cells. `wired`: the addresses
/// of the devices' maps in the first program of the process, each with its device.
pub fn misfit<'a>(
    mut wired: impl Iterator<Item = (&'a str, Address)>,
    first: &Symbols,
    next: &Symbols,
) -> Option<String> {
    let misfit = wired.find_map(|(device, address)| {
        match (placed(&first.names, address), placed(&next.names, address)) {
            (Some(was), Some(now)) if was == now => return None,
            (Some(was), _) => {
                return Some(format!(
                    "device `{device}` is wired to the place of `{was}` until a restart, and this \
                     program moves that tag in memory, or does not have it: restart rungd, or wire \
                     the device to an address"
                ));
            }
            (None, Some(now)) => {
                return Some(format!(
                    "device `{device}` is wired to {address} until a restart, and this program \
                     would place the tag `{now}` there: give the tag an `at`, or restart rungd"
                ));
            }
            (None, None) => {}
        }
        let Address::Bit(bit) = address else { return None };
        let name = first.names.address(address);
        match again(bit, &first.names, &next.names) {
            None => Some(format!(
                "device `{device}` is wired to `{name}` until a restart, and this program does \
                 not have it: restart rungd"
            )),
            Some(now) if next.layout.bit_in(now) != first.layout.bit_in(bit) => Some(format!(
                "device `{device}` is wired to `{name}` until a restart, and this program moves \
                 it in memory, because it has different blocks or stages: restart rungd, or wire \
                 the device to a Y or C that the ladder drives"
            )),
            Some(_) => None,
        }
    })?;
    Some(format!("{misfit}; nothing is reloaded until then"))
}

/// The name of the tag with a `type` that has an address in a program.
fn placed(names: &NameBook, address: Address) -> Option<String> {
    names.places.at(address).map(|(place, index)| place.name_of(index))
}

/// The bit of the same name in the next program.
fn again(bit: Bit, first: &NameBook, next: &NameBook) -> Option<Bit> {
    let stage = |id| {
        let at = next.stages.iter().position(|stage| stage.whole == first.stage(id))?;
        Some(StageId(at as u32))
    };
    let block = |id: BlockId| {
        let name = &first.block(id).name;
        let at = next.blocks.iter().position(|block| block.name == *name)?;
        Some(BlockId(at as u32))
    };
    match bit {
        Bit::Stage(id) => stage(id).map(Bit::Stage),
        Bit::Running(id) => block(id).map(Bit::Running),
        Bit::Done(id) => block(id).map(Bit::Done),
        Bit::Space(..) | Bit::Flag(..) | Bit::Device(..) | Bit::InWord(_) => Some(bit),
    }
}
