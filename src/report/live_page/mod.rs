//! The live page: one document with its style and its script, which shows the snapshots of a stream of events.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use crate::report::palette;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// One after the other they are one script.
const SCRIPTS: [&str; 4] = [
    include_str!("draw.js"),
    include_str!("sections.js"),
    include_str!("history.js"),
    include_str!("page.js"),
];

/// The page, and the policy that allows its own style and script and nothing else.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LivePage {
    /// The document, with style and script.
    pub html: String,
    /// Value of the header `Content-Security-Policy`.
    pub content_security_policy: String,
}

impl LivePage {
    /// Puts the page together.
    pub fn new() -> Self {
        let script = SCRIPTS.concat();
        // Their hashes cover everything between the tags.
        let style = palette::style() + STYLE;
        let html = TEMPLATE.replace("{{style}}", &style).replace("{{script}}", &script);
        let content_security_policy = format!(
            "default-src 'none'; style-src '{}'; script-src '{}'; connect-src 'self'; img-src data:; base-uri 'none'; \
             form-action 'none'; frame-ancestors 'none'",
            hash(&style),
            hash(&script)
        );
        Self { html, content_security_policy }
    }
}

impl Default for LivePage {
    fn default() -> Self {
        Self::new()
    }
}

/// A source of a security policy: the text itself.
fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
