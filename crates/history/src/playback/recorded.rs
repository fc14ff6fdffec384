//! Makes the program of a recording again, and provides its past in the form that `observe` needs.
//!
//! Used by the commands of `cli` that read recordings, by the editor and by `live`. This module
//! changes nothing in a controller.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::replay::Playback;
use crate::observe::{EarlierPast, Explanation, Limits, Past, QuestionTime, Subject, TapeEnd};
use crate::record::{RecordedFile, RecordedProgram, Recording};
use rungd_config::controller::{Controller, OutputRules};
use rungd_config::load::{self, Loaded};
use rungd_engine::{Cell, Engine, EngineProgram};
use rungd_language::lower::lower;
use rungd_language::resolve::program;
use rungd_language::source::span::SourceFile;
use rungd_runtime::TapeSection;

/// The files of a recorded program, loaded.
///
/// # Errors
/// This version of rungd cannot load them.
pub fn loaded(program: &RecordedProgram) -> Result<(program::Program, Loaded), String> {
    let file =
        |file: &RecordedFile| SourceFile { name: file.name.clone(), text: file.text.to_string() };
    let files: Vec<SourceFile> = program.files.iter().map(file).collect();
    let mut loaded = load::recorded_files(&files);
    let found = loaded.program.take();
    let made = found.filter(|_| loaded.controller.is_some());
    let program = made.ok_or_else(|| {
        let version = env!("CARGO_PKG_VERSION");
        format!(
            "rungd {version} cannot load the files that rungd {} recorded: `rungd record files` \
             writes them out for `rungd check`",
            program.version
        )
    })?;
    Ok((program, loaded))
}

/// The engine of a recorded program.
///
/// # Errors
/// This version of rungd cannot load the program.
pub fn whole_program(program: &RecordedProgram) -> Result<Engine, String> {
    let (program, _) = loaded(program)?;
    Ok(Engine::new(lower(&program).0))
}

/// A recorded program as the subject of observations.
///
/// # Errors
/// This version of rungd cannot load it.
pub fn subject(program: &RecordedProgram) -> Result<Subject, String> {
    subject_and_settings(program).map(|(subject, _)| subject)
}

/// A recorded program as the subject of observations, and the settings of its controller.
///
/// # Errors
/// This version of rungd cannot load it.
pub fn subject_and_settings(
    program: &RecordedProgram,
) -> Result<(Subject, Option<Controller>), String> {
    let (program, Loaded { files, controller, .. }) = loaded(program)?;
    let subject = Subject::new(Arc::new(program), files);
    let outputs = OutputRules::of(controller.as_ref(), subject.symbols());
    Ok((subject.with_outputs(outputs), controller))
}

/// A question about a recording.
#[derive(Clone, Copy, Debug)]
pub struct RecordedQuestion {
    /// The section of the moment, or of a later one of the same program.
    pub section: usize,
    /// The moment.
    pub at: QuestionTime,
    /// The limits of the answer.
    pub limits: Limits,
}

/// Explains the value of an operand in a recording. `subject`: the program of the section.
///
/// # Errors
/// There is no such operand, or the recording does not have the moment.
pub fn why(
    subject: &Subject,
    recording: &Arc<Recording>,
    operand: &str,
    RecordedQuestion { section, at, limits }: RecordedQuestion,
) -> Result<Explanation, String> {
    let cell = subject.cell(operand)?;
    let mut past = RecordedPast::around(Arc::clone(recording), section, subject.code_for(cell));
    subject.why(&mut past, cell, at, limits).map_err(|refusal| refusal.to_string())
}

/// The sections of one program in a recording, for a question about it.
struct RecordedPast {
    playback: Playback<EngineProgram>,
    first: usize,
    end: usize,
    /// The sections from a base image to the section that was requested last.
    loaded: BTreeMap<usize, Arc<TapeSection>>,
}

impl RecordedPast {
    /// The sections with the same program as `section`, from the first to the last. `slice`: the
    /// part of the program that the question needs.
    fn around(recording: Arc<Recording>, section: usize, slice: EngineProgram) -> RecordedPast {
        let same = |at: &usize| recording.program(*at) == recording.program(section);
        let first = (0..=section).rev().take_while(same).last().unwrap_or(section);
        let end = (section..recording.count()).take_while(same).last().unwrap_or(section) + 1;
        let playback = Playback::new(recording, slice);
        RecordedPast { playback, first, end, loaded: BTreeMap::new() }
    }
}

impl Past for RecordedPast {
    fn count(&self) -> usize {
        self.end - self.first
    }

    fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        let at = self.first + at;
        if !self.loaded.contains_key(&at) {
            // A search goes backward in time, but states are computed forward from a base image.
            let base = self.playback.recording().base_of(at)?;
            let sections = (base..=at).map_while(|at| Some((at, self.playback.section(at).ok()?)));
            self.loaded = sections.map(|(at, section)| (at, Arc::new(section))).collect();
        }
        self.loaded.get(&at).cloned()
    }

    fn begins(&self) -> TapeEnd {
        let recording = self.playback.recording();
        let process = |at: usize| recording.program(at).process_start_ns;
        match self.first.checked_sub(1) {
            None => TapeEnd::Oldest,
            Some(before) if process(before) != process(self.first) => TapeEnd::Restarted,
            Some(_) if recording.follows(self.first) => TapeEnd::Swapped,
            Some(_) => TapeEnd::Lost,
        }
    }

    fn earlier(&mut self, operands: &[&str]) -> Option<EarlierPast> {
        if self.begins() != TapeEnd::Swapped {
            return None;
        }
        let (recording, last) = (Arc::clone(self.playback.recording()), self.first.checked_sub(1)?);
        let subject = subject(recording.program(last)).ok()?;
        let cells: Vec<Cell> = operands.iter().filter_map(|name| subject.cell(name).ok()).collect();
        let past = RecordedPast::around(recording, last, subject.code_for_all(&cells));
        Some(EarlierPast { subject: Arc::new(subject), past: Box::new(past) })
    }
}
