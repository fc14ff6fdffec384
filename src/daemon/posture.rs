//! Logs the real-time posture: its requests and grants. Applies `strict`.

use rungd_runtime::Grant;
use rungd_runtime::say::say;

/// How the scan thread gets a real-time priority; `None` if it has one.
pub(super) fn priority_remedy(grants: &[Grant]) -> Option<String> {
    let asked = grants.iter().find(|grant| grant.what.starts_with("SCHED_"));
    match asked.map(|grant| &grant.refused) {
        Some(None) => None,
        Some(Some(refused)) => Some(format!(
            "grant the scan thread the real-time priority that was refused (it needs {})",
            refused.remedy
        )),
        None => Some(
            "give the scan thread a real-time priority (`[realtime] policy = \"fifo\"` and \
             `priority = 80`: docs/running.md, real-time posture)"
                .to_owned(),
        ),
    }
}

/// The load of the machine, if more threads want to run than it has processors.
pub(super) fn load() -> Option<String> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    let processors = std::thread::available_parallelism().ok()?.get();
    overload(&text, processors)
}

fn overload(text: &str, processors: usize) -> Option<String> {
    let load: f64 = text.split_whitespace().next()?.parse().ok()?;
    (load > processors as f64).then(|| {
        let processors = if processors == 1 {
            "1 processor".to_owned()
        } else {
            format!("{processors} processors")
        };
        format!("load {load:.1} on {processors}")
    })
}

/// Logs the grants; `Err` is the reason why the controller does not start.
pub(super) fn log_grants(grants: &[Grant], strict: bool) -> Result<(), String> {
    let list = |all: &mut dyn Iterator<Item = &Grant>| {
        all.map(|grant| grant.what.as_str()).collect::<Vec<_>>().join(", ")
    };
    let asked = list(&mut grants.iter());
    let granted = list(&mut grants.iter().filter(|grant| grant.refused.is_none()));
    say!(POSTURE, asked, granted, "real-time posture");
    let mut refused = Vec::new();
    for Grant { what, refused: refusal } in grants {
        let Some(refusal) = refusal else { continue };
        let (why, remedy) = (&refusal.why, &refusal.remedy);
        say!(
            POSTURE_REFUSED,
            what = %what,
            why = %why,
            "real-time posture: {what} was refused: {why}; it needs {remedy}"
        );
        refused.push(format!("{what} ({why}; it needs {remedy})"));
    }
    if strict && !refused.is_empty() {
        return Err(format!(
            "`[realtime]` is strict, and not all of it was granted: {}. Grant it (docs/running.md, \
             real-time posture), or take `strict` out",
            refused.join(", ")
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_runtime::NotGranted;

    #[test]
    fn the_remedy_for_a_missing_priority_names_its_cause() {
        let grant = |what: &str, refused| Grant { what: what.to_owned(), refused };
        let slack = grant("timer slack 1 ns", None);
        let none = priority_remedy(std::slice::from_ref(&slack)).unwrap_or_default();
        assert!(none.contains("`[realtime] policy = \"fifo\"`"), "{none}");
        let (why, remedy) = ("no".to_owned(), "LimitRTPRIO=80 in the unit".to_owned());
        let refused = grant("SCHED_FIFO priority 80", Some(NotGranted { why, remedy }));
        let told = priority_remedy(&[slack.clone(), refused]).unwrap_or_default();
        assert!(told.contains("it needs LimitRTPRIO=80"), "{told}");
        assert_eq!(priority_remedy(&[slack, grant("SCHED_RR priority 3", None)]), None);
    }

    #[test]
    fn a_load_above_the_number_of_processors_is_reported() {
        let told = overload("10.21 4.00 2.00 12/300 99\n", 2);
        assert_eq!(told.as_deref(), Some("load 10.2 on 2 processors"));
        assert_eq!(overload("1.99 4.00 2.00 12/300 99\n", 2), None);
        assert_eq!(overload("", 2), None);
    }
}
