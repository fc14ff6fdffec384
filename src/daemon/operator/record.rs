//! Answers an operator with the part of the scan log that is in memory. `rungd why` and
//! `rungd record` use it.
//!
//! Called by `desk`. A recording contains the ladder's files. So a client that may only look gets a
//! recording only if everybody may read these files.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use tokio::time::timeout;

use super::peer::Peer;
use super::status::About;
use crate::operator::protocol::{RecordingBytes, Refusal, RefusalKind};
use std::time::Duration;

/// The time limit for the scan log's thread.
const THREAD_MAX: Duration = Duration::from_secs(10);

/// The most recent part of the scan log, as a recording: the sections from a number on.
///
/// # Errors
/// The peer may not read the ladder, or the thread does not answer.
pub(super) async fn recent(
    about: &About,
    peer: &Peer,
    from: u64,
) -> Result<RecordingBytes, Refusal> {
    if !peer.may_change && !about.is_public() {
        let message = format!(
            "{peer} may only look, and a recording contains the ladder's files, which not \
             everybody may read: recordings are for root, the user rungd runs as, and members of \
             the socket's group; or give everybody the right to read these files"
        );
        return Err(Refusal::new(RefusalKind::NotPermitted, message));
    }
    let recent = timeout(THREAD_MAX, about.recording().recent(from)).await;
    let Ok(Some(bytes)) = recent else {
        let message = "the thread of the scan log gives no answer (a bug in rungd)";
        return Err(Refusal::new(RefusalKind::NoAnswer, message));
    };
    Ok(RecordingBytes { base64: BASE64_STANDARD.encode(bytes) })
}
