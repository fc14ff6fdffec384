//! `[realtime]` of a controller file: the requests to the operating system.
//!
//! Called by [`super::written`]. Checks each key and the combination of keys. `runtime::posture`
//! shows at run time whether the machine grants the requests.

use rungd_base::scan_period::ScanPeriod;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, give_one, pair, possible, propose};
use rungd_language::source::key::{NOT_EMPTY, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::Span;
use rungd_language::source::value_kind::{KeyWords, ParsedText, WrongWord};
use rungd_runtime::{Policy, Posture};

/// The greatest CPU number in a CPU set of the kernel's usual size.
const CPU_MAX: i64 = 1023;
/// One second: no CPU takes longer to wake up.
const LATENCY_US_MAX: i32 = 1_000_000;

/// A longer time awake is a scan period of its own.
const SPIN_US_MAX: u32 = 1000;

/// The words for policies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PolicyWord {
    Fifo,
    RoundRobin,
    Other,
}

const POLICIES: KeyWords<PolicyWord> = KeyWords::new(&[
    ("fifo", PolicyWord::Fifo),
    ("rr", PolicyWord::RoundRobin),
    ("other", PolicyWord::Other),
])
.refused_as(WrongWord::No("policy", "`fifo`, `rr` or `other`"));

const LATENCY: ParsedText<i32> =
    ParsedText::new(latency).limited(r#"{"pattern":"^[0-9]+(us|ms)$"}"#);

const SPIN: ParsedText<u32> = ParsedText::new(spin).limited(r#"{"pattern":"^[0-9]+(us|ms)$"}"#);

/// `[realtime]` as written.
#[derive(Debug, Default)]
pub(crate) struct WrittenRealtime {
    posture: Posture,
    spin: Option<Span>,
}

impl WrittenRealtime {
    /// The requests, with a finding if the scan thread would be awake for more than half of the
    /// period.
    pub(super) fn resolve(&self, period: ScanPeriod, findings: &mut Vec<Finding>) -> Posture {
        let most_us = period.us() / 2;
        if let Some(span) = self.spin
            && u64::from(self.posture.spin_us) > most_us
        {
            let message = "`spin` is longer than half of the period".to_owned();
            let finding = Finding::new(Code::OutOfRange, span, message);
            let help = propose(pair(format!("spin = \"{most_us}us\""))).and(", or less");
            findings.push(finding.help(help));
        }
        self.posture.clone()
    }
}

/// Reads `[realtime]`; without it, nothing is requested.
pub(super) fn read_in(root: &mut Table<'_>) -> WrittenRealtime {
    let table = root.table(key("realtime", "Requests to the operating system."), "`[realtime]`");
    table.map_or_else(WrittenRealtime::default, read)
}

fn read(mut table: Table<'_>) -> WrittenRealtime {
    let latency = key("cpu-latency", "How long an idle CPU may take to wake up: `0us`, `1ms`.");
    let mut posture = Posture {
        policy: read_policy(&mut table),
        cpus: read_cpus(&mut table),
        lock_memory: table.flag(key("lock-memory", "All memory stays in RAM."), false),
        cpu_latency_us: table.value_of(latency, &LATENCY),
        spin_us: 0,
        strict: table.flag(key("strict", "Do not start if any of these is not granted."), false),
    };
    let explained = key("spin", "The scan thread is awake for this time before each scan: `60us`.");
    let spin = table.value(explained, &SPIN);
    posture.spin_us = spin.as_ref().map_or(0, |spin| spin.value);
    table.finish();
    WrittenRealtime { posture, spin: spin.map(|spin| spin.span) }
}

fn read_policy(table: &mut Table<'_>) -> Policy {
    let has_policy = table.has("policy");
    let explained = key("policy", "How the scan thread is scheduled; `other` if not given.");
    let policy = table.value(explained, &POLICIES);
    let has_priority = table.has("priority");
    let priority = table.whole(key("priority", "Of policy `fifo` or `rr`."), 1..=99);
    let Some(policy) = policy else {
        if let (Some(priority), false) = (&priority, has_policy) {
            let message = "`priority` has no effect without a `policy`";
            let finding = Finding::new(Code::MissingKey, priority.span, message);
            table.find(finding.help(give_one("policy", "\"fifo\"")));
        }
        return Policy::Other;
    };
    match (policy.value, &priority) {
        (PolicyWord::Fifo, Some(priority)) => Policy::Fifo(priority.value),
        (PolicyWord::RoundRobin, Some(priority)) => Policy::RoundRobin(priority.value),
        (PolicyWord::Fifo | PolicyWord::RoundRobin, None) => {
            if !has_priority {
                let message = format!("policy `{}` has no `priority`", POLICIES.word(policy.value));
                let finding = Finding::new(Code::MissingKey, policy.span, message);
                let priority = pair("priority = 80").possible();
                table.find(finding.help(advise("give it one, 1 to 99: `{}`", [priority])));
            }
            Policy::Other
        }
        (PolicyWord::Other, Some(priority)) => {
            let message = "`priority` has no effect with policy `other`";
            let finding = Finding::new(Code::Controller, priority.span, message);
            let help = propose(pair("policy = \"fifo\"")).and(", or take `priority` out");
            table.find(finding.help(help).fix(FixEdit::Delete));
            Policy::Other
        }
        (PolicyWord::Other, None) => Policy::Other,
    }
}

fn read_cpus(table: &mut Table<'_>) -> Vec<u32> {
    let Some(cpus) = table.integers(
        key("cpus", "The CPUs that the scan thread may use.").limited(NOT_EMPTY),
        0..=CPU_MAX,
    ) else {
        return Vec::new();
    };
    let mut numbers: Vec<u32> = cpus.value.iter().filter_map(|n| u32::try_from(*n).ok()).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() && !table.doc().has_finding_in(cpus.span) {
        let finding = Finding::new(Code::Controller, cpus.span, "no CPU is named");
        let help = propose(pair("cpus = [1]")).and(", or take the key out");
        table.find(finding.help(help).fix(FixEdit::Delete));
    }
    numbers
}

/// The microseconds of `0us`, `20us` or `1ms`; `None` for any other form.
fn micros(text: &str) -> Option<i64> {
    let units = [("us", 1), ("ms", 1000)];
    let parts = units.iter().find_map(|(unit, us)| Some((text.strip_suffix(unit)?, *us)));
    let digits = |number: &str| {
        (!number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
            .then(|| number.parse::<i64>().unwrap_or(i64::MAX))
    };
    parts.and_then(|(number, us)| Some(digits(number)?.saturating_mul(us)))
}

/// The time for which the scan thread is awake before a scan, µs.
fn spin(_key: &str, text: &Text) -> Result<u32, Finding> {
    let us = micros(&text.text).ok_or_else(|| {
        let message = format!("`{}` is no time to be awake", text.text);
        let finding = Finding::new(Code::BadDuration, text.span, message);
        let times = ["60us", "1ms"].map(possible);
        finding.help(advise("write a number and its unit: `{}`, `{}`", times))
    })?;
    u32::try_from(us).ok().filter(|us| *us <= SPIN_US_MAX).ok_or_else(|| {
        let finding = Finding::new(Code::OutOfRange, text.span, "`spin` is at most a millisecond");
        finding.help(propose("60us").and(", or what `benches/lateness.sh` shows"))
    })
}

/// The longest time that an idle CPU may take to wake up, µs.
fn latency(_key: &str, text: &Text) -> Result<i32, Finding> {
    let Some(us) = micros(&text.text) else {
        let message = format!("`{}` is no latency", text.text);
        let finding = Finding::new(Code::BadDuration, text.span, message);
        let latencies = ["0us", "20us", "1ms"].map(possible);
        return Err(
            finding.help(advise("write a number and its unit: `{}`, `{}`, `{}`", latencies))
        );
    };
    let us = i32::try_from(us).ok().filter(|us| *us <= LATENCY_US_MAX);
    us.ok_or_else(|| {
        let message = "`cpu-latency` is at most a second";
        let finding = Finding::new(Code::OutOfRange, text.span, message);
        finding.help(propose("0us").and(" to keep idle CPUs awake"))
    })
}
