//! The text of a new `gateway.toml`.

/// A bus of a vehicle and where it is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusInterface {
    /// Name of the bus in the profile.
    pub bus: String,
    /// Name of the SocketCAN interface.
    pub interface: String,
}

/// A commented configuration for a profile, with the keys that most vehicles need.
pub fn gateway_toml(profile: &str, buses: &[BusInterface]) -> String {
    let mut text = format!(
        "{}# Configuration of signal-gateway. Every key, with its unit, range and default:\n\
         # /usr/share/signal-gateway/config/gateway.toml, in the sources config/gateway.toml.\n\
         # Before a drive: signal-gateway check --config gateway.toml [LOG]\n\
         \n\
         # The vehicle profile: which signals of the DBC mean what. Paths are relative to this file.\n\
         profile = {}\n",
        schema("gateway"),
        quoted(profile)
    );
    for BusInterface { bus, interface } in buses {
        text += &format!(
            "\n[can.{}]                           # a bus of the profile …\n\
             interface = {}                # … and the SocketCAN interface it is plugged in to\n",
            key(bus),
            quoted(interface)
        );
    }
    text += "\n\
             [reports]\n\
             # publish = \"periodic\"              # or \"on_change\"\n\
             # rate_hz = 10.0\n\
             \n\
             [ros]\n\
             # enabled = true                    # false: `run` only logs\n\
             # domain_id = 0                     # default: the environment's ROS_DOMAIN_ID, else 0\n\
             \n\
             [black_box]                         # a recording around each change to ERROR\n\
             # folder = \"black-box\"\n\
             \n\
             # Commands to the vehicle, traffic lights and the turn signal decider have sections of their own; without\n\
             # them there are none.\n";
    text
}

/// Returns the line by which an editor finds the schema of a kind of file in the installed package.
pub(super) fn schema(kind: &str) -> String {
    format!("#:schema /usr/share/signal-gateway/schema/{kind}.schema.json\n")
}

/// Returns a text as a TOML string.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A TOML key, quoted where it has to be.
pub(crate) fn key(text: &str) -> String {
    let is_bare = |character: char| character.is_ascii_alphanumeric() || matches!(character, '_' | '-');
    if !text.is_empty() && text.chars().all(is_bare) { text.to_owned() } else { quoted(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_is_toml_with_the_given_values() {
        let buses = [("body", "can0"), ("a bus", "vcan1")]
            .map(|(bus, interface)| BusInterface { bus: bus.into(), interface: interface.into() });
        let table: toml::Table = gateway_toml("a \"b\".toml", &buses).parse().unwrap();
        assert_eq!(table["profile"].as_str(), Some("a \"b\".toml"));
        assert_eq!(table["can"]["a bus"]["interface"].as_str(), Some("vcan1"));
    }
}
