//! The changes of the last hours as text.

use super::text::escaped;
use gateway_core::gateway::history::HistoryEntry;

/// Width of a time and the following space.
const TIME: usize = 25;

/// Formats a change in a line, with its remedy and the location of its frames below.
pub fn entry_text(entry: &HistoryEntry) -> String {
    let mut text = line_text(entry);
    text.push('\n');
    let mut below = |line: &str| {
        text.push_str(&" ".repeat(TIME + 6));
        text.push_str(line);
        text.push('\n');
    };
    if let Some(remedy) = &entry.remedy {
        below(&format!("→ {}", escaped(remedy)));
    }
    if let Some(place) = &entry.black_box {
        let (seconds, millis) = (place.at_us / 1_000_000, place.at_us / 1000 % 1000);
        let recording = escaped(&place.recording);
        below(&format!("frames: black box fault-*-{recording}.log, at {seconds}.{millis:03} s"));
    }
    text
}

/// Formats a change in a line.
pub fn line_text(entry: &HistoryEntry) -> String {
    let (time, level) = (entry.stamp().utc_line_text(), entry.level.to_string());
    format!("{time} {level:<5} {:<24} {}", escaped(&entry.subject), escaped(&entry.text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway_base::diagnostics::Level;
    use gateway_core::gateway::history::{ChangeKind, InBlackBox};

    #[test]
    fn change_is_a_line_with_what_to_do_and_its_frames_below() {
        let entry = HistoryEntry {
            number: 1,
            stamp_ns: 1_700_000_000_123_000_000,
            kind: ChangeKind::Status,
            level: Level::Error,
            subject: "turn_indicators".to_owned(),
            text: "stale\u{1b}[2J".to_owned(),
            remedy: Some("Check the cable.".to_owned()),
            black_box: Some(InBlackBox { recording: "0a-20231114T221320Z".to_owned(), at_us: 5_043_210 }),
        };
        let expected = "2023-11-14 22:13:20.123Z ERROR turn_indicators          stale\\u{1b}[2J
                               → Check the cable.
                               frames: black box fault-*-0a-20231114T221320Z.log, at 5.043 s
";
        assert_eq!(entry_text(&entry), expected);
        let plain = HistoryEntry { level: Level::Ok, remedy: None, black_box: None, ..entry };
        assert_eq!(entry_text(&plain).lines().count(), 1);
    }
}
