//! The command line: one small file per subcommand, and their shared parts.
//!
//! [`run()`] is the whole program except for the process's exit. Findings and failures go to
//! standard error, results to standard output.

mod ack;
mod alarm_history;
mod alarm_spans;
mod alarms;
#[cfg(feature = "prove")]
mod asked_ladders;
mod audit;
mod audit_source;
mod audit_verify;
mod check;
mod compared;
mod completions;
mod default_files;
mod draw;
mod early_end;
#[cfg(feature = "fleet")]
mod edge;
mod events;
mod exit;
mod explain;
mod export;
#[cfg(feature = "fleet")]
mod fleet;
#[cfg(feature = "fleet")]
mod fleet_broker;
#[cfg(feature = "fleet")]
mod fleet_page;
mod fmt;
mod fmt_file;
mod folded;
mod folders;
mod force;
mod foreign;
mod habits;
#[cfg(feature = "prove")]
mod how;
#[cfg(feature = "import")]
mod import;
mod init;
mod log_level;
mod lsp;
mod man;
#[cfg(feature = "fleet")]
mod metrics;
mod mode;
#[cfg(feature = "monitor")]
mod monitor;
mod mutate;
mod new_file;
mod operator;
#[cfg(feature = "prove")]
mod prove;
#[cfg(feature = "prove")]
mod prove_equal;
#[cfg(feature = "prove")]
mod prove_survey;
mod read;
mod record;
mod record_info;
mod recorded_trace;
mod recording;
mod reload;
mod replay;
mod replay_args;
mod replay_ladder;
mod replay_why;
mod replay_window;
mod retain;
mod run;
pub mod schema;
mod shelve;
mod sim;
mod status;
mod terminal;
mod test;
mod test_trace;
mod trace_file;
mod watch;
mod watched_operands;
#[cfg(feature = "web")]
mod web;
mod when;
mod why;
mod write;
mod xref;

use std::panic::{AssertUnwindSafe, catch_unwind};

use anyhow::Result;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::CompleteEnv;

use exit::Exit;
use terminal::say;

use rungd_language::source::wording::is_obeyed;

/// A soft-PLC for Linux: ladder programs in TOML, scanned at a fixed period.
#[derive(Parser, Debug)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Check(check::CheckArgs),
    Completions(completions::CompletionsArgs),
    Draw(draw::DrawArgs),
    #[cfg(feature = "fleet")]
    Edge(edge::EdgeArgs),
    Events(events::EventsArgs),
    Explain(explain::ExplainArgs),
    Export(export::ExportArgs),
    #[cfg(feature = "fleet")]
    Fleet(fleet::FleetArgs),
    Fmt(fmt::FmtArgs),
    #[cfg(feature = "import")]
    Import(import::ImportArgs),
    Init(init::InitArgs),
    #[command(hide = true)]
    Man(man::ManArgs),
    Run(run::RunArgs),
    Lsp(lsp::LspArgs),
    Schema(schema::SchemaArgs),
    Sim(sim::SimArgs),
    Test(test::TestArgs),
    Mutate(mutate::MutateArgs),
    #[cfg(feature = "prove")]
    Prove(prove::ProveArgs),
    #[cfg(feature = "prove")]
    How(how::HowArgs),
    Status(status::StatusArgs),
    Read(read::ReadArgs),
    Write(write::WriteArgs),
    Force(force::ForceArgs),
    Unforce(force::UnforceArgs),
    Watch(watch::WatchArgs),
    Alarms(alarms::AlarmsArgs),
    Audit(audit::AuditArgs),
    Ack(ack::AckArgs),
    Shelve(shelve::ShelveArgs),
    Unshelve(shelve::UnshelveArgs),
    #[cfg(feature = "fleet")]
    Metrics(metrics::MetricsArgs),
    Mode(mode::ModeArgs),
    #[cfg(feature = "monitor")]
    Monitor(monitor::MonitorArgs),
    Reload(reload::ReloadArgs),
    Rollback(reload::RollbackArgs),
    Replay(replay_args::ReplayArgs),
    Retain(retain::RetainArgs),
    LogLevel(log_level::LogLevelArgs),
    Record(record::RecordArgs),
    #[cfg(feature = "web")]
    Web(web::WebArgs),
    Why(why::WhyArgs),
    Xref(xref::XrefArgs),
}

