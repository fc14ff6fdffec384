//! Jobs: commands that take time. Each job runs on its own thread, so that the server continues to
//! answer.
//!
//! `commands` starts jobs, `server` receives their reports. A new job replaces a running job of the
//! same name: the report of the replaced job is dropped, and that job ends as soon as it checks
//! [`JobPlace::is_replaced`].

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, Sender, unbounded};

use super::scratch::Scratch;
use super::test_results::FileResults;

/// The result of a job.
#[derive(Debug)]
pub(super) enum Made {
    /// A file to show; `true`: in the desktop's program for it.
    Document(PathBuf, bool),
    /// The verdicts of tests.
    Tests(FileResults),
    /// The job failed, for this reason.
    Failed(String),
}

/// A report of a job.
#[derive(Debug)]
pub(super) struct JobReport {
    name: String,
    number: u64,
    /// The result of the job.
    pub made: Made,
}

/// The jobs of a server.
#[derive(Debug)]
pub(super) struct Jobs {
    send: Sender<JobReport>,
    number: u64,
    /// The latest job of each name, with its number.
    latest: HashMap<String, (u64, Arc<AtomicBool>)>,
    scratch: Arc<Scratch>,
}

/// The environment of a job.
pub(super) struct JobPlace {
    is_replaced: Arc<AtomicBool>,
    /// The folder for its files.
    pub scratch: Arc<Scratch>,
}

impl JobPlace {
    /// Whether the result of the job is no longer wanted.
    pub fn is_replaced(&self) -> bool {
        self.is_replaced.load(Ordering::Relaxed)
    }
}

impl Jobs {
    /// An empty set of jobs, and the channel of their reports.
    pub fn new() -> (Jobs, Receiver<JobReport>) {
        let (send, reports) = unbounded();
        let (latest, scratch) = (HashMap::new(), Arc::default());
        (Jobs { send, number: 0, latest, scratch }, reports)
    }

    /// The folder for the files that the editor shows.
    pub fn scratch(&self) -> &Scratch {
        &self.scratch
    }

    /// Starts a job; it replaces a running job of the same name.
    ///
    /// # Errors
    /// The system cannot create a thread for it.
    pub fn start(
        &mut self,
        name: String,
        work: impl FnOnce(&JobPlace) -> Result<Option<Made>> + Send + 'static,
    ) -> Result<()> {
        self.number += 1;
        let (number, is_replaced) = (self.number, Arc::new(AtomicBool::new(false)));
        let before = self.latest.insert(name.clone(), (number, is_replaced.clone()));
        if let Some((_, before)) = before {
            before.store(true, Ordering::Relaxed);
        }
        let (send, scratch) = (self.send.clone(), self.scratch.clone());
        let run = move || {
            let made = match work(&JobPlace { is_replaced, scratch }) {
                Ok(Some(made)) => made,
                Ok(None) => return,
                Err(failure) => Made::Failed(format!("{failure:#}")),
            };
            // If the channel is closed, the server has ended.
            let _ = send.send(JobReport { name, number, made });
        };
        let builder = thread::Builder::new().name("job".to_owned());
        builder.spawn(run).context("no thread for the command")?;
        Ok(())
    }

    /// Ends a job. Returns its result, unless the job was replaced.
    pub fn ended(&mut self, report: JobReport) -> Option<Made> {
        let (latest, _) = self.latest.get(&report.name)?;
        if *latest != report.number {
            return None;
        }
        self.latest.remove(&report.name);
        Some(report.made)
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        self.latest.values().for_each(|(_, replaced)| replaced.store(true, Ordering::Relaxed));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_start_replaces_the_first_one() {
        let (mut jobs, reports) = Jobs::new();
        let (go, wait) = unbounded::<()>();
        let failed = |words: &str| Ok(Some(Made::Failed(words.to_owned())));
        let first = move |place: &JobPlace| {
            let _ = wait.recv();
            assert!(place.is_replaced());
            failed("first")
        };
        jobs.start("a".to_owned(), first).unwrap();
        jobs.start("a".to_owned(), move |_| failed("second")).unwrap();
        jobs.start("b".to_owned(), move |_| failed("other")).unwrap();
        go.send(()).unwrap();
        let made = (0..3).filter_map(|_| jobs.ended(reports.recv().unwrap()));
        let mut told: Vec<String> = made.map(|made| format!("{made:?}")).collect();
        told.sort();
        assert_eq!(told, ["Failed(\"other\")", "Failed(\"second\")"]);
    }
}
