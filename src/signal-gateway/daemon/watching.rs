//! Serves snapshots to the clients of the status socket and of HTTP.

use std::io;
use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;

use tokio::sync::Semaphore;

use super::history::SharedHistory;
use super::pages::{ReportPage, Sources, router};
use crate::config::Settings;
use crate::config::gateway::HttpConfig;
use crate::io::http;
use crate::io::optional_future::or_never;
use crate::io::snapshots::feed::SnapshotFeed;
use crate::io::snapshots::places::{self, PlaceError, SOCKET_OF_SERVICE};
use crate::io::snapshots::socket::{GROUP_MODE, StatusSocket, serve};
use crate::io::systemd::service_folder;

/// Clients that watch the gateway.
pub(super) struct Clients {
    pub(super) feed: SnapshotFeed,
    /// Held because dropping it removes its file.
    _socket: Option<StatusSocket>,
}

/// Serves HTTP and the status socket.
pub(super) fn serve_clients(
    settings: &Settings,
    history: SharedHistory,
    report: Option<ReportPage>,
) -> Clients {
    let socket = bind_socket(settings);
    let http = settings.http.address.and_then(|address| {
        let failed = |error: &io::Error| tracing::warn!("no HTTP server: {address}: {error}");
        http::bind(address).inspect_err(failed).ok()
    });
    if let (Some(_), Some(url)) = (&http, settings.http.url().filter(|_| settings.http.opens_browser)) {
        open_browser(&url);
    }
    let (feed, snapshots) = SnapshotFeed::new();
    let sources = Sources { snapshots, history, report, making: Arc::new(Semaphore::new(1)) };
    if (socket.is_some() || http.is_some())
        && let Err(error) = start_thread(socket.as_ref(), http, &settings.http, sources)
    {
        tracing::warn!("no status: {error}");
    }
    Clients { feed, _socket: socket }
}

/// Binds the socket of the configuration, else one in systemd's `RUNTIME_DIRECTORY`, else one of this user.
/// If there is none, the gateway runs without it, and the log states the reason.
fn bind_socket(settings: &Settings) -> Option<StatusSocket> {
    let config = &settings.status;
    if !config.enabled {
        return None;
    }
    let from_systemd = || Some(service_folder("RUNTIME_DIRECTORY")?.join(SOCKET_OF_SERVICE));
    let bound = match config.socket.clone().or_else(from_systemd) {
        Some(path) => StatusSocket::bind(&path, GROUP_MODE).map_err(PlaceError::from),
        None => places::bind(&settings.instance_name())
            .inspect(|socket| tracing::info!("status socket: {}", socket.path().display())),
    };
    match bound {
        Ok(socket) => return Some(socket),
        Err(error) if error.is_usual() => {
            tracing::info!("no status socket: {error}; for one, write [status] socket = \"PATH\"");
        }
        Err(error) => tracing::warn!("no status socket: {error}"),
    }
    None
}

/// Starts the thread that serves the socket and HTTP.
fn start_thread(
    socket: Option<&StatusSocket>,
    http: Option<TcpListener>,
    config: &HttpConfig,
    sources: Sources,
) -> io::Result<()> {
    let socket = socket.map(StatusSocket::listener).transpose()?;
    let hosts = config.hosts.clone();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (source, history) = (sources.snapshots.clone(), sources.history.clone());
    let pages = router(sources, config.page);
    thread::Builder::new().name("status".to_owned()).spawn(move || {
        runtime.block_on(async {
            let page = move |request| history.page(request);
            let socket = or_never(socket.map(|listener| serve(listener, source, page)));
            let http = or_never(http.map(|listener| http::serve(listener, pages, hosts)));
            let ended = tokio::select! { ended = socket => ended, ended = http => ended };
            if let Err(error) = ended {
                tracing::warn!("the status is no longer served: {error}");
            }
        });
    })?;
    Ok(())
}

/// Opens a page in the browser of the desktop, if there is one.
fn open_browser(url: &str) {
    let mut command = Command::new("xdg-open");
    let command = command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    match command.spawn() {
        // The opener ends at once, or with the browser.
        Ok(mut opener) => drop(thread::spawn(move || opener.wait())),
        Err(error) => tracing::warn!("no browser: xdg-open: {error}; the page is {url}"),
    }
}
