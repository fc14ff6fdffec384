//! The command line: one small file a subcommand.

pub mod sim;

use clap::{Parser, Subcommand};

/// A soft-PLC for Linux.
#[derive(Parser, Debug)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Simulate
    Sim(sim::SimArgs),
}

/// Runs the command line; gives the exit code.
pub fn run() -> i32 {
    let Command::Sim(args) = Cli::parse().command;
    let mut files = Vec::new();
    for path in sim::ladders(&args) {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).unwrap_or_default();
        files.push(crate::source::span::SourceFile { name, text });
    }
    let (program, findings) = crate::resolve::load_ladders(&files, &Default::default());
    for f in findings {
        let file = &files[f.span.file.0 as usize];
        let (line, column) = file.line_column(f.span.start);
        eprintln!("{}:{line}:{column}: {}: {}", file.name, f.code.name(), f.message);
    }
    let Some(program) = program else { return 78 };
    match sim::simulate(&args, &program) {
        Ok(()) => 0,
        Err(e) => {
            eprintln!("rungd: {e:#}");
            78
        }
    }
}
