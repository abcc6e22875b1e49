//! Messages of statuses. Each is a row with level, text and remedy; programs never parse the text.

use std::fmt;

use super::level::Level;

/// A message of a status, or a reason within a message.
#[derive(Debug, PartialEq, Eq)]
pub struct MessageRow {
    /// Severity; `None` for a reason, which has the level of the message that contains it.
    pub level: Option<Level>,
    /// Text, in which `{name}` is a placeholder for a value.
    pub template: &'static str,
    /// Remedy in sentences; empty if no action is needed, or if the reason's remedy is sufficient.
    pub remedy: &'static str,
}

/// A status that the gateway can report, with its messages.
#[derive(Debug, PartialEq, Eq)]
pub struct Section {
    /// Names of the statuses of this kind; `{interface}` stands for the name of any interface.
    pub names: &'static [&'static str],
    /// Messages of these statuses, in groups.
    pub messages: &'static [&'static [&'static MessageRow]],
}

impl Section {
    /// Returns where the section is documented: a project file, and the anchor of a heading in it.
    pub fn document(&self) -> String {
        let names: Vec<_> = self.names.iter().map(|name| name.trim_matches(['{', '}'])).collect();
        format!("docs/diagnostics.md#{}", names.join("-"))
    }

    /// Returns all messages of the section.
    pub fn rows(&self) -> impl Iterator<Item = &'static MessageRow> {
        self.messages.iter().copied().flatten().copied()
    }
}

/// A part of a status's message: a row with its placeholders filled in, with the rows of its reasons.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessagePart {
    /// Its own row, then the row of its reason, and so on.
    pub rows: Vec<&'static MessageRow>,
    /// Text with its placeholders filled in.
    pub text: String,
    /// Remedy; empty if no action is needed.
    pub remedy: String,
}

impl MessagePart {
    /// Creates a part from a row and its text with placeholders filled in, as [`messages!`](crate::messages)
    /// does.
    pub fn new(row: &'static MessageRow, text: String) -> Self {
        Self { rows: vec![row], text, remedy: row.remedy.to_owned() }
    }

    /// Returns the severity of the part.
    pub fn level(&self) -> Level {
        self.rows.first().and_then(|row| row.level).unwrap_or_default()
    }

    /// Returns the message that has this one as its reason. The remedy of the reason comes first.
    pub fn within(self, message: impl FnOnce(String) -> Self) -> Self {
        let mut outer = message(self.text);
        outer.rows.extend(self.rows);
        outer.remedy = joined([self.remedy.as_str(), &outer.remedy]);
        outer
    }

    /// Returns the same message with a remedy for this case.
    pub fn with_remedy(self, remedy: String) -> Self {
        Self { remedy, ..self }
    }

    /// Returns the same message with a more detailed text.
    pub fn with_text(self, text: impl FnOnce(String) -> String) -> Self {
        Self { text: text(self.text), ..self }
    }
}

impl fmt::Display for MessagePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Joins sentences, without repeating any.
pub(super) fn joined<'a>(sentences: impl IntoIterator<Item = &'a str>) -> String {
    let mut distinct: Vec<&str> = Vec::new();
    for text in sentences {
        if !text.is_empty() && !distinct.contains(&text) {
            distinct.push(text);
        }
    }
    distinct.join(" ")
}

/// Creates a list of messages, and a function for each message that fills in its placeholders. A row is
/// `LEVEL name(places) TEXT, REMEDY;`. The level is `-` for a reason; the remedy is omitted if no action is
/// needed.
#[macro_export]
macro_rules! messages {
    ($(#[$doc:meta])* $list:ident { $($level:tt $message:ident($($place:ident),*) $text:literal $(, $remedy:literal)?;)+ }) => {
        $(#[$doc])*
        pub static $list: &[&$crate::diagnostics::MessageRow] = &[$(&$message::ROW),+];
        $(
            #[doc = concat!("The row of `", $text, "`.")]
            pub mod $message {
                pub(super) static ROW: $crate::diagnostics::MessageRow = $crate::diagnostics::MessageRow {
                    level: $crate::diagnostics::messages!(@level $level),
                    template: $text,
                    remedy: concat!($($remedy)?),
                };
            }

            #[doc = concat!("Makes the message `", $text, "`.")]
            #[allow(clippy::useless_format)] // a text without placeholders
            pub fn $message($($place: impl std::fmt::Display),*) -> $crate::diagnostics::MessagePart {
                $crate::diagnostics::MessagePart::new(&$message::ROW, format!($text))
            }
        )+
    };
    (@level -) => { None };
    (@level $level:ident) => { Some($crate::diagnostics::Level::$level) };
}

pub use messages;
