//! Retentive memory at the start: opens the file, restores the newest image, and logs both.
//!
//! `start_parts` calls [`begin`] before the first scan; the shell hands the result to
//! `retain_thread`. The content of the file, and the way to write it, are in `rungd_state::retain`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::failure::StartFailure;
use rungd_base::directories;
use rungd_base::faults::{self, FaultPoint};
use rungd_base::wall_clock::{now_ms, now_ns};
use rungd_engine::Engine;
use rungd_runtime::exchange::StopReason;
use rungd_runtime::say::say;
use rungd_state::retain::format::{FLAG_FINAL, ImageStamp};
use rungd_state::retain::keeper::{FileNews, StartResult};
use rungd_state::retain::plan::Restoration;
use rungd_state::retain::show::utc;
use rungd_state::retain::{Keeper, RetainPlan};

/// How to run a controller without an operator's socket if nothing was restored.
pub(super) const COLD_BY_HAND: &str = "stop this process, then start it once with `rungd run \
    --cold-start run FILE`, or with `[retain] cold-start = \"run\"`: there is no operator's socket \
    for `rungd mode run`";
/// The greatest number of log lines about elements that were not restored.
const DROPPED_LINES_MAX: usize = 100;
const NO_STOP: &str = "and no orderly stop followed, so everything with termination logic is \
                       terminated";
/// The file's name in systemd's state directory, and its extension beside a controller file.
const FILE_NAME: &str = "retain";

/// The settings of retentive memory, from the controller file.
#[derive(Clone, Debug)]
pub(super) struct RetainSettings {
    pub path: PathBuf,
    pub plan: RetainPlan,
    pub interval: Duration,
    pub runs_cold: bool,
    /// Whether an operator can run a controller that waits in STOP; set at the start.
    pub has_operator: bool,
    /// The limit of bytes written per day.
    pub budget: u64,
}

/// The open file, and the result of its restoration.
pub(super) struct RestoredFile {
    pub keeper: Keeper,
    pub wanted: RetainSettings,
    /// A sentence about what was restored, for the status.
    pub restored: String,
    /// The reason why the controller starts in STOP; `None` if it may run.
    pub cold: Option<StopReason>,
    /// Whether the next start would find nothing to restore either.
    pub nothing_kept: NothingKept,
}

impl RestoredFile {
    /// The reason for a start in STOP, and whether the next start would find nothing to restore.
    pub fn outlook(&self) -> (Option<StopReason>, NothingKept) {
        (self.cold, self.nothing_kept.clone())
    }
}

/// Whether a restart would wait in STOP, because nothing was restored at the start, and no image
/// has been kept since. `retain_thread` changes it, the log's remedies depend on it.
#[derive(Clone, Debug, Default)]
pub(super) struct NothingKept {
    is_so: Arc<AtomicBool>,
    /// Whether an image could not be written.
    fails: Arc<AtomicBool>,
}

impl NothingKept {
    pub fn new(is_so: bool) -> NothingKept {
        NothingKept { is_so: Arc::new(AtomicBool::new(is_so)), fails: Arc::default() }
    }

    /// Notes that an image is durable.
    pub fn kept(&self) {
        self.is_so.store(false, Ordering::Release);
    }

    /// Notes that an image could not be written.
    pub fn failed(&self) {
        self.fails.store(true, Ordering::Release);
    }

    /// Whether it is so after this number of complete scans. A complete scan has an image, which is
    /// kept at the end of the process at the latest, unless the disk fails.
    pub fn after(&self, scans: u64) -> bool {
        self.is_so.load(Ordering::Acquire) && (scans == 0 || self.fails.load(Ordering::Acquire))
    }
}

/// The path of the file: the path that the controller file sets (relative to itself), else a file
/// in systemd's state directory, else a file beside the controller file.
pub(super) fn place(file: Option<&str>, controller: &Path) -> PathBuf {
    if let Some(file) = file {
        return controller.parent().unwrap_or(Path::new("")).join(file);
    }
    directories::state_file(FILE_NAME, controller)
}

/// Opens the file and restores its newest image, before the first scan.
///
/// # Errors
/// A different process owns the file.
pub(super) fn begin(
    wanted: &RetainSettings,
    engine: &mut Engine,
) -> Result<RestoredFile, StartFailure> {
    let path = wanted.path.display();
    faults::point(FaultPoint::RetainOpen);
    let opened = Keeper::open(&wanted.path, wanted.plan.clone(), new_id());
    let (keeper, StartResult { image, news }) = opened.map_err(|error| {
        StartFailure::Environment(anyhow::anyhow!(
            "{path}: {error}: each controller needs its own file: set `[retain] file`"
        ))
    })?;
    news.iter().for_each(|news| tell_news(&wanted.path, news));
    let (restored, cold) = match image {
        Ok((stamp, restoration)) if restoration.restored == 0 => {
            tell_dropped(&restoration);
            let (image, scan) = (stamp.sequence, stamp.scan);
            let why = format!(
                "image {image} of scan {scan} is whole, but nothing in it matches what is retained \
                 now"
            );
            (tell_cold(wanted, &why), Some(StopReason::NothingRestored))
        }
        Ok((stamp, restoration)) => (restore(engine, wanted, stamp, &restoration), None),
        Err(why) => (tell_cold(wanted, &why), Some(StopReason::NothingRestored)),
    };
    let cold = cold.filter(|_| !wanted.runs_cold);
    let nothing_kept = NothingKept::new(cold.is_some());
    Ok(RestoredFile { keeper, wanted: wanted.clone(), restored, cold, nothing_kept })
}

