//! `rungd force` and `rungd unforce`: a bit or word that keeps its value, whatever writes it.

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{At, New, complete};
use super::read::table;
use crate::operator::protocol::{Request, Values};

/// Forces a bit or word of a running controller: it keeps its value until it is unforced
#[derive(Args, Debug)]
pub struct ForceArgs {
    #[command(flatten)]
    new: New,
    #[command(flatten)]
    at: At,
}

/// Ends a force, or all of them; values stay until something writes them
#[derive(Args, Debug)]
pub struct UnforceArgs {
    /// Tag, address or member
    #[arg(
        value_name = "OPERAND",
        required_unless_present = "all",
        conflicts_with = "all",
        add = ArgValueCompleter::new(complete)
    )]
    operand: Option<String>,
    /// All that is forced
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    at: At,
}

/// Forces.
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
    if let Some(operand) = &args.operand {
        let request = Request::Unforce { operand: operand.clone() };
        return args.at.change(&request, "not forced, ");
    }
    let values: Values = match args.at.ask(&Request::UnforceAll {}) {
        Ok(values) => values,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&values, || match values.values.len() {
        0 => "nothing was forced\n".to_owned(),
        count => format!("{count} not forced any more:\n{}", table(&values.values)),
    })?;
    Ok(Exit::Ok)
}
