//! The parts shared by the commands that communicate with a running controller: its socket, the
//! request and the answer, the exit code of a refusal, and the completion of its names.

use std::ffi::OsStr;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use clap_complete::engine::{ArgValueCompleter, CompletionCandidate};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::exit::Exit;
use super::terminal::{
    one_line, plain, plain_json, print, say, say_findings, say_line, with_own_lines,
};
use rungd_client::operator::client::{self, CallFailure};
use rungd_client::operator::protocol::{
    AlarmList, AlarmStatus, ChangedOperand, GivenValue, NameList, OfferedName, RefusalKind,
    Request, RequestRefusal,
};
use rungd_client::operator::search::{self, running_instead};
use rungd_client::operator::search_failure::SearchFailure;
use rungd_client::operator::{SOCKET_VARIABLE, socket_of_environment};
use rungd_language::resolve::value_texts::with_text;

/// The socket of the controller, and the form of its printed answer.
#[derive(Args, Clone, Debug)]
pub struct OperatorArgs {
    /// The running controller's socket (default: that of the controller that runs in this folder,
    /// else of your only running one, else the service's, /run/rungd/rungd.sock)
    #[arg(long, value_name = "PATH", env = SOCKET_VARIABLE)]
    pub socket: Option<PathBuf>,
    /// Print the answer as one line of JSON
    #[arg(long)]
    pub json: bool,
}

/// An operand and the value to write or force.
#[derive(Args, Debug)]
pub struct NewValue {
    /// Tag, address or member
    #[arg(value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operand: String,
    /// ON or OFF; or a number, as 12, 0x1F or 1m30s
    #[arg(value_name = "VALUE", allow_hyphen_values = true)]
    value: String,
}

impl NewValue {
    /// The operand and the value, in the form of a request.
    pub fn named(&self) -> (String, GivenValue) {
        (self.operand.clone(), GivenValue::Text(self.value.clone()))
    }
}

impl OperatorArgs {
    /// Sends a request whose failure does not end the command. A failure is not printed.
    ///
    /// # Errors
    /// The request is refused, or no controller answers.
    pub fn try_ask<T: DeserializeOwned + Serialize>(
        &self,
        request: &Request,
    ) -> Result<T, CallFailure> {
        client::ask(&search::socket(self.socket.clone())?, request)
    }

    /// Sends a request; `Err` is the exit code of a refusal or failure, which has been printed.
    pub fn ask<T: DeserializeOwned + Serialize>(&self, request: &Request) -> Result<T, Exit> {
        self.asked(request).map_err(|failure| self.print_failure(&failure))
    }

    /// As [`OperatorArgs::ask`]; a failure is not printed.
    ///
    /// # Errors
    /// The request is refused, or no controller answers.
    pub fn asked<T: DeserializeOwned + Serialize>(
        &self,
        request: &Request,
    ) -> Result<T, CallFailure> {
        let waits = |why: &str| say_line(&format!("rungd: {why}"));
        search::found(self.socket.clone()).and_then(|found| {
            // Said before it is done: the user has not named the controller.
            if let Some(notice) = found.notice().filter(|_| !request.only_looks()) {
                waits(&notice);
            }
            client::ask_and_tell(&found.socket, request, &waits)
        })
    }

    /// Prints a refusal or failure, and returns its exit code.
    pub fn print_failure(&self, failure: &CallFailure) -> Exit {
        if self.json {
            let mut error =
                serde_json::json!({ "kind": kind_of(failure), "message": failure.to_string() });
            if let CallFailure::Refused(RequestRefusal { mistakes, .. }) = failure
                && !mistakes.is_empty()
            {
                error["mistakes"] = serde_json::to_value(mistakes).unwrap_or_default();
            }
            let error = serde_json::json!({ "error": error });
            let _ = writeln!(io::stdout(), "{}", plain_json(&error.to_string()));
        } else if let CallFailure::Refused(RequestRefusal {
            kind: RefusalKind::BadFiles,
            message,
            ..
        }) = failure
        {
            say_findings(&plain(&format!("{}\n", message.trim_end())));
            say("rungd: the files cannot be run as they are; nothing is changed\n");
        } else {
            say_failure(failure);
        }
        exit_of(failure)
    }

    /// Prints an answer as JSON or as text.
    ///
    /// # Errors
    /// Standard output cannot be written.
    pub fn print<T: Serialize>(&self, answer: &T, text: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            let json = serde_json::to_string(answer)?;
            writeln!(io::stdout().lock(), "{}", plain_json(&json))?;
        } else {
            print(&text())?;
        }
        Ok(())
    }

    /// Requests a change of one operand, and prints it.
    ///
    /// # Errors
    /// Standard output cannot be written.
    pub fn change(&self, request: &Request, did: &str) -> Result<Exit> {
        let change: ChangedOperand = match self.ask(request) {
            Ok(change) => change,
            Err(exit) => return Ok(exit),
        };
        self.print(&change, || change_line(&change, did))?;
        if let Some(note) = change.note.filter(|_| !self.json) {
            say_line(&format!("note: {note}"));
        }
        Ok(Exit::Ok)
    }
}

/// The line about a changed operand. `did`: before the value.
pub(super) fn change_line(change: &ChangedOperand, did: &str) -> String {
    let forced = |is: bool| if is { ", forced" } else { "" };
    format!(
        "{}: {did}{}{}, was {}{}\n",
        one_line(&change.now.to_string()),
        one_line(&change.now.say_value()),
        forced(change.now.forced),
        one_line(&with_text(change.before, change.before_text.as_deref())),
        forced(change.was_forced)
    )
}

