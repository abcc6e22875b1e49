//! The paths of the HTTP server.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::{ACCEPT, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderMap};
use axum::response::sse::{Event, Sse};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::{Extension, Router};
use futures_util::stream::unfold;
use tokio::time::sleep;

use crate::core::gateway::snapshot::Snapshot;
use crate::io::http::Connection;
use crate::io::snapshots::feed::SnapshotSource;
use crate::report::live_page::LivePage;
use crate::report::live_view::Feed;
use crate::report::metrics::{CLASSIC, OPENMETRICS, classic, openmetrics};

/// Time from one event of a stream to the next.
const EVENT_INTERVAL: Duration = Duration::from_millis(200);
/// Time after which a browser connects again.
const RETRY: Duration = Duration::from_secs(1);

/// Answers by the snapshots of a source; with the live page if `has_page`.
pub(super) fn router(source: SnapshotSource, has_page: bool) -> Router {
    let mut router = Router::new().route("/metrics", get(metrics));
    if has_page {
        let page = Arc::new(LivePage::new());
        let live = move || async move { live_page(&page) };
        router = router.route("/", get(live)).route("/events", get(events));
    }
    router.with_state(source)
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

fn live_page(page: &LivePage) -> Response {
    let policy = [(CONTENT_SECURITY_POLICY, page.content_security_policy.clone())];
    (policy, Html(page.html.clone())).into_response()
}

fn feed_json(snapshot: &Snapshot) -> String {
    serde_json::to_string(&Feed::new(snapshot)).unwrap_or_default()
}

/// A snapshot as an event every [`EVENT_INTERVAL`]. A client that is slow gets fewer of them, each of them present when it is taken.
async fn events(
    State(source): State<SnapshotSource>,
    Extension(connection): Extension<Connection>,
) -> Response {
    if !connection.begin_stream() {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many streams\n").into_response();
    }
    let first = Event::default().retry(RETRY);
    let stream = unfold((source, connection, Some(first)), |(mut source, connection, first)| async {
        let event = match first {
            Some(event) => event,
            None => {
                sleep(EVENT_INTERVAL).await;
                Event::default()
            }
        };
        let taken = source.next().await?;
        connection.extend();
        Some((Ok::<_, Infallible>(event.data(taken.event(feed_json))), (source, connection, None)))
    });
    Sse::new(stream).into_response()
}
