//! Formats a discovery as text, for a person in a car.

use std::fmt::Write as _;

use can_signal::can::DriverMark;
use gateway_base::time::MonoTime;
use vehicle_bringup::discovery::capture::MessageKey;
use vehicle_bringup::discovery::findings::{Certainty, DiscoveryFindings};
use vehicle_bringup::discovery::timeline::DriverAction;

/// Minimum number of terminal columns for showing a request in full, beside its countdown.
const WIDE: usize = 80;

/// Returns the request to the driver, in a line of a terminal of this width.
pub fn request(mark: DriverMark, width: usize) -> &'static str {
    let (short, long) = match mark {
        DriverMark::Quiet => ("HANDS OFF  touch nothing", "HANDS OFF  touch nothing: pedals, lever, wheel"),
        DriverMark::Left => {
            ("LEFT       indicate, leave on", "LEFT       indicate LEFT now, all the way, and leave it on")
        }
        DriverMark::Right => {
            ("RIGHT      indicate, leave on", "RIGHT      indicate RIGHT now, all the way, and leave it on")
        }
        DriverMark::Hazard => {
            ("HAZARD     press, leave on", "HAZARD     press the HAZARD button now, and leave it on")
        }
        DriverMark::Off => ("OFF        all off again", "OFF        everything off again"),
    };
    if width < WIDE { short } else { long }
}

/// Returns the request to the driver and the next action, in a line of a terminal of this width.
pub fn request_and_next(mark: DriverMark, next: Option<DriverAction>, width: usize) -> String {
    let request = request(mark, width);
    let Some(next) = next else { return request.to_owned() };
    let room = if width < WIDE { 30 } else { 60 };
    format!("{request:<room$}next: {}", next.to_string().to_uppercase())
}

/// Returns a bar for the remaining time, with whole seconds: `■■■□□ 3 s`.
pub fn countdown(from: MonoTime, until: MonoTime, now: MonoTime) -> String {
    let total = until.since(from).as_millis().div_ceil(1000).max(1);
    let left = until.since(now).as_millis().div_ceil(1000).min(total);
    let squares = |count: u128, square: &str| square.repeat(usize::try_from(count).unwrap_or(0));
    format!("{}{} {left:>2} s", squares(total - left, "■"), squares(left, "□"))
}

/// Describes the response to an action: `4 bits of 2A5 and 1F0 responded`.
pub fn seen(action: DriverAction, messages: &[MessageKey], bits: usize) -> String {
    const LISTED: usize = 4;
    if messages.is_empty() {
        return format!("{action}: nothing responded");
    }
    let ids: Vec<_> = messages.iter().take(LISTED).map(|key| format!("0x{}", key.id)).collect();
    let more = messages.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let bits = if bits == 1 { "1 bit".to_owned() } else { format!("{bits} bits") };
    format!("{action}: {bits} responded, in {}{more}", ids.join(", "))
}

/// Explains why actions are repeated.
pub fn repeats(actions: &[DriverAction]) -> String {
    let names: Vec<_> = actions.iter().map(|action| action.to_string().to_uppercase()).collect();
    let why = "Not every request was followed clearly, or too few were.";
    format!("Not sure about {} yet: once more.\n{why}", names.join(" and "))
}

const MAX_RIVALS: usize = 3;

