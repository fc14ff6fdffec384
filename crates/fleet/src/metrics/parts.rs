//! The families about the parts of a controller: alarms, devices, memory, scan log, log, tags.
//! Called by `scrape`. Pure.

use super::family::{MetricFamily, MetricKind, flag};
use super::scraped::Scraped;
pub use rungd_client::operator::protocol::{
    AlarmStatus, BitOrNumber, DevicesStatus, FieldDevice, LISTED_STATES, LogStatus, RecordStatus,
    RetainStatus, ShownValue,
};
use rungd_language::resolve::priority::Priority;

/// The most alarms with a metric of their own. All alarms are counted.
const ALARMS_MAX: usize = 256;
/// The most characters of an alarm's text in a label.
const TEXT_CHARS_MAX: usize = 128;

const US: f64 = 1e6;
const MS: f64 = 1e3;

fn gauges(name: &'static str, help: &'static str) -> MetricFamily {
    MetricFamily::new(MetricKind::Gauge, name, help)
}

fn counters(name: &'static str, help: &'static str) -> MetricFamily {
    MetricFamily::new(MetricKind::Counter, name, help)
}

/// The families.
pub(super) fn families(seen: &Scraped) -> Vec<MetricFamily> {
    let status = &seen.status;
    let mut families = alarms(&seen.alarms);
    families.extend(devices(&status.devices));
    families.extend(status.retain.as_ref().map(retain).unwrap_or_default());
    families.extend(record(&status.record));
    families.extend(log(&status.log));
    families.extend(tags(&seen.values, seen.left_out));
    families
}

fn alarms(alarms: &[AlarmStatus]) -> Vec<MetricFamily> {
    let help =
        "Alarms that stand, wait for an acknowledgement or are shelved, by priority and state.";
    let mut counts = gauges("rungd_alarms", help);
    for (priority, state) in
        Priority::ALL.iter().flat_map(|priority| LISTED_STATES.map(|state| (*priority, state)))
    {
        let fits = |alarm: &&AlarmStatus| (alarm.priority, alarm.state_name()) == (priority, state);
        let labels = [("priority", priority.name()), ("state", state)];
        counts = counts.with(&labels, alarms.iter().filter(fits).count() as f64);
    }
    let mut named: Vec<&AlarmStatus> = alarms.iter().collect();
    named.sort_by_key(|alarm| alarm.priority);
    let help = "1 for each alarm that stands, waits for an acknowledgement or is shelved.";
    let mut each = gauges("rungd_alarm", help);
    for alarm in named.into_iter().take(ALARMS_MAX) {
        let text: String = alarm.text.chars().take(TEXT_CHARS_MAX).collect();
        let labels = [
            ("alarm", alarm.tag.as_str()),
            ("priority", alarm.priority.name()),
            ("state", alarm.state_name()),
            ("text", &text),
        ];
        each = each.with(&labels, 1.0);
    }
    vec![counts, each]
}

fn devices(devices: &DevicesStatus) -> Vec<MetricFamily> {
    let field = &devices.field;
    let device_family = |family: MetricFamily, value: &dyn Fn(&FieldDevice) -> f64| {
        family.each(field, |device| (vec![("device", &*device.name)], value(device)))
    };
    let up = gauges("rungd_device_up", "Whether a field device answers and is fresh (0, 1).");
    let mut families = vec![
        up.each(field, |device| {
            let labels = vec![("device", &*device.name), ("driver", &*device.driver)];
            (labels, flag(device.ok && !device.stale))
        }),
        device_family(
            counters("rungd_device_exchanges", "Good exchanges with a field device."),
            &|device| device.exchanges as f64,
        ),
        device_family(
            counters("rungd_device_failures", "Failed exchanges with a field device."),
            &|device| device.failures as f64,
        ),
        device_family(
            gauges("rungd_device_exchange_seconds", "The duration of the last good exchange."),
            &|device| device.took_us as f64 / US,
        ),
        device_family(
            gauges("rungd_device_exchange_max_seconds", "The duration of the slowest exchange."),
            &|device| device.took_max_us as f64 / US,
        ),
    ];
    if let Some(modbus) = &devices.modbus {
        let help = "The clients of the Modbus server.";
        families.push(MetricFamily::gauge("rungd_modbus_clients", help, modbus.clients as f64));
        let (help, most) = ("The most clients of the Modbus server.", modbus.connections_max);
        families.push(MetricFamily::gauge("rungd_modbus_clients_limit", help, most.into()));
    }
    families
}

