//! `duplicate-out`: within one block's own rungs, or one stage, one instruction drives a bit.
//!
//! OUT, PD, ND, and ONDTMR and OFFDTMR by their output, write their bit ON and OFF at every
//! execution: of two, the first has no effect at all. SET, RST and PONOFF write it now and then and
//! are no drivers.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["X0 | X1"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["OUT Y0"] }, { when = ["X1"], do = ["OUT Y0"] } ]
//! ```

use crate::isa::{Address, Bit, Mnemonic};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Driver, Element};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (bit, drivers) in context.drivers() {
        for (at, second) in drivers.iter().enumerate() {
            let element = second.placed.place.element();
            let first = drivers[..at].iter().find(|d| d.placed.place.element() == element);
            if let Some(first) = first {
                let all = within(drivers, element);
                findings.push(finding(context, bit, (first, second), &all));
            }
        }
    }
}

fn within<'d, 'a>(drivers: &'d [Driver<'a>], element: Element) -> Vec<&'d Driver<'a>> {
    drivers.iter().filter(|d| d.placed.place.element() == element).collect()
}

fn finding(context: &Context, bit: Bit, pair: (&Driver, &Driver), all: &[&Driver]) -> Finding {
    let (first, second) = pair;
    let message = format!(
        "{} is driven twice, by {} in {} and by {} in {}: the first has no effect",
        context.say_bit(bit),
        first.placed.name(),
        first.placed.place,
        second.placed.name(),
        second.placed.place,
    );
    Finding::new(Code::DuplicateOut, second.span, message)
        .label("driven again")
        .related(first.span, "has no effect")
        .help(help(context, bit, all))
}

fn help(context: &Context, bit: Bit, all: &[&Driver]) -> String {
    let name = context.name(Address::Bit(bit));
    let outs = all.iter().all(|d| d.placed.mnemonic() == Mnemonic::Out);
    let powers: Option<Vec<_>> = all.iter().map(|d| context.power(&d.placed.place)).collect();
    match powers.filter(|_| outs).and_then(|powers| context.any_of(&powers)) {
        Some(when) => format!(
            "drive it in one rung, if either condition is to turn it ON:\n\
             when = [\"{when}\"]\ndo   = [\"OUT {name}\"]"
        ),
        None => {
            format!("let each drive a bit of its own, and drive this one from both: `OUT {name}`")
        }
    }
}
