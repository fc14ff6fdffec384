//! The offset of local time: a thread that reads the time zone once a second.
//!
//! The zone is that of `TZ`, or else `/etc/localtime`, as for every other program. Its file is read
//! again each time, so a change of the zone, or of the rules in its file, takes effect within a
//! second. If the zone cannot be read, the last zone stays in use, or UTC if there was none.
//! `cli::when` reads the same zone for the times that a person enters.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::{Duration, SystemTime};

use tz::{TimeZone, TimeZoneSettings};

use rungd_config::load::read_bytes;
use rungd_runtime::say::say;
use rungd_runtime::wall::{OffsetChange, UtcOffset};

/// The longest time until a change of the zone is noticed.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// The time before a change of the offset at which the scan thread is informed of it.
const AHEAD_S: i64 = 3600;
/// A small stack is enough to read a small file, and locked memory is scarce.
const STACK_BYTES: usize = 256 << 10;

/// Starts the thread, which ends once nobody holds the offset. The offset is correct from the
/// start.
///
/// # Errors
/// The system cannot start a thread.
pub(super) fn keep() -> io::Result<Arc<UtcOffset>> {
    let (offset, mut keeper) = first_offset();
    let held = Arc::downgrade(&offset);
    let named = thread::Builder::new().name("rungd-zone".into()).stack_size(STACK_BYTES);
    named.spawn(move || keeper.run(&held))?;
    Ok(offset)
}

/// The offset now and until its next change, without a thread.
pub(super) fn at_start() -> Arc<UtcOffset> {
    first_offset().0
}

fn first_offset() -> (Arc<UtcOffset>, ZoneKeeper) {
    let offset = Arc::new(UtcOffset::default());
    let tz = std::env::var_os("TZ").map(|tz| tz.to_string_lossy().into_owned());
    let mut keeper = ZoneKeeper::new(tz, PathBuf::from("/etc/localtime"));
    keeper.update(&offset, now_s());
    (offset, keeper)
}

fn now_s() -> i64 {
    match SystemTime::now().duration_since(SystemTime::UNIX_EPOCH) {
        Ok(since) => since.as_secs() as i64,
        Err(before) => -(before.duration().as_secs() as i64) - 1,
    }
}

struct ZoneKeeper {
    /// `TZ`, if it is set.
    tz: Option<String>,
    localtime: PathBuf,
    zone: Option<TimeZone>,
    /// The zone could not be read at the last look.
    failing: bool,
}

impl ZoneKeeper {
    fn new(tz: Option<String>, localtime: PathBuf) -> ZoneKeeper {
        ZoneKeeper { tz, localtime, zone: None, failing: false }
    }

    fn run(&mut self, held: &Weak<UtcOffset>) {
        loop {
            thread::sleep(LOOK_EVERY);
            let Some(offset) = held.upgrade() else { return };
            self.update(&offset, now_s());
        }
    }

    fn update(&mut self, offset: &UtcOffset, now_s: i64) {
        match read_zone(self.tz.as_deref(), &self.localtime) {
            Ok(zone) => (self.zone, self.failing) = (Some(zone), false),
            // By convention, a machine without a zone is in UTC.
            Err(_) if self.zone.is_none() && self.tz.is_none() && !self.localtime.exists() => {}
            Err(error) => {
                if !self.failing {
                    let name =
                        self.tz.as_deref().map_or("/etc/localtime".into(), |tz| format!("TZ={tz}"));
                    let instead = if self.zone.is_some() { "the previous zone" } else { "UTC" };
                    say!(TIME_ZONE, "{name} gives no time zone ({error}): local time is {instead}");
                }
                self.failing = true;
            }
        }
        if let Some(zone) = &self.zone {
            offset.set(offset_s(zone, now_s), next_change(zone, now_s));
        }
    }
}

/// The zone of `TZ`, or of the machine's file; an error if the zone cannot be read.
pub(crate) fn read_zone(tz: Option<&str>, localtime: &Path) -> Result<TimeZone, tz::Error> {
    let file = |path: &str| Ok(read_bytes(Path::new(path))?);
    let Some(tz) = tz else {
        return match read_bytes(localtime) {
            Ok(bytes) => Ok(TimeZone::from_tz_data(&bytes)?),
            Err(error) => Err(tz::Error::Io(error.into())),
        };
    };
    // In `TZ=:Asia/Kathmandu` the colon marks a file. Without it the name is that of the same file.
    match tz.strip_prefix(':').unwrap_or(tz) {
        "" => Ok(TimeZone::utc()),
        tz => TimeZoneSettings::new(TimeZoneSettings::DEFAULT_DIRECTORIES, file).parse_posix_tz(tz),
    }
}