fn retain(retain: &RetainStatus) -> Vec<MetricFamily> {
    let age = gauges("rungd_retain_age_seconds", "The age of the last durable image.");
    let age = match retain.age_ms {
        Some(ms) => age.with(&[], ms as f64 / MS),
        None => age,
    };
    vec![
        MetricFamily::gauge(
            "rungd_retain_failing",
            "Whether retentive memory cannot be written (0, 1).",
            flag(retain.failing.is_some()),
        ),
        age,
        MetricFamily::counter("rungd_retain_writes", "Images written.", retain.writes),
        MetricFamily::counter("rungd_retain_written_bytes", "Bytes written.", retain.bytes),
        MetricFamily::gauge(
            "rungd_retain_flush_seconds",
            "From the beginning of the last write until it was durable.",
            retain.flush_us as f64 / US,
        ),
        MetricFamily::gauge(
            "rungd_retain_flush_max_seconds",
            "The same for the slowest write.",
            retain.flush_max_us as f64 / US,
        ),
    ]
}

fn record(record: &RecordStatus) -> Vec<MetricFamily> {
    let mut families = vec![
        MetricFamily::counter(
            "rungd_record_lost_scans",
            "Scans that the scan log lacks.",
            record.lost,
        ),
        MetricFamily::gauge(
            "rungd_record_memory_seconds",
            "How far back the scan log in memory reaches.",
            record.memory_ms as f64 / MS,
        ),
    ];
    if let Some(disk) = &record.disk {
        families.push(MetricFamily::gauge(
            "rungd_record_failing",
            "Whether the scan log's folder cannot be written (0, 1).",
            flag(disk.failing.is_some()),
        ));
        let help = "How far the scan log on disk is behind.";
        let behind_s = disk.behind_ms as f64 / MS;
        families.push(MetricFamily::gauge("rungd_record_behind_seconds", help, behind_s));
        let help = "The scan log on disk.";
        families.push(MetricFamily::gauge("rungd_record_disk_bytes", help, disk.bytes as f64));
        let help = "The most that the scan log may take on disk.";
        families.push(MetricFamily::gauge("rungd_record_limit_bytes", help, disk.size as f64));
    }
    families
}

fn log(log: &LogStatus) -> Vec<MetricFamily> {
    let lines = "Lines of the log that were dropped.";
    let records = "Records of the scan thread that the log lacks.";
    vec![
        MetricFamily::counter("rungd_log_dropped_lines", lines, log.lines_dropped),
        MetricFamily::counter("rungd_log_dropped_records", records, log.records_dropped),
    ]
}

fn tags(values: &[ShownValue], left_out: usize) -> Vec<MetricFamily> {
    let family = gauges("rungd_tag", "The value of a tag with `metric = true`.");
    // What is not known has no sample: a line of a graph ends there.
    let known: Vec<(&ShownValue, BitOrNumber)> =
        values.iter().filter_map(|value| Some((value, value.present()?))).collect();
    let family = family.each(&known, |(value, present)| {
        let unit = value.unit.as_deref().unwrap_or_default();
        (vec![("tag", &*value.operand), ("unit", unit)], number(*present))
    });
    let help = "Tags with `metric = true` beyond the most that are read.";
    vec![family, MetricFamily::gauge("rungd_tags_left_out", help, left_out as f64)]
}

fn number(value: BitOrNumber) -> f64 {
    match value {
        BitOrNumber::Bit(on) => flag(on),
        BitOrNumber::Word(word) => f64::from(word),
        // The shortest digits: 0.1 instead of 0.10000000149011612.
        BitOrNumber::Real(real) => real.to_string().parse().unwrap_or(f64::NAN),
    }
}
