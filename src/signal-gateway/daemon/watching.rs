//! The gateway's part for those who watch it: snapshots on demand for the clients of the status socket, and
//! the status line of the service manager.

use std::ffi::OsString;
use std::future::pending;
use std::io;
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::Semaphore;

use super::history::SharedHistory;
use super::pages::{ReportPage, Sources, router};
use crate::config::Settings;
use crate::config::gateway::HttpConfig;
use crate::io::can::traffic::TrafficMeter;
use crate::io::http;
use crate::io::snapshots::feed::SnapshotFeed;
use crate::io::snapshots::socket::{StatusSocket, serve};
use crate::io::systemd::Supervisor;
use crate::process_status::snapshot::{Build, ProcessSnapshot, Snapshot};
use crate::report::status::headline;
use gateway_base::diagnostics::Status;
use gateway_base::time::{Now, millis};
use gateway_core::gateway::Gateway;
use gateway_core::provenance::ProvenanceSummary;

/// Shortest interval from one status line to the next.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// Clients, and what they are shown beside the gateway.
pub(super) struct Watching {
    /// `None` where nothing is served.
    feed: Option<SnapshotFeed>,
    /// Held for its file.
    _socket: Option<StatusSocket>,
    started: Instant,
    /// Name of the vehicle profile.
    pub(super) vehicle: String,
    /// What has verified the profile.
    pub(super) provenance: ProvenanceSummary,
    traffic: Vec<TrafficMeter>,
    line: String,
    next_line: Instant,
}

/// The parts of the process that know their own state.
pub(super) struct Process {
    pub(super) snapshot: ProcessSnapshot,
    pub(super) statuses: Vec<Status>,
}

impl Watching {
    /// Serves HTTP, and the socket of the configuration or one in systemd's `RUNTIME_DIRECTORY`. Without a
    /// socket the gateway runs as well: the log names the reason.
    pub(super) fn start(settings: &Settings, history: SharedHistory, report: Option<ReportPage>) -> Self {
        let from_systemd = || runtime_socket(std::env::var_os("RUNTIME_DIRECTORY"));
        let config = &settings.status;
        let path = config.socket.clone().or_else(from_systemd).filter(|_| config.enabled);
        let socket = path.and_then(|path| {
            StatusSocket::bind(&path).inspect_err(|error| tracing::warn!("no status socket: {error}")).ok()
        });
        let http = settings.http.address.and_then(|address| {
            let failed = |error: &io::Error| tracing::warn!("no HTTP server: {address}: {error}");
            http::bind(address).inspect_err(failed).ok()
        });
        if let (Some(_), Some(url)) = (&http, settings.http.url().filter(|_| settings.http.opens_browser)) {
            open_browser(&url);
        }
        let feed = open(socket.as_ref(), http, &settings.http, (history, report));
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.as_str());
        Self {
            feed,
            _socket: socket,
            started: Instant::now(),
            vehicle: settings.vehicle.clone(),
            provenance: settings.provenance.summary(),
            traffic: interfaces.map(TrafficMeter::new).collect(),
            line: String::new(),
            next_line: Instant::now(),
        }
    }

    /// Waits until [`Self::show`] has something to do for a client; loses nothing when it is given up.
    pub(super) async fn due(&mut self) {
        match &mut self.feed {
            Some(feed) => feed.due().await,
            None => pending().await,
        }
    }

    /// Announces that start-up is done, with the first status line.
    pub(super) fn ready(
        &mut self,
        gateway: &Gateway,
        now: Now,
        supervisor: &mut Supervisor,
        process: Process,
    ) {
        self.line = headline(&self.snapshot(gateway, now, process));
        self.next_line = Instant::now() + LINE_INTERVAL;
        supervisor.ready(&self.line);
    }

    /// True if a snapshot is to be taken now, for clients or for the status line.
    pub(super) fn is_due(&self, supervisor: &Supervisor) -> bool {
        self.is_line_due(supervisor) || self.feed.as_ref().is_some_and(SnapshotFeed::is_due)
    }

    /// Takes a snapshot, and hands it out to those who are due.
    pub(super) fn show(
        &mut self,
        gateway: &Gateway,
        now: Now,
        supervisor: &mut Supervisor,
        process: Process,
    ) -> Snapshot {
        let snapshot = self.snapshot(gateway, now, process);
        if self.is_line_due(supervisor) {
            self.next_line = Instant::now() + LINE_INTERVAL;
            let line = headline(&snapshot);
            if line != self.line {
                supervisor.status(&line);
                self.line = line;
            }
        }
        if let Some(feed) = self.feed.as_mut().filter(|feed| feed.is_due()) {
            feed.hand_out(snapshot.clone());
        }
        snapshot
    }

    fn is_line_due(&self, supervisor: &Supervisor) -> bool {
        supervisor.is_present() && Instant::now() >= self.next_line
    }

    fn snapshot(&mut self, gateway: &Gateway, now: Now, process: Process) -> Snapshot {
        let Process { snapshot, statuses } = process;
        let process = ProcessSnapshot {
            vehicle: self.vehicle.clone(),
            provenance: self.provenance.clone(),
            pid: std::process::id(),
            uptime_ms: millis(self.started.elapsed()),
            build: build(),
            ..snapshot
        };
        let mut snapshot = gateway.snapshot(now).with_process(process, &statuses);
        for (bus, meter) in snapshot.buses.iter_mut().zip(&mut self.traffic) {
            bus.traffic = meter.measure();
        }
        snapshot
    }
}

/// The origin of this binary.
pub fn build() -> Build {
    Build {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("SIGNAL_GATEWAY_COMMIT").map(str::to_owned),
        distribution: ros_transport::IS_BUILT_IN.then(|| ros_transport::DISTRO.to_owned()),
    }
}

/// Starts the thread that serves the socket and HTTP; `None` when there is neither.
fn open(
    socket: Option<&StatusSocket>,
    http: Option<TcpListener>,
    config: &HttpConfig,
    (history, report): (SharedHistory, Option<ReportPage>),
) -> Option<SnapshotFeed> {
    if socket.is_none() && http.is_none() {
        return None;
    }
    let (feed, snapshots) = SnapshotFeed::new();
    let sources = Sources { snapshots, history, report, making: Arc::new(Semaphore::new(1)) };
    let started = start_serving(socket, http, config, sources);
    started.inspect_err(|error| tracing::warn!("no status: {error}")).ok()?;
    Some(feed)
}

fn start_serving(
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
            let socket = async {
                match socket {
                    Some(listener) => serve(listener, source, move |request| history.page(request)).await,
                    None => pending().await,
                }
            };
            let http = async {
                match http {
                    Some(listener) => http::serve(listener, pages, hosts).await,
                    None => pending().await,
                }
            };
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
        // It ends at once, or with the browser.
        Ok(mut opener) => drop(thread::spawn(move || opener.wait())),
        Err(error) => tracing::warn!("no browser: xdg-open: {error}; the page is {url}"),
    }
}

fn runtime_socket(variable: Option<OsString>) -> Option<PathBuf> {
    // A list separated by colons; ours has one entry.
    let first = variable?.to_str()?.split(':').next()?.to_owned();
    (!first.is_empty()).then(|| PathBuf::from(first).join("status.sock"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn socket_goes_to_the_first_folder_of_the_service_managers_list() {
        let socket = |variable: &str| runtime_socket(Some(variable.into()));
        assert_eq!(socket("/run/one:/run/other"), Some(PathBuf::from("/run/one/status.sock")));
        assert_eq!((socket(""), runtime_socket(None)), (None, None));
    }
}
