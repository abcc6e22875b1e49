//! The text of a new `gateway.toml`.

use vehicle_bringup::car_model::DimensionRange;

/// A bus of a vehicle and its interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusInterface {
    /// Name of the bus in the profile.
    pub bus: String,
    /// Name of the SocketCAN interface.
    pub interface: String,
}

/// The dimensions of a car for its new configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct DimensionsDraft {
    /// The car, or the models, e.g. `the models of toyota_nodsu`.
    pub subject: String,
    /// The car as the key `car` names it; `None` unless it is a single car of the list.
    pub car: Option<DraftCar>,
    /// Dimensions listed by opendbc; `None` if it lists none.
    pub listed: Option<DimensionRange>,
}

/// The car of a new configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftCar {
    /// Make, model and year.
    pub name: String,
    /// True if its listed dimensions are to be used until they are measured.
    pub is_used: bool,
}

/// Returns a commented configuration for a profile, with the keys that most vehicles need. `dimensions` is
/// `None` for a profile that needs none.
pub fn gateway_toml(profile: &str, buses: &[BusInterface], dimensions: Option<&DimensionsDraft>) -> String {
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
    text += &dimensions.map_or_else(String::new, dimensions_toml);
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
             [status]                            # the socket that `signal-gateway status` finds by itself\n\
             # socket = \"status.sock\"           # default: in /run/signal-gateway, or $XDG_RUNTIME_DIR/signal-gateway\n\
             \n\
             # Commands to the vehicle, traffic lights and the turn signal decider have sections of their own; without\n\
             # them there are none.\n";
    text
}

/// Returns the section of the dimensions, commented out, since no one has measured this car.
fn dimensions_toml(draft: &DimensionsDraft) -> String {
    let subject = &draft.subject;
    let (source, [wheel_base, ratio]) = match &draft.listed {
        Some(range) => (
            format!("Unproven, from opendbc's list for {subject}:"),
            [range.wheel_base_m(), range.steering_ratio()].map(|(least, greatest)| {
                if least < greatest {
                    ("0".to_owned(), format!("{least} to {greatest}"))
                } else {
                    (least.to_string(), "as listed".to_owned())
                }
            }),
        ),
        None => (
            format!("opendbc lists none for {subject}:"),
            [(); 2].map(|()| ("0".to_owned(), "measure it".to_owned())),
        ),
    };
    let is_used = draft.car.as_ref().is_some_and(|car| car.is_used);
    let comment = if is_used { "" } else { "# " };
    let car = draft.car.as_ref().map_or_else(String::new, |car| {
        let car = format!("{comment}car = {}", quoted(&car.name));
        format!("{car:36}# or: these listed dimensions, with a WARN until the ratio is measured\n")
    });
    format!(
        "\n\
         # Dimensions of the car, which the reports on velocity and steering need. {source}\n\
         # measure them, and compare them with a drive that turns: signal-gateway check LOG\n\
         {comment}[vehicle_geometry]\n\
         {car}\
         {:36}# from axle to axle, m: {}\n\
         {:36}# angle of the steering wheel for each angle of the front wheels: {}\n\
         # wheel_tread_m = 0                 # from rear wheel to rear wheel, m: measure it\n",
        format!("# wheel_base_m = {}", wheel_base.0),
        wheel_base.1,
        format!("# steering_ratio = {}", ratio.0),
        ratio.1,
    )
}

/// Returns the line by which an editor finds the schema of a kind of file in the installed package.
pub(super) fn schema(kind: &str) -> String {
    format!("#:schema /usr/share/signal-gateway/schema/{kind}.schema.json\n")
}

pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Returns a TOML key, quoted if necessary.
pub(crate) fn key(text: &str) -> String {
    let is_bare = |character: char| character.is_ascii_alphanumeric() || matches!(character, '_' | '-');
    if !text.is_empty() && text.chars().all(is_bare) { text.to_owned() } else { quoted(text) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle_bringup::car_model::ListedDimensions;

    #[test]
    fn the_text_is_toml_with_the_given_values() {
        let buses = [("body", "can0"), ("a bus", "vcan1")]
            .map(|(bus, interface)| BusInterface { bus: bus.into(), interface: interface.into() });
        let table: toml::Table = gateway_toml("a \"b\".toml", &buses, None).parse().unwrap();
        assert_eq!(table["profile"].as_str(), Some("a \"b\".toml"));
        assert_eq!(table["can"]["a bus"]["interface"].as_str(), Some("vcan1"));
    }
    #[test]
    fn dimensions_are_suggested_in_comments_and_a_range_has_to_be_chosen_from() {
        let listed = |wheel_base_m, steering_ratio| ListedDimensions { wheel_base_m, steering_ratio };
        let (small, large) = (listed(2.6, 13.5), listed(2.9, 15.5));
        for (least, greatest, expected) in [
            (small, small, ["# wheel_base_m = 2.6 ", "as listed", "# steering_ratio = 13.5 ", "Unproven"]),
            (small, large, ["# wheel_base_m = 0 ", "2.6 to 2.9", "13.5 to 15.5", "Unproven"]),
        ] {
            let listed = Some(DimensionRange { least, greatest });
            for is_used in [false, true] {
                let car = Some(DraftCar { name: "A B 2020".to_owned(), is_used });
                let draft = DimensionsDraft { subject: "the car".to_owned(), car, listed };
                let text = gateway_toml("a", &[], Some(&draft));
                assert!(expected.iter().all(|part| text.contains(part)), "{text}");
                let table: toml::Table = text.parse().unwrap();
                let car = table.get("vehicle_geometry").map(|section| section["car"].as_str().unwrap());
                assert_eq!(car, is_used.then_some("A B 2020"), "{text}");
            }
        }
    }
}
