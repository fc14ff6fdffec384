//! Answers an operator with the part of the scan log that is in memory. `rungd why` and
//! `rungd record` use it.
//!
//! Called by `service`. A recording contains the files of its programs. So a client that may only
//! look gets a recording only if everybody may read the files of the running program, and could
//! read those of all earlier programs in it when they were loaded. A recording can have many
//! megabytes, so other threads read rights and make the answer.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use super::peer::OperatorPeer;
use super::status::StatusFacts;
use rungd_client::operator::protocol::{
    PresentOutputs, RecordingBytes, RefusalKind, Reply, RequestRefusal, RequestResult,
};
use rungd_config::load;
use rungd_history::record::RecordedFile;

/// The time limit for the scan log's thread, and for the rights of the files.
const THREAD_MAX: Duration = Duration::from_secs(10);

/// The most recent part of the scan log, as the line of an answer: the sections from a number on.
///
/// # Errors
/// The peer may not read the ladder, or the thread does not answer.
pub(super) async fn recent(
    about: &StatusFacts,
    present: &(dyn Fn() -> PresentOutputs + Sync),
    peer: &OperatorPeer,
    from: u64,
) -> RequestResult<Vec<u8>> {
    may_read(about, peer).await?;
    let recent = timeout(THREAD_MAX, about.recording().recent(from)).await;
    let Ok(Some(recent)) = recent else {
        let message = "the thread of the scan log gives no answer (a bug in rungd)";
        return Err(RequestRefusal::new(RefusalKind::NoAnswer, message));
    };
    if !peer.may_see_files && !recent.is_public {
        return Err(private(peer));
    }
    // Taken after the log, so that no mode of the log is newer.
    let present = Some(present());
    let line = spawn_blocking(move || {
        let base64 = BASE64_STANDARD.encode(recent.bytes);
        Reply::Ok(RecordingBytes { base64, present }).line()
    });
    line.await
        .map_err(|bug| RequestRefusal::new(RefusalKind::Refused, format!("a bug in rungd: {bug}")))
}

/// Whether a client may read the files of the running program.
///
/// # Errors
/// It may only look, and not everybody may read them.
pub(super) async fn may_read(about: &StatusFacts, peer: &OperatorPeer) -> RequestResult<()> {
    match peer.may_see_files || are_public(about.files()).await {
        true => Ok(()),
        false => Err(private(peer)),
    }
}

/// Whether everybody may read these files now.
async fn are_public(files: &Arc<[RecordedFile]>) -> bool {
    let files = Arc::clone(files);
    let look = move || files.iter().all(|file| load::may_all_read(Path::new(&file.name)));
    matches!(timeout(THREAD_MAX, spawn_blocking(look)).await, Ok(Ok(true)))
}

fn private(peer: &OperatorPeer) -> RequestRefusal {
    let message = format!(
        "{peer} may only look, and a recording contains the ladder's files, which not everybody \
         may read, or could read when they were loaded: recordings are for root, the user rungd \
         runs as, and members of the socket's group; or give everybody the right to read these \
         files, and restart rungd"
    );
    RequestRefusal::new(RefusalKind::NotPermitted, message)
}
