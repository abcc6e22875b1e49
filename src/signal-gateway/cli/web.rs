//! Arguments of the commands that can serve the live page.

use std::ffi::OsString;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};

use clap::Args;

use super::failure::Failure;
use super::messages;
use crate::config::gateway::HttpConfig;

const DEFAULT_ADDRESS: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 9464);

#[derive(Debug, Args)]
pub(super) struct WebArgs {
    /// Serve the live page for browsers, at 127.0.0.1:9464 unless an address, a port or both are given
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "9464",
        value_parser = page_address
    )]
    web: Option<SocketAddr>,
    /// Serve it, and open it in the browser
    #[arg(long)]
    open: bool,
}

impl WebArgs {
    pub(super) fn is_on(&self) -> bool {
        self.web.is_some() || self.open
    }

    /// Enables the page in the configuration as requested, and writes its address to standard error. Fails if
    /// it cannot be served there, since a browser would reach another program at the address.
    pub(super) fn apply(&self, http: &mut HttpConfig) -> Result<(), Failure> {
        if !self.is_on() {
            return Ok(());
        }
        let address = self.web.or(http.address).unwrap_or(DEFAULT_ADDRESS);
        http.address = Some(address);
        (http.page, http.opens_browser) = (true, self.open);
        TcpListener::bind(address).map_err(|error| Failure::PageAddress(address, error))?;
        if let Some(url) = http.url() {
            messages::note(&format!("live page: {url}"));
        }
        Ok(())
    }
}

/// Parses `ADDRESS:PORT`, or only one of the two.
fn page_address(text: &str) -> Result<SocketAddr, String> {
    let text = text.replacen("localhost", "127.0.0.1", 1);
    let full = text.parse().ok();
    let port = || Some(SocketAddr::new(DEFAULT_ADDRESS.ip(), text.parse().ok()?));
    let address = || Some(SocketAddr::new(text.parse().ok()?, DEFAULT_ADDRESS.port()));
    let read: Option<SocketAddr> = full.or_else(port).or_else(address);
    read.filter(|address| address.port() != 0).ok_or_else(|| {
        "expected an address of this computer, a port, or both: 127.0.0.1:9464, 9464, 0.0.0.0 for all its \
         addresses, [::1]:9464"
            .to_owned()
    })
}

/// Why a page cannot be served, and what to do; `remedy` may be empty.
pub(super) struct UnusableAddress {
    pub(super) text: String,
    pub(super) remedy: String,
}

pub(super) fn unusable_address(address: SocketAddr, error: &io::Error) -> UnusableAddress {
    let (ip, port) = (address.ip(), address.port());
    let next = port.checked_add(1).unwrap_or(DEFAULT_ADDRESS.port());
    #[allow(clippy::wildcard_enum_match_arm)] // all others say it themselves
    let (text, remedy) = match error.kind() {
        io::ErrorKind::AddrInUse => (
            format!("no live page: another program listens on {address}"),
            format!("choose another port: --web={next}; `ss -ltnp 'sport = :{port}'` shows who has this one"),
        ),
        io::ErrorKind::AddrNotAvailable => (
            format!("no live page: {ip} is not an address of this computer"),
            "`ip -brief address` lists them; --web=0.0.0.0 serves it on all".to_owned(),
        ),
        io::ErrorKind::PermissionDenied => (
            format!("no live page: this user may not listen on port {port}"),
            format!("choose one from 1024 on: --web={DEFAULT_ADDRESS}"),
        ),
        _ => (format!("no live page at {address}: {error}"), String::new()),
    };
    UnusableAddress { text, remedy }
}

/// Joins `--web ADDRESS:PORT` to `--web=ADDRESS:PORT`, also for an address or a port alone. Without an
/// address `--web` is a flag, and no other argument looks like an address.
pub(super) fn with_joined_address(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    for argument in arguments {
        let is_address = argument.to_str().is_some_and(|text| page_address(text).is_ok());
        match joined.last_mut() {
            Some(last) if is_address && last == "--web" => {
                last.push("=");
                last.push(argument);
            }
            _ => joined.push(argument),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use std::ffi::OsStr;

    use super::*;

    #[test]
    fn address_of_the_page_may_follow_a_space_and_nothing_else_is_taken_for_one() {
        let joined = |text: &str| {
            let words = with_joined_address(text.split(' ').map(OsString::from));
            words.join(OsStr::new(" ")).into_string().unwrap()
        };
        assert_eq!(joined("x demo --web 127.0.0.1:8000 --repeat"), "x demo --web=127.0.0.1:8000 --repeat");
        assert_eq!(joined("x demo --web [::1]:80"), "x demo --web=[::1]:80");
        assert_eq!(joined("x demo --web 8080 --repeat"), "x demo --web=8080 --repeat");
        assert_eq!(joined("x demo --web 0.0.0.0"), "x demo --web=0.0.0.0");
        for same in ["x demo --web commands", "x replay --web drive.log", "x replay 127.0.0.1:80 --web"] {
            assert_eq!(joined(same), same);
        }
    }

    #[test]
    fn an_address_a_port_or_both_are_read_and_the_refusal_of_others_shows_each() {
        for (text, expected) in [
            ("8080", "127.0.0.1:8080"),
            ("0.0.0.0", "0.0.0.0:9464"),
            ("localhost:80", "127.0.0.1:80"),
            ("localhost", "127.0.0.1:9464"),
            ("[::1]:80", "[::1]:80"),
            ("::1", "[::1]:9464"),
        ] {
            assert_eq!(page_address(text), Ok(expected.parse().unwrap()), "{text}");
        }
        for text in ["", "car.local", "127.0.0.1:", ":8080", "99999", "0", "127.0.0.1:0"] {
            assert!(page_address(text).unwrap_err().starts_with("expected an address"), "{text}");
        }
    }

    #[test]
    fn an_address_that_cannot_be_used_is_refused_with_the_remedy() {
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap();
        let args = WebArgs { web: Some(address), open: false };
        let Err(Failure::PageAddress(refused, error)) = args.apply(&mut HttpConfig::default()) else {
            panic!("it was accepted")
        };
        let UnusableAddress { text, remedy } = unusable_address(refused, &error);
        assert_eq!(text, format!("no live page: another program listens on {address}"));
        assert!(remedy.contains(&format!("--web={}", address.port() + 1)), "{remedy}");
        let elsewhere = "192.0.2.77:9464".parse().unwrap();
        let UnusableAddress { text, remedy } =
            unusable_address(elsewhere, &TcpListener::bind(elsewhere).unwrap_err());
        assert_eq!(text, "no live page: 192.0.2.77 is not an address of this computer");
        assert!(remedy.contains("--web=0.0.0.0"), "{remedy}");
    }
}
