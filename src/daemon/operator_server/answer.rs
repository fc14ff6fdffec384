//! Answers an operator's requests: each is carried out by its function, and the result becomes a
//! line.
//!
//! Called by `session` for each request that its client is permitted to make.

use std::sync::Arc;

use serde::Serialize;

use super::memory;
use super::peer::PeerRequest;
use super::record;
use super::service::{OperatorService, log_level};
use crate::daemon::reload::Caller;
use rungd_client::operator::protocol::{GivenWrite, NameList, Reply, Request, RequestResult};

impl OperatorService {
    /// Carries out a request; returns the line of its answer.
    pub(super) async fn answer(
        &self,
        asker: &PeerRequest,
        request: &Request,
    ) -> RequestResult<Vec<u8>> {
        let peer = &asker.peer;
        match request {
            Request::Status {} => answered(self.status()),
            Request::Read { operands, each } => answered(self.read(operands, *each).await?),
            Request::ReadSet { operands } => answered(self.read_set(operands)?),
            Request::Write { operand, value, for_user, from_page } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                let write = GivenWrite { operand: operand.clone(), value: value.clone() };
                answered(self.write(&asker, &write, *from_page).await?)
            }
            Request::WriteSet { writes, for_user, from_page } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                answered(self.write_set(&asker, writes, *from_page).await?)
            }
            Request::Hold { operand, for_user, from_page } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                answered(self.hold(&asker, operand, *from_page).await?)
            }
            Request::KeepHold { hold, for_user } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                answered(self.keep_hold(&asker, *hold).await?)
            }
            Request::EndHold { hold, for_user } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                answered(self.end_hold(&asker, *hold).await?)
            }
            Request::Force { operand, value } => answered(self.force(asker, operand, value).await?),
            Request::Unforce { operand } => answered(self.unforce(asker, operand).await?),
            Request::UnforceAll {} => answered(self.unforce_all(asker).await?),
            Request::Mode { to, no_wait } => {
                let changed = self.mode(asker, *to).await?;
                answered(self.durable(changed, *to, *no_wait).await)
            }
            Request::Alarms {} => answered(self.alarms().await),
            Request::Ack { alarms, for_user } => {
                let asker = asker.acting_for(for_user.as_deref())?;
                answered(self.acknowledge(&asker, Some(alarms)).await?)
            }
            Request::AckAll {} => answered(self.acknowledge(asker, None).await?),
            Request::LogLevel { level } => answered(log_level(peer, *level)),
            Request::Reload { dry_run } => {
                let reloads = Arc::clone(&self.reloads);
                answered(reloads.reload(caller(asker), *dry_run).await?)
            }
            Request::Rollback {} => {
                let reloads = Arc::clone(&self.reloads);
                answered(reloads.rollback(caller(asker)).await?)
            }
            Request::RetainSave {} => {
                let view = self.seen().1;
                answered(memory::save(view.about.retention(), peer).await?)
            }
            Request::Recording { from_section } => {
                let (view, from) = (self.seen().1, from_section.unwrap_or(0));
                record::recent(&view.about, &|| self.present(), peer, from).await
            }
            Request::Metrics {} => answered(self.names().metrics()),
            Request::Names { prefix } => {
                let names = self.names().beginning(prefix);
                answered(NameList { names })
            }
        }
    }
}

fn caller(asker: &PeerRequest) -> Caller {
    Caller { who: asker.peer.to_string(), until_ns: asker.until_ns }
}

/// The line of an answer.
fn answered(answer: impl Serialize) -> RequestResult<Vec<u8>> {
    Ok(Reply::Ok(answer).line())
}
