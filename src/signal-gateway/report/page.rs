//! A page for a browser: one document with its style and its script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

/// A page, with a policy that allows only its own style and script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The document, with style and script.
    pub html: String,
    /// Value of the header `Content-Security-Policy`.
    pub content_security_policy: String,
}

impl Page {
    /// Creates the page of a document that contains this style and this script.
    pub fn new(html: String, style: &str, script: &str) -> Self {
        // The hashes cover everything between the tags.
        let content_security_policy = format!(
            "default-src 'none'; style-src '{}'; script-src '{}'; connect-src 'self'; img-src data:; base-uri 'none'; \
             form-action 'none'; frame-ancestors 'none'",
            hash(style),
            hash(script)
        );
        Self { html, content_security_policy }
    }
}

/// Returns the source expression for a security policy: the hash of the text.
fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
