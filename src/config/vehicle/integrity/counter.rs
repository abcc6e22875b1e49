//! `counter = { … }` of `[message.*]`.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use super::field::field;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::dbc::model::Message;
use crate::core::validation::integrity::counter::{Counter, CounterRule, IncrementsOn};

keywords!(IncrementsOn { "sends" => IncrementsOn::Sends, "changes" => IncrementsOn::Changes });

/// `counter = { signal = … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterFile {
    /// Signal of the same message.
    pub signal: Spanned<String>,
    /// First value; the signal's lowest when not given.
    pub first: Option<u32>,
    /// Last value; the signal's highest when not given.
    pub last: Option<u32>,
    /// Largest step that is still believed.
    #[serde(default = "one_step")]
    pub max_step: u32,
    /// Equal counters in a row that are tolerated, though not believed.
    #[serde(default)]
    pub tolerated_repeats: u8,
    /// Frames in sequence needed after a break.
    #[serde(default = "one")]
    pub sync_after: u8,
    /// What it counts.
    #[serde(default)]
    pub increments_on: Keyword<IncrementsOn>,
}

fn one_step() -> u32 {
    1
}

fn one() -> u8 {
    1
}

/// The rule with the signal it counts in.
pub(in crate::config::vehicle) fn counter(
    binder: &mut Binder<'_>,
    file: &Spanned<CounterFile>,
    message: &Message,
) -> Option<Counter> {
    let (span, file) = (file.span(), file.get_ref());
    let signal = field(binder, message, &file.signal)?;
    let (lowest, highest) = signal.range();
    let limit = |value: i128| u32::try_from(value).unwrap_or(if value < 0 { 0 } else { u32::MAX });
    let rule = CounterRule::new(file.first.unwrap_or(limit(lowest)), file.last.unwrap_or(limit(highest)))
        .and_then(|rule| rule.with_max_step(file.max_step))
        .map(|rule| {
            rule.with_increments_on(file.increments_on.0).with_tolerated_repeats(file.tolerated_repeats)
        })
        .map(|rule| rule.with_sync_after(file.sync_after));
    match rule.and_then(|rule| Counter::new(rule, signal)) {
        Ok(counter) => Some(counter),
        Err(error) => {
            binder.refuse(span, error.to_string(), "see [message.*] counter in config/gateway.toml");
            None
        }
    }
}
