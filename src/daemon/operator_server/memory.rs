//! Answers an operator about retentive memory: saves it on request, and waits for the image of a
//! stop.
//!
//! Called by `service`. `retain_thread` writes; this module turns the outcome into an answer.

use tokio::time::timeout;

use super::peer::OperatorPeer;
use crate::daemon::retain_thread::{NotSaved, RetainHandle};
use rungd_client::operator::protocol::{MemorySave, RefusalKind, RequestRefusal};
use rungd_runtime::say::say;
use std::time::Duration;

/// The time limit for the disk.
const DISK_MAX: Duration = Duration::from_secs(120);
const DISK_LATE: &str = "the disk has not answered in time; the image may still be saved";

/// Saves the latest image, and answers once it is durable.
///
/// # Errors
/// It is not kept, or the disk has not answered in time.
pub(super) async fn save(
    retention: Option<&RetainHandle>,
    peer: &OperatorPeer,
) -> Result<MemorySave, RequestRefusal> {
    let refused = |message: String| RequestRefusal::new(RefusalKind::Refused, message);
    let retention = retention
        .ok_or_else(|| refused("the controller file retains nothing: see `[retain]`".to_owned()))?;
    let late = |_| RequestRefusal::new(RefusalKind::NoAnswer, DISK_LATE);
    let saved = timeout(DISK_MAX, durable(retention)).await.map_err(late)?;
    let saved = saved
        .map_err(|why| refused(format!("{}: not kept: {why}", retention.wanted.path.display())))?;
    let MemorySave { image, scan, .. } = saved;
    say!(
        RETAIN_SAVED,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        image,
        scan,
        "{peer} saved retentive memory: image {image} of scan {scan} is durable"
    );
    Ok(saved)
}

/// After a stop: the last image, once it is durable. `Ok(None)` if there is no image to keep; `Err`
/// gives the reason why the image is not kept, and the remedy.
pub(super) async fn last_image(
    retention: Option<&RetainHandle>,
) -> Result<Option<MemorySave>, String> {
    let Some(retention) = retention else { return Ok(None) };
    let why = match timeout(DISK_MAX, durable(retention)).await {
        Ok(Ok(saved)) => return Ok(Some(saved)),
        Ok(Err(NotSaved::NothingToKeep | NotSaved::NothingRetained)) => return Ok(None),
        Ok(Err(NotSaved::Failed(why))) => why,
        Err(_) => DISK_LATE.to_owned(),
    };
    Err(format!(
        "{}: the last image is not kept: {why}. Memory is as the stop left it while rungd runs: \
         repair the disk or the file, then run `rungd retain save` before the process ends",
        retention.wanted.path.display()
    ))
}

async fn durable(retention: &RetainHandle) -> Result<MemorySave, NotSaved> {
    let durable = retention.save().await?;
    let stamp = durable.kept.stamp;
    Ok(MemorySave {
        file: retention.wanted.path.display().to_string(),
        image: stamp.sequence,
        scan: stamp.scan,
        flush_us: durable.flush.as_micros() as u64,
    })
}
