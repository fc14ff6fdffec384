//! The progress of a load: its current step, its longest step, and whether it must end early.
//!
//! A reload gives a [`Progress`] to its load and keeps a copy. The load names every step that it
//! begins, and checks between files, rungs and rules whether its time is over. If so, it skips the
//! rest, and its result is dropped. A step within a system call is not ended by this. Commands that
//! read files for their caller use [`Progress::default`], which nothing ends.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::locked::locked;

/// A step of a load.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
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
pub struct Progress(Option<Arc<Shared>>);

#[derive(Debug, Default)]
struct Shared {
    over: AtomicBool,
    steps: Mutex<Steps>,
    /// For tests: the time is over when the load begins this step.
    #[cfg(test)]
    last: Option<Step>,
}

/// The current step, and the longest of the steps before it.
#[derive(Debug, Default)]
struct Steps {
    current: Option<(Step, Instant)>,
    longest: Option<(Step, Duration)>,
}

/// The progress of a load that nobody watches or ends.
pub static UNASKED: Progress = Progress(None);

impl Progress {
    /// The progress of a load that its caller may end.
    pub fn new() -> Progress {
        Progress(Some(Arc::default()))
    }

    /// The progress of a load whose time is over when it begins this step.
    #[cfg(test)]
    pub fn over_at(step: Step) -> Progress {
        Progress(Some(Arc::new(Shared { last: Some(step), ..Shared::default() })))
    }

    /// Notes that the load begins a step.
    pub fn begin(&self, step: Step) {
        let Some(shared) = &self.0 else { return };
        #[cfg(test)]
        if shared.last.as_ref() == Some(&step) {
            self.end();
        }
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
        self.0.as_ref().is_some_and(|shared| shared.over.load(Ordering::Relaxed))
    }

    /// The current step.
    pub fn current(&self) -> Option<Step> {
        self.0.as_ref()?.steps().current.as_ref().map(|(step, _)| step.clone())
    }

    /// The longest step so far, including the current one.
    pub fn longest(&self) -> Option<Step> {
        self.0.as_ref()?.steps().longest_at(Instant::now())
    }
}

impl Shared {
    fn steps(&self) -> MutexGuard<'_, Steps> {
        locked(&self.steps)
    }
}

impl Steps {
    fn begin(&mut self, step: Step, now: Instant) {
        if let Some((ended, since)) = self.current.replace((step, now)) {
            let took = now.saturating_duration_since(since);
            if self.longest.as_ref().is_none_or(|(_, most)| took > *most) {
                self.longest = Some((ended, took));
            }
        }
    }

    fn longest_at(&self, now: Instant) -> Option<Step> {
        let (current, since) = self.current.as_ref()?;
        let took = now.saturating_duration_since(*since);
        let before = self.longest.as_ref().filter(|(_, most)| *most > took);
        Some(before.map_or(current, |(step, _)| step).clone())
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Step::Reading(file) => write!(f, "reading `{file}`"),
            Step::Parsing(file) => write!(f, "parsing `{file}`"),
            Step::Names => f.write_str("looking up names"),
            Step::Settings => f.write_str("the settings of the controller file"),
            Step::Rule(name) => write!(f, "the rule `{name}`"),
            Step::Findings => f.write_str("printing the findings"),
            Step::Lowering => f.write_str("lowering the program"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_step_is_told_whether_it_has_ended_or_not() {
        let (start, mut steps) = (Instant::now(), Steps::default());
        let at = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(steps.longest_at(at(0)), None);
        steps.begin(Step::Names, at(0));
        steps.begin(Step::Settings, at(5));
        assert_eq!(steps.longest_at(at(9)), Some(Step::Names), "5 s, then 4 s");
        assert_eq!(steps.longest_at(at(11)), Some(Step::Settings), "5 s, then 6 s");
        steps.begin(Step::Lowering, at(7));
        assert_eq!(steps.longest_at(at(8)), Some(Step::Names), "5 s, 2 s, 1 s");
    }

    #[test]
    fn nothing_ends_a_load_of_which_nobody_asks() {
        let progress = Progress::default();
        progress.begin(Step::Names);
        progress.end();
        assert!(!progress.is_over() && progress.longest().is_none());
    }
}
