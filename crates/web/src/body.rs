//! The bodies of answers: complete bytes, or a stream of events. A stream buffers one event at
//! most, so a browser that does not read uses no more memory.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use hyper::body::{Body, Bytes, Frame, SizeHint};
use tokio::sync::mpsc::Receiver;

use rungd_io::seats::BusySeat;

/// The body of an answer.
pub(super) enum AnswerBody {
    /// The whole body.
    Whole(Option<Bytes>),
    /// A stream of events; the connection is busy until it ends.
    Events(Receiver<Bytes>, Option<BusySeat>),
}

impl AnswerBody {
    /// A complete body.
    pub fn of(bytes: impl Into<Bytes>) -> AnswerBody {
        AnswerBody::Whole(Some(bytes.into()))
    }

    /// Keeps the connection busy while events are sent.
    pub fn hold(&mut self, busy: BusySeat) {
        match self {
            AnswerBody::Whole(_) => {}
            AnswerBody::Events(_, held) => *held = Some(busy),
        }
    }
}

impl Body for AnswerBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        match &mut *self {
            AnswerBody::Whole(bytes) => Poll::Ready(bytes.take().map(|b| Ok(Frame::data(b)))),
            AnswerBody::Events(events, _) => {
                events.poll_recv(context).map(|event| event.map(|bytes| Ok(Frame::data(bytes))))
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        matches!(self, AnswerBody::Whole(None))
    }

    fn size_hint(&self) -> SizeHint {
        match self {
            AnswerBody::Whole(bytes) => {
                SizeHint::with_exact(bytes.as_ref().map_or(0, |bytes| bytes.len() as u64))
            }
            AnswerBody::Events(..) => SizeHint::default(),
        }
    }
}
