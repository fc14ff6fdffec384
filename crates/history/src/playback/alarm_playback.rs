//! Fills the history of alarms: executes the recorded calls again, with only the operations on
//! which the bits of alarms and the lines of `[[watch]]` depend.
//!
//! Part of `alarm_history`. The execution begins before the window, by the longest delay of an
//! alarm, so that an alarm that stands when the window begins is known.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use super::alarm_follower::PlacedAlarms;
use super::alarm_history::{AlarmHistory, SeenScan, SpanEnd};
use super::followed_alarm::{FollowedAlarm, FollowedSource, LineJudge, MakeJudge};
use super::programs::{PlayableProgram, RecordedPrograms};
use super::replay::{MakeEngine, Playback, PlayedScan, PlayedStep, Unplayable};
use crate::record::{RecordedProgram, Recording};
use rungd_config::controller::watch::WatchSettings;
use rungd_engine::{Cell, Engine, EngineCall};

impl AlarmHistory {
    /// The history of some sections. `is_shown`: whether a scan of them counts. `make_judge`: makes
    /// the judge of a program's lines.
    pub fn of(
        recording: &Arc<Recording>,
        sections: Range<usize>,
        is_shown: impl Fn(&PlayedScan) -> bool,
        make_judge: MakeJudge,
    ) -> AlarmHistory {
        let sections = with_lead(recording, sections);
        let programs = &RecordedPrograms::of(recording, sections.clone());
        let engines = AlarmEngines { programs, make_judge };
        let playback = Playback::new(Arc::clone(recording), engines);
        let history = AlarmHistory::default();
        let mut run = HistoryRun { playback, is_shown, judged: None, history };
        for at in sections.clone() {
            if at > sections.start && !recording.follows(at) {
                run.gap();
            }
            if run.section(at).is_err() {
                run.history.unplayable += 1;
                run.gap();
            }
        }
        run.history.end(SpanEnd::Stands);
        run.history
    }
}

/// The sections with those before them that the delays of alarms need.
fn with_lead(recording: &Recording, sections: Range<usize>) -> Range<usize> {
    let Range { start, end } = sections;
    let programs = RecordedPrograms::of(recording, start..end.min(start + 1));
    let lead_ns = programs.first().map_or(0, delay_max_ns);
    let from_ns = recording.head(start).begin_ns.saturating_sub(lead_ns);
    let is_needed = |at: &usize| recording.follows(at + 1) && recording.head(*at).end_ns >= from_ns;
    let lead = (0..start).rev().take_while(is_needed).count();
    start - lead..end
}

fn delay_max_ns(program: &PlayableProgram) -> i64 {
    FollowedAlarm::delay_max_ns(&alarms(program))
}

/// The alarms of a program: those of its bits, then its lines.
fn alarms(program: &PlayableProgram) -> Vec<FollowedAlarm> {
    let mut alarms = FollowedAlarm::of_bits(&program.symbols);
    alarms.extend(watches(program).into_iter().flat_map(FollowedAlarm::of_lines));
    alarms
}

fn watches(program: &PlayableProgram) -> Option<&WatchSettings> {
    program.loaded.controller.as_ref().map(|controller| &controller.watches)
}

/// The execution of the sections, one after the other.
struct HistoryRun<'a, F> {
    playback: Playback<AlarmEngines<'a>>,
    is_shown: F,
    judged: Option<JudgedAlarms>,
    history: AlarmHistory,
}

/// The program of the last section.
struct JudgedAlarms {
    place: usize,
    alarms: Vec<FollowedAlarm>,
    /// The judge of its lines, if it has some.
    judge: Option<Box<dyn LineJudge>>,
}

impl<F: Fn(&PlayedScan) -> bool> HistoryRun<'_, F> {
    /// What follows is not known to follow.
    fn gap(&mut self) {
        self.history.gap();
        self.judged = None;
    }

    /// Executes a section.
    fn section(&mut self, at: usize) -> Result<(), Unplayable> {
        let body = self.playback.seek(at)?;
        let AlarmEngines { programs, make_judge } = self.playback.programs;
        let place = programs.place(at);
        let program = programs.program(at).map_err(|why| Unplayable::NoEngine(why.clone()))?;
        let known = self.judged.take().filter(|judged| judged.place == place);
        let image = self.playback.engine()?.image();
        let mut judged = known.unwrap_or_else(|| {
            let mut judge = judge_of(program, make_judge);
            judge.iter_mut().for_each(|judge| judge.joins(image));
            JudgedAlarms { place, alarms: alarms(program), judge }
        });
        let (history, is_shown) = (&mut self.history, &self.is_shown);
        let mut visit = |step: PlayedStep, engine: &Engine| {
            let image = engine.image();
            judged.judge.iter_mut().for_each(|judge| judge.called(step.call, image));
            if step.call == EngineCall::Execute {
                let judge = judged.judge.as_ref();
                let is_on = |alarm: &FollowedAlarm| match alarm.source {
                    FollowedSource::Bit(bit) => image.value(bit) != 0,
                    FollowedSource::Line(line) => judge.is_some_and(|judge| !judge.holds(line)),
                };
                let alarms = PlacedAlarms { place, alarms: &judged.alarms };
                let (scan, is_shown) = (step.scan, is_shown(&step.scan));
                history.look(alarms, SeenScan { scan, is_shown, is_on: &is_on });
            }
            ControlFlow::Continue(())
        };
        let _ = self.playback.play(at, &body, &mut visit)?;
        self.judged = Some(judged);
        Ok(())
    }
}

/// The judge of a program's lines, if it has some.
fn judge_of(program: &PlayableProgram, make_judge: MakeJudge) -> Option<Box<dyn LineJudge>> {
    let watches = watches(program).filter(|watches| !watches.all.is_empty())?;
    Some(make_judge(watches, &program.symbols))
}

/// Makes engines with only the operations on which alarms depend.
#[derive(Clone, Copy)]
struct AlarmEngines<'a> {
    programs: &'a RecordedPrograms,
    make_judge: MakeJudge,
}

impl MakeEngine for AlarmEngines<'_> {
    type Engine = Engine;

    fn engine(&mut self, program: &Arc<RecordedProgram>) -> Result<Engine, String> {
        let program = self.programs.playable(program)?;
        let mut cells: Vec<Cell> = program.symbols.alarms.iter().map(|alarm| alarm.bit).collect();
        if let Some(judge) = judge_of(program, self.make_judge) {
            cells.extend(judge.cells());
        }
        Ok(Engine::new(program.code.slice(&cells).program))
    }
}
