//! `rungd force` and `rungd unforce`: make a bit or word keep a value, and release it.

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{NewValue, OperatorArgs, complete};
use super::read::table;
use super::terminal::say;
use rungd_client::operator::protocol::{OperandValues, Request};

/// Forces a bit or word of a running controller: it keeps this value until `unforce`
///
/// A force stays through STOP, RUN and a reload. While it lasts, changes of the value by inputs,
/// writes and instructions are discarded. After `unforce` the value stays until the ladder, a
/// device or an operator writes it. `rungd status` lists forces.
#[derive(Args, Debug)]
pub struct ForceArgs {
    #[command(flatten)]
    new: NewValue,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Ends a force, or all of them; the value stays until something writes it
///
/// `unforce` does not restore the old value: a coil, an input or a command writes the next value.
#[derive(Args, Debug)]
pub struct UnforceArgs {
    /// Tag, address or member; or `--all`
    #[arg(
        value_name = "OPERAND",
        conflicts_with = "all",
        add = ArgValueCompleter::new(complete)
    )]
    operand: Option<String>,
    /// End all forces
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Forces an operand.
///
/// # Errors
/// Standard output cannot be written.
pub fn force(args: &ForceArgs) -> Result<Exit> {
    let (operand, value) = args.new.named();
    args.at.change(&Request::Force { operand, value }, "")
}

/// Ends forces.
///
/// # Errors
/// Standard output cannot be written.
pub fn unforce(args: &UnforceArgs) -> Result<Exit> {
    if args.operand.is_none() && !args.all {
        say("rungd: name the operand whose force ends, or give `--all` to end all of them\n");
        return Ok(Exit::Usage);
    }
    if let Some(operand) = &args.operand {
        let request = Request::Unforce { operand: operand.clone() };
        return args.at.change(&request, "not forced, ");
    }
    let values: OperandValues = match args.at.ask(&Request::UnforceAll {}) {
        Ok(values) => values,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&values, || match values.values.len() {
        0 => "nothing was forced\n".to_owned(),
        count => format!("{count} not forced any more:\n{}", table(&values.values)),
    })?;
    Ok(Exit::Ok)
}
