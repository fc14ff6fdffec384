//! Answers an operator with what the scan log has in memory, for `rungd why` and `rungd record`.
//!
//! Called by `desk`. A recording has the ladder's files in it, so those who may only look get it
//! only where everybody may read these files.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use tokio::time::timeout;

use super::peer::Peer;
use super::status::About;
use crate::operator::protocol::{RecordingBytes, Refusal, RefusalKind};
use std::time::Duration;

/// The time limit of the scan log's thread.
const THREAD_MAX: Duration = Duration::from_secs(10);

/// The scan log's last while, as a recording: the sections from a number on.
///
/// # Errors
/// The peer may not read the ladder; or the thread does not answer.
pub(super) async fn recent(
    about: &About,
    peer: &Peer,
    from: u64,
) -> Result<RecordingBytes, Refusal> {
    if !peer.may_change && !about.is_public() {
        let message = format!(
            "{peer} may only look, and a recording holds the ladder's files, which not everybody \
             may read: it is for root, the user rungd runs as, and members of the socket's group; \
             or give everybody the right to read these files"
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
