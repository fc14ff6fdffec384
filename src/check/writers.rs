//! The bits and words that something other than an instruction may write.
//!
//! Called by the rules about operands that nothing writes. Devices and Modbus clients are those of
//! [`outside`](super::outside). An operator may write almost every bit and word, so the ladder says
//! which of them are meant as settings: those with `initial`, `min` or `max`. Retained memory is a
//! setting too.

use crate::isa::{Address, NumberSet};
use crate::resolve::program::{Tag, TagMeaning};

use super::context::Context;
use super::outside::{holds, may_be_moved};

/// The addresses that something other than an instruction may write.
pub struct Writable<'c> {
    context: &'c Context<'c>,
    settings: NumberSet<Address>,
}

impl<'c> Writable<'c> {
    /// Of a program and its controller file.
    pub fn new(context: &'c Context<'c>) -> Writable<'c> {
        let tags = context.program.tags.iter();
        let is_setting =
            |tag: &&Tag| tag.initial.is_some() || tag.min.is_some() || tag.max.is_some();
        let settings = tags.filter(is_setting).filter_map(|tag| match tag.meaning {
            TagMeaning::Address(address) => Some(address),
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
        });
        Writable { context, settings: settings.collect() }
    }

    /// Whether an address is among them.
    pub fn holds(&self, address: Address) -> bool {
        let context = self.context;
        self.settings.contains(&address)
            || context.retained.iter().any(|range| holds(range, address))
            || match context.outside {
                Some(outside) => outside.writes(address),
                None => may_be_moved(address, !context.program.devices.is_empty()),
            }
    }
}
