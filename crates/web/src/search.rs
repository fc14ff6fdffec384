//! A search for a page, with the feature `prove`: how a value could change.
//!
//! Called by `api`. A search takes up to ten seconds and all processors: one at a time. It ends as
//! soon as its page is gone.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use hyper::StatusCode;
use serde_json::Value;

use super::reply::{WebFailure, WebResult, computed};
use super::site::WebSite;

/// Ends a search with the request that waits for it.
struct WaitingPage(Arc<AtomicBool>);

impl Drop for WaitingPage {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Answers a question whose flag tells that nobody waits any more.
pub(super) async fn search(
    site: &WebSite,
    question: impl FnOnce(Arc<AtomicBool>) -> Result<Value, WebFailure> + Send + 'static,
) -> WebResult {
    let place = Arc::clone(&site.searches).try_acquire_owned().map_err(|_| {
        let busy = "another search runs: try again in some seconds";
        WebFailure(StatusCode::SERVICE_UNAVAILABLE, busy.to_owned())
    })?;
    let given_up = Arc::new(AtomicBool::new(false));
    let waiting = WaitingPage(Arc::clone(&given_up));
    let answered = computed(move || {
        let _place = place;
        question(given_up)
    });
    let answered = answered.await;
    drop(waiting);
    answered
}
