//! `rungd read`: prints the values of a running controller's operands, all from one scan.

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{OperatorArgs, complete};
use super::terminal::one_line;
use rungd_client::operator::protocol::{OperandValues, Request, ShownValue};

/// Prints the values of a running controller's operands
#[derive(Args, Debug)]
pub struct ReadArgs {
    /// Tags, addresses, members, ranges (`X0..X7`); a structure, block or use of a
    /// template stands for all its members
    #[arg(required = true, value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operands: Vec<String>,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Reads the values.
///
/// # Errors
/// Standard output cannot be written.
pub fn read(args: &ReadArgs) -> Result<Exit> {
    let request = Request::Read { operands: args.operands.clone(), each: false };
    let values: OperandValues = match args.at.ask(&request) {
        Ok(values) => values,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&values, || table(&values.values))?;
    Ok(Exit::Ok)
}

/// One line for each operand: name, address, value, and whether it is forced. For a Y outside RUN,
/// the line also has the state of the output. A tag with a `type` has no address.
pub fn table(values: &[ShownValue]) -> String {
    let name =
        |value: &ShownValue| one_line(value.tag.as_ref().unwrap_or(&value.operand)).into_owned();
    let address = |value: &ShownValue| match value.tag.as_ref() == Some(&value.address) {
        true => String::new(),
        false => one_line(&value.address).into_owned(),
    };
    let wide = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0);
    let first = wide(&mut values.iter().map(|value| name(value).chars().count()));
    let second = wide(&mut values.iter().map(|value| address(value).chars().count()));
    let gap = if second == 0 { "" } else { "  " };
    let row = |value: &ShownValue| {
        let forced = if value.forced { "  forced" } else { "" };
        let (name, address, driven) = (name(value), address(value), value.driven_text("  "));
        let held = value.value_text();
        let held = one_line(&held);
        format!("{name:first$}  {address:second$}{gap}{held}{forced}{driven}\n")
    };
    values.iter().map(row).collect()
}
