//! `[reports]`: when and how reports are published.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::core::vehicle_lights::report::Publish;

const DEFAULT_RATE_HZ: f64 = 10.0;

/// `[reports]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportsFile {
    /// Rhythm.
    #[serde(default)]
    pub publish: PublishFile,
    /// Rate of periodic publishing, Hz.
    pub rate_hz: Option<Spanned<f64>>,
    /// What late joiners get.
    #[serde(default)]
    pub durability: Durability,
}

/// `publish = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PublishFile {
    /// At `rate_hz`, and at once on a change.
    #[default]
    Periodic,
    /// On a change only.
    OnChange,
}

/// `durability = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// A late joiner gets the report that is current.
    #[default]
    TransientLocal,
    /// A late joiner waits for the next one.
    Volatile,
}

/// When reports are published; what has no usable rate is not periodic.
pub(super) fn publish(checker: &mut Checker<'_>, file: &ReportsFile) -> Publish {
    let rate = file.rate_hz.as_ref();
    match file.publish {
        PublishFile::OnChange => {
            if let Some(rate) = rate {
                checker.refuse(rate, "on_change has no rate", "remove it, or use publish = \"periodic\"");
            }
            Publish::OnChange
        }
        PublishFile::Periodic => {
            let range = 0.1..=1000.0;
            let given = checker.in_range(rate, &range, "{} Hz cannot be published", "give 0.1 to 1000 Hz");
            let rate_hz = given.unwrap_or(DEFAULT_RATE_HZ);
            if !range.contains(&rate_hz) {
                return Publish::OnChange;
            }
            Publish::Periodic(Duration::from_secs_f64(1.0 / rate_hz))
        }
    }
}
