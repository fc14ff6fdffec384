//! `rungd write`: one value into a running controller, before its next scan.

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{At, complete};
use crate::operator::protocol::{Given, Request};

/// Writes a bit or word of a running controller
#[derive(Args, Debug)]
pub struct WriteArgs {
    /// Tag, address or member
    #[arg(value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operand: String,
    /// ON or OFF; or a number, as 12, 0x1F or 1m30s
    #[arg(value_name = "VALUE", allow_hyphen_values = true)]
    value: String,
    #[command(flatten)]
    at: At,
}

/// Writes.
///
/// # Errors
/// Standard output cannot be written.
pub fn write(args: &WriteArgs) -> Result<Exit> {
    let (operand, value) = (args.operand.clone(), Given::Text(args.value.clone()));
    args.at.change(&Request::Write { operand, value }, "")
}
