//! The log lines of reloads and rollbacks.

use super::trial::Probation;
use crate::daemon::config::ControllerSetup;
use rungd_base::duration_text::duration_text;
use rungd_client::operator::protocol::{RefusalKind, ReloadResult, RequestRefusal, is_run};
use rungd_runtime::exchange::FaultReason;
use rungd_runtime::say::say;
use rungd_state::reload::WARNING;

/// Logs a completed reload.
pub(super) fn done(
    who: &str,
    done: &ReloadResult,
    setup: &ControllerSetup,
    trial: Option<Probation>,
) {
    report(done);
    let ladder = &setup.ladder;
    let probation = trial.map_or(0, |_| setup.probation.as_nanos() as u64);
    say!(
        RELOAD_DONE,
        who,
        ladder = %ladder.name,
        files = %ladder.files,
        sha256 = %ladder.sha256,
        rungs = ladder.rungs,
        differences = done.report.len(),
        swap_us = done.swap_us,
        probation = %duration_text(probation),
        mode = %done.mode,
        "{who} reloaded: the new program {}, without a stop", takes_over(done)
    );
}

/// Logs a reload that found the files unchanged.
pub(super) fn same(who: &str, same: &ReloadResult) {
    report(same);
    say!(
        RELOAD_SAME,
        who,
        ladder = %same.ladder,
        sha256 = %same.sha256,
        "{who} asked for a reload: the files are those of the running program, nothing changed"
    );
}

/// Logs a completed rollback.
pub(super) fn rolled_back(who: &str, done: &ReloadResult, fault: Option<FaultReason>) {
    report(done);
    let why = fault.map_or_else(|| "asked for".to_owned(), |fault| format!("FAULT: {fault}"));
    let next = match done.mode.as_str() {
        mode if is_run(mode) => String::new(),
        mode => format!("; the mode stays {mode}: run `rungd mode run` next"),
    };
    say!(
        ROLLED_BACK,
        who,
        ladder = %done.ladder,
        sha256 = %done.sha256,
        swap_us = done.swap_us,
        mode = %done.mode,
        "{who} went back to the program before the reload ({why}){next}; the files still contain \
         the program that was taken back"
    );
}

fn takes_over(done: &ReloadResult) -> String {
    match done.mode.as_str() {
        mode if is_run(mode) => "scans".to_owned(),
        mode => format!("is loaded ({mode}: nothing is scanned until `rungd mode run`)"),
    }
}

fn report(done: &ReloadResult) {
    for line in &done.report {
        match line.strip_prefix(WARNING) {
            Some(line) => say!(RELOAD_WARNING, "{line}"),
            None => say!(RELOAD_DIFFERENCE, "{line}"),
        }
    }
    for what in &done.restart {
        say!(RELOAD_RESTART, "{what}: the change in the file needs a restart");
    }
}

/// Logs a refusal: one line with the error, then the findings line by line.
pub(super) fn refusal(who: &str, refusal: &RequestRefusal) {
    if refusal.kind != RefusalKind::BadFiles {
        let why = &refusal.message;
        say!(RELOAD_REFUSED, who, "{who} asked for a change of program: {why}");
        return;
    }
    let why = summary(&refusal.message);
    say!(
        RELOAD_REFUSED,
        who,
        "{who} asked for a reload, and the files cannot be run as they are; nothing changed: {why}"
    );
    for line in refusal.message.lines().filter(|line| !line.trim().is_empty()) {
        say!(RELOAD_FINDING, "{line}");
    }
}

/// The first error in the text of `render`, its place, and the number of errors. A text without
/// findings is returned unchanged.
fn summary(text: &str) -> String {
    let mut lines = text.lines().skip_while(|line| !line.starts_with("error"));
    let Some(error) = lines.next() else { return text.trim().to_owned() };
    let place = lines.next().and_then(|line| line.trim().strip_prefix("--> "));
    let place = place.map_or(String::new(), |place| format!("{place}: "));
    let count = text.trim_end().lines().last().unwrap_or_default();
    format!("{place}{error} ({count})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_reload_reports_the_first_error() {
        let text = "warning[unused-tag]: `a` is unused\n  --> l.toml:2:1\n   |\n\n\
                    error[unknown-name]: no `b`\n  --> l.toml:9:34\n   |\n\n1 error, 1 warning\n";
        let said = "l.toml:9:34: error[unknown-name]: no `b` (1 error, 1 warning)";
        assert_eq!(summary(text), said);
        assert_eq!(summary("controller.toml: gone\n"), "controller.toml: gone");
    }
}
