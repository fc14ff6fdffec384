//! `retained-but-reset`: the controller file retains a structure whose owner resets it at every
//! stop.
//!
//! The termination passes of an orderly stop run before memory is kept, so what is kept of a CNT is
//! 0. UDCG, TMRAG and the Sensaphone counters have no termination logic. The finding lies at the
//! owner, where it can be allowed; the range is told beside it.
//!
//! Passes: `ranges = ["CT0"]` and
//!
//! ```toml
//! do = ["UDCG CT0 up-preset=12"]
//! ```
//!
//! Fails: `ranges = ["CT0"]` and
//!
//! ```toml
//! do = ["CNT CT0 preset=12"]
//! ```

use crate::isa::instruction::Termination;
use crate::isa::{Address, Structure, Word, WordSpace};
use crate::resolve::program::RetainedRange;
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};
use super::names::structure_kind;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for (structure, owners) in context.owners() {
        let Some(range) = context.retained.iter().find(|range| covers(range, structure)) else {
            continue;
        };
        let resets = |p: &&Placed| p.mnemonic().spec().termination == Termination::Reset;
        if let Some(owner) = owners.iter().find(resets) {
            findings.push(finding(context, structure, owner, range));
        }
    }
}

fn covers(range: &RetainedRange, structure: Structure) -> bool {
    let (Address::Structure(first), Address::Structure(last)) = (range.first, range.last) else {
        return false;
    };
    first.space_name() == structure.space_name()
        && (first.number()..=last.number()).contains(&structure.number())
}

fn finding(
    context: &Context,
    structure: Structure,
    owner: &Placed,
    range: &RetainedRange,
) -> Finding {
    let said = context.say_structure(structure);
    let message = format!(
        "{} {said} is retained, but {} resets it at every stop, before it is kept",
        structure_kind(structure),
        owner.name()
    );
    let name = context.name(Address::Structure(structure));
    let global = match structure {
        Structure::Timer(_) => format!("TMRAG keeps its time (RSTT {name} resets it)"),
        _ => format!("UDCG keeps its count (RSTCT {name} resets it)"),
    };
    Finding::new(Code::RetainedButReset, owner.instruction.span, message)
        .label("reset at every stop")
        .related(range.span, "retained here")
        .help(format!("{global}; or keep a copy: `MOVE {name}.Acc to={}`", word(context)))
}

/// A retained D that the ladder does not name; `D0` if there is none.
fn word(context: &Context) -> Word {
    let named = |word| context.program.operands.iter().any(|o| o.address == Address::Word(word));
    let ranges = context.retained.iter().filter_map(|range| match (range.first, range.last) {
        (Address::Word(Word::Space(WordSpace::D, first)), Address::Word(Word::Space(_, last))) => {
            Some(first..=last)
        }
        _ => None,
    });
    let words = ranges.flatten().map(|n| Word::Space(WordSpace::D, n));
    words.into_iter().find(|word| !named(*word)).unwrap_or(Word::Space(WordSpace::D, 0))
}
