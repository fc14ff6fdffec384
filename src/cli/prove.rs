//! `rungd prove`: whether any sequence of inputs, however long, breaks a line of a test file.
//!
//! This module reads the files and prints the answers; `rungd-prove` decides.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Args;

use super::asked_ladders::AskedLadders;
use super::check::style;
use super::early_end::{EarlyEnd, time};
use super::exit::Exit;
use super::prove_equal;
use super::prove_survey;
use super::terminal::{one_line, plain_json, print, say, say_findings};
use super::test::{ENDING, LOOK_EVERY, OpenSuite, ProgressLine, find, open, refused};
use rungd_lab::testing::Suite;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::render::render;
use rungd_language::source::span::Span;
use rungd_prove::answer::{Answer, AnswerVerdict};
use rungd_prove::certificate::certificate;
use rungd_prove::decide::{DecideLimits, can_begin, decide, decide_can};
use rungd_prove::deduce::Patience;
use rungd_prove::kept::{KeptAnswer, KeptAnswers};
use rungd_prove::question::Questions;

/// The time for a comparison, if none is given.
const TIME: Duration = Duration::from_secs(60);

/// The memory for a line, if none is given.
const MEMORY: &str = "2G";

/// Decides whether any sequence of inputs breaks a line of a test file
///
/// For each line of `always`: proved, violated, with a scenario to paste into the test file, or
/// not decided, with what stood in the way. Exit code 1: a line is violated, or two ladders are
/// different; 2: something is not decided.
#[derive(Args, Debug)]
pub struct ProveArgs {
    /// Test files, and folders that are searched for *.test.toml; with --survey, ladders, a
    /// controller file or a test file
    #[arg(required_unless_present = "equal", value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Decide whether two ladders, or the ladders of two controller files, drive the same outputs
    #[arg(long, num_args = 2, value_names = ["OLD", "NEW"], conflicts_with = "paths")]
    equal: Vec<PathBuf>,
    #[command(flatten)]
    compared: prove_equal::ComparedArgs,
    #[command(flatten)]
    surveyed: prove_survey::SurveyArgs,
    /// The time for each line, in place of that of the file: 5m, 90s
    #[arg(long, value_name = "TIME", value_parser = time)]
    time: Option<Duration>,
    /// The memory for each line
    #[arg(long, value_name = "SIZE", default_value = MEMORY, value_parser = memory)]
    memory: usize,
    /// Prove again what is kept in *.proof.toml as proved
    #[arg(long)]
    again: bool,
    /// Write the question and the invariants of each file into a folder below this one, for other
    /// programs: AIGER and DIMACS
    #[arg(long, value_name = "DIR")]
    certificate: Option<PathBuf>,
    /// Print an object of JSON for each line
    #[arg(long)]
    json: bool,
}

/// Reads a size: `2G`, `500M`.
fn memory(text: &str) -> Result<usize, String> {
    let (number, unit) = match text.strip_suffix(['G', 'g']) {
        Some(number) => (number, 1 << 30),
        None => (text.strip_suffix(['M', 'm']).unwrap_or_default(), 1 << 20),
    };
    let size = number.parse::<usize>().ok().and_then(|number| number.checked_mul(unit));
    match size {
        Some(size) if size > 0 => Ok(size),
        Some(_) | None => Err("write a size, as `500M` or `2G`".to_owned()),
    }
}

/// What was found in all files.
#[derive(Default)]
struct Tally {
    /// Ctrl+C was pressed.
    given_up: Arc<AtomicBool>,
    violated: usize,
    open: usize,
}

/// Decides the lines.
///
/// # Errors
/// A path cannot be read.
pub fn prove(args: &ProveArgs) -> Result<Exit> {
    let end = EarlyEnd::of(None)?;
    if let [old, new] = args.equal.as_slice() {
        let limits = DecideLimits {
            time: args.time.unwrap_or(TIME),
            memory: args.memory,
            given_up: Arc::clone(&end.is_over),
        };
        let ladders = prove_equal::LadderPaths { old, new };
        return prove_equal::prove_equal(&args.compared, ladders, limits, args.json);
    }
    if args.surveyed.survey {
        let limits = DecideLimits {
            time: args.time.unwrap_or(prove_survey::TIME),
            memory: args.memory,
            given_up: Arc::clone(&end.is_over),
        };
        let ladders = AskedLadders { paths: &args.paths, period: args.compared.period(), rest: "" };
        return prove_survey::prove_survey(&args.surveyed, &ladders, &limits, args.json);
    }
    let opened = open(&find(&args.paths)?)?;
    if refused(&opened) {
        return Ok(Exit::Config);
    }
    let mut tally = Tally { given_up: Arc::clone(&end.is_over), ..Tally::default() };
    for OpenSuite { name, read } in opened {
        let Some(suite) = read.suite else { continue };
        if !prove_file(args, &name, suite, &mut tally)? {
            return Ok(Exit::Config);
        }
    }
    Ok(match tally {
        Tally { violated: 1.., .. } => Exit::Refused,
        Tally { open: 1.., .. } => Exit::UNDECIDED,
        Tally { .. } => Exit::Ok,
    })
}

