//! The paths of the HTTP server.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Path as UrlPath, State};
use axum::http::header::{ACCEPT, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderMap};
use axum::http::{StatusCode, Uri};
use axum::response::sse::{Event, Sse};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::{Extension, Router};
use futures_util::stream::unfold;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};

use super::history::SharedHistory;
use crate::io::http::Connection;
use crate::io::snapshots::feed::SnapshotSource;
use crate::report::gateway_view::GatewayView;
use crate::report::live_page;
use crate::report::metrics::{CLASSIC, OPENMETRICS, classic, openmetrics};
use crate::report::page::Page;
use crate::report::timeline::{Group, OpenedAt};
use gateway_core::gateway::history::{ChangeKind, HistoryRequest};

/// Interval between events of a stream.
const EVENT_INTERVAL: Duration = Duration::from_millis(200);
/// Time after which a browser reconnects.
const RETRY: Duration = Duration::from_secs(1);

/// Creates the page of a black-box log, opened at a position. An error is a message for the user.
pub type ReportPage = Arc<dyn Fn(&Path, &OpenedAt) -> Result<Page, String> + Send + Sync>;

/// Data sources of the responses.
#[derive(Clone)]
pub(super) struct Sources {
    pub(super) snapshots: SnapshotSource,
    pub(super) history: SharedHistory,
    /// `None` for a command without black-box files.
    pub(super) report: Option<ReportPage>,
    /// Held while a report is created: only one at a time, since each replays a recording.
    pub(super) making: Arc<Semaphore>,
}

/// Creates a router over these sources, with the live page if `has_page`.
pub(super) fn router(sources: Sources, has_page: bool) -> Router {
    let mut router = Router::new().route("/metrics", get(metrics));
    if has_page {
        let page = Arc::new(live_page::page());
        let live = move || async move { with_policy(page.as_ref().clone()) };
        router = router
            .route("/", get(live))
            .route("/events", get(events))
            .route("/history", get(history))
            .route("/frames/{number}", get(frames));
    }
    router.with_state(sources)
}

/// Responds with changes as JSON. Takes the parameters of [`HistoryRequest`].
async fn history(State(sources): State<Sources>, uri: Uri) -> Response {
    match request_of(uri.query().unwrap_or_default()) {
        Ok(request) => {
            // Plain structs of numbers and strings: this cannot fail.
            let json = serde_json::to_string(&sources.history.page(request)).unwrap_or_default();
            ([(CONTENT_TYPE, "application/json")], json).into_response()
        }
        Err(error) => (StatusCode::BAD_REQUEST, format!("{error}\n")).into_response(),
    }
}

/// Reads the parameters of a request for changes.
fn request_of(query: &str) -> serde_json::Result<HistoryRequest> {
    let mut fields = serde_json::Map::new();
    for (name, value) in query
        .split('&')
        .filter(|pair| !pair.is_empty())
        .map(|pair| pair.split_once('=').unwrap_or((pair, "")))
    {
        let value = value.parse::<u64>().map_or_else(|_| value.into(), serde_json::Value::from);
        fields.insert(name.to_owned(), value);
    }
    serde_json::from_value(fields.into())
}

/// Responds with the report of the black box that contains the frames of a change, opened at the change.
async fn frames(
    State(sources): State<Sources>,
    Extension(connection): Extension<Connection>,
    UrlPath(number): UrlPath<String>,
) -> Response {
    let not_found = |text: String| (StatusCode::NOT_FOUND, text + "\n").into_response();
    let Ok(number) = number.parse() else { return not_found("expected the number of a change".to_owned()) };
    let (log, entry, place) = match sources.history.frames(number) {
        Ok(found) => found,
        Err(reason) => return not_found(reason.to_string()),
    };
    let Some(report) = sources.report else {
        return not_found("frames are shown by `signal-gateway run` alone".to_owned());
    };
    let Ok(permit) = sources.making.try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "another report is being made; try again\n")
            .into_response();
    };
    let group = match entry.kind {
        ChangeKind::ReportPublished | ChangeKind::ReportWithdrawn => Group::Reports,
        ChangeKind::CommandSent => Group::Commands,
        ChangeKind::Status | ChangeKind::Started | ChangeKind::Stopped | ChangeKind::Missing => {
            Group::Diagnostics
        }
    };
    #[allow(clippy::cast_precision_loss)] // exact for 285 years
    let opened_at = OpenedAt { group, label: entry.subject, at_s: place.at_us as f64 / 1e6 };
    let mut making = spawn_blocking(move || {
        // Held until the report is created, even if its client disconnects.
        let _permit = permit;
        report(&log, &opened_at)
    });
    let made = loop {
        match timeout(EVENT_INTERVAL, &mut making).await {
            Ok(made) => break made,
            // The time for creating the report is bounded.
            Err(_) => connection.extend(),
        }
    };
    match made {
        Ok(Ok(page)) => with_policy(page),
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, error + "\n").into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, "the report could not be made\n").into_response(),
    }
}

fn with_policy(page: Page) -> Response {
    let policy = [(CONTENT_SECURITY_POLICY, page.content_security_policy)];
    (policy, Html(page.html)).into_response()
}

async fn metrics(State(mut sources): State<Sources>, headers: HeaderMap) -> Response {
    let Some(taken) = sources.snapshots.next().await else {
        return (StatusCode::SERVICE_UNAVAILABLE, "the gateway does not answer\n").into_response();
    };
    let accepted = headers.get(ACCEPT).and_then(|accepted| accepted.to_str().ok()).unwrap_or_default();
    let (media, text) = if accepted.contains("application/openmetrics-text") {
        (OPENMETRICS, openmetrics(&taken.snapshot))
    } else {
        (CLASSIC, classic(&taken.snapshot))
    };
    ([(CONTENT_TYPE, media)], text).into_response()
}

/// Responds with a stream of snapshots for the live page, one event every [`EVENT_INTERVAL`]. A slow client
/// receives fewer events, each current when it is taken.
async fn events(State(sources): State<Sources>, Extension(connection): Extension<Connection>) -> Response {
    if !connection.begin_stream() {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many streams\n").into_response();
    }
    let first = Event::default().retry(RETRY);
    let stream =
        unfold((sources.snapshots, connection, Some(first)), |(mut source, connection, first)| async {
            let event = match first {
                Some(event) => event,
                None => {
                    sleep(EVENT_INTERVAL).await;
                    Event::default()
                }
            };
            let taken = source.next().await?;
            connection.extend();
            let json = |snapshot: &_| serde_json::to_string(&GatewayView::of(snapshot)).unwrap_or_default();
            Some((Ok::<_, Infallible>(event.data(taken.event(json))), (source, connection, None)))
        });
    Sse::new(stream).into_response()
}
