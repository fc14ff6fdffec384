//! The bits and words that something other than an instruction may write.
//!
//! Called by the rules about operands that nothing writes. `outside_operands` lists the devices and
//! Modbus clients. An operator may write almost every bit and word, but only those whose tag has
//! `initial`, `min` or `max` count as settings of an operator. Retained memory is a setting too.

use rungd_engine::isa::{Address, Space};

use super::context::Context;
use super::outside_operands::may_be_moved;

/// Whether something other than an instruction may write an address.
pub fn is_writable(context: &Context, address: Address) -> bool {
    let address = address.without_bit();
    let is_retained = |(space, n)| context.retained_with(space, n).is_some();
    context.settings.contains(&address)
        || Space::of(address).is_some_and(is_retained)
        || match context.outside {
            Some(outside) => outside.writes(address),
            None => may_be_moved(address, !context.program.devices.is_empty()),
        }
}
