//! The paths of the HTTP server.

use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::{ACCEPT, CONTENT_TYPE, HeaderMap};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;

use crate::io::snapshots::feed::SnapshotSource;
use crate::report::metrics::{CLASSIC, OPENMETRICS, classic, openmetrics};

/// Answers by the snapshots of a source.
pub(super) fn router(source: SnapshotSource) -> Router {
    Router::new().route("/metrics", get(metrics)).with_state(source)
}

async fn metrics(State(mut source): State<SnapshotSource>, headers: HeaderMap) -> Response {
    let Some(taken) = source.next().await else {
        return (StatusCode::SERVICE_UNAVAILABLE, "the gateway does not answer\n").into_response();
    };
    let accepted = headers.get(ACCEPT).and_then(|accepted| accepted.to_str().ok()).unwrap_or_default();
    let (media, text) = if accepted.contains("application/openmetrics-text") {
        (OPENMETRICS, openmetrics(taken.snapshot()))
    } else {
        (CLASSIC, classic(taken.snapshot()))
    };
    ([(CONTENT_TYPE, media)], text).into_response()
}
