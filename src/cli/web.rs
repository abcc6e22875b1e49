//! Arguments of the commands that can serve the live page.

use std::net::SocketAddr;

use clap::Args;

use super::messages;
use crate::config::gateway::HttpConfig;

const DEFAULT_ADDRESS: &str = "127.0.0.1:9464";

/// The live page.
#[derive(Debug, Args)]
pub(super) struct WebArgs {
    /// Serve the live page for browsers, at 127.0.0.1:9464 unless given
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_ADDRESS)]
    web: Option<SocketAddr>,
    /// Serve it, and open it in the browser
    #[arg(long)]
    open: bool,
}

impl WebArgs {
    /// True if the page is to be served.
    pub(super) fn is_on(&self) -> bool {
        self.web.is_some() || self.open
    }

    /// Serves the page as the arguments say, and names its address on standard error.
    pub(super) fn apply(&self, http: &mut HttpConfig) {
        if !self.is_on() {
            return;
        }
        let configured = http.address.or_else(|| DEFAULT_ADDRESS.parse().ok());
        http.address = self.web.or(configured);
        (http.page, http.opens_browser) = (true, self.open);
        if let Some(url) = http.url() {
            messages::note(&format!("live page: {url}"));
        }
    }
}
