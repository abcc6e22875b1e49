//! Compares the meanings in a profile with the DBC's names.

use super::kind::CheckKind;
use super::report::CheckReport;
use crate::config::Settings;
use can_signal::validation::display::RoleTexts;
use can_signal::validation::table::{SignalIndex, SignalTable};
use vehicle_bringup::plausibility::finding::Severity;

const MAX_HEADING: usize = 10;
const LISTED: i128 = 3;

/// Returns the DBC's name of a raw value.
pub(super) fn value_name<'a>(
    settings: &'a Settings,
    table: &SignalTable,
    signal: SignalIndex,
    raw: i128,
) -> Option<&'a str> {
    let bound = &table.signals[signal.0];
    let message = &table.messages[bound.message.0];
    let database = &settings.dbcs.get(usize::from(message.bus.0))?.database;
    let described = database.messages.iter().find(|described| described.id == message.ids.described())?;
    let (_, name) = bound.name.rsplit_once('.')?;
    let values = &described.signal(name)?.values;
    values.iter().find(|(value, _)| *value == raw).map(|(_, name)| name.as_str())
}

/// Lists the meaning of each value with its name in the DBC, and finds sides that look swapped.
pub(super) fn roles(settings: &Settings, table: &SignalTable, roles: &[RoleTexts], report: &mut CheckReport) {
    for role in roles {
        let name = &table.signals[role.signal.0].name;
        let mut values = Vec::new();
        for (range, meaning) in &role.named {
            let (first, last) = (range.first, range.last);
            let names = (first..=last.min(first + LISTED - 1))
                .filter_map(|raw| value_name(settings, table, role.signal, raw))
                .collect::<Vec<_>>();
            for name_of_value in &names {
                let ours = format!("{} {meaning}", role.subject);
                if are_opposite(&ours, name_of_value) {
                    let text =
                        format!("{name}: {range} is {ours} in the profile and {name_of_value:?} in the DBC");
                    report.find(Severity::Warning, CheckKind::OppositeSide, text);
                }
            }
            let names: Vec<_> = names.iter().filter(|name| !name.eq_ignore_ascii_case(meaning)).collect();
            let quoted = names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
            let quoted = if quoted.is_empty() { quoted } else { format!(" ({quoted})") };
            values.push(format!("{range} {meaning}{quoted}"));
        }
        if are_opposite(&role.subject, name.rsplit('.').next().unwrap_or(name)) {
            let text = format!("{name} is bound as {}: its name says the other side", role.subject);
            report.find(Severity::Warning, CheckKind::OppositeSide, text);
        }
        let (heading, rest) = heading(&role.subject);
        report.line(heading, format!("{rest}{name}: {}; anything else is invalid", values.join(", ")));
    }
}

/// Splits a long subject into a heading and the start of its text.
fn heading(subject: &str) -> (&str, String) {
    match subject.split_once(' ') {
        Some((first, rest)) if subject.chars().count() > MAX_HEADING => (first, format!("{rest}: ")),
        _ => (subject, String::new()),
    }
}

/// Returns true if one text is about the left side and the other about the right side. This is a guess, since
/// names in a DBC and a profile's texts for faults and reasons are free text.
fn are_opposite(one: &str, other: &str) -> bool {
    let side = |text: &str| {
        let text = text.to_lowercase();
        match (text.contains("left"), text.contains("right")) {
            (true, false) => Some("left"),
            (false, true) => Some("right"),
            _ => None,
        }
    };
    matches!((side(one), side(other)), (Some(one), Some(other)) if one != other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_opposite_only_when_both_texts_name_one() {
        assert!(are_opposite("turn left", "IndicatingRight"));
        assert!(!are_opposite("turn left", "IndicatingLeft"));
        assert!(!are_opposite("turn off", "Right"));
        assert!(!are_opposite("turn left", "left or right"));
    }

    #[test]
    fn long_subjects_are_cut_for_the_heading() {
        assert_eq!(heading("right lamp"), ("right lamp", String::new()));
        assert_eq!(heading("fault of turn lamp"), ("fault", "of turn lamp: ".to_owned()));
    }
}
