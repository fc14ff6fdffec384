//! The restart guard: after too many unclean restarts, the controller starts in STOP.
//!
//! A small file counts the starts that followed an unclean end. An end is unclean if the process
//! crashed or was killed, by the watchdog or otherwise. After ten such starts without ten healthy
//! minutes in RUN between them, the controller starts in STOP: a machine that runs and drops out
//! every few seconds does more harm than a machine at rest.
//!
//! The file is in `$RUNTIME_DIRECTORY`. systemd keeps that directory when it restarts the service,
//! but not over a stop or a reboot. So a power cut does not count: it does not indicate a bad
//! program. A problem with the file is logged, and never prevents a start.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rungd_base::directories;
use rungd_base::duration_text::duration_text;
use rungd_runtime::exchange::Mode;
use rungd_runtime::say::say;

/// The number of restarts that leads to STOP.
const RESTARTS_MAX: u32 = 10;
/// The file's name in the directory that systemd gives.
const FILE_NAME: &str = "restarts";
const FILE_BYTES_MAX: u64 = 200;
/// The longest time that `end` waits for a write in progress.
const WRITE_PATIENCE: Duration = Duration::from_millis(200);

/// The guard of one process.
pub struct RestartGuard {
    /// `None`: restarts are not counted.
    file: Option<PathBuf>,
    restarts: u32,
    healthy: HealthyTime,
    writing: Option<JoinHandle<()>>,
}

/// How a process ended, as reported by the process itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessEnd {
    /// On request: the count starts again at 0.
    Orderly,
    /// By its own decision, with the reason in the log: not counted.
    Refused,
    /// By a bug: counted like a crash.
    Crashed,
}

/// The content of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct RestartCount {
    restarts: u32,
    /// True while a process runs, and after a process that did not write its end.
    running: bool,
}

/// The duration of RUN, measured by the pulses of the scan thread.
#[derive(Debug)]
struct HealthyTime {
    enough: Duration,
    /// The time of the first pulse in this RUN. `pulses` is the last number seen. `reached`: RUN
    /// has lasted `enough`.
    since: Option<Duration>,
    pulses: u64,
    reached: bool,
}

/// The default file, in the directory that systemd gives; `None` if it gives none.
pub fn file_of_environment() -> Option<PathBuf> {
    let folder = directories::runtime().or_else(directories::state)?;
    Some(folder.join(FILE_NAME))
}

impl RestartGuard {
    /// Counts this start. `healthy` is the time in RUN after which the count starts again at 0.
    pub fn begin(file: Option<PathBuf>, healthy: Duration) -> RestartGuard {
        let healthy = HealthyTime { enough: healthy, since: None, pulses: 0, reached: false };
        let mut guard = RestartGuard { file, restarts: 0, healthy, writing: None };
        let Some(file) = &guard.file else { return guard };
        if let Err(why) = may_be_ours(file) {
            let file = file.display();
            say!(RESTART_GUARD_FILE, "restarts are not counted: {file} is left as it is: {why}");
            guard.file = None;
            return guard;
        }
        let before = read(file).unwrap_or_else(|why| {
            let file = file.display();
            say!(
                RESTART_GUARD_FILE,
                "the count of restarts in {file} is lost: {why}; it starts again at 0"
            );
            RestartCount::default()
        });
        let restarts = before.restarts.saturating_add(u32::from(before.running));
        if let Err(why) = write(file, RestartCount { restarts, running: true }) {
            let file = file.display();
            say!(RESTART_GUARD_FILE, "restarts are not counted: {file} cannot be written: {why}");
            guard.file = None;
            return guard;
        }
        guard.restarts = restarts;
        guard.log_restarts(before.running);
        guard
    }

    /// Whether this start must begin in STOP.
    pub fn trips(&self) -> bool {
        self.restarts >= RESTARTS_MAX
    }

    fn log_restarts(&self, unclean: bool) {
        let (restarts, healthy) =
            (self.restarts, duration_text(self.healthy.enough.as_nanos() as u64));
        if self.trips() {
            say!(
                RESTART_GUARD,
                restarts,
                "{restarts} restarts after unclean ends, without {healthy} in RUN between them: \
                 starting in STOP. The log before each start has the cause"
            );
        } else if unclean {
            say!(
                RESTART_COUNTED,
                restarts,
                "the process before this one was killed or crashed: restart {restarts} of \
                 {RESTARTS_MAX} without {healthy} in RUN between them; at restart {RESTARTS_MAX}, \
                 rungd starts in STOP"
            );
        }
    }

