//! `[record]`: its keys, and the settings made from them. Only run time shows whether the folder
//! can be made and has room.

use rungd_engine::isa::duration;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};

/// `[record]`.
#[derive(Clone, Debug, Default)]
pub struct WrittenRecord {
    /// `enabled`: whether rungd records on disk, if a folder is named.
    pub(crate) enabled: Option<bool>,
    /// `dir`: the folder, relative to the controller file.
    pub(crate) dir: Option<Text>,
    /// `keep`: the age at which a recording is removed.
    pub(crate) keep: Option<Text>,
    /// `size`: the most bytes on disk.
    pub(crate) size: Option<Text>,
    /// `memory`: the most bytes of the last minute.
    pub(crate) memory: Option<Text>,
}

/// The settings of the scan log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordSettings {
    /// Whether rungd records on disk, if a folder is named.
    pub enabled: bool,
    /// The folder, relative to the controller file; if not given, the folder of the command line.
    pub dir: Option<String>,
    /// The age at which a recording is removed, seconds.
    pub keep_s: u64,
    /// The most bytes on disk.
    pub size_bytes: u64,
    /// The most bytes of the last minute in memory.
    pub memory_bytes: u64,
}

const MB: u64 = 1_000_000;
const HOUR_S: u64 = 3600;
const DAY_S: u64 = 24 * HOUR_S;
/// The least and the greatest age: a minute, and ten years.
const KEEP_S: (u64, u64) = (60, 3660 * DAY_S);
const SIZE_BYTES: (u64, u64) = (MB, 1_000_000 * MB);
const MEMORY_BYTES: (u64, u64) = (MB, 4_000 * MB);

impl Default for RecordSettings {
    fn default() -> Self {
        RecordSettings {
            enabled: true,
            dir: None,
            keep_s: DAY_S,
            size_bytes: 256 * MB,
            memory_bytes: 16 * MB,
        }
    }
}

/// Reads `[record]`, if there is one.
pub(super) fn read_in(root: &mut Table<'_>) -> WrittenRecord {
    let explained = key("record", "The scan log: the inputs of each scan, for `rungd why`.");
    root.table(explained, "`[record]`").map_or_else(WrittenRecord::default, read)
}

