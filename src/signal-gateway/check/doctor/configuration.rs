//! Checks whether the configuration can be used.

use super::facts::{ConfigurationProblem, Facts};
use super::row::{CheckRow, FindingRow, Outcome};
use gateway_base::diagnostics::Level;

const START: &str = "docs/troubleshooting.md#it-does-not-start";

const MISSING: FindingRow = FindingRow {
    name: "configuration_missing",
    level: Level::Error,
    text: "{path}: there is no such file",
    why: "the gateway does not start without a configuration",
    remedy: "give another path with --config, or write one: signal-gateway init --interface can0 --profile NAME --out {path}",
    see: "docs/first-car.md",
};
const UNREADABLE: FindingRow = FindingRow {
    name: "configuration_unreadable",
    level: Level::Error,
    text: "{path}: this user may not read it",
    why: "a gateway of this user does not start",
    remedy: "chmod a+r {path}, and a+x for its folders; or run doctor as root, to examine the service",
    see: START,
};
const REFUSED: FindingRow = FindingRow {
    name: "configuration_refused",
    level: Level::Error,
    text: "{path} is refused: {reason}",
    why: "the gateway does not start with it",
    remedy: "signal-gateway check --config {path} shows each place with its remedy",
    see: START,
};

pub(super) const CONFIGURATION: CheckRow = CheckRow {
    name: "configuration",
    asks: "Can the configuration be read, with its vehicle profile and DBC?",
    findings: &[&MISSING, &UNREADABLE, &REFUSED],
    judge: |facts: &Facts| {
        let Some(configuration) = &facts.configuration else {
            let reason = "no configuration was given, so only interfaces and this computer are examined";
            return vec![Outcome::not_checked(reason)];
        };
        let path = &configuration.path;
        vec![match &configuration.problem {
            None => Outcome::sound(format!("{}: {}", configuration.path, configuration.vehicle)),
            Some(ConfigurationProblem::Missing) => MISSING.found().with("path", path),
            Some(ConfigurationProblem::Denied) => UNREADABLE.found().with("path", path),
            Some(ConfigurationProblem::Refused(reason)) => {
                REFUSED.found().with("path", path).with("reason", reason)
            }
        }]
    },
};
