//! The approximate width of texts, since the font depends on the viewer.

/// Returns the width of a text, pixels; slightly more than common sans-serif fonts need.
pub(super) fn width(text: &str, size_px: f64) -> f64 {
    text.chars().map(width_em).sum::<f64>() * size_px
}

pub(super) fn fits(text: &str, size_px: f64, room_px: f64) -> bool {
    width(text, size_px) <= room_px
}

/// Returns the text, or as much of its beginning as fits, with an ellipsis.
fn cut(text: &str, size_px: f64, room_px: f64) -> String {
    if fits(text, size_px, room_px) {
        return text.to_owned();
    }
    let mut left_px = room_px - width("…", size_px);
    let fits = |char: &char| {
        left_px -= width_em(*char) * size_px;
        left_px >= 0.0
    };
    text.chars().take_while(fits).collect::<String>() + "…"
}

/// Breaks a name into at most `max_lines` lines, after spaces and separators between the parts of names. The
/// last line is shortened with an ellipsis if necessary.
pub(super) fn name_lines(name: &str, size_px: f64, room_px: f64, max_lines: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in name.split_inclusive([' ', '.', '_', '/', '-', ',']) {
        let is_full = lines.len() == max_lines;
        match lines.last_mut() {
            Some(line) if is_full || fits((line.clone() + part).trim_end(), size_px, room_px) => {
                line.push_str(part);
            }
            _ => lines.push(part.to_owned()),
        }
    }
    lines.iter().map(|line| cut(line.trim_end(), size_px, room_px)).collect()
}

/// Breaks a text between words into as many lines as it needs.
pub(super) fn wrapped(text: &str, size_px: f64, room_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if width(line, size_px) + width(word, size_px) + width(" ", size_px) <= room_px => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn width_em(char: char) -> f64 {
    match char {
        'i' | 'j' | 'l' | '|' | '!' | '.' | ',' | ':' | ';' | '\'' | ' ' => 0.35,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' | 's' => 0.5,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '…' => 0.98,
        'A'..='Z' => 0.72,
        // From Hangul and kana on, letters are as wide as high.
        '\u{1100}'.. => 1.05,
        _ => 0.64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_broken_between_their_parts_and_cut_at_the_end_alone() {
        let lines = |name: &str, room_px: f64| name_lines(name, 11.0, room_px, 2);
        assert_eq!(lines("hazard_lights", 190.0), ["hazard_lights"]);
        let signal = "BCM_TurnIndicators.TurnIndicatorState";
        assert_eq!(lines(signal, 190.0), ["BCM_TurnIndicators.", "TurnIndicatorState"]);
        for room_px in [20.0, 60.0, 100.0, 190.0] {
            let lines = lines(&signal.repeat(3), room_px);
            assert!(lines.len() <= 2 && lines.iter().all(|line| fits(line, 11.0, room_px)), "{lines:?}");
            assert!(lines[1].ends_with('…'), "{lines:?}");
        }
        assert!(width("信号", 10.0) > 20.0);
    }

    #[test]
    fn what_does_not_fit_on_a_line_goes_on_below() {
        let text = "the pull-out is no longer signalled (near the bound of the lane)";
        assert_eq!(wrapped(text, 10.0, 1000.0), [text]);
        let lines = wrapped(text, 10.0, 150.0);
        assert_eq!(lines.join(" "), text);
        assert!(lines.len() > 2 && lines.iter().all(|line| width(line, 10.0) <= 150.0), "{lines:?}");
        assert_eq!(wrapped("unbreakable", 10.0, 5.0), ["unbreakable"]);
    }
}
