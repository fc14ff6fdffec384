//! `rungd explain`: explains an instruction from the instruction table, a function of MATH, a
//! finding from its page, or an event of the log from the catalogue; prints a file of the library
//! below its page.
//!
//! [`rungd_config::explain`] has the texts; this module finds them by name, and lists the names.

use std::fmt::Write as _;

use clap::Args;
use clap::builder::StyledStr;
use clap_complete::engine::{ArgValueCandidates, CompletionCandidate};

use super::exit::Exit;
use super::terminal::{print, say};
use super::xref::ProgramArgs;
use rungd_config::explain::{explanation, of_library};
use rungd_config::load::library;
use rungd_engine::isa::function::FUNCTIONS;
use rungd_engine::isa::instruction;
use rungd_lab::draw::xref;
use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::finding::{self, Severity};
use rungd_language::source::nearest::did_you_mean;
use rungd_runtime::events;

/// Explains an instruction (`CNT`), a function (`sqrt`), a finding (`missing-leg`) or an event
/// (`alarm-on`)
///
/// Without a name, lists all of them. An event is found by its code (`RUNGD-0301`), too. For an
/// instruction of other controllers (`TON`, `XIC`), prints its equivalent in a ladder of rungd. For
/// `lib:pid`, or a template in it (`Pid`), prints that file of the library, with its page as
/// comments. For a tag, an address or a block of a program (`--in`, or the controller file of this
/// folder), prints how often it is written and read; `rungd xref` shows where.
#[derive(Args, Debug)]
pub(crate) struct ExplainArgs {
    /// A mnemonic, the name of a function or a finding, the name or code of an event, or a file of
    /// the library (`lib:pid`)
    #[arg(value_name = "NAME", add = ArgValueCandidates::new(candidates))]
    name: Option<String>,
    #[command(flatten)]
    program: ProgramArgs,
}

/// Prints the explanation.
///
/// # Errors
/// Standard output cannot be written.
pub(crate) fn explain(args: &ExplainArgs) -> anyhow::Result<Exit> {
    let text = match &args.name {
        None => list(),
        Some(name) => match named(name).or_else(|mistake| operand(args, name).ok_or(mistake)) {
            Ok(text) => text,
            Err(mistake) => {
                say(&format!("rungd: {mistake}\n"));
                return Ok(Exit::Usage);
            }
        },
    };
    print(&text)?;
    Ok(Exit::Ok)
}

/// The text for a name; the error is the message about a name without a text.
fn named(name: &str) -> Result<String, String> {
    if let Some(file) = library::named(name) {
        let mistake = |(message, help)| format!("{message}: {help}");
        return file.map(of_library).map_err(mistake);
    }
    let template = || library::of_template(name).map(of_library);
    explanation(name).or_else(template).ok_or_else(|| {
        let help = did_you_mean(name, known())
            .unwrap_or_else(|| "`rungd explain` lists what can be explained".into());
        format!("no instruction, function, finding or event is called `{name}`: {help}")
    })
}

/// The text about an operand of a program; `None` if no program has the operand.
fn operand(args: &ExplainArgs, name: &str) -> Option<String> {
    let program = args.program.load_quietly().ok()??;
    // Most unknown names are typing errors, so the tests are read only for an operand that exists.
    program.index(&[]).reference(name).ok()?;
    let tests = program.tests();
    let reference = program.index(&tests).reference(name).ok()?;
    Some(format!("{}`rungd xref {name}` says where\n", xref::text::short(&reference)))
}

/// All names, except those of the library.
fn known() -> impl Iterator<Item = &'static str> {
    let known = instruction::TABLE.iter().map(|spec| spec.name);
    let known = known.chain(FUNCTIONS.iter().map(|spec| spec.name));
    let known = known.chain(finding::TABLE.iter().map(|row| row.name));
    known.chain(events::all().map(|event| event.name))
}

/// The names that the shell offers.
fn candidates() -> Vec<CompletionCandidate> {
    let library = library::FILES.iter().map(|file| {
        let about = StyledStr::from(file.head().0);
        CompletionCandidate::new(format!("{LIBRARY}{}", file.name)).help(Some(about))
    });
    known().map(CompletionCandidate::new).chain(library).collect()
}

fn list() -> String {
    let mut text = "Instructions:\n".to_owned();
    for spec in instruction::TABLE {
        let _ = writeln!(text, "  {:<36} {}", spec.form(), spec.title);
    }
    text.push_str("\nFunctions of MATH:\n");
    for spec in FUNCTIONS {
        let _ = writeln!(text, "  {:<36} {}", spec.form(), spec.summary);
    }
    text.push_str("\nLibrary:\n");
    for file in library::FILES {
        let _ = writeln!(text, "  {:<24} {}", format!("{LIBRARY}{}", file.name), file.head().0);
    }
    for (title, severity) in [("Errors", Severity::Error), ("Warnings", Severity::Warning)] {
        let _ = writeln!(text, "\n{title}:");
        for row in finding::TABLE.iter().filter(|row| row.severity == severity) {
            let _ = writeln!(text, "  {:<24} {}", row.name, row.summary);
        }
    }
    text.push_str("\nEvents of the log:\n");
    for event in events::all() {
        let _ = writeln!(text, "  {:<24} {} {}", event.name, event.code(), event.level.name());
    }
    text
}
