//! One look at a controller: its status, its alarms, and the values of the tags with
//! `metric = true`.
//!
//! Called by `serve` and by the functions of `mod.rs`. Blocking, within time limits. The list of
//! tags is requested again when the ladder has changed.

use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::family::MetricFamily;
use super::scraped::Scraped;
use super::{controller, parts};
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{ControllerPoller, PolledController};
use rungd_client::operator::protocol::{
    ControllerStatus, MetricList, OPERANDS_MAX, OperandValues, Request, ShownValue,
};

/// The longest wait for an answer. A scraper usually waits ten seconds.
const ANSWER_MAX: Duration = Duration::from_secs(3);
/// The start time is computed from the uptime at each look. Two results that differ by less than
/// this are the same start.
const START_S_APART: f64 = 2.0;

/// Looks at a controller.
#[derive(Debug)]
pub(super) struct Scraper {
    pub poller: ControllerPoller,
    /// The hash of a ladder, and its operands.
    known: Option<(String, MetricList)>,
    /// The controller's process, and its start time.
    started: Option<(u32, f64)>,
}

impl Scraper {
    pub fn new(named: Option<PathBuf>) -> Scraper {
        Scraper { poller: ControllerPoller::new(named, ANSWER_MAX), known: None, started: None }
    }

    /// The families of one look; if the look failed, also the reason.
    pub fn families(&mut self) -> (Vec<MetricFamily>, Option<CallFailure>) {
        match self.look() {
            Ok(seen) => {
                let mut families = vec![controller::up(true)];
                families.extend(controller::families(&seen));
                families.extend(parts::families(&seen));
                (families, None)
            }
            Err(failure) => (vec![controller::up(false)], Some(failure)),
        }
    }

    fn look(&mut self) -> Result<Scraped, CallFailure> {
        let controller = self.poller.controller()?;
        let (status, alarms) = controller.status_and_alarms()?;
        self.poller.keep(&controller);
        let sha256 = &status.ladder.sha256;
        let read = match self.values(&controller, sha256) {
            // A reload has happened in between, and the new ladder has different tags.
            Err(CallFailure::Refused(_)) => {
                self.known = None;
                self.values(&controller, sha256)
            }
            read => read,
        };
        let (values, left_out) = read?;
        let start_s = self.start_s(&status);
        Ok(Scraped { status, alarms: alarms.alarms, values, left_out, start_s })
    }

    fn values(
        &mut self,
        controller: &PolledController,
        sha256: &str,
    ) -> Result<(Vec<ShownValue>, usize), CallFailure> {
        if self.known.as_ref().is_none_or(|(known_sha256, _)| known_sha256 != sha256) {
            self.known = Some((sha256.to_owned(), controller.ask(&Request::Metrics {})?));
        }
        let Some((_, list)) = &self.known else { return Ok((Vec::new(), 0)) };
        let mut values = Vec::new();
        for operands in list.operands.chunks(OPERANDS_MAX) {
            let read = Request::Read { operands: operands.to_vec(), each: false };
            values.extend(controller.ask::<OperandValues>(&read)?.values);
        }
        Ok((values, list.left_out))
    }

    fn start_s(&mut self, status: &ControllerStatus) -> f64 {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let start_s = now.as_secs_f64() - status.uptime_ms as f64 / 1000.0;
        let known = self
            .started
            .filter(|(pid, at)| *pid == status.pid && (at - start_s).abs() < START_S_APART);
        let start_s = known.map_or_else(|| (start_s * 1000.0).round() / 1000.0, |(_, at)| at);
        self.started = Some((status.pid, start_s));
        start_s
    }
}
