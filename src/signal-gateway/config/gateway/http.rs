//! `[http]`: the address at which the live page and metrics are served.

use std::net::SocketAddr;

use crate::config::reading::{Fields, ValueShape, collection, flag, key_rows, other};

key_rows! {
    ADDRESS: SocketAddr = other("address", || ValueShape::Text, address, |_| None).example("\"127.0.0.1:9464\"").restart()
        .doc("where they are served; default: nowhere. Anybody who reaches it may read them");
    PAGE: bool = flag("page", true).restart().doc("false: metrics only");
    HOSTS: Vec<String> = collection("hosts", || ValueShape::Texts, hosts).example("[\"car.local\"]").restart()
        .doc("names of this computer that requests may use, beside addresses and localhost");
}

fn address(fields: &Fields<'_>, key: &'static str) -> Option<SocketAddr> {
    let given = fields.string(key)?;
    let remedy = "give an IP address and a port, such as \"127.0.0.1:9464\"";
    fields.checker.accept(&given.location, given.text.parse(), remedy)
}

fn hosts(fields: &Fields<'_>, key: &'static str) -> Vec<String> {
    let hosts = fields.list(key, "give a list of names").iter();
    hosts.filter_map(|host| Some(fields.checker.string(host)?.text)).collect()
}

/// The HTTP server; it is off without an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HttpConfig {
    /// Address and port to listen on; `None` for no server.
    pub address: Option<SocketAddr>,
    /// Names of this computer that requests may use, in addition to addresses and `localhost`.
    pub hosts: Vec<String>,
    /// False for metrics only.
    pub page: bool,
    /// True to open the page in a browser; set by the command line.
    pub opens_browser: bool,
}

impl HttpConfig {
    /// Returns the address of the page for a browser on this computer; `None` if it is off.
    pub fn url(&self) -> Option<String> {
        let address = self.address.filter(|_| self.page)?;
        let host = match (address.ip().is_unspecified(), address.is_ipv4()) {
            (true, true) => SocketAddr::from(([127, 0, 0, 1], address.port())),
            (true, false) => SocketAddr::from(([0, 0, 0, 0, 0, 0, 0, 1], address.port())),
            (false, _) => address,
        };
        Some(format!("http://{host}/"))
    }
}

impl Default for HttpConfig {
    fn default() -> Self {
        Self { address: None, hosts: Vec::new(), page: true, opens_browser: false }
    }
}

pub(super) fn http(fields: &Fields<'_>) -> HttpConfig {
    HttpConfig {
        address: fields.given(&ADDRESS),
        hosts: fields.read(&HOSTS),
        page: fields.read(&PAGE),
        opens_browser: false,
    }
}
