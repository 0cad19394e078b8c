//! Refusals as HTTP answers, and work that blocks.

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use protocol::v1::Reason;
use schemars::JsonSchema;
use serde::Serialize;

use crate::session::intake::Rejection;

/// Why a request is refused.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct Refused {
    /// A name of the list in protocol/SPEC.md.
    reason: String,
    /// For people, with the values.
    text: String,
}

fn status(reason: Reason) -> StatusCode {
    match reason {
        Reason::MalformedMessage | Reason::InvalidSessionId => StatusCode::BAD_REQUEST,
        Reason::Unauthenticated => StatusCode::UNAUTHORIZED,
        Reason::Forbidden => StatusCode::FORBIDDEN,
        Reason::UnknownSession | Reason::UnknownRecording => StatusCode::NOT_FOUND,
        Reason::SessionBusy | Reason::TakenOver | Reason::NotAReplay => StatusCode::CONFLICT,
        Reason::OversizedMessage => StatusCode::PAYLOAD_TOO_LARGE,
        Reason::InvalidCalibration | Reason::InvalidRecording => StatusCode::UNPROCESSABLE_ENTITY,
        Reason::TooManySessions => StatusCode::TOO_MANY_REQUESTS,
        Reason::ShuttingDown | Reason::PictureUnavailable => StatusCode::SERVICE_UNAVAILABLE,
        Reason::StorageFull => StatusCode::INSUFFICIENT_STORAGE,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

impl IntoResponse for Rejection {
    fn into_response(self) -> Response {
        let status = status(self.reason);
        let body = Json(Refused { reason: self.reason.name(), text: self.text });
        if status == StatusCode::UNAUTHORIZED {
            return (status, [(header::WWW_AUTHENTICATE, "Bearer")], body).into_response();
        }
        (status, body).into_response()
    }
}

/// Runs what blocks off the async runtime.
pub(crate) async fn off_runtime<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Rejection> {
    tokio::task::spawn_blocking(work).await.map_err(internal)
}

/// Something that no caller can help.
pub(super) fn internal(error: impl std::fmt::Display) -> Rejection {
    Rejection::new(Reason::Internal, error.to_string())
}
