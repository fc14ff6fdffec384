//! The bits and words that something other than an instruction may write.
//!
//! Called by the rules about operands that nothing writes. [`outside`](super::outside) lists the
//! devices and Modbus clients. An operator may write almost every bit and word, but only those
//! whose tag has `initial`, `min` or `max` count as settings of an operator. Retained memory is a
//! setting too.

use crate::isa::Address;

use super::context::Context;
use super::outside::may_be_moved;

/// Whether something other than an instruction may write an address.
pub fn is_writable(context: &Context, address: Address) -> bool {
    context.settings.contains(&address)
        || context.retained.iter().any(|range| range.holds(address))
        || match context.outside {
            Some(outside) => outside.writes(address),
            None => may_be_moved(address, !context.program.devices.is_empty()),
        }
}
