//! `rungd read`: prints the values of a running controller's operands, all from one scan, or makes
//! a file of them that `rungd write` reads.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::new_file::new_file;
use super::operator::{OperatorArgs, complete};
use super::terminal::{one_line, print, say_line};
use super::write::request_bytes;
use rungd_client::operator::protocol::{
    CHANGE_BYTES_MAX, OperandValues, Request, ShownValue, WritableValues,
};
use rungd_client::operator::value_set::{file_text, read_file};

/// Prints the values of a running controller's operands
///
/// With `--file` the values become a file that `rungd write --file` writes back: without OPERAND of
/// all tags. It leaves out what cannot be written, members of structures that are not named
/// themselves, and inputs that a device moves.
#[derive(Args, Debug)]
pub struct ReadArgs {
    /// Tags, addresses, members, ranges (`X0..X7`); a structure, block or use of a
    /// template stands for all its members
    #[arg(
        required_unless_present = "file",
        value_name = "OPERAND",
        add = ArgValueCompleter::new(complete)
    )]
    operands: Vec<String>,
    /// Write the values into a new TOML file, in the form that `rungd write --file` reads; - is
    /// standard output
    #[arg(long, value_name = "SET.toml")]
    file: Option<PathBuf>,
    #[command(flatten)]
    at: OperatorArgs,
}

/// Reads the values.
///
/// # Errors
/// Standard output or the file cannot be written.
pub fn read(args: &ReadArgs) -> Result<Exit> {
    if let Some(path) = &args.file {
        return read_into(args, path);
    }
    let request = Request::Read { operands: args.operands.clone(), each: false };
    let values: OperandValues = match args.at.ask(&request) {
        Ok(values) => values,
        Err(exit) => return Ok(exit),
    };
    args.at.print(&values, || table(&values.values))?;
    Ok(Exit::Ok)
}

/// Writes the values into a new file.
fn read_into(args: &ReadArgs, path: &Path) -> Result<Exit> {
    let request = Request::ReadSet { operands: args.operands.clone() };
    let set: WritableValues = match args.at.ask(&request) {
        Ok(set) => set,
        Err(exit) => return Ok(exit),
    };
    let (name, count) = (path.display().to_string(), set.values.len());
    if count == 0 {
        say_line("rungd: there is nothing to write back: no file is made");
        return Ok(Exit::Refused);
    }
    let text = format!(
        "# Values after scan {}, written back by: rungd write --file\n{}",
        set.scans,
        file_text(&set.values, &set.records)
    );
    let writes = read_file(&text).0.into_iter().map(|found| found.write).collect();
    if request_bytes(&Request::WriteSet { writes, for_user: None, from_page: false, reason: None })
        > CHANGE_BYTES_MAX
    {
        say_line(&format!(
            "rungd: the names and values of {count} operands have no room in one change: name \
             fewer operands"
        ));
        return Ok(Exit::Usage);
    }
    if path == Path::new("-") {
        print(&text)?;
    } else {
        let mut file = new_file(path)?;
        if let Err(error) = file.write_all(text.as_bytes()) {
            let _ = std::fs::remove_file(path);
            return Err(error).context(name);
        }
        args.at.print(&set, || format!("{}: {count} values\n", one_line(&name)))?;
    }
    if set.structures + set.read_only > 0 && !args.at.json {
        say_line(&format!(
            "note: left out: {} structures, {} places that are read-only or moved by a device",
            set.structures, set.read_only
        ));
    }
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
