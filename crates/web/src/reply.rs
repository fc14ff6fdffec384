//! Answers: JSON, pages, events, and failures.

use hyper::header::{CONTENT_TYPE, HeaderValue};
use hyper::{Response, StatusCode};
use serde_json::Value;

use super::body::AnswerBody;

/// An answer.
pub(super) type WebAnswer = Response<AnswerBody>;

/// Why a request fails: the status, and the reason.
pub(super) struct WebFailure(pub StatusCode, pub String);

/// A request that cannot be answered as it is.
pub(super) fn bad(why: impl Into<String>) -> WebFailure {
    WebFailure(StatusCode::BAD_REQUEST, why.into())
}

/// The result of a request.
pub(super) type WebResult = Result<WebAnswer, WebFailure>;

/// An answer in JSON.
pub(super) fn json_answer(value: &Value) -> WebAnswer {
    typed("application/json", AnswerBody::of(value.to_string()))
}

/// An answer of a content type.
pub(super) fn typed(kind: &'static str, body: AnswerBody) -> WebAnswer {
    let mut answer = Response::new(body);
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

/// Answers a question on a thread for blocking work.
pub(super) async fn computed(
    question: impl FnOnce() -> Result<Value, WebFailure> + Send + 'static,
) -> WebResult {
    match tokio::task::spawn_blocking(question).await {
        Ok(answered) => answered.map(|value| json_answer(&value)),
        Err(bug) => {
            let why = format!("a bug in rungd: {bug}");
            Err(WebFailure(StatusCode::INTERNAL_SERVER_ERROR, why))
        }
    }
}
