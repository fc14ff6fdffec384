//! `rungd draw`: draws a ladder diagram as text, SVG or HTML.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{CommandLine, Exit};
use super::foreign::is_foreign;
use super::terminal::print;
use super::xref::ProgramArgs;
use rungd_config::load::read_bytes;
use rungd_lab::draw::coverage::CoverageMarks;
use rungd_lab::draw::difference::difference;
use rungd_lab::draw::ladder::Picture;
use rungd_lab::draw::listing::listing;
use rungd_lab::draw::page::{page, picture};
use rungd_lab::draw::text::WireStyle;

/// Draws a ladder: contacts, branches, coils and boxes
///
/// Without `-o` it prints text. A page (`-o plant.html`) has contents, a search and the
/// cross-reference, and needs no other file.
#[derive(Args, Debug)]
pub struct DrawArgs {
    /// A controller file, ladder files, or a file that `rungd import` reads (.L5X)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The file to write; its ending (.svg, .html or .txt) selects the format
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// In text, draw wires with `-`, `|` and `+`
    #[arg(long)]
    ascii: bool,
    /// Mark the contacts that tests have not seen ON and OFF: the output of `rungd test --coverage
    /// --json`
    #[arg(long, value_name = "REPORT")]
    coverage: Option<PathBuf>,
    /// Draw only the rungs that differ between two versions: `--diff OLD NEW`
    #[arg(long, conflicts_with_all = ["output", "coverage"])]
    diff: bool,
}

/// The form of a drawing.
#[derive(Clone, Copy)]
enum DrawingForm {
    Text,
    Svg,
    Html,
}

/// Draws the ladder.
///
/// # Errors
/// A file cannot be read, or the output cannot be written.
pub fn draw(args: &DrawArgs) -> Result<Exit> {
    let style = if args.ascii { WireStyle::Ascii } else { WireStyle::Lines };
    if args.diff {
        return draw_difference(args, style);
    }
    let form = form(args.output.as_deref())?;
    let marks = args.coverage.as_deref().map(marks).transpose()?;
    let program = ProgramArgs::of(args.files.clone());
    let Some(asked) = program.load()? else { return Ok(Exit::Config) };
    let ladder = Picture::of(&asked.subject);
    if let (Some(marks), Some(path)) = (&marks, &args.coverage) {
        let of_path = |why| CommandLine(format!("{}: {why}", path.display()));
        marks.fits(&ladder).map_err(of_path)?;
    }
    let text = match form {
        DrawingForm::Text => listing(&ladder, style, marks.as_ref()),
        DrawingForm::Svg => picture(&ladder, marks.as_ref()),
        // The page describes only the ladder, so tests are left out.
        DrawingForm::Html => page(&ladder, &asked.index(&[]).all(), marks.as_ref()),
    };
    match &args.output {
        Some(path) => std::fs::write(path, text).with_context(|| path.display().to_string())?,
        None => print(&text)?,
    }
    Ok(Exit::Ok)
}

/// Draws the rungs that differ between two files.
fn draw_difference(args: &DrawArgs, style: WireStyle) -> Result<Exit> {
    let [old, new] = &args.files[..] else {
        return Err(CommandLine("--diff compares two files: OLD and NEW".to_owned()).into());
    };
    let loaded = |path: &PathBuf| ProgramArgs::of(vec![path.clone()]).load();
    let (Some(old), Some(new)) = (loaded(old)?, loaded(new)?) else { return Ok(Exit::Config) };
    let has_names = !args.files.iter().any(|path| is_foreign(path));
    print(&difference(&old.subject, &new.subject, style, has_names))?;
    Ok(Exit::Ok)
}

fn form(output: Option<&Path>) -> Result<DrawingForm> {
    let Some(path) = output else { return Ok(DrawingForm::Text) };
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("txt") => Ok(DrawingForm::Text),
        Some("svg") => Ok(DrawingForm::Svg),
        Some("html" | "htm") => Ok(DrawingForm::Html),
        Some(_) | None => {
            let message = format!("{}: a drawing is .svg, .html or .txt", path.display());
            Err(CommandLine(message).into())
        }
    }
}

fn marks(path: &Path) -> Result<CoverageMarks> {
    let bytes = read_bytes(path).with_context(|| path.display().to_string())?;
    let marks = CoverageMarks::read(&String::from_utf8_lossy(&bytes));
    marks.map_err(|why| CommandLine(format!("{}: {why}", path.display())).into())
}
