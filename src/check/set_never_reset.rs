//! `set-never-reset`: a bit is SET, and nothing ever turns it OFF.
//!
//! RST and PONOFF turn a bit OFF, and so do its drivers (see `duplicate_out`). MC bits are left
//! out: a Modbus client writes them.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["SET C0"] }, { when = ["X1"], do = ["RST C0"] } ]
//! ```
//!
//! Fails: the first rung alone.

use std::collections::BTreeSet;

use crate::isa::{Address, Bit, BitSpace, Mnemonic};
use crate::source::finding::{Code, Finding};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut off: BTreeSet<Bit> = context.drivers().map(|(bit, _)| bit).collect();
    let resets = context.of(&[Mnemonic::Rst, Mnemonic::Ponoff]);
    off.extend(resets.filter_map(|p| p.bit().map(|(bit, _)| bit)));
    for set in context.of(&[Mnemonic::Set]) {
        let Some((bit, span)) = set.bit() else { continue };
        // One finding a bit is enough: the first SET.
        if matches!(bit, Bit::Space(BitSpace::Mc, _)) || !off.insert(bit) {
            continue;
        }
        let message = format!("{} is SET, and nothing ever turns it OFF", context.say_bit(bit));
        let name = context.name(Address::Bit(bit));
        findings.push(Finding::new(Code::SetNeverReset, span, message).label("stays ON").help(
            format!(
                "`RST {name}` in a rung that says when, or `OUT {name}` if the bit is to follow \
                 this rung"
            ),
        ));
    }
}