    /// Checks whether RUN has lasted long enough. `now` counts from any fixed moment. Never waits.
    pub(super) fn look(&mut self, now: Duration, mode: Mode, pulses: u64) {
        let Some(file) = &self.file else { return };
        if !self.healthy.look(now, mode, pulses) || self.restarts == 0 {
            return;
        }
        self.restarts = 0;
        let healthy = duration_text(self.healthy.enough.as_nanos() as u64);
        say!(RESTART_GUARD_RESET, "{healthy} in RUN: the count of restarts starts again at 0");
        let file = file.clone();
        // A separate thread writes: the caller also feeds systemd's watchdog and must not wait.
        let named = thread::Builder::new().name("rungd-guard".into());
        self.writing = named
            .spawn(move || {
                if let Err(why) = write(&file, RestartCount { restarts: 0, running: true }) {
                    let file = file.display();
                    say!(RESTART_GUARD_FILE, "{file} cannot be written: {why}");
                }
            })
            .ok();
    }

    /// Records the end of the process in the file.
    pub fn end(self, how: ProcessEnd) {
        let Some(file) = self.file else { return };
        if let Some(writing) = self.writing {
            let until = Instant::now() + WRITE_PATIENCE;
            while !writing.is_finished() && Instant::now() < until {
                thread::sleep(Duration::from_millis(1));
            }
        }
        let done = match how {
            ProcessEnd::Orderly => match fs::remove_file(&file) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
                done => done,
            },
            ProcessEnd::Refused => {
                write(&file, RestartCount { restarts: self.restarts, running: false })
            }
            ProcessEnd::Crashed => Ok(()),
        };
        if let Err(why) = done {
            let file = file.display();
            say!(
                RESTART_GUARD_FILE,
                "this end is counted as unclean: {file} cannot be written: {why}"
            );
        }
    }
}

impl HealthyTime {
    /// True once, when RUN has lasted long enough.
    fn look(&mut self, now: Duration, mode: Mode, pulses: u64) -> bool {
        let grown = pulses > self.pulses;
        self.pulses = pulses;
        if mode != Mode::Run {
            (self.since, self.reached) = (None, false);
        } else if grown {
            let since = *self.since.get_or_insert(now);
            let was = std::mem::replace(&mut self.reached, now >= since + self.enough);
            return self.reached && !was;
        }
        false
    }
}

/// Refuses a path at which there is something that the guard did not write: a device, a pipe, a
/// folder, a link or a longer text. Since the command line can name any path, the guard could
/// otherwise overwrite and remove it.
fn may_be_ours(file: &Path) -> io::Result<()> {
    match fs::symlink_metadata(file) {
        Ok(meta) if !meta.is_file() => Err(io::Error::other("it is no file")),
        Ok(meta) if meta.len() > FILE_BYTES_MAX => Err(io::Error::other("it holds something else")),
        // Any other error occurs again when the file is read or written, and is reported there.
        _ => Ok(()),
    }
}

/// Reads the count; a missing file counts as 0. `O_NONBLOCK`: a pipe or a device in the file's
/// place does not delay the start.
fn read(file: &Path) -> io::Result<RestartCount> {
    let mut options = File::options();
    let file = match options.read(true).custom_flags(libc::O_NONBLOCK).open(file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(RestartCount::default()),
        file => file?,
    };
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is no file"));
    }
    let mut text = String::new();
    file.take(FILE_BYTES_MAX).read_to_string(&mut text)?;
    parse(&text).ok_or_else(|| io::Error::other("it is not what rungd wrote"))
}

/// Writes a new file beside the old one, then renames it. If the process is killed meanwhile, one
/// of the two counts is left whole.
fn write(file: &Path, count: RestartCount) -> io::Result<()> {
    let mut beside = file.as_os_str().to_owned();
    beside.push(".new");
    let beside = PathBuf::from(beside);
    // Removes anything that has this name, even a link or a pipe.
    let _ = fs::remove_file(&beside);
    let mut new = File::options().write(true).create_new(true).mode(0o644).open(&beside)?;
    new.write_all(text(count).as_bytes())?;
    drop(new);
    fs::rename(&beside, file)
}

fn text(count: RestartCount) -> String {
    let state = if count.running { "running" } else { "ended" };
    format!("restarts={} process={state}\n", count.restarts)
}