fn read(mut table: Table<'_>) -> WrittenRecord {
    let record = WrittenRecord {
        enabled: table
            .boolean(key("enabled", "Whether rungd records on disk; true if not given."))
            .map(|enabled| enabled.value),
        dir: table.string(key(
            "dir",
            "The folder, relative to this file; if not given, that of `rungd run --record`.",
        )),
        keep: table.string(
            key("keep", "The age at which a recording is removed; \"24h\" if not given.")
                .limited(r#"{"pattern":"^[0-9]+d$|^([0-9]+(h|m|s|ms))+$"}"#),
        ),
        size: table.string(
            key("size", "The most that it takes on disk; \"256MB\" if not given.").limited(SIZE),
        ),
        memory: table.string(
            key("memory", "The most that the last minute takes in memory; \"16MB\" if not given.")
                .limited(SIZE),
        ),
    };
    table.finish();
    record
}

/// A JSON Schema: a number of bytes.
const SIZE: &str = r#"{"pattern":"^[0-9]+(kB|MB|GB)$"}"#;

/// Makes the settings from the keys, with a finding for each wrong value.
pub(super) fn resolve(written: &WrittenRecord, findings: &mut Vec<Finding>) -> RecordSettings {
    let default = RecordSettings::default();
    if let Some(dir) = &written.dir
        && (dir.text.is_empty() || dir.text.contains('\0'))
    {
        let finding = Finding::new(Code::Controller, dir.span, "recordings are kept in a folder");
        findings.push(finding.help("write `dir = \"/var/lib/rungd/record\"`"));
    }
    let mut limited = |given: &Option<Text>, default: u64, of: &Measure| {
        let Some(text) = given else { return default };
        match (of.parse)(&text.text) {
            Some(value) if (of.limits.0..=of.limits.1).contains(&value) => value,
            Some(_) => {
                let message = format!("`{}` is {}", text.text, of.beyond);
                let finding = Finding::new(Code::Controller, text.span, message);
                findings.push(finding.help(of.help));
                default
            }
            None => {
                let message = format!("`{}` is {}", text.text, of.no_form);
                let finding = Finding::new(Code::Controller, text.span, message);
                let whole = duration::of_fraction(&text.text).filter(|_| of.takes_durations);
                let help = whole.map_or(of.help.to_owned(), |text| format!("write `\"{text}\"`"));
                findings.push(finding.help(help));
                default
            }
        }
    };
    RecordSettings {
        enabled: written.enabled.unwrap_or(default.enabled),
        dir: written.dir.as_ref().map(|dir| dir.text.clone()),
        keep_s: limited(&written.keep, default.keep_s, &AGE),
        size_bytes: limited(&written.size, default.size_bytes, &ON_DISK),
        memory_bytes: limited(&written.memory, default.memory_bytes, &IN_MEMORY),
    }
}

/// How a value is read and limited, and the words of the findings for a wrong value.
struct Measure {
    parse: fn(&str) -> Option<u64>,
    limits: (u64, u64),
    no_form: &'static str,
    /// Whether it is a duration, which is written in whole numbers.
    takes_durations: bool,
    beyond: &'static str,
    help: &'static str,
}

const AGE: Measure = Measure {
    parse: age_s,
    limits: KEEP_S,
    no_form: "no time",
    takes_durations: true,
    beyond: "not between a minute and ten years",
    help: "write hours or days: `keep = \"24h\"`, `keep = \"30d\"`",
};
const ON_DISK: Measure = Measure {
    parse: bytes,
    limits: SIZE_BYTES,
    no_form: "no size",
    takes_durations: false,
    beyond: "not between 1 MB and 1,000 GB",
    help: "write megabytes or gigabytes: `size = \"256MB\"`, `size = \"2GB\"`",
};
const IN_MEMORY: Measure = Measure {
    parse: bytes,
    limits: MEMORY_BYTES,
    no_form: "no size",
    takes_durations: false,
    beyond: "not between 1 MB and 4 GB",
    help: "write megabytes: `memory = \"16MB\"`",
};

/// The seconds of a duration or of a number of days: `24h`, `30d`.
fn age_s(text: &str) -> Option<u64> {
    if let Some(days) = text.strip_suffix('d') {
        return digits(days)?.checked_mul(DAY_S);
    }
    let ms = duration::parse(text).ok()?;
    Some(u64::from(ms.unsigned_abs()) / 1000)
}

/// A number of bytes: `500kB`, `256MB`, `2GB`.
fn bytes(text: &str) -> Option<u64> {
    let units = [("kB", MB / 1000), ("MB", MB), ("GB", 1000 * MB)];
    units.iter().find_map(|(unit, bytes)| digits(text.strip_suffix(unit)?)?.checked_mul(*bytes))
}

fn digits(text: &str) -> Option<u64> {
    text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_and_sizes_are_read_as_people_write_them() {
        assert_eq!(age_s("24h"), Some(DAY_S));
        assert_eq!(age_s("30d"), Some(30 * DAY_S));
        assert_eq!(age_s("1h30m"), Some(5400));
        assert_eq!([age_s(""), age_s("d"), age_s("-1d"), age_s("1y"), age_s("24")], [None; 5]);
        assert_eq!(bytes("256MB"), Some(256 * MB));
        assert_eq!(bytes("2GB"), Some(2000 * MB));
        assert_eq!(bytes("500kB"), Some(MB / 2));
        let wrong = ["", "MB", "1", "1.5GB", "-1MB", "+1MB", "1 MB", "99999999999999999999GB"];
        assert!(wrong.iter().all(|text| bytes(text).is_none()));
    }
}
