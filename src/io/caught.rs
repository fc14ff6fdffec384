//! A future whose panic is an answer: for what must go on behind a bug in a part of it.
//!
//! The panic itself is in the log already: the daemon's hook puts it there.

use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::task::Poll;

/// What the call gives; `None` if it panics. It is not polled again then, so that nobody sees what
/// it left half done; what it borrowed, its caller has to judge.
pub async fn caught<T>(call: impl Future<Output = T>) -> Option<T> {
    let mut call = pin!(call);
    poll_fn(|context| match catch_unwind(AssertUnwindSafe(|| call.as_mut().poll(context))) {
        Ok(poll) => poll.map(Some),
        Err(_) => Poll::Ready(None),
    })
    .await
}
