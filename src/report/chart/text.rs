//! The approximate width of texts: the font is the reader's.

/// Width of a text, pixels; a little more than common sans-serif fonts need.
pub(super) fn width(text: &str, size_px: f64) -> f64 {
    text.chars().map(width_em).sum::<f64>() * size_px
}

/// The text, or as much of its beginning as fits, with an ellipsis; empty when not even two letters do.
pub(super) fn fitted(text: &str, size_px: f64, room_px: f64) -> String {
    if width(text, size_px) <= room_px {
        return text.to_owned();
    }
    let mut left_px = room_px - width("…", size_px);
    let fits = |char: &char| {
        left_px -= width_em(*char) * size_px;
        left_px >= 0.0
    };
    let beginning: String = text.chars().take_while(fits).collect();
    if beginning.chars().nth(1).is_none() { String::new() } else { beginning + "…" }
}

/// The text on as many lines as it needs, broken between words.
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
        // From Hangul and kana on, letters are as wide as they are high.
        '\u{1100}'.. => 1.05,
        _ => 0.64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_cut_with_an_ellipsis() {
        assert_eq!(fitted("green", 10.0, 100.0), "green");
        let cut = fitted("a rather long name of a phase", 10.0, 80.0);
        assert!(cut.starts_with("a rather") && cut.ends_with('…'), "{cut}");
        assert!(width(&cut, 10.0) <= 80.0);
        assert_eq!(fitted("green", 10.0, 12.0), "");
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