/// Prints a failure on standard error; if a named socket does not answer, also the controllers that
/// run.
pub(super) fn say_failure(failure: &CallFailure) {
    let told = format!("rungd: {failure}");
    with_own_lines(&told).lines().for_each(say_line);
    if let CallFailure::NotRunning(..) = failure {
        running_instead().iter().flat_map(|told| told.lines()).for_each(say_line);
    }
}

pub(super) fn exit_of(failure: &CallFailure) -> Exit {
    match failure {
        CallFailure::NotFound(SearchFailure::None { .. }) => Exit::Unavailable,
        CallFailure::NotFound(SearchFailure::Several { .. }) => Exit::Usage,
        CallFailure::NotRunning(..) => Exit::Unavailable,
        CallFailure::NotAllowed(..) => Exit::NoPerm,
        CallFailure::Broken(..) => Exit::Io,
        CallFailure::Refused(refusal) => match refusal.kind {
            RefusalKind::BadRequest | RefusalKind::BadOperand | RefusalKind::BadValue => {
                Exit::Usage
            }
            RefusalKind::BadFiles => Exit::Config,
            RefusalKind::NotPermitted => Exit::NoPerm,
            RefusalKind::Refused | RefusalKind::NoAnswer | RefusalKind::TooLate => Exit::Refused,
        },
    }
}

fn kind_of(failure: &CallFailure) -> serde_json::Value {
    match failure {
        CallFailure::NotFound(SearchFailure::None { .. }) | CallFailure::NotRunning(..) => {
            "not-running".into()
        }
        CallFailure::NotFound(SearchFailure::Several { .. }) => "several".into(),
        CallFailure::NotAllowed(..) => "not-permitted".into(),
        CallFailure::Broken(..) => "broken".into(),
        CallFailure::Refused(refusal) => serde_json::to_value(refusal.kind).unwrap_or_default(),
    }
}

/// The names in the running controller, for the shell. Empty if no controller answers.
pub fn complete(current: &OsStr) -> Vec<CompletionCandidate> {
    let prefix = current.to_string_lossy().into_owned();
    let asked = socket_to_complete()
        .and_then(|socket| client::ask::<NameList>(&socket, &Request::Names { prefix }));
    let Ok(names) = asked else { return Vec::new() };
    let candidate = |name: &OfferedName| candidate(&name.name, &name.about);
    names.names.iter().map(candidate).collect()
}

/// As [`complete`], behind a first OPERAND=VALUE: the names of further ones, each with its `=`.
pub fn complete_assigned(current: &OsStr) -> Vec<CompletionCandidate> {
    let is_assigned = |word: std::ffi::OsString| {
        let word = word.to_string_lossy().into_owned();
        !word.starts_with('-') && word.contains('=')
    };
    let is_name = !current.to_string_lossy().contains('=');
    match is_name && std::env::args_os().skip(1).any(is_assigned) {
        true => complete(current).iter().map(with_equals_sign).collect(),
        false => Vec::new(),
    }
}

fn with_equals_sign(name: &CompletionCandidate) -> CompletionCandidate {
    let mut value = name.get_value().to_owned();
    value.push("=");
    CompletionCandidate::new(value).help(name.get_help().cloned())
}

/// The alarms that can be acknowledged, for the shell. Empty if no controller answers.
pub fn complete_alarms(current: &OsStr) -> Vec<CompletionCandidate> {
    listed_alarms(current, &AlarmStatus::waits)
}

/// The listed alarms that can be shelved, for the shell. Empty if no controller answers.
pub fn complete_unshelved(current: &OsStr) -> Vec<CompletionCandidate> {
    listed_alarms(current, &|alarm| alarm.shelved.is_none())
}

/// The alarms that are shelved, for the shell. Empty if no controller answers.
pub fn complete_shelved(current: &OsStr) -> Vec<CompletionCandidate> {
    listed_alarms(current, &|alarm| alarm.shelved.is_some())
}

fn listed_alarms(
    current: &OsStr,
    is_offered: &dyn Fn(&AlarmStatus) -> bool,
) -> Vec<CompletionCandidate> {
    let prefix = current.to_string_lossy();
    let asked = socket_to_complete()
        .and_then(|socket| client::ask::<AlarmList>(&socket, &Request::Alarms {}));
    let Ok(list) = asked else { return Vec::new() };
    let fits = |alarm: &&AlarmStatus| is_offered(alarm) && alarm.tag.starts_with(&*prefix);
    list.alarms.iter().filter(fits).map(|alarm| candidate(&alarm.tag, &alarm.text)).collect()
}

fn candidate(name: &str, about: &str) -> CompletionCandidate {
    let about = one_line(about).into_owned();
    CompletionCandidate::new(one_line(name).into_owned()).help(Some(about.into()))
}

/// The socket that the incomplete command line would use.
fn socket_to_complete() -> Result<PathBuf, CallFailure> {
    let words: Vec<_> = std::env::args_os().collect();
    let after = |(at, word): (usize, &std::ffi::OsString)| match word.to_str() {
        Some("--socket") => words.get(at + 1).map(PathBuf::from),
        Some(word) => word.strip_prefix("--socket=").map(PathBuf::from),
        None => None,
    };
    let given = words.iter().enumerate().find_map(after);
    search::socket(given.or_else(socket_of_environment))
}
