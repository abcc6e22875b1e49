//! A small HTTP server for clients that watch the gateway: read-only, with limits on connections, time and
//! size.

use std::convert::Infallible;
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::extract::Request;
use axum::http::header::{
    ALLOW, CACHE_CONTROL, CONTENT_SECURITY_POLICY, HOST, HeaderName, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::uri::Scheme;
use axum::http::{HeaderValue, Method, StatusCode, Version};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse as _, Response};
use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpSocket;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{Instant, sleep, sleep_until};

use super::lock::lock;

/// Maximum number of simultaneous requests; further connections are closed.
pub const MAX_CONNECTIONS: usize = 64;
/// Maximum number of simultaneous streams, in addition to the requests.
pub const MAX_STREAMS: usize = 64;
/// Longest duration of a request, or between two events of a stream.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum number of bytes in the kernel for a slow client, so that the client reads recent data.
const SEND_BUFFER: u32 = 64 * 1024;
const BACKLOG: u32 = 128;
/// Longest wait for the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Largest head of a request, bytes.
const MAX_HEAD: usize = 16 * 1024;
/// Pause before the next connection if there are too many, or no file descriptors.
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// Binds a listener. Must be called within a runtime. Fails if the address is in use, or does not belong to
/// this computer.
pub fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.set_reuseaddr(true)?;
    // Accepted connections inherit it.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)?.into_std()
}

/// The connection of a request, stored in the request's extensions. It is closed at its deadline unless its
/// response is a stream.
#[derive(Debug, Clone)]
pub struct Connection(Arc<ConnectionState>);

#[derive(Debug)]
struct ConnectionState {
    end: watch::Sender<Instant>,
    place: Mutex<OwnedSemaphorePermit>,
    streams: Arc<Semaphore>,
}

impl Connection {
    /// Turns the request into a stream, which frees its slot for another request. Returns false if there are
    /// too many streams.
    pub fn begin_stream(&self) -> bool {
        let Ok(place) = Arc::clone(&self.0.streams).try_acquire_owned() else { return false };
        *lock(&self.0.place) = place;
        true
    }

    /// Extends the deadline. Call it for each event of the stream, which shows that the client has received
    /// the previous one.
    pub fn extend(&self) {
        self.0.end.send_replace(Instant::now() + CONNECTION_TIMEOUT);
    }
}

/// Waits for the deadline of a connection, which may be extended meanwhile.
async fn over(mut end: watch::Receiver<Instant>) {
    loop {
        let at = *end.borrow_and_update();
        sleep_until(at).await;
        if *end.borrow() <= at {
            return;
        }
    }
}

