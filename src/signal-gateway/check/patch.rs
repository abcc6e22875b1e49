//! Creates TOML lines to paste into a vehicle profile to fix it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::config::MissingTimeout;
use crate::config::draft::toml_key;
use crate::report::text::plain_path;
use can_log::EntryContent;
use can_log::Log;
use can_signal::can::CanId;
use gateway_base::time::MonoTime;
use vehicle_bringup::plausibility::gaps::GapDistribution;

/// Maximum proposed timeout, ms. Less frequent messages are sent on change.
const MAX_TIMEOUT_MS: u128 = 60_000;

/// A line for one section of a vehicle profile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fix {
    message: String,
    /// The new key with its value.
    pub line: String,
}

impl Fix {
    /// Creates a fix for a message by its name in reports; returns `None` for `BUS:MESSAGE`, whose section
    /// may belong to another bus.
    pub(super) fn new(message: &str, line: String) -> Option<Self> {
        (!message.contains(':')).then(|| Self { message: message.to_owned(), line })
    }

    /// Returns the section of the profile, without brackets.
    pub fn section(&self) -> String {
        format!("message.{}", toml_key(&self.message))
    }

    fn key(&self) -> &str {
        self.line.split('=').next().unwrap_or_default().trim()
    }
}

/// Returns the timeout line for a median period: five periods, as for the default from a DBC. Returns `None`
/// if the message is too rare to have a period.
pub(super) fn timeout(median: Duration) -> Option<String> {
    let timeout = (median.as_millis() * 5).max(200).div_ceil(50) * 50;
    (timeout <= MAX_TIMEOUT_MS).then(|| format!("timeout_ms = {timeout}"))
}

/// Returns timeouts for the messages without one whose period can be measured in the recording. Fails if the
/// recording cannot be read.
pub fn timeouts(log: &mut Log, missing: &[&MissingTimeout]) -> io::Result<Vec<Fix>> {
    let mut gaps: BTreeMap<(CanId, usize), (u64, GapDistribution)> = BTreeMap::new();
    let (mut first, mut now) = (None, MonoTime::ZERO);
    while let Some(record) = log.next_record()? {
        let EntryContent::Data(frame) = record.content else { continue };
        if missing.iter().any(|missing| missing.ids.contains(frame.id())) {
            let first = *first.get_or_insert(record.stamp.as_nanos());
            let since = u64::try_from(record.stamp.as_nanos().saturating_sub(first)).unwrap_or(0);
            now = now.max(MonoTime::ZERO.after(Duration::from_nanos(since)));
            let (frames, gaps) = gaps.entry((frame.id(), record.interface.0)).or_default();
            *frames += 1;
            gaps.frame(now);
        }
    }
    let fix = |missing: &&MissingTimeout| {
        let of_message = gaps.iter().filter(|((id, _), _)| missing.ids.contains(*id));
        let (_, (_, gaps)) = of_message.max_by_key(|(_, (frames, _))| *frames)?;
        Fix::new(&missing.message, timeout(gaps.median()?)?)
    };
    Ok(missing.iter().filter_map(fix).collect())
}

/// Returns the lines with their places in the profile: first those for existing sections, then new sections.
/// `text` is the content of `file`; `profile_key` is the key of the profile's table in it, or empty for the
/// whole file.
pub fn patch(file: &Path, text: &str, profile_key: &str, fixes: &[&Fix]) -> String {
    let file = plain_path(file);
    let document = DeTable::parse(text).ok();
    let profile = document.as_ref().map(Spanned::get_ref);
    let profile =
        if profile_key.is_empty() { profile } else { profile.and_then(|top| table(top, profile_key)) };
    let messages = profile.and_then(|profile| table(profile, "message"));
    let line_of = |at: usize| text.get(..at).unwrap_or(text).matches('\n').count() + 1;
    let (mut known, mut new) = (String::new(), BTreeMap::<String, String>::new());
    for fix in fixes {
        let prefix = if profile_key.is_empty() { "" } else { &format!("{profile_key}.") };
        let section = format!("{prefix}{}", fix.section());
        let entry = messages.and_then(|messages| messages.get_key_value(fix.message.as_str()));
        let Some((name, value)) = entry else {
            let lines = new.entry(section).or_default();
            let _ = writeln!(lines, "{}", fix.line);
            continue;
        };
        let keys = value.get_ref().as_table();
        let present = keys.and_then(|keys| keys.get_key_value(fix.key()));
        let place = match present {
            Some((key, _)) => format!("line {}, instead of that {}", line_of(key.span().start), fix.key()),
            None => format!("below [{section}] in line {}", line_of(name.span().start)),
        };
        let _ = writeln!(known, "# {file}, {place}:\n{}\n", fix.line);
    }
    let sections = new.iter().map(|(section, lines)| format!("[{section}]\n{lines}")).collect::<Vec<_>>();
    if sections.is_empty() {
        return known.trim_end().to_owned() + if known.is_empty() { "" } else { "\n" };
    }
    format!("{known}# {file}, at the end:\n{}", sections.join("\n"))
}

fn table<'t, 'd>(top: &'t DeTable<'d>, key: &str) -> Option<&'t DeTable<'d>> {
    top.get(key).and_then(|value| DeValue::as_table(value.get_ref()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fix(message: &str, line: &str) -> Fix {
        Fix::new(message, line.to_owned()).unwrap()
    }

    #[test]
    fn no_section_is_given_twice() {
        let text = "name = \"Car\"\n\n[message.A]\ntimeout_ms = 100\n[message.B]\ntiming = \"cyclic\"\n";
        let fixes = [
            fix("C d", "timeout_ms = 200"),
            fix("A", "timeout_ms = 500"),
            fix("B", "timeout_ms = 250"),
            fix("C d", "counter = { signal = \"x\" }"),
        ];
        let fixes: Vec<_> = fixes.iter().collect();
        let expected = "\
# a/car.toml, line 4, instead of that timeout_ms:
timeout_ms = 500

# a/car.toml, below [message.B] in line 5:
timeout_ms = 250

# a/car.toml, at the end:
[message.\"C d\"]
timeout_ms = 200
counter = { signal = \"x\" }
";
        let printed = patch(Path::new("a/b/../car.toml"), text, "", &fixes);
        assert_eq!(printed, expected);
        assert_eq!(patch(Path::new("car.toml"), text, "", &[]), "");
    }

    #[test]
    fn a_profile_within_a_configuration_has_its_key_in_front() {
        let text = "[vehicle]\nname = \"Car\"\n[vehicle.message.A]\ntiming = \"cyclic\"\n";
        let (known, new) = (fix("A", "timeout_ms = 500"), fix("B", "timeout_ms = 600"));
        let expected = "\
# gateway.toml, below [vehicle.message.A] in line 3:
timeout_ms = 500

# gateway.toml, at the end:
[vehicle.message.B]
timeout_ms = 600
";
        assert_eq!(patch(Path::new("gateway.toml"), text, "vehicle", &[&new, &known]), expected);
    }

    #[test]
    fn a_timeout_is_five_periods_and_a_message_of_two_buses_has_none() {
        assert_eq!(timeout(Duration::from_millis(20)).as_deref(), Some("timeout_ms = 200"));
        assert_eq!(timeout(Duration::from_millis(101)).as_deref(), Some("timeout_ms = 550"));
        assert_eq!(timeout(Duration::from_secs(3600)), None);
        assert_eq!(Fix::new("body:A", String::new()), None);
    }
}
