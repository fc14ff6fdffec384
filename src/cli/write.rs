//! `rungd write`: writes one value into a running controller before its next scan.

use anyhow::Result;
use clap::Args;

use super::exit::Exit;
use super::operator::{NewValue, OperatorArgs};
use rungd_client::operator::protocol::Request;

/// Writes a bit or word of a running controller
#[derive(Args, Debug)]
pub struct WriteArgs {
    #[command(flatten)]
    new: NewValue,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Writes the value.
///
/// # Errors
/// Standard output cannot be written.
pub fn write(args: &WriteArgs) -> Result<Exit> {
    let (operand, value) = args.new.named();
    args.at.change(&Request::Write { operand, value, for_user: None, from_page: false }, "")
}
