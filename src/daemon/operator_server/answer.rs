//! Answers an operator's requests: each is carried out by its function, and the result becomes a
//! line.
//!
//! Called by `session` for each request that its client is permitted to make.

use std::sync::Arc;

use serde::Serialize;

use super::memory;
use super::page_rights::WriteTerms;
use super::peer::PeerRequest;
use super::record;
use super::service::{OperatorService, log_level};
use super::shelves::ShelveRequest;
use crate::daemon::reload::Caller;
use rungd_client::operator::protocol::{GivenWrite, NameList, Reply, Request, RequestResult};

impl OperatorService {
    /// Carries out a request; returns the line of its answer.
    pub(super) async fn answer(
        &self,
        asker: &PeerRequest,
        request: &Request,
    ) -> RequestResult<Vec<u8>> {
        let asker = &asker.acting_for(person(request))?;
        let peer = &asker.peer;
        match request {
            Request::Status {} => answered(self.status()),
            Request::Read { operands, each } => answered(self.read(operands, *each).await?),
            Request::ReadSet { operands } => answered(self.read_set(operands)?),
            Request::Write { operand, value, .. } => {
                let write = GivenWrite { operand: operand.clone(), value: value.clone() };
                answered(self.write(asker, &write, terms(request)).await?)
            }
            Request::WriteSet { writes, .. } => {
                answered(self.write_set(asker, writes, terms(request)).await?)
            }
            Request::Hold { operand, .. } => {
                answered(self.hold(asker, operand, terms(request)).await?)
            }
            Request::KeepHold { hold, .. } => answered(self.keep_hold(asker, *hold).await?),
            Request::EndHold { hold, .. } => answered(self.end_hold(asker, *hold).await?),
            Request::Force { operand, value } => answered(self.force(asker, operand, value).await?),
            Request::Unforce { operand } => answered(self.unforce(asker, operand).await?),
            Request::UnforceAll {} => answered(self.unforce_all(asker).await?),
            Request::Mode { to, no_wait } => {
                let changed = self.mode(asker, *to).await?;
                answered(self.durable(changed, *to, *no_wait).await)
            }
            Request::Alarms {} => answered(self.alarms().await),
            Request::Ack { alarms, .. } => answered(self.acknowledge(asker, Some(alarms)).await?),
            Request::Shelve { alarms, for_ms, why, .. } => {
                let wanted = ShelveRequest { alarms, for_ms: *for_ms, why };
                answered(self.shelve(peer, wanted).await?)
            }
            Request::Unshelve { alarms, .. } => answered(self.unshelve(peer, alarms).await?),
            Request::AckAll {} => answered(self.acknowledge(asker, None).await?),
            Request::LogLevel { level } => answered(log_level(peer, *level)),
            Request::Reload { dry_run } => {
                answered(Arc::clone(&self.reloads).reload(caller(asker), *dry_run).await?)
            }
            Request::Rollback {} => {
                answered(Arc::clone(&self.reloads).rollback(caller(asker)).await?)
            }
            Request::RetainSave {} => {
                let view = self.seen().1;
                answered(memory::save(view.about.retention(), peer).await?)
            }
            Request::Recording { from_section } => {
                let (view, from) = (self.seen().1, from_section.unwrap_or(0));
                record::recent(&view.about, &|| self.present(), peer, from).await
            }
            Request::Deploys {} => {
                let about = &self.seen().1.about;
                record::may_read(about, peer).await?;
                answered(about.deploys())
            }
            Request::Metrics {} => answered(self.names().metrics()),
            Request::Names { prefix } => {
                answered(NameList { names: self.names().beginning(prefix) })
            }
        }
    }
}

/// How a change is asked for.
fn terms(request: &Request) -> WriteTerms<'_> {
    let terms = WriteTerms { person: person(request), ..WriteTerms::default() };
    let (Request::Write { from_page, reason, .. }
    | Request::WriteSet { from_page, reason, .. }
    | Request::Hold { from_page, reason, .. }) = request
    else {
        return terms;
    };
    WriteTerms { from_page: *from_page, reason: reason.as_deref(), ..terms }
}

/// The person for whom a client makes a request.
fn person(request: &Request) -> Option<&str> {
    match request {
        Request::Write { for_user, .. }
        | Request::WriteSet { for_user, .. }
        | Request::Hold { for_user, .. }
        | Request::KeepHold { for_user, .. }
        | Request::EndHold { for_user, .. }
        | Request::Ack { for_user, .. }
        | Request::Shelve { for_user, .. }
        | Request::Unshelve { for_user, .. } => for_user.as_deref(),
        Request::Status { .. }
        | Request::Read { .. }
        | Request::ReadSet { .. }
        | Request::Force { .. }
        | Request::Unforce { .. }
        | Request::UnforceAll { .. }
        | Request::Alarms { .. }
        | Request::AckAll { .. }
        | Request::Mode { .. }
        | Request::Reload { .. }
        | Request::Rollback { .. }
        | Request::LogLevel { .. }
        | Request::RetainSave { .. }
        | Request::Recording { .. }
        | Request::Metrics { .. }
        | Request::Deploys { .. }
        | Request::Names { .. } => None,
    }
}

fn caller(asker: &PeerRequest) -> Caller {
    Caller { who: asker.peer.to_string(), until_ns: asker.until_ns }
}

/// The line of an answer.
fn answered(answer: impl Serialize) -> RequestResult<Vec<u8>> {
    Ok(Reply::Ok(answer).line())
}
