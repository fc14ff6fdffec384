//! The operands of a trace: those of `--watch`, else all operands that the ladder names.
//!
//! Used by the commands that trace: `sim` and `replay`.

use anyhow::Result;

use super::exit::CommandLine;
use super::terminal::say;
use rungd_engine::isa::{Address, Structure};
use rungd_lab::rig::simulation::{ELEMENTS_MAX, all_named};
use rungd_lab::traces::stimulus::split_element;
use rungd_lab::traces::trace::TracedOperand;
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::NamedThing;
use rungd_language::source::indexed::IndexedName;

/// Returns from the function with an error about the command line.
macro_rules! usage {
    ($($words:tt)*) => { return Err(CommandLine(format!($($words)*)).into()) };
}

/// The operands with these names; without names, all operands that the ladder names, with arrays up
/// to a maximum length.
///
/// # Errors
/// A name is not an operand: the command line is wrong.
pub(super) fn watched(
    names: Option<&[String]>,
    program: &Program,
    symbols: &Symbols,
) -> Result<Vec<TracedOperand>> {
    let scope = program.scope();
    let named = |name: &str| -> Result<TracedOperand> {
        if name.contains("..") {
            usage!("--watch: `{name}`: a range is not taken here: name each, as `X0,X1`");
        }
        let address = scope.address(name).map_err(|m| CommandLine(format!("--watch: {m}")))?;
        let Some(cell) = symbols.layout.cell(address) else {
            let member = address.structure().map_or("Done", Structure::done_name);
            usage!("--watch: `{name}` is a structure: name its members, as `{name}.{member}`");
        };
        Ok(TracedOperand::new(name, cell, &symbols.layout))
    };
    match names {
        Some(names) => {
            if let Some(message) = split_element(names.iter().map(|name| name.trim())) {
                usage!("--watch: {message}");
            }
            let names = names.iter().flat_map(|name| fields(program, name.trim()));
            names.map(|name| named(&name)).collect()
        }
        None => {
            say_left_out(program);
            Ok(all_named(program, symbols))
        }
    }
}

/// The names of the bits and words of a whole record, of all records of an array, or of a column;
/// of anything else, the name itself.
fn fields(program: &Program, name: &str) -> Vec<String> {
    let scope = program.scope();
    let addresses = match scope.look_up(name).map(|found| found.thing) {
        Ok(NamedThing::Record(place)) => program.record_addresses(place),
        Ok(NamedThing::Array(array)) if scope.is_column(name) => array.addresses().collect(),
        Ok(_) | Err(_) => return vec![name.to_owned()],
    };
    let operands = addresses.into_iter().flat_map(Address::operands);
    operands.map(|address| program.names.name(address)).collect()
}

/// Prints which arrays have more elements than the trace without `--watch` shows.
fn say_left_out(program: &Program) {
    for array_tag in program.arrays.iter().filter(|tag| tag.array.count as usize > ELEMENTS_MAX) {
        let column = IndexedName::of(&array_tag.name).map(|name| name.column());
        let (name, count) = (column.as_deref().unwrap_or(&array_tag.name), array_tag.array.count);
        say(&format!(
            "note: of the {count} elements of `{name}` the trace has the first {ELEMENTS_MAX}; \
             `--watch` names others\n"
        ));
    }
}
