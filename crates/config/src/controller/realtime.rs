//! `[realtime]` of a controller file: the requests to the operating system.
//!
//! Called by [`super::written`]. Checks each key and the combination of keys. `runtime::posture`
//! shows at run time whether the machine grants the requests.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, NOT_EMPTY, key};
use rungd_language::source::reader::{Table, Text};
use rungd_runtime::{Policy, Posture};

/// The greatest CPU number in a CPU set of the kernel's usual size.
const CPU_MAX: i64 = 1023;
/// One second: no CPU takes longer to wake up.
const LATENCY_US_MAX: i64 = 1_000_000;

/// Reads `[realtime]`; without it, nothing is requested.
pub(super) fn read_in(root: &mut Table<'_>) -> Posture {
    let table = root.table(key("realtime", "Requests to the operating system."), "`[realtime]`");
    table.map_or_else(Posture::default, read)
}

fn read(mut table: Table<'_>) -> Posture {
    let flag = |table: &mut Table<'_>, key: Key| table.boolean(key).is_some_and(|flag| flag.value);
    let realtime = Posture {
        policy: read_policy(&mut table),
        cpus: read_cpus(&mut table),
        lock_memory: flag(&mut table, key("lock-memory", "All memory stays in RAM.")),
        cpu_latency_us: table
            .string(
                key("cpu-latency", "How long an idle CPU may take to wake up: `0us`, `1ms`.")
                    .limited(r#"{"pattern":"^[0-9]+(us|ms)$"}"#),
            )
            .and_then(|text| latency(&table, &text)),
        strict: flag(&mut table, key("strict", "Do not start if any of these is not granted.")),
    };
    table.finish();
    realtime
}

fn read_policy(table: &mut Table<'_>) -> Policy {
    let says = table.has("policy");
    let policy = table.string(
        key("policy", "How the scan thread is scheduled; `other` if not given.")
            .limited(r#"{"enum":["fifo","rr","other"]}"#),
    );
    let asked = table.has("priority");
    let priority = table.integer(key("priority", "Of policy `fifo` or `rr`."), (1, 99));
    let number = priority.as_ref().and_then(|priority| u8::try_from(priority.value).ok());
    let place = |policy: &Text| priority.as_ref().map_or(policy.span, |priority| priority.span);
    match policy.as_ref().map(|policy| (policy, policy.text.as_str())) {
        Some((policy, "fifo" | "rr")) => {
            if !asked {
                let message = format!("policy `{}` has no `priority`", policy.text);
                let finding = Finding::new(Code::MissingKey, policy.span, message);
                table.find(finding.help("give it one, 1 to 99: `priority = 80`"));
            }
            let Some(number) = number else { return Policy::Other };
            if policy.text == "rr" { Policy::RoundRobin(number) } else { Policy::Fifo(number) }
        }
        Some((policy, "other")) => {
            if number.is_some() {
                let message = "`priority` has no effect with policy `other`";
                let finding = Finding::new(Code::Controller, place(policy), message);
                table.find(finding.help("write `policy = \"fifo\"`, or take `priority` out"));
            }
            Policy::Other
        }
        Some((policy, _)) => {
            let message = format!("`{}` is no policy", policy.text);
            let finding = Finding::new(Code::Controller, policy.span, message);
            table.find(finding.help("write `fifo`, `rr` or `other`"));
            Policy::Other
        }
        None => {
            if let (Some(priority), false) = (&priority, says) {
                let message = "`priority` has no effect without a `policy`";
                let finding = Finding::new(Code::MissingKey, priority.span, message);
                table.find(finding.help("give it one: `policy = \"fifo\"`"));
            }
            Policy::Other
        }
    }
}

fn read_cpus(table: &mut Table<'_>) -> Vec<u32> {
    let Some(cpus) = table.integers(
        key("cpus", "The CPUs that the scan thread may use.").limited(NOT_EMPTY),
        (0, CPU_MAX),
    ) else {
        return Vec::new();
    };
    let mut numbers: Vec<u32> = cpus.value.iter().filter_map(|n| u32::try_from(*n).ok()).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() && !table.doc().has_finding_in(cpus.span) {
        let finding = Finding::new(Code::Controller, cpus.span, "no CPU is named");
        table.find(finding.help("write `cpus = [1]`, or take the key out"));
    }
    numbers
}

/// The microseconds of `0us`, `20us` or `1ms`.
fn latency(table: &Table<'_>, text: &Text) -> Option<i32> {
    let units = [("us", 1), ("ms", 1000)];
    let parts = units.iter().find_map(|(unit, us)| Some((text.text.strip_suffix(unit)?, *us)));
    let digits = |number: &str| {
        (!number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
            .then(|| number.parse::<i64>().unwrap_or(i64::MAX))
    };
    let Some(us) = parts.and_then(|(number, us)| Some(digits(number)?.saturating_mul(us))) else {
        let message = format!("`{}` is no latency", text.text);
        let finding = Finding::new(Code::BadDuration, text.span, message);
        table.find(finding.help("write a number and its unit: `0us`, `20us`, `1ms`"));
        return None;
    };
    if us > LATENCY_US_MAX {
        let message = "`cpu-latency` is at most a second";
        let finding = Finding::new(Code::OutOfRange, text.span, message);
        table.find(finding.help("write `0us` to keep idle CPUs awake"));
        return None;
    }
    i32::try_from(us).ok()
}