fn parse(text: &str) -> Option<RestartCount> {
    let (restarts, state) = text.strip_prefix("restarts=")?.split_once(" process=")?;
    let running = match state {
        "running\n" => true,
        "ended\n" => false,
        _ => return None,
    };
    Some(RestartCount { restarts: restarts.parse().ok()?, running })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_runtime::exchange::StopReason;

    const HEALTHY: Duration = Duration::from_secs(600);

    /// A file that is removed when this value is dropped.
    struct TemporaryFile(PathBuf);

    impl AsRef<Path> for TemporaryFile {
        fn as_ref(&self) -> &Path {
            &self.0
        }
    }

    impl Drop for TemporaryFile {
        fn drop(&mut self) {
            let _ = fs::remove_file(&self.0);
        }
    }

    fn place(name: &str) -> TemporaryFile {
        let name = format!("rungd-guard-{}-{name}", std::process::id());
        TemporaryFile(std::env::temp_dir().join(name))
    }

    fn start(file: impl AsRef<Path>) -> RestartGuard {
        RestartGuard::begin(Some(file.as_ref().to_owned()), HEALTHY)
    }

    fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn the_tenth_restart_after_unclean_ends_and_later_ones_are_in_stop() {
        let file = place("tenth");
        let trips: Vec<bool> = (0..13).map(|_| start(&file).trips()).collect();
        assert_eq!(trips.iter().position(|trips| *trips), Some(10));
        assert_eq!(trips.iter().filter(|trips| **trips).count(), 3);
    }

    #[test]
    fn an_orderly_end_resets_the_count_and_a_refused_start_does_not_change_it() {
        let file = place("ends");
        (0..6).for_each(|_| drop(start(&file)));
        start(&file).end(ProcessEnd::Refused);
        let next = start(&file);
        assert_eq!(next.restarts, 6);
        next.end(ProcessEnd::Crashed);
        let next = start(&file);
        assert_eq!(next.restarts, 7);
        next.end(ProcessEnd::Orderly);
        assert!(!file.0.exists());
        assert_eq!(start(&file).restarts, 0);
    }

    #[test]
    fn healthy_minutes_of_scans_in_run_reset_the_count() {
        let file = place("healthy");
        (0..6).for_each(|_| drop(start(&file)));
        let mut guard = start(&file);
        guard.look(s(1), Mode::Run, 1);
        guard.look(s(500), Mode::Stop(StopReason::Operator), 2);
        guard.look(s(501), Mode::Run, 3);
        guard.look(s(1000), Mode::Run, 4);
        assert_eq!(guard.restarts, 6, "RUN was left in between");
        guard.look(s(1101), Mode::Run, 4);
        assert_eq!(guard.restarts, 6, "no scan was seen");
        guard.look(s(1101), Mode::Run, 5);
        assert_eq!(guard.restarts, 0);
        guard.writing.take().unwrap().join().unwrap();
        assert_eq!(read(&file.0).unwrap(), RestartCount { restarts: 0, running: true });
    }

    #[test]
    fn no_damaged_guard_file_prevents_a_start() {
        let file = place("bad");
        for text in ["", "restarts=", "restarts=7", "restarts=-1 process=ended\n", "\u{0}\u{0}"] {
            fs::write(&file, text).unwrap();
            assert_eq!(start(&file).restarts, 0, "{text:?}");
        }
        fs::write(&file, [0xFF; 4096]).unwrap();
        assert!(!start(&file).trips());
        fs::write(&file, "restarts=4294967295 process=running\n").unwrap();
        assert!(start(&file).trips());
        fs::remove_file(&file).unwrap();
        fs::create_dir_all(&file).unwrap();
        let guard = start(&file);
        assert_eq!((guard.file.is_none(), guard.trips()), (true, false), "it is a folder");
        fs::remove_dir(&file).unwrap();
        let nowhere = start(Path::new("/nonexistent/restarts"));
        assert!(nowhere.file.is_none() && !nowhere.trips());
        assert!(!RestartGuard::begin(None, HEALTHY).trips());
    }

    #[test]
    fn files_of_other_programs_are_not_changed() {
        let (file, target) = (place("else"), place("target"));
        fs::write(&file, "x".repeat(300)).unwrap();
        start(&file).end(ProcessEnd::Orderly);
        assert_eq!(fs::read_to_string(&file).unwrap().len(), 300);
        fs::remove_file(&file).unwrap();
        fs::write(&target, "precious").unwrap();
        std::os::unix::fs::symlink(&target, &file).unwrap();
        start(&file).end(ProcessEnd::Orderly);
        assert!(fs::symlink_metadata(&file).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "precious");
        fs::remove_file(&file).unwrap();
        let socket = std::os::unix::net::UnixListener::bind(&file).unwrap();
        start(&file).end(ProcessEnd::Orderly);
        assert!(file.0.exists(), "as a device would be");
        drop(socket);
        fs::remove_file(&file).unwrap();
        // The guard's temporary file does not overwrite another file either.
        let (named, other) = (place("count.txt"), place("count.new"));
        fs::write(&other, "precious").unwrap();
        start(&named).end(ProcessEnd::Orderly);
        assert_eq!(fs::read_to_string(&other).unwrap(), "precious");
    }

    #[test]
    fn a_written_count_is_read_back() {
        for count in [RestartCount::default(), RestartCount { restarts: 7, running: true }] {
            assert_eq!(parse(&text(count)), Some(count));
        }
    }
}