/// Local time minus UTC at a time.
pub(crate) fn offset_s(zone: &TimeZone, at_s: i64) -> i32 {
    match zone.find_local_time_type(at_s) {
        Ok(found) => found.ut_offset(),
        // A file in the old format ends with its last change: the offset after that change stays
        // valid.
        Err(_) => {
            let zone = zone.as_ref();
            let last = zone.transitions().last().map_or(0, |last| last.local_time_type_index());
            zone.local_time_types().get(last).map_or(0, |last| last.ut_offset())
        }
    }
}

/// The next change of the offset, if it is near.
fn next_change(zone: &TimeZone, now_s: i64) -> Option<OffsetChange> {
    let (before, mut from, mut to) = (offset_s(zone, now_s), now_s, now_s + AHEAD_S);
    let after = offset_s(zone, to);
    if before == after {
        return None;
    }
    while to - from > 1 {
        let middle = from + (to - from) / 2;
        if offset_s(zone, middle) == before { from = middle } else { to = middle }
    }
    Some(OffsetChange { at_s: to, offset_s: offset_s(zone, to) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The difference of a zone's local time from UTC at a time, after the thread has looked at
    /// `looked_s`.
    fn local(tz: &str, looked_s: i64, at_s: i64) -> i64 {
        let mut keeper = ZoneKeeper::new(Some(tz.to_owned()), PathBuf::new());
        let offset = UtcOffset::default();
        keeper.update(&offset, looked_s);
        assert!(!keeper.failing, "{tz}");
        offset.local_s(at_s) - at_s
    }

    const BERLIN: &str = "CET-1CEST,M3.5.0,M10.5.0/3";
    /// 2026-03-29 01:00:00 UTC: Central Europe's clocks go forward.
    const SPRING_S: i64 = 1_774_746_000;
    /// 2026-10-25 01:00:00 UTC: the clocks go back.
    const AUTUMN_S: i64 = 1_792_890_000;

    #[test]
    fn a_time_zone_is_read_from_a_file_or_a_rule() {
        for (tz, by) in [
            ("", 0),
            (":", 0),
            ("UTC0", 0),
            ("<+0545>-5:45", 20_700),
            ("EST5", -18_000),
            (BERLIN, 3600),
        ] {
            assert_eq!(local(tz, 1_795_000_000, 1_795_000_000), by, "{tz}");
        }
        if Path::new("/usr/share/zoneinfo/Asia/Kathmandu").exists() {
            for tz in ["Asia/Kathmandu", ":Asia/Kathmandu", "/usr/share/zoneinfo/Asia/Kathmandu"] {
                assert_eq!(local(tz, 1_795_000_000, 1_795_000_000), 20_700, "{tz}");
            }
        }
    }

    #[test]
    fn summer_time_begins_and_ends_at_its_exact_second() {
        for ahead_s in [1, 2, 59, 3599, 3600] {
            for (change_s, before, after) in [(SPRING_S, 3600, 7200), (AUTUMN_S, 7200, 3600)] {
                let looked_s = change_s - ahead_s;
                assert_eq!(local(BERLIN, looked_s, change_s - 1), before);
                assert_eq!(local(BERLIN, looked_s, change_s), after);
                assert_eq!(local(BERLIN, change_s, change_s + 3600), after);
            }
        }
    }

    #[test]
    fn a_changed_zone_file_is_read_again_and_a_lost_one_is_ignored() {
        let zones = Path::new("/usr/share/zoneinfo");
        let folder = std::env::temp_dir().join(format!("rungd-zone-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let localtime = folder.join("localtime");
        let mut keeper = ZoneKeeper::new(None, localtime.clone());
        let offset = UtcOffset::default();
        let mut local = |now_s: i64| {
            keeper.update(&offset, now_s);
            (offset.local_s(now_s) - now_s, keeper.failing)
        };
        assert_eq!(local(1_795_000_000), (0, false));
        std::fs::write(&localtime, "no time zone").unwrap();
        assert_eq!(local(1_795_000_000), (0, true));
        for (zone, by) in [("Asia/Kathmandu", 20_700), ("America/Lima", -18_000)] {
            if zones.join(zone).exists() {
                std::fs::copy(zones.join(zone), &localtime).unwrap();
                assert_eq!(local(1_795_000_000), (by, false));
                std::fs::remove_file(&localtime).unwrap();
                assert_eq!(local(1_795_000_000), (by, true));
            }
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
