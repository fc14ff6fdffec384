//! The state of a recorded controller at a moment: what `rungd how` begins with.
//!
//! `moment` finds it in a recording, `live` in the sections that it follows. It is always one
//! between two scans, as the calls of the recording leave it. Nothing is asked here.

use std::sync::Arc;

use super::programs::PlayableProgram;
use super::replay::Playback;
use crate::observe::QuestionTime;
use crate::record::{RecordedProgram, Recording};
use rungd_engine::{Engine, EngineCall, EngineState};
use rungd_runtime::{TapeEntry, TapeSection, TapeStep, runs_behind};

/// A recorded controller between two scans.
pub struct RecordedMoment {
    /// Its program.
    pub program: PlayableProgram,
    /// The state of the engine.
    pub state: EngineState,
    /// The last scan before it; `None` before the first one.
    pub scan: Option<MomentScan>,
    /// Whether it is in RUN, so that a scan follows.
    pub runs: bool,
}

/// The last scan before a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MomentScan {
    /// Its number; the first of a process is 1.
    pub number: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// The state at the end of a scan, or at the end of a section.
///
/// # Errors
/// The program cannot be loaded, or the recording does not have the moment.
pub fn moment(
    recording: &Arc<Recording>,
    section: usize,
    at: QuestionTime,
) -> Result<RecordedMoment, String> {
    let program = PlayableProgram::of(recording.program(section))?;
    let engine = |_: &RecordedProgram| Ok::<Engine, String>(program.engine());
    let mut playback = Playback::new(Arc::clone(recording), engine);
    let section = playback.section(section).map_err(|why| why.to_string())?;
    RecordedMoment::in_section(program, &section, at)
}

impl RecordedMoment {
    /// The state at the end of a scan of a section of this program, or at the end of the section.
    ///
    /// # Errors
    /// The section does not have the moment, or does not fit the program.
    pub fn in_section(
        program: PlayableProgram,
        section: &TapeSection,
        at: QuestionTime,
    ) -> Result<RecordedMoment, String> {
        let end = end_of(section, at).ok_or("the recording does not have that scan")?;
        let mut engine = program.engine();
        if !engine.resume(&section.state) {
            return Err("the recording does not fit its program".to_owned());
        }
        let calls = section.entries[..end].iter().filter_map(|entry| entry.call());
        for call in calls {
            if !engine.program().has(call) {
                return Err("the recording does not fit its program".to_owned());
            }
            engine.apply(call);
        }
        let begun = section.begins().take_while(|begin| begin.at < end).last();
        let begun = begun.map(|TapeStep { number, now_ns, .. }| (number, now_ns));
        let before = section.start.number.checked_sub(1).filter(|number| *number > 0);
        let scan = begun.or(before.map(|number| (number, section.state.now_ns())));
        Ok(RecordedMoment {
            state: EngineState::of(&engine),
            scan: scan.map(|(number, now_ns)| MomentScan {
                number,
                unix_ns: section.start.unix_ns(now_ns),
            }),
            runs: runs_behind(section.start.mode, &section.entries[..end]),
            program,
        })
    }
}

/// The number of entries up to the moment; `None`: the section does not have it. No moment is
/// within a scan.
fn end_of(section: &TapeSection, at: QuestionTime) -> Option<usize> {
    let executes = |entry: &TapeEntry| entry.call() == Some(EngineCall::Execute);
    match at {
        QuestionTime::Scan(number) => {
            let mut steps = section.steps();
            let end = steps.find(|step| executes(&step.entry) && step.number == number);
            end.map(|step| step.at + 1)
        }
        QuestionTime::Now => {
            let begun = section.begins().last().map(|begin| begin.at);
            let open = begun.filter(|at| !section.entries[*at..].iter().any(executes));
            Some(open.unwrap_or(section.entries.len()))
        }
    }
}
