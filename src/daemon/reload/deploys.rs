//! The last changes of the program, with their differences, for people who look.
//!
//! `reload` adds each swap, and `operator_server` answers with them; the log has the same lines.
//! What is kept is bounded: the oldest change is forgotten, and a long report is cut.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use rungd_base::locked::locked;
use rungd_client::operator::protocol::{Deploy, DeployList, ReloadResult};

/// The most changes, and the most bytes of the report of each.
const DEPLOYS_MAX: usize = 16;
const REPORT_BYTES_MAX: usize = 64 * 1024;

/// The last changes, the newest first.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Deploys(Arc<Mutex<VecDeque<Deploy>>>);

/// Who changed the program, and when.
pub(super) struct DeployCause<'a> {
    pub who: &'a str,
    pub unix_ns: i64,
    pub is_rollback: bool,
}

impl Deploys {
    /// Adds a change.
    pub(super) fn add(&self, cause: DeployCause<'_>, done: &ReloadResult) {
        let DeployCause { who, unix_ns, is_rollback } = cause;
        let mut bytes = 0;
        let fits = |line: &&String| {
            bytes += line.len();
            bytes <= REPORT_BYTES_MAX
        };
        let report: Vec<String> = done.report.iter().take_while(fits).cloned().collect();
        let more = done.report.len() - report.len();
        let (ladder, sha256) = (done.ladder.clone(), done.sha256.clone());
        let rollback = is_rollback;
        let who = who.to_owned();
        let mut all = locked(&self.0);
        all.push_front(Deploy { unix_ns, who, rollback, ladder, sha256, report, more });
        all.truncate(DEPLOYS_MAX);
    }

    /// The list for an answer.
    pub fn list(&self) -> DeployList {
        DeployList { deploys: locked(&self.0).iter().cloned().collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(report: &[String]) -> ReloadResult {
        ReloadResult {
            dry_run: false,
            same: false,
            report: report.to_vec(),
            restart: Vec::new(),
            ladder: "line".to_owned(),
            sha256: "00ff".to_owned(),
            swap_us: None,
            mode: "RUN".to_owned(),
        }
    }

    #[test]
    fn the_last_changes_are_kept_and_a_long_report_is_cut() {
        let deploys = Deploys::default();
        for unix_ns in 0..20 {
            let cause = DeployCause { who: "anna", unix_ns, is_rollback: unix_ns == 19 };
            deploys.add(cause, &done(&["a".repeat(40_000), "b".repeat(40_000)]));
        }
        let list = deploys.list().deploys;
        assert_eq!((list.len(), list[0].unix_ns, list[0].rollback), (16, 19, true));
        assert_eq!((list[0].report.len(), list[0].more, list[1].rollback), (1, 1, false));
    }
}
