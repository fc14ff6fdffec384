//! Holds a bit ON while a person presses a button of a page.
//!
//! Called by `answer`. A hold begins as a write of ON, and has an end. The page renews it as long
//! as the button is pressed; each renewal puts the end off. The scan thread itself turns the bit
//! OFF at the end (`runtime::hold`), so nothing here must run for it: this module checks the right,
//! and logs the end with the name of the user. It has no timer that moves anything.

use std::collections::HashMap;
use std::sync::MutexGuard;
use std::time::Duration;

use tokio::time::{sleep, timeout};

use super::known_hold::KnownHold;
use super::logged_change::{LoggedOperandChange, PreviousState};
use super::page_rights::{WriteTerms, judge_right};
use super::peer::PeerRequest;
use super::refused::{not_for_holds, not_taken};
use super::service::OperatorService;
use super::write::HeldWrite;
use rungd_base::duration_text::duration_text;
use rungd_base::locked::locked;
use rungd_client::operator::deadline;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{
    BitOrNumber, HOLD_MAX, HOLD_PERIOD_MAX, HeldOperand, HoldState, RefusalKind, RequestRefusal,
    RequestResult,
};
use rungd_runtime::exchange::{BatchRefusal, BatchTerms, Ticket};
use rungd_runtime::hold_step::HoldStep;
use rungd_runtime::{Origin, events};

/// The longest wait for the image that shows the end of a hold, before its line is logged.
const SHOWN_MAX: Duration = Duration::from_secs(1);

impl OperatorService {
    /// Turns a bit ON, and begins its hold.
    pub(super) async fn hold(
        &self,
        asker: &PeerRequest,
        operand: &str,
        terms: WriteTerms<'_>,
    ) -> RequestResult<HeldOperand> {
        let period = Duration::from_nanos(self.port.tempo().period_ns);
        if period > HOLD_PERIOD_MAX {
            let message = format!(
                "`{operand}` is not held: a scan comes every {}, and a hold ends in time only with \
                 `scan.period` of at most {}",
                duration_text(period.as_nanos() as u64),
                duration_text(HOLD_PERIOD_MAX.as_nanos() as u64),
            );
            return Err(RequestRefusal::new(RefusalKind::Refused, message));
        }
        let asker = PeerRequest { until_ns: until_ns(asker), ..asker.clone() };
        let HeldWrite { hold, operand, change } = self.write_hold(&asker, operand, terms).await?;
        let [person, reason] = [terms.person, terms.reason].map(|text| text.map(str::to_owned));
        let (peer, from_page, until_ns) = (asker.peer.clone(), terms.from_page, asker.until_ns);
        let known = KnownHold { peer, person, from_page, reason, operand, until_ns };
        self.holds().insert(hold.0, known);
        self.tell_end(hold);
        Ok(HeldOperand { hold: hold.0, change })
    }

    /// Puts off the end of a hold of the same user.
    pub(super) async fn keep_hold(
        &self,
        asker: &PeerRequest,
        hold: u64,
    ) -> RequestResult<HoldState> {
        let known = self.known_hold(asker, hold)?;
        let view = self.seen().1;
        let now = view.names.again(&known.operand);
        let now = now.filter(|operand| view.pages.hold.contains(&operand.what));
        let now = now.ok_or_else(|| not_for_holds(&known.operand.operand))?;
        // A reload may have taken the right away.
        if known.from_page {
            judge_right(&view.pages, &now, known.terms())?;
        }
        let until_ns = until_ns(asker);
        self.step(hold, HoldStep::Keep { hold: Ticket(hold), until_ns }).await?;
        // For the scan log, which forgets the signatures of its earlier parts.
        self.port.sign(Origin::Batch(Ticket(hold)), known.peer.to_string());
        if let Some(known) = self.holds().get_mut(&hold) {
            known.until_ns = known.until_ns.max(until_ns);
        }
        Ok(HoldState { hold })
    }

