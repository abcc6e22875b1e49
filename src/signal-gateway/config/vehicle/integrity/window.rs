//! `window = { init = …, valid = …, invalid = … }` of `[message.*]`: the E2E state machine.

use crate::config::reading::Fields;
use can_signal::validation::integrity::window::{Window, WindowLimits};

pub(super) fn window(fields: &Fields<'_>) -> Option<Window> {
    fields.require(&["init", "valid", "invalid"], "");
    let [init, valid, invalid] = ["init", "valid", "invalid"].map(|key| fields.read_table(key, limits));
    // If set, results from before the invalid state do not count towards leaving it.
    let clear_to_invalid = fields.flag("clear_to_invalid").unwrap_or_default();
    let window = Window::new(init?, valid?, invalid?, clear_to_invalid);
    fields.checker.accept(fields.location(), window, "see [message.*] window in config/gateway.toml")
}

/// Reads `{ size = …, min_ok = …, max_error = … }`.
fn limits(fields: &Fields<'_>) -> Option<WindowLimits> {
    fields.require(&["size", "min_ok", "max_error"], "");
    let [size, min_ok, max_error] =
        ["size", "min_ok", "max_error"].map(|key| fields.number(key, 0..=u8::MAX, ""));
    Some(WindowLimits { size: size?, min_ok: min_ok?, max_error: max_error? })
}
