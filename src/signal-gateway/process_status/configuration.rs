//! The configuration in effect, by parts, and the changes that another configuration would make.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue::{self, CONFIGURATION};
use gateway_base::diagnostics::Status;
use gateway_base::time::WallStamp;

/// A configuration in effect: the value of each part, with its defaults, by the part's name, such as `[ros]
/// domain_id`.
///
/// A value is what the user has written, or the default; of a file it is a digest of the content. Values of
/// two configurations compare where the same build made them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct EffectiveConfiguration {
    /// Parts that a reload changes while the gateway runs.
    pub reloadable: BTreeMap<String, String>,
    /// Parts that only a restart changes.
    pub fixed: BTreeMap<String, String>,
}

/// A part that two configurations do not have alike.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Change {
    /// Name of the part.
    pub part: String,
    /// Its value in effect; `None` where the running configuration does not have it.
    pub before: Option<String>,
    /// Its value in the new configuration; `None` where that does not have it.
    pub after: Option<String>,
}

/// The changes that another configuration brings.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ReloadPlan {
    /// Changes that a reload carries out.
    pub reloadable: Vec<Change>,
    /// Changes that only a restart carries out; with one of them nothing is reloaded.
    pub restart: Vec<Change>,
}

/// The configuration that is in effect, and what became of the last other one.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ConfigurationState {
    /// The parts in effect.
    pub in_effect: EffectiveConfiguration,
    /// Times since start that a configuration was reloaded.
    pub reloads: u64,
    /// Times since start that one was refused.
    pub refused: u64,
    /// The last reload, in effect or refused; `None` since start.
    pub last_reload: Option<Reload>,
}

/// A reload that was requested.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Reload {
    /// When it ended, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// True if the new configuration is in effect; false if it was refused, and the previous one stays in
    /// effect.
    pub is_applied: bool,
    /// Why it was refused; `None` if it is in effect.
    pub reason: Option<String>,
    /// The parts that changed, or would have.
    pub changes: Vec<Change>,
}

impl ConfigurationState {
    /// Creates the state at the start.
    pub fn new(in_effect: EffectiveConfiguration) -> Self {
        Self { in_effect, ..Self::default() }
    }

    /// Records that a configuration is in effect from now on.
    pub fn applied(&mut self, in_effect: EffectiveConfiguration, changes: Vec<Change>, at: WallStamp) {
        self.in_effect = in_effect;
        self.reloads = self.reloads.saturating_add(1);
        self.last_reload = Some(Reload { stamp_ns: at.as_nanos(), is_applied: true, reason: None, changes });
    }

    /// Records that a configuration was refused.
    pub fn refused(&mut self, reason: String, changes: Vec<Change>, at: WallStamp) {
        self.refused = self.refused.saturating_add(1);
        let (stamp_ns, reason) = (at.as_nanos(), Some(reason));
        self.last_reload = Some(Reload { stamp_ns, is_applied: false, reason, changes });
    }

    /// Returns the status of the configuration.
    pub fn status(&self) -> Status {
        let reason = self.last_reload.as_ref().and_then(|reload| reload.reason.as_deref());
        let first = reason.and_then(|reason| reason.lines().next());
        let message = match (first, &self.last_reload) {
            (Some(first), _) => catalogue::refused(first),
            (None, Some(_)) => catalogue::reloaded(),
            (None, None) => catalogue::as_at_start(),
        };
        let changes = self.last_reload.as_ref().map_or(&[][..], |reload| &reload.changes);
        let text = if changes.is_empty() { "none".to_owned() } else { changes_text(changes) };
        let values = vec![
            ("reloads", self.reloads.to_string()),
            ("refused_reloads", self.refused.to_string()),
            ("last_changes", text),
            ("last_error", reason.unwrap_or("none").to_owned()),
        ];
        Status::new(&CONFIGURATION, "configuration", &[message], values)
    }
}

impl ReloadPlan {
    /// Returns true if both configurations are the same.
    pub fn is_empty(&self) -> bool {
        self.reloadable.is_empty() && self.restart.is_empty()
    }
}

/// Compares the configuration in effect with another one.
pub fn plan(old: &EffectiveConfiguration, new: &EffectiveConfiguration) -> ReloadPlan {
    ReloadPlan {
        reloadable: changes(&old.reloadable, &new.reloadable),
        restart: changes(&old.fixed, &new.fixed),
    }
}

fn changes(old: &BTreeMap<String, String>, new: &BTreeMap<String, String>) -> Vec<Change> {
    let parts: BTreeSet<_> = old.keys().chain(new.keys()).collect();
    let change = |part: &String| Change {
        part: part.clone(),
        before: old.get(part).cloned(),
        after: new.get(part).cloned(),
    };
    parts.into_iter().map(change).filter(|change| change.before != change.after).collect()
}

/// Returns true for a digest, which only shows that a value differs.
fn is_digest(value: &str) -> bool {
    let digits = value.strip_prefix('#').unwrap_or_default();
    digits.len() == 16 && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { part, before, after } = self;
        match (before.as_deref(), after.as_deref()) {
            (Some(before), Some(after)) if !is_digest(before) && !is_digest(after) => {
                write!(f, "{part}: {before} → {after}")
            }
            (Some(_), Some(_)) => write!(f, "{part}: changed"),
            (None, Some(after)) if !is_digest(after) => write!(f, "{part}: added, {after}"),
            (None, _) => write!(f, "{part}: added"),
            (Some(_), None) => write!(f, "{part}: removed"),
        }
    }
}

/// Returns the changes as one text, separated by semicolons.
pub fn changes_text(changes: &[Change]) -> String {
    changes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn configuration(reloadable: &[(&str, &str)], fixed: &[(&str, &str)]) -> EffectiveConfiguration {
        let map = |parts: &[(&str, &str)]| {
            parts.iter().map(|(part, value)| ((*part).to_owned(), (*value).to_owned())).collect()
        };
        EffectiveConfiguration { reloadable: map(reloadable), fixed: map(fixed) }
    }

    #[test]
    fn plan_names_each_part_that_differs_and_no_other() {
        let old =
            configuration(&[("a", "1"), ("b", "#0000000000000001"), ("c", "3")], &[("[ros] domain_id", "0")]);
        assert!(plan(&old, &old).is_empty());
        let new =
            configuration(&[("a", "2"), ("b", "#0000000000000002"), ("d", "4")], &[("[ros] domain_id", "7")]);
        let plan = plan(&old, &new);
        assert_eq!(changes_text(&plan.reloadable), "a: 1 → 2; b: changed; c: removed; d: added, 4");
        assert_eq!(changes_text(&plan.restart), "[ros] domain_id: 0 → 7");
    }
}