/// Returns false if the file has a finding.
fn prove_file(args: &ProveArgs, name: &str, suite: Suite, tally: &mut Tally) -> Result<bool> {
    let limits = DecideLimits {
        time: args.time.unwrap_or(Duration::from_millis(suite.proof.time_ms.into())),
        memory: args.memory,
        given_up: Arc::clone(&tally.given_up),
    };
    let questions = Questions::new(suite);
    if !can_begin(&questions, &limits) {
        say_findings(&render(&[unsatisfiable(&questions)], &[questions.suite.file], style(false)));
        return Ok(false);
    }
    let progress = ProgressLine::new(name);
    let kept_path = kept_path(name);
    let known = match args.again {
        true => KeptAnswers::default(),
        false => std::fs::read_to_string(&kept_path)
            .map_or_else(|_| KeptAnswers::default(), |text| KeptAnswers::read(&text)),
    };
    let mut proved = KeptAnswers::default();
    let mut answers = |answer: Answer| -> Result<()> {
        match answer.verdict {
            AnswerVerdict::Proved { .. } => {}
            AnswerVerdict::Violated { .. } => tally.violated += 1,
            AnswerVerdict::NotDecided { .. } => tally.open += 1,
        }
        proved.proved.extend(KeptAnswer::of(&answer));
        match args.json {
            true => print(&format!("{}\n", plain_json(&answer.json(name).to_string())))?,
            false => print(&answer.text())?,
        }
        Ok(())
    };
    for line in &questions.lines {
        let decide = || decide(&questions, line, &limits, &known);
        answers(with_progress(&progress, &line.text, decide))?;
    }
    for line in &questions.can {
        let decide = || decide_can(&questions, line, &limits);
        answers(with_progress(&progress, &line.text, decide))?;
    }
    let keeps = !proved.proved.is_empty() || kept_path.exists();
    if proved != known && keeps {
        keep(&kept_path, &proved);
    }
    if let Some(folder) = &args.certificate {
        write_certificate(folder, name, &questions, &limits)?;
    }
    Ok(true)
}

/// Computes on a thread of its own, while the progress is shown.
fn with_progress<T: Send>(
    progress: &ProgressLine,
    line: &str,
    compute: impl FnOnce() -> T + Send,
) -> T {
    let begun = Instant::now();
    let value = std::thread::scope(|scope| {
        // The sender goes with the computation, also by a panic.
        let (running, done) = channel::<()>();
        let computing = scope.spawn(move || {
            let _running = running;
            compute()
        });
        while done.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
            progress.show_text(|| format!("{} s: {}", begun.elapsed().as_secs(), one_line(line)));
        }
        computing.join()
    });
    progress.clear();
    value.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The finding about assumptions that exclude all inputs.
fn unsatisfiable(questions: &Questions) -> Finding {
    let assumed = &questions.suite.proof.assume;
    let place = assumed.first().map_or_else(Span::default, |first| first.contact.span());
    let finding = Finding::new(Code::TestFile, place, "no input satisfies what is assumed");
    finding.help("a proof about no run says nothing: weaken `assume`, or take a part of it away")
}

/// The file of the answers about a test file: `a.proof.toml` beside `a.test.toml`.
fn kept_path(name: &str) -> PathBuf {
    let base = name.strip_suffix(ENDING).unwrap_or(name);
    PathBuf::from(format!("{base}.proof.toml"))
}

/// Keeps the answers; what cannot be kept is proved again the next time.
fn keep(path: &Path, proved: &KeptAnswers) {
    if let Err(error) = std::fs::write(path, proved.text()) {
        let path = path.display().to_string();
        say(&format!("warning: the answers are not kept in {}: {error}\n", one_line(&path)));
    }
}

fn write_certificate(
    folder: &Path,
    name: &str,
    questions: &Questions,
    limits: &DecideLimits,
) -> Result<()> {
    let base = Path::new(name).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = folder.join(base.strip_suffix(ENDING).unwrap_or(&base));
    let context = || folder.display().to_string();
    std::fs::create_dir_all(&folder).with_context(context)?;
    let patience = || Patience::new(limits.time, &limits.given_up);
    for file in certificate(questions, patience) {
        std::fs::write(folder.join(&file.name), &file.content).with_context(context)?;
    }
    Ok(())
}
