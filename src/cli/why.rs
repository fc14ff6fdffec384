//! `rungd why`: the reason for the value of an operand, in a running controller or in a recording.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{OperatorArgs, complete};
use super::recording;
use super::terminal::{plain_json, print, say_line};
use super::when::{LocalClock, WrittenTime};
use rungd_history::observe::{Limits, QuestionTime};
use rungd_history::playback::{self, RecordedQuestion};

/// Explains the value of an operand: the write, the contacts, and what would change it
#[derive(Args, Debug)]
pub struct WhyArgs {
    /// Tag, address or member
    #[arg(value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operand: String,
    /// At this time or scan: `10:02:03`, `yesterday 23:50`, `-15s` (before the last scan),
    /// `scan 81234` (default: now)
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = WrittenTime::parse)]
    at: Option<WrittenTime>,
    /// A recording: a file, or a folder as `[record] dir` names it (default: the last minute of
    /// the running controller)
    #[arg(long, value_name = "RECORDING")]
    recording: Option<PathBuf>,
    /// How many levels of reasons to follow
    #[arg(long, value_name = "N", default_value_t = Limits::default().depth)]
    depth: u32,
    #[command(flatten)]
    controller: OperatorArgs,
}

/// Explains the value.
///
/// # Errors
/// The recording cannot be read, or standard output cannot be written.
pub fn why(args: &WhyArgs) -> Result<Exit> {
    let found = match &args.recording {
        Some(path) => Ok((recording::opened(path)?, None)),
        None => recording::live(&args.controller),
    };
    let (recording, present) = match found {
        Ok(found) => found,
        Err(exit) => return Ok(exit),
    };
    recording::tell_flaws(&recording);
    let (section, at) = match recording::moment(args.at.as_ref(), &recording) {
        Ok(place) => place,
        Err(why) => return Ok(refused(args, &why)),
    };
    let subject = match playback::subject(recording.program(section)) {
        Ok(subject) => subject,
        Err(why) => return Ok(refused(args, &why)),
    };
    let limits = Limits { depth: args.depth, ..Limits::default() };
    let question = RecordedQuestion { section, at, limits };
    let mut answer = playback::why(&subject, &Arc::new(recording), &args.operand, question);
    if let (Ok(answer), Some(present), QuestionTime::Now) = (&mut answer, &present, at) {
        present.complete(answer, &subject);
    }
    match answer {
        Ok(answer) if args.controller.json => {
            let json = answer.json().to_string();
            writeln!(io::stdout().lock(), "{}", plain_json(&json))?;
            Ok(Exit::Ok)
        }
        Ok(answer) => {
            if let (Some(_), Some(scan)) = (&args.at, answer.at.scan) {
                let time = LocalClock::here().text(answer.at.unix_ns);
                print(&format!("at the end of scan {scan}, {time}:\n"))?;
            }
            print(&format!("{}{}", answer.text(), answer.hints()))?;
            Ok(Exit::Ok)
        }
        Err(why) => Ok(refused(args, &why)),
    }
}

fn refused(args: &WhyArgs, why: &str) -> Exit {
    if args.controller.json {
        let error = serde_json::json!({ "error": { "kind": "refused", "message": why } });
        let _ = writeln!(io::stdout(), "{}", plain_json(&error.to_string()));
    } else {
        say_line(&format!("rungd: {why}"));
    }
    Exit::Refused
}
