//! Families of metrics as data: a name, its meaning, and the samples of one moment.
//!
//! Made by `controller` and `parts`, written by `text`. The names do not contain the endings that a
//! text form adds (`_total`, `_info`).

/// The kind of a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MetricKind {
    /// Only grows, until the controller restarts.
    Counter,
    Gauge,
    Histogram,
    /// Always 1; the information is in the labels.
    Info,
}

/// A family.
#[derive(Clone, Debug)]
pub(super) struct MetricFamily {
    pub name: &'static str,
    pub kind: MetricKind,
    pub help: &'static str,
    pub samples: Vec<MetricSample>,
}

/// One value.
#[derive(Clone, Debug)]
pub(super) struct MetricSample {
    /// The ending after the family's name: `_bucket`, `_sum`, `_count`, or empty.
    pub suffix: &'static str,
    pub labels: Vec<(&'static str, String)>,
    pub value: f64,
}

/// The units that are written at the end of a name.
const UNITS: [&str; 2] = ["seconds", "bytes"];

impl MetricFamily {
    pub fn new(kind: MetricKind, name: &'static str, help: &'static str) -> MetricFamily {
        MetricFamily { name, kind, help, samples: Vec::new() }
    }

    /// A gauge with one value.
    pub fn gauge(name: &'static str, help: &'static str, value: f64) -> MetricFamily {
        MetricFamily::new(MetricKind::Gauge, name, help).with(&[], value)
    }

    /// A counter with one value.
    pub fn counter(name: &'static str, help: &'static str, value: u64) -> MetricFamily {
        MetricFamily::new(MetricKind::Counter, name, help).with(&[], value as f64)
    }

    /// Adds a value.
    pub fn with(mut self, labels: &[(&'static str, &str)], value: f64) -> MetricFamily {
        let labels = labels.iter().map(|(name, text)| (*name, (*text).to_owned())).collect();
        self.samples.push(MetricSample { suffix: "", labels, value });
        self
    }

    /// Adds a value for each element of `items`.
    pub fn each<T>(
        self,
        items: &[T],
        sample: impl Fn(&T) -> (Vec<(&'static str, &str)>, f64),
    ) -> MetricFamily {
        items.iter().fold(self, |family, thing| {
            let (labels, value) = sample(thing);
            family.with(&labels, value)
        })
    }

    /// The unit at the end of the name, if there is one.
    pub fn unit(&self) -> Option<&'static str> {
        let last = self.name.rsplit('_').next()?;
        UNITS.into_iter().find(|unit| *unit == last)
    }
}

/// 1 or 0.
pub(super) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}
