//! Finds how the value of an operand of a running controller could change, for the editor.
//!
//! `commands` runs it as a job, with the feature `prove`. The request only reads.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::jobs::{JobPlace, JobResult};
use super::why_job::{LastMinute, last_minute};
use rungd_history::observe::QuestionTime;
use rungd_history::playback::moment;
use rungd_prove::how::how_to_change;

/// Writes the answer to a file and returns the file's path.
///
/// # Errors
/// No controller answers, or its program has no such operand.
pub(super) fn run(operand: &str, socket: &Path, place: &JobPlace) -> Result<Option<JobResult>> {
    let LastMinute { recording, last, .. } = last_minute(socket)?;
    let answer = moment(&recording, last, QuestionTime::Now)
        .and_then(|moment| how_to_change(moment, operand, place.shared_flag()));
    if place.is_replaced() {
        return Ok(None);
    }
    let text = answer.map_err(anyhow::Error::msg)?.text();
    let path: PathBuf = place.scratch.write(&format!("how-{operand}.txt"), text.as_bytes())?;
    Ok(Some(JobResult::Document(path, false)))
}
