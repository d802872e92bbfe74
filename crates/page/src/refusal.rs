//! What a request is told when it cannot be done: a short code for the page's table of words, and a line.

use axum::body::Body;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// Nothing was done, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    pub status: StatusCode,
    /// Key of the page's table of words.
    pub code: &'static str,
    /// One line with the value that was refused.
    pub message: String,
}

pub type Answer<T> = Result<T, Refusal>;

impl Refusal {
    pub fn new(status: StatusCode, code: &'static str, message: impl Into<String>) -> Self {
        Self { status, code, message: message.into() }
    }

    /// What was asked for is wrong.
    pub fn bad(code: &'static str, message: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, code, message)
    }

    /// What was asked for is not there, or not any more.
    pub fn gone(what: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "gone", what)
    }

    /// Somebody else is at it.
    pub fn conflict(code: &'static str, message: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, code, message)
    }

    /// The system did not do what it should.
    pub fn system(doing: &str, error: &std::io::Error) -> Self {
        let message = format!("cannot {doing}: {error}");
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, "system", message)
    }
}

impl From<tsumu::Error> for Refusal {
    fn from(error: tsumu::Error) -> Self {
        Self::bad("input", error.line())
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let body = json!({ "error": self.code, "message": self.message });
        let mut response = Response::new(Body::from(body.to_string()));
        *response.status_mut() = self.status;
        let kind = header::HeaderValue::from_static("application/json");
        response.headers_mut().insert(header::CONTENT_TYPE, kind);
        response
    }
}
