//! The progress of a load: its current step, its longest step, and whether it must end early.
//!
//! A reload gives a [`Progress`] to its load and keeps a copy. The load names every step that it
//! begins. Between files, and within a step before each rung, row or other part, it looks whether
//! its time is over. If so, it skips the rest, and its result is dropped. A step within a system
//! call is not ended by this. Commands that read files for their caller use [`Progress::default`],
//! which nothing ends.

use std::fmt;
#[cfg(debug_assertions)]
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::locked::locked;

/// A step of a load.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LoadStep {
    /// The system reads a file.
    Reading(String),
    /// The text of a file becomes tables, blocks and rungs.
    Parsing(String),
    /// Names become addresses.
    Names,
    /// The settings of the controller file.
    Settings,
    /// A rule of the check.
    Rule(&'static str),
    /// The findings become text.
    Findings,
    /// The program becomes operations.
    Lowering,
}

/// Shared by a load and its caller.
#[derive(Clone, Debug, Default)]
pub struct Progress(Option<Arc<SharedSteps>>);

#[derive(Debug, Default)]
struct SharedSteps {
    over: AtomicBool,
    steps: Mutex<Steps>,
    /// For tests: the end of the time.
    #[cfg(debug_assertions)]
    last: Option<LastStep>,
}

/// For tests: the step within which the time is over, and the number of looks before that.
#[cfg(debug_assertions)]
#[derive(Debug)]
struct LastStep {
    step: LoadStep,
    looks: AtomicUsize,
}

/// The current step, and the longest of the steps before it.
#[derive(Debug, Default)]
struct Steps {
    current: Option<(LoadStep, Instant)>,
    longest: Option<(LoadStep, Duration)>,
}

/// The progress of a load that nobody watches or ends.
pub static UNASKED: Progress = Progress(None);

impl Progress {
    /// The progress of a load that its caller may end.
    pub fn new() -> Progress {
        Progress(Some(Arc::default()))
    }

    /// The progress of a load whose time is over when it begins this step.
    #[cfg(debug_assertions)]
    pub fn over_at(step: LoadStep) -> Progress {
        Progress::over_within(step, 0)
    }

    /// The progress of a load whose time is over after this number of looks within a step.
    #[cfg(debug_assertions)]
    pub fn over_within(step: LoadStep, looks: usize) -> Progress {
        let last = Some(LastStep { step, looks: AtomicUsize::new(looks) });
        Progress(Some(Arc::new(SharedSteps { last, ..SharedSteps::default() })))
    }

    /// For a progress of [`Progress::over_within`]: the number of looks that are left.
    #[cfg(debug_assertions)]
    pub fn looks_left(&self) -> usize {
        let last = self.0.as_ref().and_then(|shared| shared.last.as_ref());
        last.map_or(0, |last| last.looks.load(Ordering::Relaxed))
    }

    /// Notes that the load begins a step.
    pub fn begin(&self, step: LoadStep) {
        let Some(shared) = &self.0 else { return };
        #[cfg(debug_assertions)]
        shared.end_at(&step);
        shared.steps().begin(step, Instant::now());
    }

    /// Notes that the load's time is over.
    pub fn end(&self) {
        if let Some(shared) = &self.0 {
            shared.over.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the load must end.
    pub fn is_over(&self) -> bool {
        let Some(shared) = &self.0 else { return false };
        #[cfg(debug_assertions)]
        shared.count_look();
        shared.over.load(Ordering::Relaxed)
    }

    /// The items, until the load must end. Looks before each item.
    pub fn during<I: IntoIterator>(&self, items: I) -> impl Iterator<Item = I::Item> {
        items.into_iter().take_while(move |_| !self.is_over())
    }

    /// The current step.
    pub fn current(&self) -> Option<LoadStep> {
        self.0.as_ref()?.steps().current.as_ref().map(|(step, _)| step.clone())
    }

    /// The longest step so far, including the current one.
    pub fn longest(&self) -> Option<LoadStep> {
        self.0.as_ref()?.steps().longest_at(Instant::now())
    }
}

impl SharedSteps {
    fn steps(&self) -> MutexGuard<'_, Steps> {
        locked(&self.steps)
    }

    /// Ends the time at the beginning of the last step if no look is left.
    #[cfg(debug_assertions)]
    fn end_at(&self, step: &LoadStep) {
        let Some(last) = self.last.as_ref().filter(|last| last.step == *step) else { return };
        if last.looks.load(Ordering::Relaxed) == 0 {
            self.over.store(true, Ordering::Relaxed);
        }
    }

    /// Counts a look within the last step; ends the time if none was left.
    #[cfg(debug_assertions)]
    fn count_look(&self) {
        let Some(last) = &self.last else { return };
        if self.steps().current.as_ref().is_none_or(|(step, _)| *step != last.step) {
            return;
        }
        match last.looks.load(Ordering::Relaxed) {
            0 => self.over.store(true, Ordering::Relaxed),
            left => last.looks.store(left - 1, Ordering::Relaxed),
        }
    }
}

impl Steps {
    fn begin(&mut self, step: LoadStep, now: Instant) {
        if let Some((ended, since)) = self.current.replace((step, now)) {
            let took = now.saturating_duration_since(since);
            if self.longest.as_ref().is_none_or(|(_, most)| took > *most) {
                self.longest = Some((ended, took));
            }
        }
    }

    fn longest_at(&self, now: Instant) -> Option<LoadStep> {
        let (current, since) = self.current.as_ref()?;
        let took = now.saturating_duration_since(*since);
        let before = self.longest.as_ref().filter(|(_, most)| *most > took);
        Some(before.map_or(current, |(step, _)| step).clone())
    }
}

impl fmt::Display for LoadStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LoadStep::Reading(file) => write!(f, "reading `{file}`"),
            LoadStep::Parsing(file) => write!(f, "parsing `{file}`"),
            LoadStep::Names => f.write_str("looking up names"),
            LoadStep::Settings => f.write_str("the settings of the controller file"),
            LoadStep::Rule(name) => write!(f, "the rule `{name}`"),
            LoadStep::Findings => f.write_str("printing the findings"),
            LoadStep::Lowering => f.write_str("lowering the program"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_step_is_found_whether_finished_or_running() {
        let (start, mut steps) = (Instant::now(), Steps::default());
        let at = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(steps.longest_at(at(0)), None);
        steps.begin(LoadStep::Names, at(0));
        steps.begin(LoadStep::Settings, at(5));
        assert_eq!(steps.longest_at(at(9)), Some(LoadStep::Names), "5 s, then 4 s");
        assert_eq!(steps.longest_at(at(11)), Some(LoadStep::Settings), "5 s, then 6 s");
        steps.begin(LoadStep::Lowering, at(7));
        assert_eq!(steps.longest_at(at(8)), Some(LoadStep::Names), "5 s, 2 s, 1 s");
    }

    #[test]
    fn iteration_ends_when_the_time_is_over() {
        let progress = Progress::over_within(LoadStep::Names, 3);
        assert_eq!(progress.during(0..9).count(), 9, "before the step");
        progress.begin(LoadStep::Names);
        assert_eq!(progress.during(0..9).collect::<Vec<_>>(), [0, 1, 2]);
        assert!(progress.is_over() && progress.during(0..9).next().is_none());
    }

    #[test]
    fn a_load_without_a_time_limit_is_never_ended() {
        let progress = Progress::default();
        progress.begin(LoadStep::Names);
        progress.end();
        assert!(!progress.is_over() && progress.longest().is_none());
    }
}
