//! `[http]`: the address at which metrics are served.

use std::net::SocketAddr;

use crate::config::reading::fields::Fields;

/// The HTTP server; it is off without an address.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HttpConfig {
    /// Address and port to listen at; `None` for no server.
    pub address: Option<SocketAddr>,
    /// Names of this computer that requests may use, beside addresses and `localhost`.
    pub hosts: Vec<String>,
}

/// Reads the section; what is absent has its default.
pub(super) fn http(fields: Fields<'_>) -> HttpConfig {
    let address = fields.string("address").and_then(|given| {
        let remedy = "give an IP address and a port, such as \"127.0.0.1:9464\"";
        fields.checker.accept(&given.location, given.text.parse(), remedy)
    });
    let hosts = fields.list("hosts", "give a list of names").iter();
    let config = HttpConfig {
        address,
        hosts: hosts.filter_map(|host| Some(fields.checker.string(host)?.text)).collect(),
    };
    fields.done();
    config
}
