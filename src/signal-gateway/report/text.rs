//! Common parts of texts: counts, and names with arbitrary contents.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use crate::config::built_in::display;

/// Returns the text with escaped control characters, so that a name cannot move the cursor or begin a line.
pub fn escaped(text: &str) -> Cow<'_, str> {
    // Fast path: ASCII bytes are compared many at once, and most texts have no others.
    let is_plain = text.bytes().all(|byte| matches!(byte, b' '..=b'~'));
    if is_plain || !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len());
    for char in text.chars() {
        if char.is_control() { escaped.extend(char.escape_default()) } else { escaped.push(char) }
    }
    Cow::Owned(escaped)
}

/// Layout of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layout {
    /// True to write severities in colour.
    pub has_color: bool,
    /// Width at which lines are wrapped; `None` = never.
    pub width: Option<usize>,
}

/// Minimum width of a column in which a text is wrapped, characters.
const MIN_COLUMN: usize = 30;

/// Wraps a text between words in a column of `width`; `used` characters of the first line are already taken.
pub fn wrapped(text: &str, width: Option<usize>, used: usize) -> Vec<String> {
    let width = width.map_or(usize::MAX, |width| width.max(MIN_COLUMN));
    let mut lines = vec![String::new()];
    let mut used = used;
    for (index, word) in text.split(' ').enumerate() {
        let length = word.chars().count();
        if index > 0 && used.saturating_add(1 + length) > width {
            lines.push(String::new());
            used = 0;
        } else if let Some(line) = lines.last_mut().filter(|_| index > 0) {
            line.push(' ');
            used += 1;
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(word);
        }
        used += length;
    }
    lines
}

/// Shortens a text to `width` characters, with an ellipsis.
pub(super) fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

/// Formats a time since the start as on a clock: `0:07`, `12:34`, `1:02:03`.
pub fn clock_text(since_start: Duration) -> String {
    let seconds = since_start.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

/// Returns `once`, or e.g. `3 times`.
pub fn times(count: u64) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}

/// Returns e.g. `1 line` or `3 lines`.
pub fn counted(count: u64, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Returns the path in its usual form: `dbc/a.dbc` for `config/vehicles/../../dbc/a.dbc`, `built-in
/// dbc/a.dbc` for a file in the binary. Only for texts, since a folder may be a link.
pub fn plain_path(path: &Path) -> String {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match (component, plain.components().next_back()) {
            (Component::ParentDir, Some(Component::Normal(_))) => _ = plain.pop(),
            (Component::CurDir, _) => {}
            _ => plain.push(component),
        }
    }
    display(&plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_plain() {
        assert_eq!(escaped("can0 \"ä\""), "can0 \"ä\"");
        assert_eq!(escaped("a\u{1b}[2Jb\nc\u{7f}"), "a\\u{1b}[2Jb\\nc\\u{7f}");
        assert_eq!([0, 1, 2].map(times), ["0 times", "once", "2 times"]);
        assert_eq!([0, 1, 2].map(|count| counted(count, "line")), ["0 lines", "1 line", "2 lines"]);
        for (path, plain) in [
            ("config/vehicles/../../dbc/a.dbc", "dbc/a.dbc"),
            ("../../dbc/./a.dbc", "../../dbc/a.dbc"),
            ("/a/../../b", "/../b"),
            ("a.dbc", "a.dbc"),
        ] {
            assert_eq!(plain_path(Path::new(path)), plain);
        }
    }
}
