//! A page for a browser: one document with its style and its script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

/// A page, and the policy that allows its own style and script and nothing else.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The document, with style and script.
    pub html: String,
    /// Value of the header `Content-Security-Policy`.
    pub content_security_policy: String,
}

impl Page {
    /// Creates the page of a document in which stand this style and this script.
    pub fn new(html: String, style: &str, script: &str) -> Self {
        // Their hashes cover everything between the tags.
        let content_security_policy = format!(
            "default-src 'none'; style-src '{}'; script-src '{}'; connect-src 'self'; img-src data:; base-uri 'none'; \
             form-action 'none'; frame-ancestors 'none'",
            hash(style),
            hash(script)
        );
        Self { html, content_security_policy }
    }
}

/// A source of a security policy: the text itself.
fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
