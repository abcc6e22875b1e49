//! `window = { … }` of `[message.*]`: the E2E state machine.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use crate::core::validation::integrity::window::{Limits, Window};

/// `window = { init = …, valid = …, invalid = … }`: the E2E state machine.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowFile {
    /// Limits before the message was valid.
    pub init: LimitsFile,
    /// Limits while it is.
    pub valid: LimitsFile,
    /// Limits after it was invalid.
    pub invalid: LimitsFile,
    /// Results before a fall into the invalid state do not count for the way out.
    #[serde(default)]
    pub clear_to_invalid: bool,
}

/// `{ size = …, min_ok = …, max_error = … }`
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsFile {
    /// Newest results looked at, 1 to 64.
    pub size: u8,
    /// Good ones needed.
    pub min_ok: u8,
    /// Errors allowed.
    pub max_error: u8,
}

/// The window, when its limits can be.
pub(super) fn window(binder: &mut Binder<'_>, file: &Spanned<WindowFile>) -> Option<Window> {
    let limits = |file: LimitsFile| {
        let LimitsFile { size, min_ok, max_error } = file;
        Limits { size, min_ok, max_error }
    };
    let (span, file) = (file.span(), file.get_ref());
    let window =
        Window::new(limits(file.init), limits(file.valid), limits(file.invalid), file.clear_to_invalid);
    window
        .map_err(|error| {
            binder.refuse(span, error.to_string(), "see [message.*] window in config/gateway.toml");
        })
        .ok()
}