fn restore(
    engine: &mut Engine,
    wanted: &RetainSettings,
    stamp: ImageStamp,
    what: &Restoration,
) -> String {
    what.puts.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
    let is_final = stamp.flags & FLAG_FINAL != 0;
    if !is_final {
        engine.terminate_all();
    }
    engine.put_down_seconds(stamp.down_seconds(now_ms()));
    let end = match what.terminated {
        _ if is_final => "after an orderly stop".to_owned(),
        0 => NO_STOP.to_owned(),
        count => format!(
            "{NO_STOP}: {count} of them are OFF or 0, according to the program of that time"
        ),
    };
    let text = format!(
        "{} of {} elements restored: image {} of scan {}, kept at {} {end}",
        what.restored,
        wanted.plan.elements(),
        stamp.sequence,
        stamp.scan,
        utc(stamp.saved_ms)
    );
    say!(
        RETAIN_RESTORED,
        file = %wanted.path.display(),
        restored = what.restored,
        dropped = what.dropped.len(),
        fresh = what.fresh,
        terminated = what.terminated,
        image = stamp.sequence,
        scan = stamp.scan,
        orderly = is_final,
        "retentive memory: {text}"
    );
    for note in &what.notes {
        say!(RETAIN_RESTORED, "retentive memory: {note}");
    }
    tell_dropped(what);
    text
}

fn tell_dropped(what: &Restoration) {
    for dropped in what.dropped.iter().take(DROPPED_LINES_MAX) {
        say!(
            RETAIN_DROPPED,
            what = %dropped.what,
            why = %dropped.why,
            "retentive memory: {} is not restored: {}",
            dropped.what,
            dropped.why
        );
    }
    if let Some(more) = what.dropped.len().checked_sub(DROPPED_LINES_MAX).filter(|more| *more > 0) {
        say!(RETAIN_DROPPED, more, "retentive memory: {more} more are not restored");
    }
}

fn tell_cold(wanted: &RetainSettings, why: &str) -> String {
    let path = wanted.path.display();
    if wanted.runs_cold {
        say!(
            RETAIN_COLD at Warn,
            file = %path,
            why,
            "retentive memory: nothing is restored, memory is as after a cold start: {path}: \
             {why}. `[retain] cold-start` or `--cold-start` lets the controller run"
        );
    } else {
        say!(
            RETAIN_COLD,
            file = %path,
            why,
            "retentive memory: nothing is restored, memory is as after a cold start, and the mode \
             is STOP: {path}: {why}. Find the cause, unless this is the first start. To run \
             without the lost memory, {steps}",
            steps = steps(wanted)
        );
    }
    format!("nothing restored: {why}")
}

/// How to run a controller that found nothing to restore, with the values that matter. In STOP it
/// refuses `write`, and a restart alone does not make it run.
fn steps(wanted: &RetainSettings) -> String {
    if wanted.has_operator {
        let steps =
            "force the values that matter, then `rungd mode run`, then `rungd unforce --all`";
        return steps.to_owned();
    }
    format!("give the values that matter as `initial` in the ladder, then {COLD_BY_HAND}")
}

fn tell_news(path: &Path, news: &FileNews) {
    let path = path.display();
    match news {
        FileNews::Slot(slot, bad) => say!(
            RETAIN_SLOT,
            file = %path,
            slot,
            why = %bad,
            "retentive memory: slot {slot} of {path} is skipped: {bad}"
        ),
        FileNews::Aside(aside) => say!(
            RETAIN_ASIDE,
            file = %path,
            aside = %aside.display(),
            "retentive memory: {path} is kept: it was renamed to {}",
            aside.display()
        ),
        FileNews::Made(geometry) => say!(
            RETAIN_MADE,
            file = %path,
            bytes = geometry.file_bytes(),
            "retentive memory: {path} is made: {} slots of {} bytes",
            geometry.slots,
            geometry.slot_bytes
        ),
        FileNews::NotWritable(why) => say!(
            RETAIN_FAILED,
            file = %path,
            why = %why,
            "retentive memory: {path} cannot be written, and a restart would lose all later \
             changes: {why}. rungd tries again"
        ),
    }
}

/// A new id for a file, different from the ids of all other files.
fn new_id() -> u64 {
    now_ns() as u64 ^ u64::from(std::process::id()) << 40
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_counts_as_kept_until_an_image_exists_or_will_be_written() {
        let nothing = NothingKept::new(true);
        assert_eq!((nothing.after(0), nothing.after(1)), (true, false), "the end keeps scan 1");
        nothing.failed();
        assert_eq!((nothing.after(0), nothing.after(1)), (true, true), "the disk fails");
        nothing.clone().kept();
        assert_eq!((nothing.after(0), nothing.after(1)), (false, false));
        let restored = NothingKept::default();
        restored.failed();
        assert_eq!((restored.after(0), restored.after(1)), (false, false));
    }
}
