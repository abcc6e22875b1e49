//! Arguments of the commands that can serve the live page.

use std::ffi::OsString;
use std::net::SocketAddr;

use clap::Args;

use super::messages;
use crate::config::gateway::HttpConfig;

const DEFAULT_ADDRESS: &str = "127.0.0.1:9464";

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
    pub(super) fn is_on(&self) -> bool {
        self.web.is_some() || self.open
    }

    /// Enables the page in the configuration as requested, and writes its address to standard error.
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

/// Joins `--web ADDRESS:PORT` to `--web=ADDRESS:PORT`. Without an address `--web` is a flag, and no other argument
/// looks like an address.
pub(super) fn with_joined_address(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    for argument in arguments {
        let is_address = argument.to_str().is_some_and(|text| text.parse::<SocketAddr>().is_ok());
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
        for same in ["x demo --web commands", "x replay --web drive.log", "x replay 127.0.0.1:80 --web"] {
            assert_eq!(joined(same), same);
        }
    }
}
