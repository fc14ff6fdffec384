//! Answers an operator about alarms: lists them, and acknowledges them. `shelves` shelves them.
//!
//! Called by `answer`. `daemon::alarm_book` holds the alarms. The monitor thread enters their
//! changes a few milliseconds after the image that shows them, and an answer waits for this entry.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, sleep};

use super::peer::{OperatorPeer, PeerRequest};
use super::service::OperatorService;
use super::status::ProgramView;
use crate::daemon::alarm_book::{Acknowledgement, AlarmBook};
use crate::daemon::alarm_keeper::unix_ns;
use crate::daemon::narration::one_line;
use rungd_client::operator::protocol::{
    AckList, AckedAlarm, AlarmAck, AlarmList, AlarmState, OPERANDS_MAX, RefusalKind,
    RequestRefusal, RequestResult,
};
use rungd_engine::Cell;
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::monotonic_ns;
use rungd_runtime::say::say;

/// The time limit for the monitor thread. If an alarm changes with every scan, the book may never
/// agree with the latest image: then the answer is the content of the book after this time.
const BOOK_MAX: Duration = Duration::from_millis(500);
/// The time between two looks at the book.
const LOOK_EVERY: Duration = Duration::from_millis(2);

impl OperatorService {
    /// The alarms that stand or wait for an acknowledgement.
    pub(super) async fn alarms(&self) -> AlarmList {
        let (latest, view) = self.booked().await;
        let alarms = view.about.book().list(monotonic_ns());
        AlarmList { mode: latest.mode.name().to_owned(), scans: latest.scans, alarms }
    }

    /// The latest image, once the book agrees with it.
    pub(super) async fn booked(&self) -> (Arc<Snapshot>, Arc<ProgramView>) {
        let began = Instant::now();
        loop {
            let (latest, view) = self.seen();
            if view.about.book().agrees(&latest) || began.elapsed() > BOOK_MAX {
                return (latest, view);
            }
            sleep(LOOK_EVERY).await;
        }
    }

    /// Acknowledges the alarms that these texts name, or all alarms that wait for it, and turns
    /// their bits of `ack` ON.
    ///
    /// # Errors
    /// A text names no alarm; then none is acknowledged.
    pub(super) async fn acknowledge(
        &self,
        asker: &PeerRequest,
        texts: Option<&[String]>,
    ) -> RequestResult<AckList> {
        let peer = &asker.peer;
        let (latest, view) = self.booked().await;
        let ack = AlarmAck { who: peer.name.clone(), unix_ns: unix_ns(monotonic_ns()) };
        let alarms: Vec<Acknowledgement> = {
            // One lock for all texts: a reload changes the numbers of alarms.
            let mut book = view.about.book();
            let numbers = match texts {
                None => book.unacknowledged(),
                Some(texts) => {
                    let names = NamedAlarms { book: &book, view: &view, latest: &latest };
                    names.all(texts)?
                }
            };
            numbers.iter().filter_map(|number| book.acknowledge(*number, ack.clone())).collect()
        };
        let changed = alarms.iter().map(|one| &one.alarm).filter(|one| one.before != one.after);
        changed.for_each(|acked| log_acknowledgement(peer, acked));
        if let Some(file) = view.about.alarm_file() {
            file.changed();
        }
        Ok(AckList { alarms: self.tell_ladder(asker, alarms).await })
    }
}

/// The data in which the texts of a request are looked up.
pub(super) struct NamedAlarms<'a> {
    pub book: &'a AlarmBook,
    pub view: &'a ProgramView,
    pub latest: &'a Snapshot,
}

impl NamedAlarms<'_> {
    /// The numbers of the alarms that these texts name.
    pub fn all(&self, texts: &[String]) -> RequestResult<Vec<usize>> {
        if texts.len() > OPERANDS_MAX {
            let message = format!("one request names at most {OPERANDS_MAX} alarms");
            return Err(RequestRefusal::new(RefusalKind::BadRequest, message));
        }
        let mut numbers = Vec::new();
        for text in texts {
            numbers.extend(self.one(text.trim())?);
        }
        Ok(numbers)
    }

    /// The numbers of the alarms that a text names: its tag, or the address of its bit, which
    /// several tags may watch.
    fn one(&self, text: &str) -> RequestResult<Vec<usize>> {
        if let Some(number) = self.book.of_tag(text) {
            return Ok(vec![number]);
        }
        let operand = self.view.names.find_one(text)?;
        let numbers = match operand.cell {
            bit @ (Cell::Bit(_) | Cell::WordBit(_)) => {
                self.book.of_bit(self.latest.generation, bit)
            }
            Cell::Word(_) => Vec::new(),
        };
        if numbers.is_empty() {
            let message = format!(
                "`{text}` is no alarm: an alarm is a bit whose tag has the key `alarm`, or the \
                 name of a `[[watch]]` (`rungd alarms` lists those that can be acknowledged)"
            );
            return Err(RequestRefusal::new(RefusalKind::BadOperand, message));
        }
        Ok(numbers)
    }
}

/// Logs an acknowledgement.
fn log_acknowledgement(peer: &OperatorPeer, acked: &AckedAlarm) {
    let AckedAlarm { tag, text, before, after, .. } = acked;
    let gone = if *before == AlarmState::Returned { ", which went away before" } else { "" };
    let text = one_line(text);
    say!(
        OPERATOR_ACK,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        %tag,
        before = %before.name(),
        after = %after.name(),
        "{peer} acknowledged alarm {tag}{gone}: {text}"
    );
}
