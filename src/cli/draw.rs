//! `rungd draw`: a ladder as ladder people draw it, as text, SVG or HTML.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::check::style;
use super::exit::Exit;
use super::terminal::{print, say_drawn};
use crate::draw::ladder::Picture;
use crate::draw::listing::listing;
use crate::draw::text::WireStyle;
use crate::load;
use crate::source::render::render;

/// Draws a ladder: contacts, branches, coils and boxes
#[derive(Args, Debug)]
pub struct DrawArgs {
    /// A controller file, or ladder files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Draw wires with `-`, `|` and `+`
    #[arg(long)]
    ascii: bool,
}

/// Draws.
///
/// # Errors
/// A file that cannot be read; an output that cannot be written.
pub fn draw(args: &DrawArgs) -> Result<Exit> {
    let loaded = match args.files.as_slice() {
        [one] if load::is_controller_file(one)? => load::controller_file(one)?,
        files => load::ladder_files(files)?,
    };
    let Some(program) = &loaded.program else {
        say_drawn(&render(&loaded.findings, &loaded.files, style(false)));
        return Ok(Exit::Config);
    };
    let picture = Picture::of(program, &loaded.files);
    let style = if args.ascii { WireStyle::Ascii } else { WireStyle::Lines };
    print(&listing(&picture, style))?;
    Ok(Exit::Ok)
}
