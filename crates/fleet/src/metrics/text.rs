//! Families as text: OpenMetrics 1.0, and the text format of Prometheus (0.0.4), which collectors
//! of text files read too. Pure.

use std::fmt::Write as _;

use rungd_language::source::wording::is_obeyed;

use super::family::{MetricFamily, MetricKind, MetricSample};

/// A form of the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exposition {
    OpenMetrics,
    Prometheus,
}

impl Exposition {
    /// The form that a client accepts: OpenMetrics if `Accept` names it, with any weight.
    pub fn accepted(accept: &str) -> Exposition {
        let kinds = accept.split(',').map(|kind| kind.split(';').next().unwrap_or(kind).trim());
        match kinds.into_iter().any(|kind| kind == "application/openmetrics-text") {
            true => Exposition::OpenMetrics,
            false => Exposition::Prometheus,
        }
    }

    /// The value of `Content-Type`.
    pub fn content_type(self) -> &'static str {
        match self {
            Exposition::OpenMetrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
            Exposition::Prometheus => "text/plain; version=0.0.4; charset=utf-8",
        }
    }

    /// The ending after the name of a family's samples.
    fn ending(self, kind: MetricKind) -> &'static str {
        match kind {
            MetricKind::Counter => "_total",
            MetricKind::Info => "_info",
            MetricKind::Gauge | MetricKind::Histogram => "",
        }
    }

    /// The type of a family. The older form has no `info`.
    fn kind(self, kind: MetricKind) -> &'static str {
        match (kind, self) {
            (MetricKind::Counter, _) => "counter",
            (MetricKind::Info, Exposition::OpenMetrics) => "info",
            (MetricKind::Gauge, _) | (MetricKind::Info, Exposition::Prometheus) => "gauge",
            (MetricKind::Histogram, _) => "histogram",
        }
    }
}

/// The text of families.
pub(super) fn text(families: &[MetricFamily], form: Exposition) -> String {
    let mut text = String::new();
    for family in families.iter().filter(|family| !family.samples.is_empty()) {
        head(&mut text, family, form);
        let ending = form.ending(family.kind);
        for metric_sample in &family.samples {
            sample(&mut text, family.name, ending, metric_sample);
        }
    }
    if form == Exposition::OpenMetrics {
        text.push_str("# EOF\n");
    }
    text
}

fn head(text: &mut String, family: &MetricFamily, form: Exposition) {
    // OpenMetrics writes the name of the family here, the older form the name of its samples.
    let ending = if form == Exposition::OpenMetrics { "" } else { form.ending(family.kind) };
    let (name, kind) = (family.name, form.kind(family.kind));
    let _ = writeln!(text, "# TYPE {name}{ending} {kind}");
    if let (Exposition::OpenMetrics, Some(unit)) = (form, family.unit()) {
        let _ = writeln!(text, "# UNIT {name} {unit}");
    }
    let _ = writeln!(text, "# HELP {name}{ending} {}", family.help);
}

fn sample(text: &mut String, name: &str, ending: &str, sample: &MetricSample) {
    let _ = write!(text, "{name}{ending}{}", sample.suffix);
    for (at, (label, value)) in sample.labels.iter().enumerate() {
        let begin = if at == 0 { '{' } else { ',' };
        let _ = write!(text, "{begin}{label}=\"{}\"", escaped(value));
    }
    let end = if sample.labels.is_empty() { "" } else { "}" };
    let _ = writeln!(text, "{end} {}", number(sample.value));
}

/// The value of a label. Characters that a terminal obeys are replaced, since the text may be
/// printed.
fn escaped(value: &str) -> String {
    let value = value.replace(|c| c != '\n' && is_obeyed(c), "\u{fffd}");
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// A value, in the notation of both forms.
pub(super) fn number(value: f64) -> String {
    match value {
        value if value.is_nan() => "NaN".to_owned(),
        value if value.is_infinite() && value > 0.0 => "+Inf".to_owned(),
        value if value.is_infinite() => "-Inf".to_owned(),
        value => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn families() -> Vec<MetricFamily> {
        let info = MetricFamily::new(MetricKind::Info, "rungd", "The program.");
        let tag = MetricFamily::new(MetricKind::Gauge, "rungd_tag", "A tag.");
        vec![
            info.with(&[("version", "1.0"), ("ladder", "a \"b\" \\ c\nd\u{1b}")], 1.0),
            MetricFamily::counter("rungd_retain_written_bytes", "Bytes.", 5_000_000_000),
            MetricFamily::new(MetricKind::Gauge, "rungd_alarm", "No alarm."),
            tag.with(&[], f64::NAN).with(&[], f64::INFINITY).with(&[], -0.25),
        ]
    }

    #[test]
    fn both_formats_contain_types_units_and_values() {
        let open = "# TYPE rungd info\n# HELP rungd The program.\n\
            rungd_info{version=\"1.0\",ladder=\"a \\\"b\\\" \\\\ c\\nd\u{fffd}\"} 1\n\
            # TYPE rungd_retain_written_bytes counter\n# UNIT rungd_retain_written_bytes bytes\n\
            # HELP rungd_retain_written_bytes Bytes.\n\
            rungd_retain_written_bytes_total 5000000000\n\
            # TYPE rungd_tag gauge\n# HELP rungd_tag A tag.\n\
            rungd_tag NaN\nrungd_tag +Inf\nrungd_tag -0.25\n# EOF\n";
        assert_eq!(text(&families(), Exposition::OpenMetrics), open);
        let older = text(&families(), Exposition::Prometheus);
        assert!(older.starts_with("# TYPE rungd_info gauge\n# HELP rungd_info The program.\n"));
        assert!(older.contains("# TYPE rungd_retain_written_bytes_total counter\n"), "{older}");
        assert!(!older.contains("# UNIT") && !older.contains("# EOF"), "{older}");
    }

    #[test]
    fn a_client_gets_the_format_that_it_accepts() {
        let prometheus = "application/openmetrics-text;version=1.0.0;q=0.8,\
                          text/plain;version=0.0.4;q=0.5,*/*;q=0.1";
        assert_eq!(Exposition::accepted(prometheus), Exposition::OpenMetrics);
        for accept in ["", "*/*", "text/plain", "application/openmetrics-textile", ";;,,"] {
            assert_eq!(Exposition::accepted(accept), Exposition::Prometheus, "{accept}");
        }
    }
}
