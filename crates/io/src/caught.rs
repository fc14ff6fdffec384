//! Turns a panic of a future into a value, so that a task can continue after a bug in one part of
//! it.
//!
//! Does not log the panic: the daemon's panic hook has already logged it.

use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::task::Poll;

/// The call's value; `None` if it panics. The future is not polled again then, so no code sees its
/// half-done state. The caller has to decide whether everything that the future borrowed is still
/// usable.
pub async fn caught<T>(call: impl Future<Output = T>) -> Option<T> {
    let mut call = pin!(call);
    poll_fn(|context| match catch_unwind(AssertUnwindSafe(|| call.as_mut().poll(context))) {
        Ok(poll) => poll.map(Some),
        Err(_) => Poll::Ready(None),
    })
    .await
}
