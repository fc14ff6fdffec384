//! A duration as a person reads it, for log lines, messages and pages.

/// A duration in readable form: `250ms`, `3.2s`, `4m10s`, `2h05m`.
pub fn duration_text(ns: u64) -> String {
    let ms = ns / 1_000_000;
    let s = ms / 1000;
    match s {
        0 => format!("{ms}ms"),
        1..60 if ms.is_multiple_of(1000) => format!("{s}s"),
        1..60 => format!("{s}.{}s", ms % 1000 / 100),
        60..3600 if s.is_multiple_of(60) => format!("{}m", s / 60),
        60..3600 => format!("{}m{:02}s", s / 60, s % 60),
        _ => format!("{}h{:02}m", s / 3600, s % 3600 / 60),
    }
}

/// A scan period in words: as [`duration_text`], but exact if it is no number of whole ms, `250us`.
pub fn period_text(ns: u64) -> String {
    match ns.is_multiple_of(1_000_000) {
        true => duration_text(ns),
        false => format!("{}us", ns / 1000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_below_a_millisecond_are_printed_in_microseconds() {
        assert_eq!([250_000, 1_500_000, 10_000_000].map(period_text), ["250us", "1500us", "10ms"]);
    }

    #[test]
    fn durations_are_printed_in_short_form() {
        let check = |ms: u64, expected: &str| assert_eq!(duration_text(ms * 1_000_000), expected);
        check(0, "0ms");
        check(250, "250ms");
        check(3_000, "3s");
        check(3_290, "3.2s");
        check(60_000, "1m");
        check(250_000, "4m10s");
        check(7_500_000, "2h05m");
    }
}
