//! A small HTTP server for whoever watches the gateway: read-only, bounded in connections, time and size.

use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::extract::Request;
use axum::http::header::{
    ALLOW, CACHE_CONTROL, CONTENT_SECURITY_POLICY, HOST, HeaderName, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::{HeaderValue, Method, StatusCode};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse as _, Response};
use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpSocket;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{Instant, sleep, sleep_until};

/// Maximum number of simultaneous requests; further connections are closed.
pub const MAX_CONNECTIONS: usize = 64;
/// Maximum number of simultaneous streams, in addition to the requests.
pub const MAX_STREAMS: usize = 64;
/// Longest duration of a request, or between two events of a stream.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum number of bytes in the kernel for a slow client, so that it reads recent data.
const SEND_BUFFER: u32 = 64 * 1024;
const BACKLOG: u32 = 128;
/// Longest wait for the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Largest head of a request, bytes.
const MAX_HEAD: usize = 16 * 1024;
/// Pause before the next connection if there are too many, or no file descriptors.
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// Binds a listener. Must be called within a runtime. Fails if the address is in use, or not one of this computer.
pub fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.set_reuseaddr(true)?;
    // Those that are accepted inherit it.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)?.into_std()
}

/// The connection of a request, among its extensions. It is closed in time unless its response is a stream.
#[derive(Debug, Clone)]
pub struct Connection(Arc<ConnectionState>);

#[derive(Debug)]
struct ConnectionState {
    end: watch::Sender<Instant>,
    place: Mutex<OwnedSemaphorePermit>,
    streams: Arc<Semaphore>,
}

impl Connection {
    /// Turns the request into a stream, which frees its place for another request. Returns false if there are too
    /// many streams.
    pub fn begin_stream(&self) -> bool {
        let Ok(place) = Arc::clone(&self.0.streams).try_acquire_owned() else { return false };
        *self.0.place.lock().unwrap_or_else(PoisonError::into_inner) = place;
        true
    }

    /// Extends the deadline. Call it for each event of the stream, which shows that the client has taken the previous
    /// one.
    pub fn extend(&self) {
        self.0.end.send_replace(Instant::now() + CONNECTION_TIMEOUT);
    }
}

/// Waits for the end of a connection, which may be extended meanwhile.
async fn over(mut end: watch::Receiver<Instant>) {
    loop {
        let at = *end.borrow_and_update();
        sleep_until(at).await;
        if *end.borrow() <= at {
            return;
        }
    }
}

/// Serves GET and HEAD requests with `router` forever. The host must be an address, `localhost` or one of `hosts`, so
/// that a page whose name points here gets nothing. Fails if the runtime does not accept the listener.
pub async fn serve(listener: TcpListener, router: Router, hosts: Vec<String>) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let hosts = Arc::new(hosts);
    let router = router.layer(from_fn(move |request: Request, next: Next| {
        let hosts = Arc::clone(&hosts);
        async move { Ok::<_, Infallible>(answer(request, next, &hosts).await) }
    }));
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    let streams = Arc::new(Semaphore::new(MAX_STREAMS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(BUSY_PAUSE).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            drop(stream);
            sleep(BUSY_PAUSE).await;
            continue;
        };
        let (end, ended) = watch::channel(Instant::now() + CONNECTION_TIMEOUT);
        let state = ConnectionState { end, place: Mutex::new(place), streams: Arc::clone(&streams) };
        let router = router.clone().layer(Extension(Connection(Arc::new(state))));
        tokio::spawn(async move {
            let mut server = http1::Builder::new();
            server
                .timer(TokioTimer::new())
                .header_read_timeout(HEAD_TIMEOUT)
                .max_buf_size(MAX_HEAD)
                .keep_alive(false);
            // A client that disconnects, or sends garbage, does not affect others.
            tokio::select! {
                _ = server.serve_connection(TokioIo::new(stream), TowerToHyperService::new(router)) => {}
                () = over(ended) => {}
            }
        });
    }
}

/// Default headers of every response.
const HEADERS: [(HeaderName, &str); 5] = [
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (REFERRER_POLICY, "no-referrer"),
    (X_FRAME_OPTIONS, "DENY"),
    (CACHE_CONTROL, "no-store"),
    (CONTENT_SECURITY_POLICY, "default-src 'none'; frame-ancestors 'none'"),
];

async fn answer(request: Request, next: Next, hosts: &[String]) -> Response {
    let host = request.headers().get(HOST).and_then(|host| host.to_str().ok());
    let mut response = if !host.is_some_and(|host| is_known(host, hosts)) {
        (StatusCode::MISDIRECTED_REQUEST, "unknown host; add it to hosts in [http]\n").into_response()
    } else if ![Method::GET, Method::HEAD].contains(request.method()) {
        (StatusCode::METHOD_NOT_ALLOWED, [(ALLOW, "GET, HEAD")], "only GET\n").into_response()
    } else {
        next.run(request).await
    };
    for (name, value) in HEADERS {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Returns true if `host`, with or without a port, means this server.
fn is_known(host: &str, hosts: &[String]) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    };
    name.parse::<IpAddr>().is_ok()
        || name.eq_ignore_ascii_case("localhost")
        || hosts.iter().any(|known| name.eq_ignore_ascii_case(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_localhost_and_configured_names_are_known_and_no_other() {
        let hosts = ["car.local".to_owned()];
        for host in [
            "127.0.0.1",
            "127.0.0.1:9464",
            "[::1]:9464",
            "10.0.0.3",
            "localhost:1",
            "LOCALHOST",
            "Car.local:80",
        ] {
            assert!(is_known(host, &hosts), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "[",
            "[evil]:1",
            "car.local.evil",
        ] {
            assert!(!is_known(host, &hosts), "{host}");
        }
    }
}