    /// Ends a hold of the same user.
    pub(super) async fn end_hold(
        &self,
        asker: &PeerRequest,
        hold: u64,
    ) -> RequestResult<HoldState> {
        let known = self.known_hold(asker, hold)?;
        self.step(hold, HoldStep::End { hold: Ticket(hold) }).await?;
        if self.holds().remove(&hold).is_some() {
            self.log_end(&known, &format!("released {}", known.operand));
        }
        Ok(HoldState { hold })
    }

    fn known_hold(&self, asker: &PeerRequest, hold: u64) -> RequestResult<KnownHold> {
        let known = self.holds().get(&hold).cloned();
        let is_own = |known: &KnownHold| {
            (known.peer.uid, &known.peer.name) == (asker.peer.uid, &asker.peer.name)
        };
        let ended = || not_taken(BatchRefusal::HoldEnded, &self.port);
        known.filter(is_own).ok_or_else(ended)
    }

    /// Hands in a step of a hold, and waits for its scan.
    async fn step(&self, hold: u64, step: HoldStep) -> RequestResult<()> {
        let until_ns = match step {
            HoldStep::Begin { until_ns } | HoldStep::Keep { until_ns, .. } => until_ns,
            // To end it is right at any time.
            HoldStep::End { .. } => deadline::NEVER_NS,
        };
        let generation = self.port.latest().generation;
        let terms = BatchTerms { until_ns, hold: Some(step), ..BatchTerms::of(generation) };
        let refused = |why| not_taken(why, &self.port);
        let ticket = self.port.submit_by(terms, Vec::new()).map_err(refused)?;
        match timeout(self.wait(), self.port.done(ticket)).await {
            Ok(done) => done.map_err(refused),
            Err(_) => Err(super::refused::no_answer()),
        }
        .inspect_err(|_| {
            // The watch over its end logs it.
            if let Some(known) = self.holds().get_mut(&hold) {
                known.until_ns = known.until_ns.min(deadline::now_ns());
            }
        })
    }

    /// Logs the end of a hold that is not released, when it is over.
    fn tell_end(&self, hold: Ticket) {
        let service = self.clone();
        tokio::spawn(async move {
            loop {
                let Some(known) = service.holds().get(&hold.0).cloned() else { return };
                match known.until_ns.checked_sub(deadline::now_ns()) {
                    Some(left_ns) => sleep(Duration::from_nanos(left_ns) + HOLD_PERIOD_MAX).await,
                    None => {
                        service.holds().remove(&hold.0);
                        let is_off = service.is_off(&known.operand);
                        let _ = timeout(SHOWN_MAX, is_off).await;
                        // Nothing renewed it in time, a step failed, or a new RUN began.
                        let did = format!(
                            "is gone from the button of {}, whose hold ended without a release",
                            known.operand
                        );
                        return service.log_end(&known, &did);
                    }
                }
            }
        });
    }

    /// Ends with an image in which an operand is OFF or gone.
    async fn is_off(&self, operand: &Variable) {
        loop {
            let latest = self.port.latest();
            let shown = self.sight(operand).map(|sight| sight.shown().value);
            if shown.is_none_or(|value| value == BitOrNumber::Bit(false)) {
                return;
            }
            self.port.changed(&latest).await;
        }
    }

    fn log_end(&self, known: &KnownHold, did: &str) {
        let was = PreviousState { value: BitOrNumber::Bit(true), forced: false };
        let told = LoggedOperandChange::new(&known.peer, &known.operand, was);
        match self.sight(&known.operand) {
            Some(sight) => told.log(&events::OPERATOR_WRITE, did, sight.shown().value),
            None => told.log_removed(&events::OPERATOR_WRITE, did),
        }
    }

    fn holds(&self) -> MutexGuard<'_, HashMap<u64, KnownHold>> {
        locked(&self.known_holds)
    }
}

/// The end of a hold that is begun or renewed now: never later than the client says, and never
/// later than [`HOLD_MAX`] from now.
fn until_ns(asker: &PeerRequest) -> u64 {
    asker.until_ns.min(deadline::now_ns().saturating_add(HOLD_MAX.as_nanos() as u64))
}
