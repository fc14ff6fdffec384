//! `[record]`: its keys, read into settings. Only run time shows whether the folder
//! can be made and has room.

use rungd_engine::isa::duration;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, pair, write};
use rungd_language::source::key::{KeyLimit, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::value_kind::{ParsedText, ValueKind};

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

/// Reads `[record]`; without it, the settings have their defaults.
pub(super) fn read_in(root: &mut Table<'_>) -> RecordSettings {
    let explained = key("record", "The scan log: the inputs of each scan, for `rungd why`.");
    root.table(explained, "`[record]`").map_or_else(RecordSettings::default, read)
}

fn read(mut table: Table<'_>) -> RecordSettings {
    let default = RecordSettings::default();
    let dir = key(
        "dir",
        "The folder, relative to this file; if not given, that of `rungd run --record`.",
    );
    let keep = key("keep", "The age at which a recording is removed; \"24h\" if not given.");
    let size = key("size", "The most that it takes on disk; \"256MB\" if not given.");
    let memory =
        key("memory", "The most that the last minute takes in memory; \"16MB\" if not given.");
    let record = RecordSettings {
        enabled: table
            .flag(key("enabled", "Whether rungd records on disk; true if not given."), true),
        dir: table.value_of(dir, &DIR),
        keep_s: table.value_of(keep, &AGE).unwrap_or(default.keep_s),
        size_bytes: table.value_of(size, &ON_DISK).unwrap_or(default.size_bytes),
        memory_bytes: table.value_of(memory, &IN_MEMORY).unwrap_or(default.memory_bytes),
    };
    table.finish();
    record
}

const DIR: ParsedText<String> = ParsedText::new(|_, dir| {
    if dir.text.is_empty() || dir.text.contains('\0') {
        let finding = Finding::new(Code::Controller, dir.span, "recordings are kept in a folder");
        return Err(finding.propose(pair("dir = \"/var/lib/rungd/record\"")));
    }
    Ok(dir.text.clone())
});

/// Amounts within limits.
struct LimitedAmount {
    parse: fn(&str) -> Option<u64>,
    /// Its form, as a JSON Schema.
    form: &'static str,
    limits: (u64, u64),
    no_form: &'static str,
    /// Whether it is a duration, which is written in whole numbers.
    takes_durations: bool,
    beyond: &'static str,
    help: fn() -> Help,
}

/// A JSON Schema: a number of bytes.
const SIZE: &str = r#"{"pattern":"^[0-9]+(kB|MB|GB)$"}"#;

const AGE: LimitedAmount = LimitedAmount {
    parse: age_s,
    form: r#"{"pattern":"^[0-9]+d$|^([0-9]+(h|m|s|ms))+$"}"#,
    limits: KEEP_S,
    no_form: "no time",
    takes_durations: true,
    beyond: "not between a minute and ten years",
    help: || {
        let ages = ["keep = \"24h\"", "keep = \"30d\""].map(|age| pair(age).possible());
        advise("write hours or days: `{}`, `{}`", ages)
    },
};
const ON_DISK: LimitedAmount = LimitedAmount {
    parse: bytes,
    form: SIZE,
    limits: SIZE_BYTES,
    no_form: "no size",
    takes_durations: false,
    beyond: "not between 1 MB and 1,000 GB",
    help: || {
        let sizes = ["size = \"256MB\"", "size = \"2GB\""].map(|size| pair(size).possible());
        advise("write megabytes or gigabytes: `{}`, `{}`", sizes)
    },
};
const IN_MEMORY: LimitedAmount = LimitedAmount {
    limits: MEMORY_BYTES,
    beyond: "not between 1 MB and 4 GB",
    help: || advise("write megabytes: `{}`", [pair("memory = \"16MB\"").proposed()]),
    ..ON_DISK
};

impl ValueKind for LimitedAmount {
    type Value = u64;

    fn limit(&self) -> KeyLimit {
        KeyLimit::Schema(self.form)
    }

    fn read(&self, _key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<u64> {
        let amount = (self.parse)(&text.text);
        let within = amount.filter(|amount| (self.limits.0..=self.limits.1).contains(amount));
        if within.is_none() {
            let wrong = if amount.is_some() { self.beyond } else { self.no_form };
            let whole = duration::of_fraction(&text.text)
                .filter(|_| self.takes_durations && amount.is_none());
            let help = whole.map_or_else(self.help, |text| write(format!("\"{text}\"")));
            let message = format!("`{}` is {wrong}", text.text);
            find(Finding::new(Code::Controller, text.span, message).help(help));
        }
        within
    }
}

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
    fn ages_and_sizes_are_read_with_their_units() {
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
