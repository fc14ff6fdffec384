//! Jobs: commands that take time. Each job runs on its own thread, so that the server continues to
//! answer.
//!
//! `commands` starts jobs, `server` receives their reports. A new job replaces a running job of the
//! same name: the report of the replaced job is dropped, and that job ends as soon as it checks
//! [`JobPlace::is_replaced`].

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, Sender, unbounded};

use super::scratch::Scratch;
#[cfg(feature = "prove")]
use super::survey_hints::SurveyHints;
use super::test_results::{FileResults, TestedTexts, are_present};

/// The result of a job.
#[derive(Debug)]
pub(super) enum JobResult {
    /// A file to show; `true`: in the desktop's program for it.
    Document(PathBuf, bool),
    /// The verdicts of tests.
    Tests(FileResults),
    /// What a survey has found.
    #[cfg(feature = "prove")]
    Survey(SurveyHints),
    /// The job failed, for this reason.
    Failed(String),
}

/// A report of a job.
#[derive(Debug)]
pub(super) struct JobReport {
    name: String,
    number: u64,
    /// The result of the job.
    pub made: JobResult,
}

/// The jobs of a server.
#[derive(Debug)]
pub(super) struct Jobs {
    send: Sender<JobReport>,
    number: u64,
    /// The latest job of each name.
    latest: HashMap<String, RunningJob>,
    scratch: Arc<Scratch>,
}

/// What the result of a job is about. The job ends if it changes, since nobody wants the result
/// then: a test may run without end.
#[derive(Debug, Default)]
pub(super) struct JobSubject {
    /// The file for which the command was given; `None` if the job depends on no file.
    pub path: Option<PathBuf>,
    /// The texts that the job reads.
    pub texts: TestedTexts,
}

/// A job that has not reported.
#[derive(Debug)]
struct RunningJob {
    number: u64,
    is_replaced: Arc<AtomicBool>,
    subject: JobSubject,
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

    /// The flag behind [`JobPlace::is_replaced`].
    pub fn flag(&self) -> &AtomicBool {
        &self.is_replaced
    }

    /// The same flag, for threads that may outlive the place.
    #[cfg(feature = "prove")]
    pub fn shared_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.is_replaced)
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
        subject: JobSubject,
        work: impl FnOnce(&JobPlace) -> Result<Option<JobResult>> + Send + 'static,
    ) -> Result<()> {
        self.number += 1;
        let (number, is_replaced) = (self.number, Arc::new(AtomicBool::new(false)));
        let job = RunningJob { number, is_replaced: is_replaced.clone(), subject };
        if let Some(before) = self.latest.insert(name.clone(), job) {
            before.is_replaced.store(true, Ordering::Relaxed);
        }
        let (send, scratch) = (self.send.clone(), self.scratch.clone());
        let run = move || {
            let made = match work(&JobPlace { is_replaced, scratch }) {
                Ok(Some(made)) => made,
                Ok(None) => return,
                Err(failure) => JobResult::Failed(format!("{failure:#}")),
            };
            // If the channel is closed, the server has ended.
            let _ = send.send(JobReport { name, number, made });
        };
        let builder = thread::Builder::new().name("job".to_owned());
        builder.spawn(run).context("no thread for the command")?;
        Ok(())
    }

    /// Ends a job. Returns its result, unless the job was replaced.
    pub fn ended(&mut self, report: JobReport) -> Option<JobResult> {
        if self.latest.get(&report.name)?.number != report.number {
            return None;
        }
        self.latest.remove(&report.name);
        Some(report.made)
    }

    /// Ends the jobs whose texts have changed. `text`: the present text of a file.
    pub fn keep(&mut self, text: impl Fn(&Path) -> Option<Arc<str>>) {
        self.end(|subject| !are_present(&subject.texts, &text));
    }

    /// Ends the jobs of a file that the editor has closed.
    pub fn closed(&mut self, path: &Path) {
        self.end(|subject| subject.path.as_deref() == Some(path));
    }

    fn end(&mut self, is_over: impl Fn(&JobSubject) -> bool) {
        self.latest.retain(|_, job| {
            let ends = is_over(&job.subject);
            job.is_replaced.fetch_or(ends, Ordering::Relaxed);
            !ends
        });
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        self.end(|_| true);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_job::{self, TestOrder};
    use super::*;

    #[test]
    fn a_second_start_replaces_the_first_one() {
        let (mut jobs, reports) = Jobs::new();
        let (go, wait) = unbounded::<()>();
        let failed = |words: &str| Ok(Some(JobResult::Failed(words.to_owned())));
        let first = move |place: &JobPlace| {
            let _ = wait.recv();
            assert!(place.is_replaced());
            failed("first")
        };
        jobs.start("a".to_owned(), JobSubject::default(), first).unwrap();
        jobs.start("a".to_owned(), JobSubject::default(), move |_| failed("second")).unwrap();
        jobs.start("b".to_owned(), JobSubject::default(), move |_| failed("other")).unwrap();
        go.send(()).unwrap();
        let made = (0..3).filter_map(|_| jobs.ended(reports.recv().unwrap()));
        let mut told: Vec<String> = made.map(|made| format!("{made:?}")).collect();
        told.sort();
        assert_eq!(told, ["Failed(\"other\")", "Failed(\"second\")"]);
    }

    /// A ladder and a test that would take weeks.
    const LADDER: &str = "[[program]]\nname = \"Main\"\n\
                          rung = [{ when = [\"X0\"], do = [\"OUT Y0\"] }]\n";
    const ENDLESS: &str = "ladder = [\"a.toml\"]\n\n[[scenario]]\nname = \"one\"\n\
                           steps = [\"run 500h\", \"expect: Y0\"]\n\n[[random]]\nname = \"two\"\n\
                           runs = 1000000\nscans = 1000000\nchange.X0 = \"1 %\"\n";

    #[test]
    fn a_running_test_ends_when_its_text_changes_or_closes() {
        let scratch = Scratch::default();
        scratch.write("a.toml", LADDER.as_bytes()).unwrap();
        let path = scratch.write("a.test.toml", ENDLESS.as_bytes()).unwrap();
        let (mut jobs, _reports) = Jobs::new();
        let ends: [&dyn Fn(&mut Jobs); 2] =
            [&|jobs| jobs.keep(|_| Some(Arc::from("changed"))), &|jobs| jobs.closed(&path)];
        for end in ends {
            for test in ["one", "two"] {
                let texts: TestedTexts = vec![(path.clone(), Arc::from(ENDLESS))];
                let subject = JobSubject { path: Some(path.clone()), texts: texts.clone() };
                let open = rungd_config::load::OpenTexts::default();
                let order = TestOrder { path: path.clone(), test: Some(test.into()), open, texts };
                let (tell, told) = unbounded();
                let work = move |place: &JobPlace| {
                    let _ = tell.send(None);
                    let made = test_job::run(order, place);
                    let _ = tell.send(Some(format!("{made:?}")));
                    Ok(None)
                };
                jobs.start("test".to_owned(), subject, work).unwrap();
                assert_eq!(told.recv().unwrap(), None);
                jobs.keep(|_| Some(Arc::from(ENDLESS)));
                jobs.closed(Path::new("/other.toml"));
                let still = told.recv_timeout(std::time::Duration::from_millis(50));
                assert!(still.is_err(), "{test}: {still:?}");
                end(&mut jobs);
                let patience = std::time::Duration::from_secs(300);
                assert_eq!(told.recv_timeout(patience).unwrap().unwrap(), "Ok(None)", "{test}");
            }
        }
    }
}