/// Returns the result, in lines.
pub fn result(findings: &DiscoveryFindings) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |heading: &str, content: &str| {
        let _ = writeln!(text, "{heading:<9} {content}");
    };
    let sides = [DriverAction::Left, DriverAction::Right];
    if let Some(turn) = findings.turn.first() {
        let is_sure = findings.is_usable();
        if !is_sure {
            let [left, right] = sides.map(|side| findings.certainty(side));
            line("turn", &format!("NOT SURE (left: {left}, right: {right}). The best candidate is"));
        }
        line(if is_sure { "turn" } else { "" }, &turn.form.to_string());
        let [left, right] = sides.map(|side| turn.followed_text(side));
        let only = if is_sure || findings.turn_doubt.is_some() { "" } else { "but only " };
        line("", &format!("{only}followed {left} requests to the left, {right} to the right"));
        for rival in findings.turn.iter().filter(|_| is_sure).skip(1).take(MAX_RIVALS) {
            line("  rival", &rival.form.to_string());
            line("", &format!("  not taken: {}", rival.explanation(turn)));
        }
        if let Some(doubt) = findings.turn_doubt.filter(|_| !is_sure) {
            line("", &format!("but {doubt}"));
        }
    } else {
        line("turn", "NOT FOUND: no signal on this bus follows both sides");
    }
    if let Some(form) = findings.moved_at_rest {
        line("", &format!("{form} followed both sides, but it changed during HANDS OFF as well."));
        line("", "Was the lever moved then? Repeat the session, and touch nothing during HANDS OFF");
    }
    let certainty = findings.certainty(DriverAction::Hazard);
    if let Some(hazard) = findings.hazard.first() {
        let is_sure = certainty == Certainty::Sure;
        let (doubtful, unseen) = if is_sure { ("", "") } else { ("NOT SURE: ", "; written as not visible") };
        line("hazard", &format!("{doubtful}{}", hazard.form));
        line("", &format!("followed {} requests{unseen}", hazard.followed_text(DriverAction::Hazard)));
        if let Some(doubt) = findings.hazard_doubt.filter(|_| !is_sure) {
            line("", &format!("but {doubt}"));
        }
    } else {
        line("hazard", &format!("{certainty}; written as not visible"));
    }
    let turn = findings.turn.first().map(|turn| turn.form.signals()).unwrap_or_default();
    let hazard = findings.hazard.first().and_then(|hazard| hazard.form.signal());
    let mut messages: Vec<_> = turn.into_iter().chain(hazard).map(|signal| signal.message).collect();
    messages.sort_unstable();
    messages.dedup();
    for message in messages {
        let Some(protection) = findings.protection.get(&message) else { continue };
        let counter =
            protection.counter.map(|counter| format!("counter {} to {}", counter.first, counter.last));
        let checksum = protection.checksum.as_ref().map(|checksum| format!("checksum {}", checksum.kind));
        let found = counter.into_iter().chain(checksum).reduce(|found, also| found + ", " + &also);
        let found = found.as_deref().unwrap_or("neither counter nor known checksum");
        line("protected", &format!("0x{}: {found}", message.id));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_fits_beside_its_longest_countdown() {
        let at = MonoTime::from_millis;
        let countdown = countdown(at(0), at(10_000), at(0)).chars().count();
        for (width, mark) in [80, 50].into_iter().flat_map(|width| {
            [DriverMark::Quiet, DriverMark::Left, DriverMark::Right, DriverMark::Hazard, DriverMark::Off]
                .map(|mark| (width, mark))
        }) {
            // The marker of the line, the number of the request, and two blanks before the countdown.
            let length = 2 + 5 + request(mark, width).len() + 2 + countdown;
            // Only the request to do nothing lasts this long.
            let length = if mark == DriverMark::Quiet { length } else { length - 5 };
            assert!(length <= width, "{mark:?} at {width}: {length}");
        }
        let line = request_and_next(DriverMark::Off, Some(DriverAction::Right), 50);
        assert!(line.ends_with("next: RIGHT"), "{line}");
    }

    #[test]
    fn countdown_shows_the_seconds_left() {
        let at = MonoTime::from_millis;
        assert_eq!(countdown(at(1000), at(6000), at(1000)), "□□□□□  5 s");
        assert_eq!(countdown(at(1000), at(6000), at(4500)), "■■■□□  2 s");
        assert_eq!(countdown(at(1000), at(6000), at(9000)), "■■■■■  0 s");
    }
}
