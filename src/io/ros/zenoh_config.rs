//! Zenoh's own configuration, in JSON5.

use thiserror::Error;

/// The configuration without a file: that of a computer with a router on it.
pub const ONE_HOST: &str = include_str!("../../../config/zenoh/one_host.json5");

/// Why a configuration cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ZenohConfigError {
    /// This program was built without Zenoh.
    #[error("this build has no Zenoh")]
    NotBuilt,
    /// Zenoh refuses it; the text is Zenoh's.
    #[error("Zenoh refuses its configuration: {0}")]
    Refused(String),
}

impl ZenohConfigError {
    /// What to do, for people.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotBuilt => "install a package of this program, or build it with --features zenoh",
            Self::Refused(_) => "config/zenoh has examples; Zenoh's DEFAULT_CONFIG.json5 explains each key",
        }
    }
}

/// Looks whether Zenoh takes a configuration, without using it.
///
/// # Errors
/// See [`ZenohConfigError`].
pub fn check(text: Option<&str>) -> Result<(), ZenohConfigError> {
    #[cfg(feature = "zenoh")]
    let checked = parse(text).map(drop);
    #[cfg(not(feature = "zenoh"))]
    let checked = {
        let _ = text;
        Err(ZenohConfigError::NotBuilt)
    };
    checked
}

/// Keys that a session needs, whatever the file says: samples need stamps for the history of late readers, and the
/// gateway starts without a network and joins it later.
#[cfg(feature = "zenoh")]
const NEEDED: [(&str, &str); 3] =
    [("timestamping/enabled", "true"), ("connect/exit_on_failure", "false"), ("connect/timeout_ms", "-1")];

/// Reads a configuration, and sets the keys that a session needs.
#[cfg(feature = "zenoh")]
pub(super) fn parse(text: Option<&str>) -> Result<zenoh::Config, ZenohConfigError> {
    let refused = |error: zenoh::Error| ZenohConfigError::Refused(error.to_string().replace('\n', " "));
    let mut config = zenoh::Config::from_json5(text.unwrap_or(ONE_HOST)).map_err(refused)?;
    for (key, value) in NEEDED {
        config.insert_json5(key, value).map_err(refused)?;
    }
    Ok(config)
}

/// True if opening a session waits for a router.
#[cfg(feature = "zenoh")]
pub(super) fn waits_for_router(config: &zenoh::Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"client\"")
}

#[cfg(all(test, feature = "zenoh"))]
mod tests {
    use super::*;

    #[test]
    fn examples_are_taken_and_the_needed_keys_win() {
        for text in [
            None,
            Some(include_str!("../../../config/zenoh/vehicle.json5")),
            Some(include_str!("../../../config/zenoh/fleet.json5")),
            Some("{ timestamping: { enabled: false }, connect: { timeout_ms: 0, exit_on_failure: true } }"),
        ] {
            let config = parse(text).unwrap();
            for (key, value) in NEEDED {
                assert_eq!(config.get_json(key).unwrap(), value, "{key}");
            }
            assert_eq!(waits_for_router(&config), text.is_some_and(|text| text.contains("\"client\"")));
        }
    }

    #[test]
    fn what_zenoh_does_not_know_is_refused_with_its_words() {
        for (text, word) in
            [("{ mode: 'car' }", "`car`"), ("{ conect: {} }", "conect"), ("{ mode", "expected")]
        {
            let error = check(Some(text)).unwrap_err().to_string();
            assert!(error.contains(word) && !error.contains('\n'), "{error}");
        }
    }
}