/// Prints why the command line is refused, or the help that it asks for, and exits.
fn refuse(refused: &clap::Error) -> ! {
    let is_odd = |text: std::ffi::OsString| text.to_string_lossy().contains(is_obeyed);
    if !refused.use_stderr() || !std::env::args_os().any(is_odd) {
        refused.exit();
    }
    // The library repeats an argument as it is, and with its colours.
    say(&refused.render().to_string());
    std::process::exit(refused.exit_code());
}

/// Runs the command line, and returns the exit code.
pub fn run() -> i32 {
    CompleteEnv::with_factory(Cli::command).complete();
    let command = Cli::try_parse().unwrap_or_else(|mut error| {
        let all = Cli::command();
        let names: Vec<&str> = all.get_subcommands().map(clap::Command::get_name).collect();
        habits::add_tip(&mut error, &names);
        refuse(&error)
    });
    let command = command.command;
    // The exit code distinguishes a bug from a bad file, also after a panic.
    let outcome = catch_unwind(AssertUnwindSafe(|| dispatch(&command)));
    let exit = match outcome {
        Ok(Ok(exit)) => exit,
        Ok(Err(error)) if exit::is_broken_pipe(&error) => Exit::Ok,
        Ok(Err(error)) => {
            say(&format!("rungd: {error:#}\n"));
            Exit::of(&error)
        }
        Err(_) => {
            say("rungd: this is a bug in rungd; please report it with the lines above\n");
            Exit::Software
        }
    };
    exit as i32
}

fn dispatch(command: &Command) -> Result<Exit> {
    match command {
        Command::Check(args) => check::check(args),
        Command::Completions(args) => completions::completions(args),
        Command::Draw(args) => draw::draw(args),
        #[cfg(feature = "fleet")]
        Command::Edge(args) => edge::edge(args),
        Command::Events(args) => events::events(args),
        Command::Explain(args) => explain::explain(args),
        Command::Export(args) => export::export(args),
        #[cfg(feature = "fleet")]
        Command::Fleet(args) => fleet::fleet(args),
        Command::Fmt(args) => fmt::fmt(args),
        #[cfg(feature = "import")]
        Command::Import(args) => import::import(args),
        Command::Init(args) => init::init(args),
        Command::Man(args) => man::man(args, Cli::command()),
        Command::Run(args) => run::run(args),
        Command::Lsp(args) => lsp::lsp(args),
        Command::Schema(args) => schema::schema(args),
        Command::Sim(args) => sim::sim(args),
        Command::Test(args) => test::test(args),
        Command::Mutate(args) => mutate::mutate(args),
        #[cfg(feature = "prove")]
        Command::Prove(args) => prove::prove(args),
        #[cfg(feature = "prove")]
        Command::How(args) => how::how(args),
        Command::Status(args) => status::status(args),
        Command::Read(args) => read::read(args),
        Command::Write(args) => write::write(args),
        Command::Force(args) => force::force(args),
        Command::Unforce(args) => force::unforce(args),
        Command::Watch(args) => watch::watch(args),
        Command::Alarms(args) => alarms::alarms(args),
        Command::Audit(args) => audit::audit(args),
        Command::Ack(args) => ack::ack(args),
        Command::Shelve(args) => shelve::shelve(args),
        Command::Unshelve(args) => shelve::unshelve(args),
        #[cfg(feature = "fleet")]
        Command::Metrics(args) => metrics::metrics(args),
        Command::Mode(args) => mode::mode(args),
        #[cfg(feature = "monitor")]
        Command::Monitor(args) => monitor::monitor(args),
        Command::Reload(args) => reload::reload(args),
        Command::Rollback(args) => reload::rollback(args),
        Command::Replay(args) => replay::replay(args),
        Command::Retain(args) => retain::retain(args),
        Command::LogLevel(args) => log_level::log_level(args),
        Command::Record(args) => record::record(args),
        #[cfg(feature = "web")]
        Command::Web(args) => web::web(args),
        Command::Why(args) => why::why(args),
        Command::Xref(args) => xref::xref(args),
    }
}
