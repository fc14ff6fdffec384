//! How many requests of a connection are under way: asked and not answered yet.
//!
//! The library begins every request at once, whatever is under way, and keeps each answer until its
//! client has read it. So the gate reads no more of a client than this allows: one that asks and
//! asks, and reads nothing, waits. Called by `gate` with the frames of both directions, whose kinds
//! are not encrypted.

use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::Notify;

use crate::frames::{FrameKind, FrameStart};

/// The most requests under way; those that come in one piece with the last of them come too.
/// Clients keep a few requests to publish waiting, the library at most 20 of a session.
pub const UNDER_WAY_MAX: usize = 64;

/// The requests under way.
#[derive(Debug, Default)]
pub struct RequestsUnderWay {
    count: AtomicUsize,
    answered: Notify,
}

impl RequestsUnderWay {
    /// Takes a frame of the client.
    pub fn ask(&self, frame: FrameStart<'_>) {
        if frame.kind == FrameKind::Message && frame.chunk == b'F' {
            self.count.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Takes a frame of the server.
    pub fn answer(&self, frame: FrameStart<'_>) {
        if frame.kind == FrameKind::Message && frame.chunk != b'C' {
            let fewer = |count: usize| Some(count.saturating_sub(1));
            let _ = self.count.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fewer);
            self.answered.notify_one();
        }
    }

    /// Waits until another request may come. For one task alone.
    pub async fn room(&self) {
        while self.count.load(Ordering::Relaxed) >= UNDER_WAY_MAX {
            self.answered.notified().await;
        }
    }
}
