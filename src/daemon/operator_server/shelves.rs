//! Shelves alarms for an operator, and brings them back.
//!
//! Called by `answer`. `daemon::alarm_book` keeps the shelves; an answer waits until `alarm_file`
//! has them on the disk, and says so if a restart would forget them.

use super::alarms::NamedAlarms;
use super::peer::OperatorPeer;
use super::service::OperatorService;
use crate::daemon::alarm_book::{AlarmBook, WantedShelf};
use crate::daemon::alarm_file::now;
use crate::daemon::narration::one_line;
use rungd_base::duration_text::duration_text;
use rungd_client::operator::protocol::{
    REASON_CHARS_MAX, RefusalKind, RequestRefusal, RequestResult, SHELF_MS_MAX, ShelfList,
    ShelvedAlarm, is_reason,
};
use rungd_runtime::say::say;

/// What an operator wants of alarms.
pub(super) struct ShelveRequest<'a> {
    /// The texts that name them.
    pub alarms: &'a [String],
    /// The time until they come back, ms; `None`: out of service.
    pub for_ms: Option<u64>,
    pub why: &'a str,
}

impl OperatorService {
    /// Shelves all of these alarms or none.
    ///
    /// # Errors
    /// A text names no alarm, or an alarm that is not shelved; the time or the reason is wrong.
    pub(super) async fn shelve(
        &self,
        peer: &OperatorPeer,
        wanted: ShelveRequest<'_>,
    ) -> RequestResult<ShelfList> {
        wanted.check()?;
        let ShelveRequest { alarms, for_ms, why } = wanted;
        let (latest, view) = self.booked().await;
        let shelf = WantedShelf { who: peer.name.clone(), why: why.trim().to_owned(), for_ms };
        let alarms: Vec<ShelvedAlarm> = {
            let mut book = view.about.book();
            let names = NamedAlarms { book: &book, view: &view, latest: &latest };
            let numbers = names.all(alarms)?;
            let refused = numbers.iter().find(|number| !book.may_shelve(**number));
            if let Some(number) = refused {
                return Err(critical(&book, *number));
            }
            let now = now(&self.port);
            numbers.iter().filter_map(|at| book.shelve(*at, shelf.clone(), now)).collect()
        };
        alarms.iter().for_each(|alarm| log_shelf(peer, alarm, for_ms));
        Ok(ShelfList { alarms, not_kept: self.not_kept().await })
    }

    /// Brings all of these alarms back.
    ///
    /// # Errors
    /// A text names no alarm; then none comes back.
    pub(super) async fn unshelve(
        &self,
        peer: &OperatorPeer,
        alarms: &[String],
    ) -> RequestResult<ShelfList> {
        let (latest, view) = self.booked().await;
        let alarms: Vec<ShelvedAlarm> = {
            let mut book = view.about.book();
            let names = NamedAlarms { book: &book, view: &view, latest: &latest };
            let numbers = names.all(alarms)?;
            let now = now(&self.port);
            numbers.iter().filter_map(|number| book.unshelve(*number, now)).collect()
        };
        let ended = alarms.iter().filter(|alarm| alarm.before.is_some());
        ended.for_each(|alarm| log_unshelved(peer, alarm));
        Ok(ShelfList { alarms, not_kept: self.not_kept().await })
    }

    /// Why a restart would forget the shelves.
    async fn not_kept(&self) -> Option<String> {
        let file = self.seen().1.about.alarm_file().cloned();
        match file {
            Some(file) => file.kept().await.err(),
            None => None,
        }
    }
}

impl ShelveRequest<'_> {
    /// # Errors
    /// The time or the reason is wrong.
    fn check(&self) -> RequestResult<()> {
        let refuse = |message: String| RequestRefusal::new(RefusalKind::BadRequest, message);
        if self.for_ms.is_some_and(|ms| !(1..=SHELF_MS_MAX).contains(&ms)) {
            let most = SHELF_MS_MAX / 3_600_000;
            return Err(refuse(format!(
                "an alarm is shelved for at least 1ms and at most {most}h; one that is to stay \
                 away for longer is taken out of service (`rungd shelve --out-of-service`)"
            )));
        }
        if !is_reason(self.why.trim()) {
            return Err(refuse(format!(
                "give the reason, which the list shows: one line of at most {REASON_CHARS_MAX} \
                 characters (`--why`)"
            )));
        }
        Ok(())
    }
}

fn critical(book: &AlarmBook, number: usize) -> RequestRefusal {
    let message = format!(
        "`{}` is critical: it is shelved only if the controller file has `[alarms] \
         shelve-critical = true`; nothing is shelved",
        book.tag(number)
    );
    RequestRefusal::new(RefusalKind::Refused, message)
}

fn log_shelf(peer: &OperatorPeer, alarm: &ShelvedAlarm, for_ms: Option<u64>) {
    let ShelvedAlarm { tag, text, after, .. } = alarm;
    let Some(shelf) = after else { return };
    let did = match for_ms {
        Some(ms) => format!("shelved alarm {tag} for {}", duration_text(ms * 1_000_000)),
        None => format!("took alarm {tag} out of service"),
    };
    let (after, why, text) = (shelf.name(), one_line(&shelf.why), one_line(text));
    say!(
        OPERATOR_SHELVE,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        %tag,
        after,
        for_ms = for_ms.unwrap_or_default(),
        why = %why,
        "{peer} {did}: {why} ({text})"
    );
}

fn log_unshelved(peer: &OperatorPeer, alarm: &ShelvedAlarm) {
    let ShelvedAlarm { tag, text, before, .. } = alarm;
    let Some(shelf) = before else { return };
    let (before, text) = (shelf.name(), one_line(text));
    let did = match shelf.is_timed() {
        true => format!("brought alarm {tag} back from its shelf"),
        false => format!("returned alarm {tag} to service"),
    };
    say!(
        OPERATOR_UNSHELVE,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        %tag,
        before,
        "{peer} {did}: {text}"
    );
}
