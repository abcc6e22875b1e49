//! Zenoh's own configuration, in JSON5.

use thiserror::Error;

/// The configuration without a file: a client of a router on the same computer.
pub const ONE_HOST: &str = include_str!("../../config/zenoh/one_host.json5");

/// Reason why a configuration cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ZenohConfigError {
    /// This program was built without Zenoh.
    #[error("this build has no Zenoh")]
    NotBuilt,
    /// Zenoh refuses it, with Zenoh's text.
    #[error("Zenoh refuses its configuration: {0}")]
    Refused(String),
}

impl ZenohConfigError {
    /// Returns a remedy for the user.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotBuilt => "install a package of this program, or build it with --features zenoh",
            Self::Refused(_) => "config/zenoh has examples; Zenoh's DEFAULT_CONFIG.json5 explains each key",
        }
    }
}

/// Checks whether Zenoh accepts a configuration, without using it.
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

/// Keys that a session needs, whatever the file contains: samples need stamps for the history of late
/// readers, and the gateway starts without a network and joins it later.
#[cfg(feature = "zenoh")]
const NEEDED: [(&str, &str); 3] =
    [("timestamping/enabled", "true"), ("connect/exit_on_failure", "false"), ("connect/timeout_ms", "-1")];

/// Keys that a file may omit; they then have the values of `rmw_zenoh_cpp` rather than of the library. With
/// the library's lease of 10 s, nodes of `rmw_zenoh_cpp` that stopped for longer than that would be lost for
/// good.
#[cfg(feature = "zenoh")]
const DEFAULTS: [(&str, &str); 2] =
    [("transport/link/tx/lease", "60000"), ("transport/link/tx/keep_alive", "2")];

/// Reads a configuration, and sets the keys that a session needs.
#[cfg(feature = "zenoh")]
pub(crate) fn parse(text: Option<&str>) -> Result<zenoh::Config, ZenohConfigError> {
    let refused = |error: zenoh::Error| ZenohConfigError::Refused(error.to_string().replace('\n', " "));
    let text = text.unwrap_or(ONE_HOST);
    let mut config = zenoh::Config::from_json5(text).map_err(refused)?;
    // Zenoh does not report which keys were given. A text that Zenoh has accepted can be parsed here as well.
    let given: serde_json::Value = json5::from_str(text).unwrap_or_default();
    let is_given = |key: &str| given.pointer(&format!("/{key}")).is_some();
    for (key, value) in DEFAULTS.into_iter().filter(|(key, _)| !is_given(key)).chain(NEEDED) {
        config.insert_json5(key, value).map_err(refused)?;
    }
    Ok(config)
}

/// Returns the configuration of a client that queries a router, and gives up after a while.
#[cfg(feature = "zenoh")]
pub(crate) fn for_a_query(
    mut config: zenoh::Config,
    patience: std::time::Duration,
) -> zenoh::Result<zenoh::Config> {
    let patience = patience.as_millis().to_string();
    for (key, value) in [
        ("mode", "\"client\""),
        ("listen/endpoints", "[]"),
        ("connect/timeout_ms", &patience),
        ("connect/exit_on_failure", "true"),
    ] {
        config.insert_json5(key, value)?;
    }
    with_another_id(config)
}

/// Returns the configuration of a session that exists next to another.
#[cfg(feature = "zenoh")]
pub(crate) fn with_another_id(mut config: zenoh::Config) -> zenoh::Result<zenoh::Config> {
    config.insert_json5("id", "null")?;
    Ok(config)
}

/// Returns true if sessions connect with each other, not only with routers.
#[cfg(feature = "zenoh")]
pub(crate) fn is_peer(config: &zenoh::Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"peer\"" || mode == "null")
}

/// Returns true if opening a session waits for a router.
#[cfg(feature = "zenoh")]
pub(crate) fn waits_for_router(config: &zenoh::Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"client\"")
}

#[cfg(all(test, feature = "zenoh"))]
mod tests {
    use super::*;

    #[test]
    fn examples_are_taken_and_the_needed_keys_win() {
        for text in [
            None,
            Some(include_str!("../../config/zenoh/vehicle.json5")),
            Some(include_str!("../../config/zenoh/fleet.json5")),
            Some("{ timestamping: { enabled: false }, connect: { timeout_ms: 0, exit_on_failure: true } }"),
        ] {
            let config = parse(text).unwrap();
            for (key, value) in NEEDED {
                assert_eq!(config.get_json(key).unwrap(), value, "{key}");
            }
            assert_eq!(waits_for_router(&config), text.is_some_and(|text| text.contains("\"client\"")));
        }
    }

    /// The values in the examples' comments, which users copy, also apply without a file.
    #[test]
    fn the_lease_is_that_of_rmw_zenoh_unless_the_file_says_another() {
        let lease = |config: &zenoh::Config| DEFAULTS.map(|(key, _)| config.get_json(key).unwrap());
        let expected = DEFAULTS.map(|(_, value)| value.to_owned());
        for example in [
            ONE_HOST,
            include_str!("../../config/zenoh/vehicle.json5"),
            include_str!("../../config/zenoh/fleet.json5"),
            include_str!("../../config/zenoh/fleet_router.json5"),
        ] {
            assert_eq!(lease(&zenoh::Config::from_json5(example).unwrap()), expected, "{example}");
        }
        assert_eq!(lease(&parse(Some("{ /* lease: 7 */ mode: 'peer' }")).unwrap()), expected);
        let other = parse(Some("{ transport: { link: { tx: { lease: 10000 } } } }")).unwrap();
        assert_eq!(lease(&other), ["10000", "2"]);
    }

    #[test]
    fn a_query_is_that_of_a_client_under_an_id_of_its_own() {
        let config =
            parse(Some("{ id: 'abc', mode: 'peer', listen: { endpoints: ['tcp/localhost:0'] } }")).unwrap();
        assert!(is_peer(&config) && is_peer(&parse(None).unwrap()) && is_peer(&parse(Some("{}")).unwrap()));
        let query = for_a_query(config, std::time::Duration::from_secs(2)).unwrap();
        let keys = ["id", "listen/endpoints", "connect/timeout_ms"].map(|key| query.get_json(key).unwrap());
        assert_eq!(keys, ["null", "[]", "2000"]);
        assert!(waits_for_router(&query) && !is_peer(&query));
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