/// Serves GET and HEAD requests with `router` forever. The host must be an address, `localhost` or one of
/// `hosts`, so that a web page cannot reach the server through a host name that resolves to this address.
/// Fails if the runtime does not accept the listener.
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
    let mut response = match addressee(&request, hosts) {
        Addressee::Malformed(reason) => (StatusCode::BAD_REQUEST, reason).into_response(),
        Addressee::Unknown => {
            (StatusCode::MISDIRECTED_REQUEST, "unknown host; add it to hosts in [http]\n").into_response()
        }
        Addressee::Known if ![Method::GET, Method::HEAD].contains(request.method()) => {
            (StatusCode::METHOD_NOT_ALLOWED, [(ALLOW, "GET, HEAD")], "only GET\n").into_response()
        }
        Addressee::Known => next.run(request).await,
    };
    for (name, value) in HEADERS {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// The server that a request addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Addressee {
    /// This server.
    Known,
    /// Another server, or none: HTTP/1.0 does not require a host.
    Unknown,
    /// The request names its host in an invalid form (RFC 9112, 3.2); contains the reason.
    Malformed(&'static str),
}

/// Returns the server that a request addresses: by its target if that is an absolute URL, otherwise by its
/// `Host`.
fn addressee(request: &Request, hosts: &[String]) -> Addressee {
    let mut values = request.headers().get_all(HOST).iter();
    let named = match (values.next(), values.next()) {
        (_, Some(_)) => return Addressee::Malformed("more than one Host\n"),
        (None, _) if request.version() > Version::HTTP_10 => {
            return Addressee::Malformed("no Host\n");
        }
        (None, _) => Addressee::Unknown,
        (Some(value), _) => value.to_str().map_or(MALFORMED_HOST, |value| addressee_of(value, hosts)),
    };
    match (named, request.uri().authority()) {
        (Addressee::Malformed(_), _) | (_, None) => named,
        // Without TLS there is no other scheme.
        _ if request.uri().scheme().is_some_and(|scheme| *scheme != Scheme::HTTP) => Addressee::Unknown,
        (_, Some(target)) => addressee_of(target.as_str(), hosts),
    }
}

const MALFORMED_HOST: Addressee = Addressee::Malformed("malformed host; expected NAME or NAME:PORT\n");

/// Returns the server that `value`, a host with an optional port, addresses.
fn addressee_of(value: &str, hosts: &[String]) -> Addressee {
    let (name, port) = match value.strip_prefix('[') {
        Some(rest) => match rest.split_once(']') {
            Some((address, port)) if address.parse::<Ipv6Addr>().is_ok() => (None, port),
            _ => return MALFORMED_HOST,
        },
        None => {
            let (name, port) = value.split_at(value.find(':').unwrap_or(value.len()));
            (Some(name), port)
        }
    };
    let is_port = |port: &str| {
        port.is_empty() || port.bytes().all(|byte| byte.is_ascii_digit()) && port.parse::<u16>().is_ok()
    };
    // The port may be omitted, with or without its colon (RFC 3986, 3.2.3).
    let has_port = port.is_empty() || port.strip_prefix(':').is_some_and(is_port);
    let is_name = |name: &str| {
        !name.is_empty()
            && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._~%!$&'()*+,;=".contains(&byte))
    };
    match name {
        _ if !has_port => MALFORMED_HOST,
        None => Addressee::Known,
        Some(name) if !is_name(name) => MALFORMED_HOST,
        Some(name)
            if name.parse::<Ipv4Addr>().is_ok()
                || name.eq_ignore_ascii_case("localhost")
                || hosts.iter().any(|known| name.eq_ignore_ascii_case(known)) =>
        {
            Addressee::Known
        }
        Some(_) => Addressee::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    #[test]
    fn addresses_localhost_and_configured_names_are_known_others_are_not_and_junk_is_malformed() {
        let hosts = ["car.local".to_owned()];
        let of = |host| addressee_of(host, &hosts);
        for host in [
            "127.0.0.1",
            "127.0.0.1:9464",
            "127.0.0.1:",
            "127.0.0.1:65535",
            "[::1]",
            "[::1]:9464",
            "[::ffff:10.0.0.3]:80",
            "10.0.0.3",
            "localhost:1",
            "LOCALHOST",
            "Car.local:80",
        ] {
            assert_eq!(of(host), Addressee::Known, "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:80",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "localhost.",
            "car.local.evil",
            "127.1",
            "0x7f000001",
            "300.0.0.1",
        ] {
            assert_eq!(of(host), Addressee::Unknown, "{host}");
        }
        for host in [
            "",
            ":80",
            "127.0.0.1:80:90",
            "127.0.0.1:x",
            "127.0.0.1:+80",
            "127.0.0.1:-1",
            "127.0.0.1:65536",
            "127.0.0.1:99999999999999999999",
            "localhost:80/",
            "localhost/",
            "localhost?",
            "localhost#",
            "localhost\\evil",
            "user@localhost",
            "localhost@evil.example",
            "localhost evil.example",
            "localhost,evil.example:80:80",
            "http://localhost",
            "[",
            "[]",
            "[::1",
            "::1",
            "[::1]80",
            "[::1]:80:90",
            "[[::1]]",
            "[127.0.0.1]",
            "[evil]:1",
            "[fe80::1%25eth0]",
            "k\u{f6}ln",
        ] {
            assert_eq!(of(host), MALFORMED_HOST, "{host}");
        }
    }

    /// Returns the status of the response to these bytes; empty if the connection is closed without a
    /// response.
    async fn status(address: SocketAddr, request: &str) -> String {
        let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response).await;
        let response = String::from_utf8(response).unwrap();
        assert!(response.matches("HTTP/1.").count() < 2, "one request, one response: {response}");
        response.split(' ').nth(1).unwrap_or_default().to_owned()
    }

    #[tokio::test]
    async fn a_request_that_does_not_say_clearly_whom_it_means_is_refused_with_400() {
        let listener = bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new().route("/", axum::routing::get(|| async { "content" }));
        tokio::spawn(serve(listener, router, vec!["car.local".to_owned()]));
        let head = |rest: &str| format!("GET / HTTP/1.1\r\n{rest}\r\n\r\n");
        let mut wrong = Vec::new();
        for (expected, request) in [
            ("200", head("Host: localhost")),
            ("200", head("Host:localhost\t ")),
            ("200", head("HOST: 127.0.0.1:80")),
            ("200", "GET / HTTP/1.0\r\nHost: localhost\r\n\r\n".to_owned()),
            // Host: none, several, empty, junk.
            ("400", head("X: y")),
            ("421", "GET / HTTP/1.0\r\n\r\n".to_owned()),
            ("400", head("Host: localhost\r\nHost: localhost")),
            ("400", head("Host: localhost\r\nhost: evil.example")),
            ("400", head("Host: evil.example\r\nHost: localhost")),
            ("400", "GET / HTTP/1.0\r\nHost: localhost\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", head("Host:")),
            ("400", head("Host: 127.0.0.1:80:90")),
            ("400", head("Host: localhost, localhost:80:80")),
            ("421", head("Host: localhost,evil.example")),
            ("400", head("Host: user@localhost")),
            ("400", head("Host: k\u{f6}ln")),
            ("400", head("Host : localhost")),
            ("421", head("Host: evil.example")),
            // Target.
            ("200", "GET http://localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("200", "GET http://127.0.0.1:80 HTTP/1.1\r\nHost: evil.example\r\n\r\n".to_owned()),
            ("421", "GET http://evil.example/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", "GET http://user@localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", "GET http://localhost:80:90/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", "GET http://localhost/ HTTP/1.1\r\n\r\n".to_owned()),
            ("421", "GET https://localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("405", "CONNECT localhost:80 HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("405", "OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", "GET localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned()),
            // Head and length.
            ("400", head("Host: localhost\r\n continued")),
            ("400", head("Host: localhost\r\nX: y\r\n continued")),
            ("400", head("Host: localhost\r\nX: \0")),
            ("400", head("Host: localhost\r\nContent-Length: 1\r\nContent-Length: 2")),
            ("400", head("Host: localhost\r\nContent-Length: 1, 2")),
            ("400", head("Host: localhost\r\nContent-Length: -1")),
            ("400", head("Host: localhost\r\nTransfer-Encoding: identity")),
            ("400", "GET / HTTP/1.1 x\r\nHost: localhost\r\n\r\n".to_owned()),
            ("400", "GET / HTTP/1.2\r\nHost: localhost\r\n\r\n".to_owned()),
            // Bytes after a request are not parsed as a second request.
            ("200", head("Host: localhost") + &head("Host: localhost")),
        ] {
            let status = status(address, &request).await;
            if status != expected {
                wrong.push(format!("{request:?}: {status} instead of {expected}"));
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}
