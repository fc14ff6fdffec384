//! Explains the value of an operand of a running controller, for the editor.
//!
//! `commands` runs it as a job. Like `rungd why`, it fetches the last minute of the scan log from
//! the controller and derives the answer from that log. The request only reads.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};

use super::jobs::{JobPlace, JobResult};
use rungd_client::operator::client;
use rungd_client::operator::protocol::{PresentOutputs, RecordingBytes, Request};
use rungd_history::observe::{Limits, QuestionTime};
use rungd_history::playback::{self, RecordedQuestion};
use rungd_history::record::Recording;

/// Writes the answer to a file and returns the file's path.
///
/// # Errors
/// No controller answers, or its program has no such operand.
pub(super) fn run(operand: &str, socket: &Path, place: &JobPlace) -> Result<Option<JobResult>> {
    let text = answer(operand, socket)?;
    if place.is_replaced() {
        return Ok(None);
    }
    let path: PathBuf = place.scratch.write(&format!("why-{operand}.txt"), text.as_bytes())?;
    Ok(Some(JobResult::Document(path, false)))
}

/// The last minute of a controller.
pub(super) struct LastMinute {
    pub recording: Arc<Recording>,
    /// Its last section.
    pub last: usize,
    /// What the controller does now.
    pub present: Option<PresentOutputs>,
}

/// Fetches the last minute of a controller.
///
/// # Errors
/// No controller answers, or nothing is recorded.
pub(super) fn last_minute(socket: &Path) -> Result<LastMinute> {
    let told: RecordingBytes = client::ask(socket, &Request::Recording { from_section: None })
        .map_err(|failure| anyhow!("{failure}"))?;
    let bytes = told.bytes().context("the controller's answer is not a recording")?;
    let (recording, present) = (Arc::new(Recording::of_bytes(bytes)), told.present);
    let Some(last) = recording.count().checked_sub(1) else { bail!("nothing is recorded yet") };
    Ok(LastMinute { recording, last, present })
}

fn answer(operand: &str, socket: &Path) -> Result<String> {
    let LastMinute { recording, last, present } = last_minute(socket)?;
    let subject = playback::subject(recording.program(last)).map_err(anyhow::Error::msg)?;
    let question =
        RecordedQuestion { section: last, at: QuestionTime::Now, limits: Limits::default() };
    let answer = playback::why(&subject, &recording, operand, question);
    let mut answer = answer.map_err(anyhow::Error::msg)?;
    if let Some(present) = present {
        present.complete(&mut answer, &subject);
    }
    Ok(format!("{}{}", answer.text(), answer.hints()))
}
