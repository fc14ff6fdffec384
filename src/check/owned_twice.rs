//! `owned-twice`: a structure has exactly one owning instruction in the whole program.
//!
//! Passes: a CTU and a CTD on one Sensaphone counter; RSTCT, contacts and compares anywhere.
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["TMR T0 preset=3s"] }, { when = ["T0.Done"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["TMR T0 preset=3s"] }, { when = ["X1"], do = ["TMR T0 preset=5s"] } ]
//! ```

use crate::isa::{Address, Structure};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};
use super::names::structure_kind;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (structure, owners) in context.owners() {
        for (at, second) in owners.iter().enumerate().skip(1) {
            if let Some(first) = owners[..at].iter().find(|first| collide(structure, first, second))
            {
                findings.push(finding(context, structure, first, second));
            }
        }
    }
}

/// One CTU and one CTD may share a Sensaphone counter; nothing else shares.
fn collide(structure: Structure, first: &Placed, second: &Placed) -> bool {
    !matches!(structure, Structure::Sensaphone(_)) || first.mnemonic() == second.mnemonic()
}

fn finding(context: &Context, structure: Structure, first: &Placed, second: &Placed) -> Finding {
    let message = format!(
        "{} {} is owned twice: by {} in {}, and by {} in {}",
        structure_kind(structure),
        context.say_structure(structure),
        first.name(),
        first.place,
        second.name(),
        second.place,
    );
    let name = context.name(Address::Structure(structure));
    let share = match structure {
        Structure::Sensaphone(_) => format!("one CTU and one CTD may share `{name}`"),
        _ => format!("`{name}` can be read anywhere, but one instruction alone executes it"),
    };
    let help = match context.free_like(structure) {
        Some(free) => format!("{share}; give this one a structure that is free: `{free}`"),
        None => share,
    };
    Finding::new(Code::OwnedTwice, second.instruction.span, message)
        .label("second owner")
        .related(first.instruction.span, "first owner")
        .help(help)
}
